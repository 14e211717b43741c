# SPDX-License-Identifier: Apache-2.0
"""The tool for proofs accepts no harness that proves nothing, and no planted error that is not found."""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.prove import page
from fluxtrue_tools.prove.checker import Checker, NoVerdict
from fluxtrue_tools.prove.data import Planted, Proof, load

ROOT = Path(__file__).resolve().parents[2]


def named(name: str) -> Proof:
    """One of the proofs."""
    return next(proof for proof in load(ROOT) if proof.name == name)


@pytest.fixture
def checker(tmp_path: Path) -> Checker:
    """CBMC with a folder of its own for verdicts."""
    (tmp_path / "cbmc").symlink_to(ROOT / "build" / "cbmc")
    return Checker(ROOT, tmp_path)


def test_a_verdict_is_kept_and_depends_on_the_content(checker: Checker) -> None:
    proof = named("fx_saturation_q31")
    first, second = checker.check(proof), checker.check(proof)
    assert first.proved
    assert not first.cached
    assert second.cached
    error = checker.check(proof, planted=True)
    assert error.refuted
    assert not error.cached


def test_a_planted_error_that_is_none_is_not_found(checker: Checker) -> None:
    proof = named("fx_saturation_q31")
    harmless = Planted(proof.planted.file, "return (high == (low >> 31)) ? low", "return ((low >> 31) == high) ? low")
    assert not checker.check(replace(proof, planted=harmless), planted=True).refuted


def test_a_planted_error_must_fit_the_source_and_the_harness(checker: Checker) -> None:
    proof = named("fx_saturation_q31")
    with pytest.raises(FluxtrueError, match="occurs 0 times"):
        checker.check(replace(proof, planted=Planted(proof.planted.file, "no such text", "")), planted=True)
    elsewhere = Planted(Path("ecu/supervisor.c"), "SELF_TEST_MS 50U", "SELF_TEST_MS 51U")
    with pytest.raises(FluxtrueError, match="not in what the harness compiles"):
        checker.check(replace(proof, planted=elsewhere), planted=True)


def test_too_few_iterations_are_no_proof_and_no_found_error(checker: Checker) -> None:
    verdict = checker.check(replace(named("count_ones"), options=("--unwind", "2")))
    assert not verdict.proved
    assert not verdict.refuted


def test_a_source_that_is_not_accepted_is_no_verdict(checker: Checker) -> None:
    with pytest.raises(NoVerdict):
        checker.check(replace(named("fx_saturation_q31"), name="no_such_harness"))


def test_without_cbmc_nothing_is_proved(tmp_path: Path) -> None:
    with pytest.raises(FluxtrueError, match="nothing can be proved"):
        Checker(ROOT, tmp_path)


def test_every_harness_is_described_and_the_other_way_round(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "tests" / "proof", tmp_path / "tests" / "proof")
    source = tmp_path / "tests" / "proof" / "fx_format.c"
    source.write_text(source.read_text(encoding="utf-8") + "\nvoid proof_another(void)\n{\n}\n", encoding="utf-8")
    with pytest.raises(FluxtrueError, match="another"):
        load(tmp_path)


def test_the_page_lists_what_is_proved() -> None:
    proofs = load(ROOT)
    written = (ROOT / page.PAGE).read_text(encoding="utf-8")
    fresh = page.write(proofs, {})
    assert page.timeless(fresh) == page.timeless(written), "tools/fluxtrue prove --page writes it"
