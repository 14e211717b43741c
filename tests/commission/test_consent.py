# SPDX-License-Identifier: Apache-2.0
"""On a bench every movement of the shaft needs a consent, also those of steps that a named one needs."""

import sys
from pathlib import Path

import click
import pytest

from fluxtrue_tools.cli import run as command
from fluxtrue_tools.commission.cli import Target
from fluxtrue_tools.errors import FluxtrueError

BENCH = ["--can-interface", "virtual"]
CONNECTED = "the bench has been connected"


@pytest.fixture
def bench(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """A call up to the connection of the bench, which nothing may reach without a consent."""

    def connect(*_: object) -> None:
        raise FluxtrueError(CONNECTED)

    monkeypatch.setattr(Target, "drive", connect)
    return ["commission", "--motor", str(folder), *BENCH, "--out", str(tmp_path / "found")]


def answered(monkeypatch: pytest.MonkeyPatch, *answers: bool) -> list[str]:
    """A terminal whose user gives these answers; the questions."""
    left, asked = list(answers), []

    def confirm(text: str) -> bool:
        asked.append(text)
        return left.pop(0)

    monkeypatch.setattr(sys.stdin, "isatty", lambda: True)
    monkeypatch.setattr(click, "confirm", confirm)
    return asked


@pytest.mark.parametrize("step", ["drag", "all", "spin,map"])
def test_without_a_terminal_nothing_turns(step: str, bench: list[str], capsys: pytest.CaptureFixture[str],
                                          monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    monkeypatch.setattr(sys.stdin, "isatty", lambda: False)
    assert command([*bench, "--step", step]) == 2
    said = capsys.readouterr().err
    assert "phases, spin" in said and "the shaft turns, allowed" in said and CONNECTED not in said


def test_each_movement_is_asked_for(bench: list[str], capsys: pytest.CaptureFixture[str],
                                    monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    """`drag` alone needs `phases` and `spin`, which turn the shaft, too."""
    asked = answered(monkeypatch, True, True, True)
    assert command([*bench, "--step", "drag"]) == 2
    printed = capsys.readouterr()
    assert len(asked) == 3 and CONNECTED in printed.err
    assert all(f"{name}: " in printed.out for name in ("phases", "spin", "drag"))


def test_one_refusal_prevents_all(bench: list[str], capsys: pytest.CaptureFixture[str],
                                  monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    asked = answered(monkeypatch, True, False)
    assert command([*bench, "--step", "all"]) == 2
    said = capsys.readouterr().err
    assert len(asked) == 2 and "spin: without consent" in said and CONNECTED not in said


@pytest.mark.parametrize("options", [["--step", "all", "--yes"], ["--step", "map"]])
def test_a_consent_beforehand_and_a_standstill_ask_nothing(
    options: list[str], bench: list[str], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = answered(monkeypatch)
    assert command([*bench, *options]) == 2
    assert not asked and CONNECTED in capsys.readouterr().err


def test_a_simulation_turns_no_shaft(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = str(tmp_path / "found")
    assert command(["commission", "--motor", str(folder), "--step", "all", "--yes", "--out", out]) == 2
    assert "--yes: has no effect without --can-interface" in capsys.readouterr().err


@pytest.mark.parametrize(("step", "words"), [
    ("resistance", ("turns a light rotor", "beyond 15 electrical degrees a current ends")),
    ("spin", ("2160 rpm", "beyond 2700 rpm switching is disabled")),
    ("drag", ("2160 rpm", "beyond 2700 rpm switching is disabled")),
])  # fmt: skip
def test_an_announcement_says_what_may_move(
    step: str, words: tuple[str, ...], folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert command(["commission", "--motor", str(folder), "--step", step, "--dry-run"]) == 0
    line = next(line for line in capsys.readouterr().out.splitlines() if line.startswith(f"{step}: "))
    assert all(each in line for each in words)
