# SPDX-License-Identifier: Apache-2.0
"""Harsh but legal driving of six machines of a production's spread, in which no monitor may end a drive.

python -m fluxtrue_tools.campaign.healthy                         10,000 s of the six machines together, one process
python -m fluxtrue_tools.campaign.healthy prius --seconds 500     one of them

The programs are those of tests/loop/healthy in build/host. Outcomes are kept below build/healthy by the content of the
program, so that a run that was stopped continues.
"""

import hashlib
import json
import subprocess
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import click

from fluxtrue_tools.cli import run_module
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.outputs import write_text

ROOT: Final = Path(__file__).resolve().parents[3]
PROGRAMS: Final = ROOT / "build" / "host" / "tests" / "loop" / "second_level"
KEPT: Final = ROOT / "build" / "healthy"
PAGE: Final = ROOT / "docs" / "safety" / "healthy.md"
MARK: Final = "<!-- measured -->\n"
MACHINES: Final = ("prius", "leaf", "pmasynrm", "pmsyrm", "truck", "ebike")
BLOCK_S: Final = 100
SEEDS_PER_BLOCK: Final = 1000  # a block has fewer drives

Block = dict[str, Any]


@dataclass(frozen=True)
class Driven:
    """All blocks of one machine."""

    machine: str
    blocks: list[Block]

    def total(self, name: str) -> float:
        return float(sum(block[name] for block in self.blocks))

    @property
    def trips(self) -> list[Block]:
        return [trip for block in self.blocks for trip in block["trips"]]

    @property
    def kinds_s(self) -> Counter[str]:
        return sum((Counter(block["kinds_s"]) for block in self.blocks), Counter())

    def row(self) -> str:
        """A line of the page's table."""
        names = Counter(name for trip in self.trips for name in trip["faults"])
        shown = ", ".join(f"`{name}` {number}" for name, number in sorted(names.items()))
        share = 100.0 * self.total("loaded_s") / self.total("driven_s")
        trips = f"{len(self.trips)}: {shown}" if shown else "0"
        return (f"| `{self.machine}` | {self.blocks[0]['rpm_per_s']:,.0f} | {self.total('drives'):.0f} "
                f"| {self.total('driven_s'):,.0f} | {share:.0f} % | {trips} |")  # fmt: skip


def blocks_of(machine: str, seconds: float, seed: int, programs: Path, kept: Path) -> list[Block]:
    """So many seconds of a machine, by blocks; those that are kept are not driven again."""
    program = programs / f"healthy_{machine}"
    if not program.is_file():
        raise FluxtrueError(f"{program} is missing: tools/test --quick builds it")
    content = hashlib.sha256(program.read_bytes()).hexdigest()[:16]
    path = kept / f"{machine}-{content}.jsonl"
    kept.mkdir(parents=True, exist_ok=True)
    lines = path.read_text(encoding="utf-8").splitlines() if path.is_file() else []
    known = {row["first"]: row for row in map(json.loads, lines)}
    found, driven = [], 0.0
    while driven < seconds:
        first = seed + len(found) * SEEDS_PER_BLOCK
        if first not in known:
            known[first] = {"first": first} | _drive([program, str(BLOCK_S), str(first)])
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(known[first]) + "\n")
        found.append(known[first])
        driven += known[first]["driven_s"]
    return found


def _drive(command: Sequence[str | Path]) -> Block:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):
        raise FluxtrueError(f"{' '.join(map(str, command))}: {done.stderr.strip()}")
    block: Block = json.loads(done.stdout)
    return block


def table(driven: list[Driven], command: str) -> str:
    """What has been measured."""
    kinds = sum((one.kinds_s for one in driven), Counter[str]())
    rows = ["| machine | largest change of speed, rpm/s | plants | seconds | of them with more than a quarter of the "
            "largest torque | false trips |", "|---|--:|--:|--:|--:|---|", *(one.row() for one in driven)]  # fmt: skip
    total_s, trips = sum(one.total("driven_s") for one in driven), sum(len(one.trips) for one in driven)
    tripped = f"{trips} false trip{'' if trips == 1 else 's'}"
    text = ", ".join(f"{name} {seconds:,.0f} s" for name, seconds in kinds.items())
    return "\n".join([*rows, "", f"Together {total_s:,.0f} s, {tripped}.", f"By kind: {text}.", "",
                      f"    {command}", ""])  # fmt: skip


@click.command()
@click.argument("names", nargs=-1, type=click.Choice(MACHINES))
@click.option("--seconds", type=click.FloatRange(min=1.0), default=10_000.0, show_default=True, help="All machines.")
@click.option("--seed", type=click.IntRange(1, 2**31), default=1, show_default=True, help="Of the first drive.")
@click.option("--write/--no-write", default=False, help="Write the table into docs/safety/healthy.md.")
def main(names: tuple[str, ...], seconds: float, seed: int, write: bool) -> None:
    """Drive the machines NAMES, all of them by default. Simulation. Exit code 1: a monitor has ended a drive."""
    chosen, driven = names or MACHINES, []
    for name in chosen:
        blocks = blocks_of(name, seconds / len(chosen), seed, PROGRAMS, KEPT)
        driven.append(Driven(name, blocks))
        click.echo(driven[-1].row())
        for trip in driven[-1].trips:
            click.echo(f"  {json.dumps(trip)}")
    words = ["python -m fluxtrue_tools.campaign.healthy", *names, f"--seconds {seconds:g}", f"--seed {seed}"]
    text = table(driven, " ".join(words))
    click.echo(text)
    if write:
        head, _, _ = PAGE.read_text(encoding="utf-8").partition(MARK)
        write_text(PAGE, head + MARK + text)
    sys.exit(1 if any(one.trips for one in driven) else 0)


if __name__ == "__main__":
    run_module(main)
