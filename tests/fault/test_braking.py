# SPDX-License-Identifier: Apache-2.0
"""How a machine brakes in each safe state about the level at which one replaces the other, (SS-25)."""

import math
from pathlib import Path

import numpy as np
import pytest

from fluxtrue_tools.fault_campaign import fmea, spec
from fluxtrue_tools.fault_campaign.fmea import Point
from fluxtrue_tools.fault_campaign.oracle import BRIDGE, LOWER, OFF
from fluxtrue_tools.fault_campaign.run_point import Imposed, run_point
from fluxtrue_tools.sim.motor import load

CAMPAIGN = spec.read(Path(__file__).with_name("campaign.toml"))
STRONG = "plant.magnet_scale=1.06"
MOTORS = Path(__file__).resolve().parents[1] / "motors"
PRIUS = MOTORS / "prius"
PMSYRM = MOTORS / "pmsyrm"
HOT = "plant.winding_C=240"


def braking_Nm(name: str, share: float, state: str, change: str = "", torque_Nm: float = -40.0) -> float:
    """Largest torque from 200 ms after the change of state on; the back-EMF is this share of the dc voltage."""
    motor = load(name)
    strength = 1.06 if change == STRONG else 1.0
    per_rpm = math.sqrt(3.0) * motor.psi_f_Vs * strength * motor.plant["pole_pairs"] * math.pi / 30.0
    rpm = share * motor.plant["vdc_V"] / per_rpm
    cells = dict.fromkeys(fmea.COLUMNS, "") | {"id": "x", "element": "-", "failure": "-", "injection": change,
                                               "reaction": "keep", "status": "met"}  # fmt: skip
    text = ",".join(fmea.COLUMNS) + "\n" + ",".join(cells[column] for column in fmea.COLUMNS) + "\n"
    (row,) = fmea.parse(text, "t.csv")
    point = Point(0, 1.0, name, 0.0, 0.0, rpm, torque_Nm)
    trace = run_point(CAMPAIGN, motor, row, point, Imposed(BRIDGE[state], 0.0))
    after = (trace.time_ms > 200.0) & (trace.time_ms < 245.0)
    return float(np.abs(trace["truth.torque_shaft_mean_Nm"][after]).max())


def test_a_machine_with_little_saliency_is_not_braked_by_its_diodes_up_to_the_dc_voltage() -> None:
    assert braking_Nm("paper", 0.99, OFF) < 0.1
    assert braking_Nm("paper", 0.99, LOWER) > 8.0


def test_above_it_the_braking_begins_slowly_and_the_short_circuit_brakes_more() -> None:
    """Almost at its largest speed, with a hot winding."""
    assert braking_Nm("paper", 1.04, OFF, HOT) < 1.5
    assert braking_Nm("paper", 1.04, LOWER, HOT) > 14.0


@pytest.mark.parametrize("torque_Nm", [-40.0, 0.0, 40.0])
def test_a_machine_with_much_saliency_goes_on_generating_only_above_its_level(torque_Nm: float) -> None:
    assert braking_Nm("hsm1", 0.9, OFF, torque_Nm=torque_Nm) < 1.0


def test_above_its_level_the_short_circuit_brakes_less() -> None:
    """A machine that generates when it is switched off goes on so at 1.06, with the torque that it had."""
    assert braking_Nm("hsm1", 1.06, OFF) > 40.0
    assert braking_Nm("hsm1", 1.06, LOWER) < 4.0


def test_with_too_strong_a_magnet_the_braking_grows_beyond_that_of_the_short_circuit() -> None:
    assert 4.0 < braking_Nm("paper", 1.06, OFF, STRONG) < 6.0
    assert braking_Nm("paper", 1.06, LOWER, STRONG) > 9.0
    assert braking_Nm("paper", 1.09, OFF, STRONG) > 15.0
    assert braking_Nm("paper", 1.09, LOWER, STRONG) < 10.0


@pytest.mark.parametrize(("share", "off_Nm", "shorted_Nm"), [(1.03, 0.2, 2.0), (1.06, 1.3, 2.0), (1.08, 4.0, 1.9)])
def test_about_its_level_a_machine_brakes_as_the_page_says(share: float, off_Nm: float, shorted_Nm: float) -> None:
    """The row `prius` of docs/theory/safe-state.md, to its last digit."""
    assert round(braking_Nm(str(PRIUS), share, OFF), 1) == off_Nm
    assert round(braking_Nm(str(PRIUS), share, LOWER), 1) == shorted_Nm


def test_just_above_its_level_much_saliency_brakes_at_once() -> None:
    assert braking_Nm("hsm1", 1.02, OFF, STRONG) > 45.0
    assert braking_Nm("hsm1", 1.02, LOWER, STRONG) < 3.0


@pytest.mark.parametrize(
    ("share", "off_Nm", "shorted_Nm"), [(0.72, 0.0, 3.7), (0.78, 0.0, 3.3), (0.82, 30.3, 3.3), (0.9, 34.3, 3.0)]
)
def test_the_most_saliency_needs_the_lowest_level(share: float, off_Nm: float, shorted_Nm: float) -> None:
    """The rows `pmsyrm` of docs/theory/safe-state.md; tests/tools/motor/test_rectifier.py has the level."""
    assert round(braking_Nm(str(PMSYRM), share, OFF, torque_Nm=-30.0), 1) == off_Nm
    assert round(braking_Nm(str(PMSYRM), share, LOWER, torque_Nm=-30.0), 1) == shorted_Nm
