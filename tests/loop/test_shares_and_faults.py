# SPDX-License-Identifier: Apache-2.0
"""Torque and speed as shares of the largest values of a motor, and runs that trip."""

import json
import os
import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

from fluxtrue_tools import faults
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim import plot
from fluxtrue_tools.sim.motor import Motor
from fluxtrue_tools.sim.run import simulate
from fluxtrue_tools.sim.scenario import parse

ROOT = Path(__file__).resolve().parents[2]
HEAD = 'motor = "hsm1"\nduration_s = 0.3\n'
PROFILE = "[profile]\ntorque_share = 0.4\nspeed_share = 0.1\n"
BREAKS = PROFILE + "[[event]]\nt = 0.15\nset = { 'plant.current_open_b' = true }\n"
AFTER_A_TRIP = HEAD + "[profile]\ntorque_Nm = 50\nspeed_rpm = 1000\n[[event]]\nt = 0.1\nset = { 'plant.vdc_V' = 500 }\n"


@pytest.mark.parametrize("name", ["paper", "hsm1"])
def test_shares_are_of_the_motor_that_runs(name: str, paper: Motor, hsm1: Motor) -> None:
    motor = {"paper": paper, "hsm1": hsm1}[name]
    text = "[profile]\ntorque_share = [[0, 0], [0.1, 0.5]]\nspeed_share = [[0, 0], [0.2, 0.25]]"
    shares = parse(HEAD + text, "s.toml")
    units = parse(HEAD + f"[profile]\ntorque_Nm = [[0, 0], [0.1, {0.5 * motor.torque_max_Nm}]]\n"
                         f"speed_rpm = [[0, 0], [0.2, {0.25 * motor.speed_max_rpm}]]", "u.toml")  # fmt: skip
    assert np.array_equal(simulate(shares, motor).rows, simulate(units, motor).rows)


@pytest.mark.parametrize(
    ("profile", "message"),
    [
        ("torque_share = 1.2", "profile.torque_share = 1.2, allowed: -1 to 1"),
        ("torque_share = [[0, 0], [0.5, 1.2]]", "profile.torque_share.1 = [0.5, 1.2], allowed: -1 to 1"),
        ("torque_share = [[0, 0], [0.5, 'x']]", "profile.torque_share.1 = [0.5, 'x'], allowed: [t, value]"),
        ("torque_share = 0.5\ntorque_Nm = 10", "profile.torque_share and profile.torque_Nm: give one of the two"),
        ("speed_share = 0.5\nspeed_rpm = 10", "profile.speed_share and profile.speed_rpm: give one of the two"),
        ("torque_share = 'half'", "profile.torque_share = 'half': allowed: a number, or a list"),
        ("speed_share = [[0, 0], [1, 1]]\n[mechanics]\nmode = 'inertia'", "profile.speed_share: with an inertia only"),
    ],
)
def test_a_bad_share_is_refused_by_its_key(profile: str, message: str) -> None:
    with pytest.raises(FluxtrueError) as refusal:
        parse(HEAD + "[profile]\n" + profile, "s.toml")
    assert str(refusal.value).startswith(f"s.toml: {message}")


def test_a_speed_share_beyond_what_can_be_simulated_is_named(hsm1: Motor) -> None:
    with pytest.raises(FluxtrueError, match="s.toml: profile.speed_share = 200000 rpm, allowed: up to 100000 rpm"):
        simulate(parse(HEAD + "[profile]\nspeed_share = 20", "s.toml"), hsm1, where="s.toml")


def test_faults_have_the_names_of_the_bus_and_their_times(hsm1: Motor) -> None:
    run = simulate(parse(HEAD + BREAKS, "s.toml"), hsm1)
    (time_s, names), *_ = run.faults()
    assert 0.15 < time_s <= 0.152
    assert "over_current" in names
    assert names == faults.named(int(run["fault_word"][run["time_s"] >= time_s - 1e-9][0]))


def test_the_bits_are_the_documented_ones() -> None:
    """The page has a second table of bits, that of the derating reasons."""
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    table = page.partition("<!-- words: FAULT_LIST -->")[2].partition("<!-- words: end -->")[0]
    rows = re.findall(r"^\| (\d+) \| `(\w+)` \| \S", table, flags=re.MULTILINE)
    assert {int(bit): name for bit, name in rows} == faults.names()
    assert len(rows) == len(faults.names()) > 10


@pytest.mark.parametrize(
    ("expected", "complaint"),
    [
        (None, "the drive tripped: .*over_current.* at 0.15.* s; .* says expect_fault = \"over_current\""),
        ("over_current", None),
        ("current_sum", None),
        ("over_speed", "expect_fault = 'over_speed': the drive tripped with another fault first: over_current"),
    ],
)  # fmt: skip
def test_a_trip_is_a_failure_unless_it_is_the_expected_one(
    hsm1: Motor, expected: str | None, complaint: str | None
) -> None:
    head = HEAD if expected is None else HEAD + f'expect_fault = "{expected}"\n'
    told = simulate(parse(head + BREAKS, "s.toml"), hsm1).unexpected()
    if complaint is None:
        assert told is None
    else:
        assert told is not None
        assert re.search(complaint, told), told


def test_a_drive_that_should_have_tripped_and_did_not_is_a_failure(hsm1: Motor) -> None:
    run = simulate(parse(HEAD + 'expect_fault = "over_current"\n[profile]\ntorque_share = 0.2', "s.toml"), hsm1)
    assert run.unexpected() == "expect_fault = 'over_current': the drive did not trip"


def test_an_unknown_fault_name_is_refused() -> None:
    with pytest.raises(FluxtrueError, match="expect_fault = 'explosion', allowed: over_current, over_voltage"):
        parse(HEAD + 'expect_fault = "explosion"', "s.toml")


def test_a_trip_is_marked_in_every_panel_and_named_in_one(hsm1: Motor) -> None:
    run = simulate(parse(HEAD + BREAKS, "s.toml"), hsm1)
    sheet = plot.figure(run, "trip")
    time_s = run.faults()[0][0]
    for axes in sheet.axes:
        assert any(next(iter(line.get_xdata())) == time_s for line in axes.lines if len(line.get_xdata()) == 2)
    texts = [text.get_text() for axes in sheet.axes for text in axes.texts]
    assert sum("over_current" in text for text in texts) == 1
    plt.close(sheet)


def test_names_of_faults_close_together_are_not_written_over_each_other(hsm1: Motor) -> None:
    """An offset of one sensor at a stuck angle: three faults within 10 ms of a run of 1 s."""
    added = "[[event]]\nt = 0.3\nset = { 'plant.current_offset_A_b' = 60, 'plant.angle_stuck' = true }"
    head = 'motor = "hsm1"\nduration_s = 1.0\n[profile]\ntorque_Nm = 60\nspeed_rpm = 9500\n'
    run = simulate(parse(head + added, "s.toml"), hsm1)
    assert len(run.faults()) > 1
    sheet = plot.figure(run, "trip")
    sheet.canvas.draw()
    texts = [text for axes in sheet.axes for text in axes.texts]
    assert sorted("\n".join(text.get_text() for text in texts).split("\n")) == sorted(
        name for _, names in run.faults() for name in names)  # fmt: skip
    boxes = [text.get_window_extent() for text in texts]
    assert not any(a.overlaps(b) for a, b in pairwise(boxes))
    assert all(box.x0 >= 0 for box in boxes)
    plt.close(sheet)


@pytest.mark.parametrize(("added", "panels"), [("identification = false\ntorque_loop = false", 6), ("", 10)])
def test_panels_of_an_identification_that_is_off_are_not_drawn(hsm1: Motor, added: str, panels: int) -> None:
    text = HEAD + "[profile]\ntorque_share = 0.3\nspeed_share = 0.2\n[controller]\n" + added
    sheet = plot.figure(simulate(parse(text, "s.toml"), hsm1), "panels")
    assert len(sheet.axes) == panels
    plt.close(sheet)


def test_the_command_line_reports_a_trip_with_its_exit_code_and_keeps_the_files(tmp_path: Path) -> None:
    (tmp_path / "run.toml").write_text(AFTER_A_TRIP)
    command = [sys.executable, "-m", "fluxtrue_tools", "sim", "run.toml", "--json", "run.json"]
    environment = os.environ | {"PYTHONPATH": str(ROOT / "tools")}
    for head, code in (("", 1), ('expect_fault = "over_voltage"\n', 0)):
        (tmp_path / "run.toml").write_text(head + AFTER_A_TRIP)
        done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, env=environment, check=False)
        assert done.returncode == code, done.stderr
        assert "over_voltage at 0.10" in done.stdout
        assert done.stderr.startswith("error: run.toml: the drive tripped: over_voltage at 0.10") == bool(code)
        assert json.loads((tmp_path / "run.json").read_text())["faults"][0]["names"] == ["over_voltage"]
