# SPDX-License-Identifier: Apache-2.0
"""The table of the machines in docs/howto/campaign.md."""

import re
import subprocess
from pathlib import Path

import click
import pytest

from fluxtrue_tools.campaign import machines
from fluxtrue_tools.campaign.machines import CASES, FILES, KINDS, PAGE, rows_of, with_rows
from fluxtrue_tools.campaign.spec import Limits, read
from fluxtrue_tools.campaign.steps import OVERSHOOT_MAX


def missed(row: str) -> set[str]:
    """The bounds that a row does not keep; 10.0 % of overshoot is a rounded figure."""
    limits = Limits()
    cells = [cell.strip() for cell in row.strip("|\n ").split("|")]
    found = {"plants"} if int(cells[3]) != CASES else set()
    for cell, bounds in ((cells[4], (limits.rms_low, limits.p99_low)), (cells[5], (limits.rms_high, limits.p99_high))):
        figures = [float(number) for number in re.findall(r"[0-9.]+", cell)]
        found |= {"accuracy"} if any(f > bound for f, bound in zip(figures, bounds, strict=True)) else set()
    found |= {"no harm"} if float(cells[6].split()[0]) < limits.no_harm_share else set()
    found |= {"trips"} if int(cells[7]) else set()
    overshoot = re.fullmatch(r"([0-9.]+) %", cells[8])
    return found | ({"overshoot"} if overshoot is None or float(overshoot[1]) >= 100 * OVERSHOOT_MAX else set())


def test_every_machine_has_a_row_and_keeps_the_bounds() -> None:
    rows = rows_of(PAGE.read_text(encoding="utf-8"))
    assert list(rows) == list(KINDS)
    assert len(rows) >= 12
    assert {name: missed(row) for name, row in rows.items() if missed(row)} == {}


@pytest.mark.parametrize(
    ("cells", "found"),
    [
        ("10 | 0.80 / 2.50 % | 1.20 / 3.00 % | 99 % | 0 | 9.9 %", set()),
        ("9 | 0.81 / 2.50 % | 1.20 / 3.00 % | 98 % | 1 | 10.0 %",
         {"plants", "accuracy", "no harm", "trips", "overshoot"}),
        ("10 | 0.80 / 2.50 % | 1.20 / 3.01 % | 100 % | 0 | trip at 100 rpm", {"accuracy", "overshoot"}),
    ],
)  # fmt: skip
def test_a_row_beyond_a_bound_is_seen(cells: str, found: set[str]) -> None:
    assert missed(f"| `x` | kind | 10 kHz, 0.3 rad | {cells} |") == found


def test_every_machine_has_a_campaign_of_its_own_with_the_usual_bounds() -> None:
    seeds = set()
    for name in KINDS:
        campaign = read(FILES / f"{name}.toml")
        assert campaign.cases >= CASES and campaign.check.controllers == ("robust",)
        assert campaign.check.limits == Limits()
        seeds.add(campaign.seed)
    assert len(seeds) == len(KINDS)


def test_a_row_that_is_measured_again_replaces_only_itself() -> None:
    page = PAGE.read_text(encoding="utf-8")
    rows = rows_of(page)
    assert with_rows(page, rows) == page
    changed = with_rows(page, rows | {"truck": "| `truck` | new |"})
    assert rows_of(changed) == rows | {"truck": "| `truck` | new |"}
    assert len(changed.splitlines()) == len(page.splitlines())


def test_a_campaign_that_crashed_is_not_taken_for_one_that_missed_a_bound(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both end with exit code 1; the summary of an earlier run is there."""

    def crashed(command: list[str], **_: object) -> subprocess.CompletedProcess[str]:
        return subprocess.CompletedProcess(command, 1, "", "Traceback: KeyError")

    (tmp_path / "summary.json").write_text('{"cases": 10}')
    monkeypatch.setattr(subprocess, "run", crashed)
    with pytest.raises(click.ClickException, match="truck: Traceback: KeyError"):
        machines._campaign("truck", 1, tmp_path)
