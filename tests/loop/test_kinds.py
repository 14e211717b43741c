# SPDX-License-Identifier: Apache-2.0
"""Machines of every kind: steps with inductances 20 % too small, quiet sensors, and the rotor's own acceleration."""

import math

import numpy as np
import pytest

from fluxtrue_tools import faults
from fluxtrue_tools.campaign.machine import Machine, data_sheet
from fluxtrue_tools.campaign.machines import FILES, KINDS
from fluxtrue_tools.campaign.spec import Nominal, read
from fluxtrue_tools.campaign.steps import OVERSHOOT_MAX, overshoot, steps
from fluxtrue_tools.motor.config import SLEW_PER_TORQUE_MAX
from fluxtrue_tools.sim.build import prepare
from fluxtrue_tools.sim.library import Loop

MACHINES = tuple(KINDS)
MORE_LQ = {"lq_scale": 1.25}


def machine_of(name: str) -> Machine:
    return data_sheet(prepare(read(FILES / f"{name}.toml").motor, None, FILES, name), Nominal())


def test_overshoot_is_what_exceeds_the_final_value_in_the_direction_of_the_step() -> None:
    assert overshoot(np.array([0.0, 8.0, 11.0, 9.5, 10.0]), 0.0, 10.0) == pytest.approx(0.1)
    assert overshoot(np.array([0.0, -8.0, -12.0, -10.0]), 10.0, -10.0) == pytest.approx(0.1)
    assert overshoot(np.array([0.0, 5.0, 10.0]), 0.0, 10.0) == 0.0


@pytest.mark.parametrize("name", MACHINES)
def test_torque_overshoots_by_10_percent_at_most_with_inductances_20_percent_too_small(name: str) -> None:
    missed = [str(step) for step in steps(machine_of(name)) if not step.met]
    assert not missed, f"allowed: {100 * OVERSHOOT_MAX:g} %, no fault"


@pytest.mark.parametrize("name", MACHINES)
def test_no_step_trips_a_machine_whose_q_axis_has_25_percent_more_inductance(name: str) -> None:
    """Its flux is turned against the tables': no monitor may take that for a wrong angle."""
    tripped = [str(step) for step in steps(machine_of(name), MORE_LQ) if step.fault_word]
    assert not tripped


@pytest.mark.parametrize("name", MACHINES)
def test_quiet_sensors_of_a_machine_at_rest_are_not_stuck(name: str) -> None:
    """Without noise: torque steps where each of the phases carries no current, and between."""
    machine = machine_of(name)
    motor = machine.motor
    for electrical in range(0, 360, 15):
        plant = {"imposed_speed": 1.0, "theta_m_rad": math.radians(electrical) / machine.pole_pairs}
        with Loop(motor.library, motor.plant | plant, motor.flux_map) as loop:
            loop.set("enable", 1.0)
            loop.record(("fault_word",))
            for torque in (1.0, -1.0, 1.0, 0.0):
                loop.set("torque_requested_Nm", torque * motor.torque_max_Nm)
                word = int(loop.run(round(0.05 / loop.period_s)).max())
                assert word == 0, (electrical, torque, faults.named(word))


@pytest.mark.parametrize("name", MACHINES)
def test_a_rotor_that_accelerates_by_itself_trips_no_monitor(name: str) -> None:
    """All torque on the bare rotor up to 60 % of top speed, and back through zero.

    While the torque falls to zero, at SLEW_PER_TORQUE_MAX of full torque, the rotor gains half of the speed that full
    torque would give it. The light rotor of `servo` gains 40 % of its top speed: the reversal begins so much earlier,
    or the rotor would rightly be found too fast.
    """
    machine = machine_of(name)
    motor = machine.motor
    plant = {"imposed_speed": 0.0, "inertia_kgm2": motor.inertia_kgm2}
    top = 0.6 * machine.speed_max_rpm * 2.0 * math.pi / 60.0
    acceleration = motor.torque_max_Nm / motor.inertia_kgm2
    run_up_s = 1.2 * top / acceleration
    reverses = max(top - 0.5 * acceleration / SLEW_PER_TORQUE_MAX, 0.1 * top)
    with Loop(motor.library, motor.plant | plant, motor.flux_map) as loop:
        loop.set("enable", 1.0)
        loop.record(("fault_word", "truth.speed_rad_s"))
        loop.run(round(0.1 / loop.period_s))
        for torque in (1.0, -1.0, 1.0):
            loop.set("torque_requested_Nm", torque * motor.torque_max_Nm)
            for _ in range(400):
                row = loop.run(round(max(run_up_s / 50.0, 1e-3) / loop.period_s))[-1]
                word = int(row[0])
                assert word == 0, (torque, row[1], faults.named(word))
                if torque * row[1] >= reverses:
                    break
            else:
                raise AssertionError(f"{row[1]:.0f} rad/s after {8 * run_up_s:.2g} s, wanted: {torque * reverses:.0f}")
