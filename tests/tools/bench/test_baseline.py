# SPDX-License-Identifier: Apache-2.0
"""The comparison with the committed figures."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from fluxtrue_tools.bench import baseline, figures, page
from fluxtrue_tools.emulate import build as emulation
from fluxtrue_tools.errors import FluxtrueError

COMMITTED = {"compiler": "gcc 1", "drives": {"robust": {"fast": [1, 2.5, 3]}}, "image": {"flash": 10}}


def test_equal_figures_have_no_difference() -> None:
    assert baseline.compare(COMMITTED, json.loads(json.dumps(COMMITTED)), "page", "page") == []


def test_one_instruction_more_is_named_with_old_and_new() -> None:
    new = json.loads(json.dumps(COMMITTED))
    new["drives"]["robust"]["fast"][2] = 4
    assert baseline.compare(COMMITTED, new, "a", "b") == ["drives / robust / fast: [1, 2.5, 3] → [1, 2.5, 4]"]


def test_figures_that_come_and_go_are_differences() -> None:
    new = {"compiler": "gcc 1", "drives": {"robust": {}}, "image": {"flash": 10, "RAM": 3}}
    assert baseline.compare(COMMITTED, new, "", "") == [
        "drives / robust / fast: [1, 2.5, 3], now gone", "image / RAM: new, 3",
    ]  # fmt: skip


def test_a_page_changed_by_hand_is_a_difference() -> None:
    assert "performance.md" in baseline.compare(COMMITTED, COMMITTED, "page", "page, nicer")[0]


def test_another_compiler_is_told_and_compares_nothing() -> None:
    assert baseline.other_compiler(COMMITTED, "gcc 1") is None
    reason = baseline.other_compiler(COMMITTED, "gcc 2")
    assert reason is not None and "'gcc 1'" in reason and "'gcc 2'" in reason


@pytest.mark.parametrize(
    ("content", "message"), [(None, "bench --update"), ("{", "no JSON"), ("[]", "compiler is missing")]
)
def test_a_baseline_that_cannot_be_read_is_an_error(tmp_path: Path, content: str | None, message: str) -> None:
    path = tmp_path / "performance.json"
    if content is not None:
        path.write_text(content)
    with pytest.raises(FluxtrueError, match=message):
        baseline.load(path)


def test_what_is_written_reads_back(tmp_path: Path) -> None:
    baseline.write(COMMITTED, "text\n", tmp_path / "a.json", tmp_path / "a.md")
    assert baseline.load(tmp_path / "a.json") == COMMITTED
    assert (tmp_path / "a.md").read_text() == "text\n"
    assert len(list(tmp_path.iterdir())) == 2


def test_the_committed_page_is_what_the_committed_figures_give() -> None:
    assert page.page(baseline.load()) == baseline.PAGE.read_text(encoding="utf-8")


def test_a_bound_that_is_missed_is_called_missed() -> None:
    committed = baseline.load()
    committed["image"]["flash"] = page.FLASH_MAX + 1
    assert f"| image, flash | {page.FLASH_MAX + 1} | {page.FLASH_MAX} | **missed** |" in page.page(committed)
    committed["image"]["flash"] = page.FLASH_MAX
    assert f"| image, flash | {page.FLASH_MAX} | {page.FLASH_MAX} | met |" in page.page(committed)


def test_the_tick_meets_its_bound_on_average_and_the_peers_stand_beside_the_one_with_the_look_up() -> None:
    stages = baseline.load()["kernels"]["stages"]
    tick, with_tables, tables = (stages[name] for name in ("current_tick", "current_tick_tables", "flux_table"))
    assert page.BOUNDS["current_tick"] == (160, 214)
    assert tick[1] <= 160
    assert tick[2] <= 214
    assert with_tables[1] > tick[1] + tables[1] / 2
    peers = baseline.PAGE.read_text(encoding="utf-8").split("## Comparison with other projects")[1]
    ours = next(line for line in peers.splitlines() if "current control with its flux tables" in line)
    assert ours.endswith(f"| {with_tables[1]} | {with_tables[2]} |")


def test_the_fast_interrupt_and_the_control_library_meet_their_bounds() -> None:
    figures = baseline.load()
    for drive in figures["drives"].values():
        assert drive["runs"]["fast ISR"]["instructions"][1] <= page.ENCODER_MAX
    library = figures["control library"]
    assert library["code"] + library["constants"] <= 11.5 * 1024
    assert (page.ENCODER_MAX, page.RESOLVER_MAX, page.CODE_MAX) == (360, 345, 11776)


def _row_of_the_resolver(figures: page.Figures, mode: str) -> str:
    begin = f"| **resolver, AD2S1210** | {mode}"
    return next(line for line in page.page(figures).splitlines() if line.startswith(begin))


def test_the_demanded_bound_of_the_fast_interrupt_is_that_of_the_image_with_the_resolver() -> None:
    figures = baseline.load()
    for mode in ("paper", "robust"):
        spread = figures["sensors"]["resolver"]["runs"][mode]["fast ISR"]["instructions"]
        assert spread[1] > figures["drives"][mode]["runs"]["fast ISR"]["instructions"][1]
        assert ("avg ≤ 345 met" in _row_of_the_resolver(figures, mode)) == (spread[1] <= 345)
        spread[1] = 345.1
        assert "avg ≤ 345 **missed**" in _row_of_the_resolver(figures, mode)
        spread[1] = 345.0
        assert "avg ≤ 345 met" in _row_of_the_resolver(figures, mode)


def test_every_sensor_that_an_image_can_have_stands_beside_the_encoder() -> None:
    figures = baseline.load()
    assert {"encoder", *figures["sensors"]} == set(emulation.FLASHED) == set(page.SENSORS)
    for sensor in figures["sensors"].values():
        executed = max(run["fast ISR"]["instructions"][2] for run in sensor["runs"].values())
        bound = sensor["bounds"]["fast ISR"]["instructions"]
        assert executed <= bound
        assert sum(f"| {executed} | {bound} |" in line for line in page.page(figures).splitlines()) >= 1


def test_the_maxima_contain_what_only_the_reactions_to_faults_have() -> None:
    runs = np.array([[100, 200, 210, 300], [300, 500, 520, 900]])
    row = figures._row(runs, np.array([[625, 450, 460, 800]]))
    assert row == {"runs": 2, "instructions": [100, 200.0, 625], "cycles": [200, 350.0, 500],
                   "least": [210, 365.0, 520], "most": [300, 600.0, 900],
                   "cycles_at_most": {"driving": 500, "reacting": 450}}  # fmt: skip
    empty = np.empty((0, 4), dtype=np.int64)
    assert figures._row(runs[:1], empty)["instructions"] == [100, 100.0, 100]
