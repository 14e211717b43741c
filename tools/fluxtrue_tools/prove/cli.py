# SPDX-License-Identifier: Apache-2.0
"""fluxtrue prove: the proofs of tests/proof, each with its planted error."""

from collections.abc import Sequence
from pathlib import Path

import click

from fluxtrue_tools import kinds, paths
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.prove import page
from fluxtrue_tools.prove.checker import CPU_S, Checker, NoVerdict, Verdict
from fluxtrue_tools.prove.data import Proof, load
from fluxtrue_tools.sim.build import ROOT


def _chosen(proofs: Sequence[Proof], names: Sequence[str], groups: Sequence[str], long: bool) -> list[Proof]:
    known = {proof.name for proof in proofs} | {proof.group for proof in proofs}
    if unknown := sorted((set(names) | set(groups)) - known):
        raise FluxtrueError(f"no such proof or group: {', '.join(unknown)}; tools/fluxtrue prove --list names them")
    if names:
        return [proof for proof in proofs if proof.name in names]
    return [proof for proof in proofs if (not groups or proof.group in groups) and (long or not proof.long)]


def _row(name: str, text: str, verdict: Verdict) -> None:
    known = ", kept verdict" if verdict.cached else ""
    click.echo(f"{text:8} {name:44} {verdict.seconds:7.2f} s {verdict.megabytes:5d} MB{known}")


def _is_right(checker: Checker, proof: Proof, planted: bool) -> tuple[bool, Verdict]:
    try:
        return _proved(checker, proof, planted)
    except NoVerdict as error:
        click.echo(f"NOTHING  {proof.name}: {error}")
        return False, Verdict(False, (), 0.0, 0)


def _proved(checker: Checker, proof: Proof, planted: bool) -> tuple[bool, Verdict]:
    verdict = checker.check(proof)
    _row(proof.name, "proved" if verdict.proved else "REFUTED", verdict)
    for failed in verdict.failed:
        click.echo(f"         {failed}")
    if not planted:
        return verdict.proved, verdict
    error = checker.check(proof, planted=True)
    _row(f"  with its planted error in {proof.planted.file.name}", "found" if error.refuted else "MISSED", error)
    return verdict.proved and error.refuted, verdict


@click.command(cls=paths.Command)
@click.argument("names", nargs=-1, type=kinds.Text())
@click.option("--group", "groups", type=kinds.Text(), multiple=True, help="All proofs of one file of tests/proof.")
@click.option("--long", is_flag=True, help="Also those that take minutes.")
@click.option("--fresh", is_flag=True, help="Run again what has a kept verdict.")
@click.option("--planted/--no-planted", default=True, help="Also with the planted error of each, which must be found.")
@click.option("--seconds", type=click.IntRange(1, 100_000), default=CPU_S, show_default=True,
              help="Of a processor, for each run; what takes longer is not proved.")  # fmt: skip
@click.option("--list", "only_list", is_flag=True,
              help="Name the proofs, and check that their errors still fit the firmware.")  # fmt: skip
@click.option("--page", "write_page", is_flag=True, help="Prove all and write docs/safety/proofs.md.")
def prove(names: tuple[str, ...], groups: tuple[str, ...], long: bool, fresh: bool, planted: bool, seconds: int,
          only_list: bool, write_page: bool) -> int:  # fmt: skip
    """Prove properties of the firmware for all values in stated ranges, with the model checker CBMC.

    A verdict is kept below build/proofs by the content that it is about: an unchanged proof takes no time. Ends with
    exit code 1 if a property is refuted or a planted error is not found.
    """
    proofs = load(ROOT)
    chosen = proofs if write_page else _chosen(proofs, names, groups, long)
    if only_list:
        for proof in chosen:
            proof.planted.apply(ROOT)  # a text that the firmware no longer has is an error
        click.echo("\n".join(f"{proof.group:12} {proof.name:40} {proof.statement}" for proof in chosen))
        return 0
    checker = Checker(ROOT, ROOT / "build", fresh, seconds)
    results = {proof.name: _is_right(checker, proof, planted and not write_page) for proof in chosen}
    wrong = [name for name, (right, _) in results.items() if not right]
    if write_page and not wrong:
        Path(ROOT / page.PAGE).parent.mkdir(parents=True, exist_ok=True)
        text = page.write(proofs, {name: verdict for name, (_, verdict) in results.items()})
        (ROOT / page.PAGE).write_text(text, encoding="utf-8")
    total_s = sum(verdict.seconds for _, verdict in results.values())
    click.echo(
        f"{len(chosen) - len(wrong)} of {len(chosen)} proofs hold ({total_s:.0f} s of a processor when they ran)"
    )
    if wrong:
        click.echo(f"not proved: {', '.join(wrong)}")
    return 1 if wrong else 0
