# SPDX-License-Identifier: Apache-2.0
"""A slice of the fault campaign with the flashed image on the emulated processor."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest
from fault_command import faults

from fluxtrue_tools.bench.build import have_arm_compiler
from fluxtrue_tools.emulate import build
from fluxtrue_tools.emulate.ecu_loop import EmulatedEcuLoop
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.fault_campaign import fmea, spec

ROOT = Path(__file__).resolve().parents[3]
CAMPAIGN = ROOT / "tests" / "fault" / "emulated.toml"
LINES = ("healthy", "winding-hot", "current-a-open", "angle-frozen-fast", "dc-sensor-far-low", "lead-a-open",
         "switch-upper-c-open", "battery-open-regen", "gate-fault", "command-lost", "command-crc", "enable-withdrawn",
         "memory-1", "memory-10", "inverter-sensor-broken")  # fmt: skip
LEFT_OUT = "inverter-sensor-broken"  # its cause is a member of the host's port
ONE = (
    'fmea = "fmea.csv"\nprocessor = "{processor}"\nsigns = [1]\npoints = [[0.2, 0.5]]\n[[machine]]\nmotor = "hsm1"\n'
    "current_A = 600\nvdc_V = 500\n"
)
# A word of the motor data changes: only the image's lie in a flash with a checksum. The drive has copied it, so that on
# the host the change has no effect.
FLASH = "flash,software,a word,,memory.motor.measure.v_dc.scale=x0.7,,bounded,any,60,,60,,,,100,met,hsm1/0/+,,\n"


@pytest.fixture(scope="module", autouse=True)
def compiler() -> None:
    if not have_arm_compiler():
        pytest.skip("no cross compiler: there is no image to emulate")


def test_points_times_and_bounds_are_those_of_the_campaign_on_the_host() -> None:
    image, host = spec.read(CAMPAIGN), spec.read(CAMPAIGN.with_name("campaign.toml"))
    own = {"processor", "slice_points", "machine"}
    assert image.model_dump(exclude=own) == host.model_dump(exclude=own)
    assert set(image.machine) < set(host.machine)


def test_the_image_reacts_to_the_faults_of_the_table_as_the_table_demands(tmp_path: Path) -> None:
    done = faults(CAMPAIGN, "--slice", "--lines", ",".join(LINES), "--out", tmp_path / "out", "--workers", 2)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"left out: {LEFT_OUT}" in done.stdout
    runs = pd.read_parquet(tmp_path / "out" / "results.parquet")
    assert set(runs["row"]) == set(LINES) - {LEFT_OUT}


@pytest.mark.parametrize(("processor", "code", "said"), [("emulated", 0, ""), ("host", 1, "WITHOUT EFFECT")])
def test_a_changed_word_of_the_flash_is_found_by_the_image_alone(
    tmp_path: Path, processor: str, code: int, said: str
) -> None:
    campaign = tmp_path / "one.toml"
    campaign.write_text(ONE.format(processor=processor), encoding="utf-8")
    (tmp_path / "fmea.csv").write_text(",".join(fmea.COLUMNS) + "\n" + FLASH, encoding="utf-8")
    done = faults(campaign, "--out", tmp_path / "out")
    assert done.returncode == code, done.stdout + done.stderr
    assert said in done.stdout
    runs = pd.read_parquet(tmp_path / "out" / "results.parquet")
    assert set(runs["first_fault"]) == ({"config"} if processor == "emulated" else {""})


@pytest.mark.parametrize("option", ["--line", "--lines"])
def test_a_line_that_the_image_cannot_have_is_refused_alone(option: str) -> None:
    done = faults(CAMPAIGN, option, LEFT_OUT)
    assert done.returncode == 2
    assert f"{option} {LEFT_OUT}: not possible on the emulated processor" in done.stderr


def test_the_results_are_not_recorded_in_the_table_of_the_host(tmp_path: Path) -> None:
    done = faults(CAMPAIGN, "--record", "--out", tmp_path / "out")
    assert done.returncode == 2
    assert "--record: the table has the results of the host" in done.stderr


@pytest.mark.parametrize(
    ("expected", "status", "code"),
    [
        ("over_current", "met", 0),
        ("over_current", "open", 0),  # one of the many points of the host's runs: it may show less
        ("over_speed", "met", 1),
        ("over_speed", "open", 0),
    ],
)
def test_a_line_that_says_met_must_not_be_open_with_the_image(
    tmp_path: Path, expected: str, status: str, code: int
) -> None:
    (tmp_path / "one.toml").write_text(ONE.format(processor="emulated"), encoding="utf-8")
    line = f"open,sensor,input open,,plant.current_open_a=1,,safe_state,{expected},5,,50,,,,60,{status},hsm1/0/+,,\n"
    (tmp_path / "fmea.csv").write_text(",".join(fmea.COLUMNS) + "\n" + line, encoding="utf-8")
    done = faults(tmp_path / "one.toml", "--out", tmp_path / "out")
    assert done.returncode == code, done.stdout + done.stderr
    assert ("status met is NOT TRUE" in done.stdout) == bool(code)


def test_members_of_the_image_have_the_names_of_the_source() -> None:
    parts = build.prepare("hsm1", angle="resolver", flashed=True)
    with EmulatedEcuLoop(parts.image, parts.layout, parts.motor, {"imposed_speed": 1.0}) as loop:
        loop.power_up()
        loop.steps(50, TorqueRequested=40.0)
        base_Nm = json.loads(parts.motor.folder.data.read_text(encoding="utf-8"))["bases"]["torque_Nm"]
        assert loop.read("drive.task.torque_commanded") == pytest.approx(40.0 / base_Nm * 32768.0, abs=2.0)
        loop.write("drive.task.torque_commanded", -5.0)
        assert loop.read("drive.task.torque_commanded") == -5.0
        assert loop.read("motor.angle_tracker.pole_pairs") == parts.motor.plant["pole_pairs"]
        with pytest.raises(FluxtrueError, match="no member 'board'"):
            loop.read("board.winding_broken")
