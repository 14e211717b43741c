# SPDX-License-Identifier: Apache-2.0
"""The campaign of healthy drives continues where it was stopped, and a trip ends it with exit code 1."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from fluxtrue_tools.campaign import healthy
from fluxtrue_tools.errors import FluxtrueError

# Drives 40 s a block; the drive 1001 trips.
PROGRAM = """#!/bin/sh
echo "$@" >> "$0.calls"
trip='{"drive": 1001, "ms": 7, "kind": "kerb", "rpm": 3, "requested_Nm": 1.0, "faults": ["angle_jump"]}'
[ "$2" = 1001 ] || trip=
printf '{"machine": "prius", "trips": [%s], "drives": 4, "driven_s": 40.0, "loaded_s": 10.0, ' "$trip"
printf '"rpm_per_s": 40000, "kinds_s": {"kerb": 30.0, "slip": 10.0}}\\n'
[ -z "$trip" ]
"""


@pytest.fixture
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The program of one machine, which tells how it was called."""
    path = tmp_path / "healthy_prius"
    path.write_text(PROGRAM)
    path.chmod(0o755)
    monkeypatch.setattr(healthy, "PROGRAMS", tmp_path)
    monkeypatch.setattr(healthy, "KEPT", tmp_path / "kept")
    return path


def calls(program: Path) -> list[str]:
    return Path(f"{program}.calls").read_text().splitlines()


def test_a_run_that_was_stopped_continues_with_the_next_block(program: Path) -> None:
    CliRunner().invoke(healthy.main, ["prius", "--seconds", "40"])
    assert calls(program) == ["100 1"]
    CliRunner().invoke(healthy.main, ["prius", "--seconds", "120"])
    assert calls(program) == ["100 1", "100 1001", "100 2001"]


def test_another_program_is_driven_again(program: Path) -> None:
    CliRunner().invoke(healthy.main, ["prius", "--seconds", "40"])
    program.write_text(PROGRAM + "# changed\n")
    CliRunner().invoke(healthy.main, ["prius", "--seconds", "40"])
    assert calls(program) == ["100 1", "100 1"]


def test_a_trip_is_counted_by_its_name_and_ends_with_exit_code_1(program: Path) -> None:
    del program
    good = CliRunner().invoke(healthy.main, ["prius", "--seconds", "40"])
    assert good.exit_code == 0
    assert "| `prius` | 40,000 | 4 | 40 | 25 % | 0 |" in good.output
    bad = CliRunner().invoke(healthy.main, ["prius", "--seconds", "80"])
    assert bad.exit_code == 1
    assert "| `prius` | 40,000 | 8 | 80 | 25 % | 1: `angle_jump` 1 |" in bad.output
    assert "Together 80 s, 1 false trip." in bad.output
    assert "By kind: kerb 60 s, slip 20 s." in bad.output


def test_the_page_keeps_its_text(program: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    del program
    page = tmp_path / "healthy.md"
    page.write_text(f"# Title\n\n{healthy.MARK}old\n")
    monkeypatch.setattr(healthy, "PAGE", page)
    CliRunner().invoke(healthy.main, ["prius", "--seconds", "40", "--seed", "5", "--write"])
    text = page.read_text()
    assert text.startswith(f"# Title\n\n{healthy.MARK}| machine |")
    assert "    python -m fluxtrue_tools.campaign.healthy prius --seconds 40 --seed 5\n" in text
    assert "old" not in text


def test_a_program_that_fails_or_is_missing_is_an_error(program: Path, tmp_path: Path) -> None:
    program.write_text("#!/bin/sh\necho 'the plant cannot continue' >&2\nexit 2\n")
    with pytest.raises(FluxtrueError, match="the plant cannot continue"):
        healthy.blocks_of("prius", 40.0, 1, tmp_path, tmp_path / "kept")
    with pytest.raises(FluxtrueError, match="healthy_leaf is missing"):
        healthy.blocks_of("leaf", 40.0, 1, tmp_path, tmp_path / "kept")


def test_a_kept_outcome_is_a_line_of_json(program: Path, tmp_path: Path) -> None:
    del program
    healthy.blocks_of("prius", 40.0, 1, tmp_path, tmp_path / "kept")
    (kept,) = (tmp_path / "kept").glob("prius-*.jsonl")
    assert json.loads(kept.read_text())["first"] == 1
