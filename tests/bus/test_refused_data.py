# SPDX-License-Identifier: Apache-2.0
"""Motor data that the drive refuses: the library and a simulated scenario say why, without a bus."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
from damage import BAD_FLUX, damaged
from ecu import BUILD, Ecu

from fluxtrue_tools import faults
from fluxtrue_tools.sim import cli, library, output
from fluxtrue_tools.sim import motor as sim_motor
from fluxtrue_tools.sim.build import MotorFolder
from fluxtrue_tools.sim.run import simulate
from fluxtrue_tools.sim.scenario import Scenario

HSM1 = sim_motor.read(MotorFolder("hsm1", BUILD / "motors" / "hsm1"))
TEXT = "A flux table contains an inductance or observer gain that is not positive"
SCENARIO = {"duration_s": 0.1, "motor": "hsm1", "profile": {"speed_rpm": [[0.0, 1000.0]], "torque_Nm": [[0.0, 20.0]]}}


@pytest.fixture
def refused(tmp_path: Path) -> sim_motor.Motor:
    """hsm1 with an inductance of zero in its flux tables."""
    return replace(HSM1, library=library.load(damaged(HSM1.folder.library, tmp_path / "refused.so", *BAD_FLUX)))


def test_the_library_and_the_frame_on_the_bus_name_the_check(refused: sim_motor.Motor) -> None:
    for motor, word in ((refused, "flux_table_value"), (HSM1, "ok")):
        ecu = Ecu(motor)
        ecu.run(300)
        assert str(ecu.last["INV_Configuration"]["MotorCheck"]) == word
        assert faults.explained("INV_Configuration.MotorCheck")[int(ecu.get("motor_check"))][0] == word
        assert (ecu.state == "fault") == (word != "ok")
        ecu.close()


def test_a_scenario_with_refused_data_ends_with_the_reason(refused: sim_motor.Motor) -> None:
    scenario = Scenario.model_validate(SCENARIO)
    run = simulate(scenario, refused)
    assert f"config (flux_table_value: {TEXT}) at " in str(run.unexpected())
    data = output.summary(run)
    assert data["motor_check"] == f"flux_table_value: {TEXT}"
    (line,) = [line for line in cli.table(data).splitlines() if "faults" in line]
    assert line.endswith(f"(flux_table_value: {TEXT})")
    good = output.summary(simulate(scenario, HSM1))
    assert good["motor_check"] is None and "(" not in next(x for x in cli.table(good).splitlines() if "faults" in x)


def test_every_bit_and_check_has_a_sentence() -> None:
    for path, count in (("INV_Faults.DriveFaults", 16), ("INV_Faults.EcuFaults", 11)):
        assert sorted(faults.explained(path)) == list(range(count))
    checks = faults.explained("INV_Configuration.MotorCheck")
    assert len(checks) > 40 and all(text.endswith(".") and not math.isnan(n) for n, (_, text) in checks.items())
    assert faults.refused_data(0) == ""
    assert faults.refused_data(255) == "check 255: Not known to these tools"
