# SPDX-License-Identifier: Apache-2.0
"""Campaigns that cannot be measured and keys without effect are refused, by key, before anything is run or written."""

from pathlib import Path

import pytest
from conftest import SMALL, campaign

from fluxtrue_tools.campaign.case import run_case
from fluxtrue_tools.campaign.check import check
from fluxtrue_tools.campaign.machine import Machine, make_machine
from fluxtrue_tools.campaign.score import bounds, score
from fluxtrue_tools.campaign.spec import parse
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim.build import prepare

SPEEDS = "speed_rpm = [[500, 6000, 1]]"
HIGH = SMALL.replace(SPEEDS, "speed_rpm = [[500, 4000, 1]]")
CHECKED = '[check]\ncontrollers = ["paper"]\n'

REFUSED = [
    ("windows beyond the motor", SMALL.replace("6000, 1]]", "12000, 1]]"),
     "windows.speed_rpm.0.1 = 12000 rpm, allowed: up to 10000 rpm (speed_max_rpm of motor hsm1)"),
    ("a low speed beyond the motor", SMALL.replace("[250]", "[11000]"),
     "windows.low_speed_rpm.0 = 11000 rpm, allowed: up to 10000 rpm"),
    ("torque beyond the motor", SMALL.replace("settle_s", "torque_min_Nm = 200\nsettle_s"),
     "windows.torque_min_Nm = 200 N·m, allowed: up to 128.3 N·m (what motor hsm1 can give at 500 rpm"),
    ("torque beyond the motor at speed", SMALL.replace(SPEEDS, "torque_min_Nm = 100\nspeed_rpm = [[9000, 9900, 1]]"),
     "windows.torque_min_Nm = 100 N·m, allowed: up to "),
    ("bounds without a controller", SMALL + "[check.limits]\nrms_low = 1", "check.limits.rms_low: has no effect here"),
    ("bounds without a window", HIGH + CHECKED + "[check.limits]\nrms_high = 1",
     "check.limits.rms_high: has no effect here: no window lies above 5000 up to 5000 rpm"),
    ("nothing to check", SMALL.replace(SPEEDS, "speed_rpm = [[100, 280, 1]]") + CHECKED,
     "check.controllers: has no effect here: no window lies from 300 rpm on"),
    ("a drive without a controller", SMALL.replace("mode = 0 }", "mode = 0 }\nwarm_up = false"),
     "drive.duration_s: has no effect"),
    ("the paper's gain in the robust way", SMALL.replace("mode = 0 }", "mode = 1, observer_m = 3 }"),
     "controller.1.set.observer_m: has no effect here"),
    ("a plant field that is drawn", SMALL.replace("[plant]", "[plant]\ndevice_drop_V = 2"),
     "plant.device_drop_V: has no effect here: every case draws it: spread.device_drop_error_V"),
    ("constants beside a map", SMALL.replace("[plant]", "[plant]\nld_H = 1e-3"),
     "plant.ld_H: has no effect here: the motor has a flux map"),
    ("a ripple without a frequency", SMALL.replace("[plant]", "[plant]\nvdc_ripple_V = 2"),
     "plant.vdc_ripple_V: has no effect here"),
    ("a resolution with the firmware", SMALL.replace("[plant]", "[plant]\nvdc_quantise = true"),
     "plant.vdc_quantise: has no effect here: the firmware always gets the converter's whole codes"),
    ("a nominal value the motor has", SMALL + "[nominal]\ndevice_drop_V = 2", "nominal.device_drop_V: has no effect"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "message"), [case[1:] for case in REFUSED], ids=[case[0] for case in REFUSED])
def test_what_cannot_be_measured_is_refused_by_its_key(text: str, message: str) -> None:
    assert text not in (SMALL, HIGH)
    campaign_file = parse(text, "c.toml")
    with pytest.raises(FluxtrueError) as refusal:
        check(campaign_file, make_machine(prepare("hsm1"), campaign_file, "c.toml"), "c.toml")
    assert str(refusal.value).startswith(f"c.toml: {message}"), refusal.value


def test_it_is_refused_before_a_folder_is_made(tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(SMALL.replace("settle_s", "torque_min_Nm = 200\nsettle_s"))
    result = campaign("c.toml", "--out", "out", cwd=tmp_path)
    assert result.returncode == 2
    assert result.stderr.startswith("error: c.toml: windows.torque_min_Nm = 200 N·m, allowed: up to ")
    assert [path.name for path in tmp_path.iterdir()] == ["c.toml"]


def test_a_band_without_windows_has_no_bounds_and_no_verdict(machine: Machine) -> None:
    import pandas as pd

    text = HIGH.replace("low_speed_rpm = [250]", "low_speed_rpm = []").replace("cases = 4", "cases = 1") + CHECKED
    one = parse(text, "c.toml")
    check(one, machine, "c.toml")
    scores = score(one, pd.DataFrame(run_case(one, machine, 0)))
    promised = bounds(one, next(s for s in scores if s.controller == "paper"))
    assert not [bound.what for bound in promised if "above" in bound.what or "below 300" in bound.what]
    assert all(bound.value == bound.value for bound in promised)  # no NaN
    assert [bound.what for bound in promised][:2] == ["rms, 300 to 5000 rpm", "99th percentile, 300 to 5000 rpm"]


def test_plants_that_reach_no_window_are_said_and_leave_no_folder(tmp_path: Path) -> None:
    """The nominal machine reaches the torque; no drawn one does, because its magnet has a third of the flux."""
    weak = SMALL.replace("settle_s", "torque_min_Nm = 120\nsettle_s").replace("cases = 4", "cases = 1")
    (tmp_path / "c.toml").write_text(weak + "[spread]\nmagnet_scale = [0.3, 0.3]\n")
    result = campaign("c.toml", "--out", "out", "--workers", 1, cwd=tmp_path)
    assert result.returncode == 2, result.stderr
    assert "no case has a window" in result.stderr and result.stderr.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["c.toml"]


@pytest.mark.parametrize("path", sorted((Path(__file__).resolve().parents[2] / "loop" / "campaign").glob("*.toml")),
                         ids=lambda path: path.stem)  # fmt: skip
def test_the_shipped_campaigns_are_accepted(path: Path) -> None:
    from fluxtrue_tools.campaign.spec import read

    shipped = read(path)
    if shipped.motor != "hsm1":
        pytest.skip("its motor is not built here")
    check(shipped, make_machine(prepare("hsm1"), shipped, str(path)), str(path))
