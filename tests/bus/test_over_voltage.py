# SPDX-License-Identifier: Apache-2.0
"""A battery that is lost while the machine charges it: from the task's decision through the trip to the release of the
short circuit, with the dc link, contactor and state machine of the simulated vehicle."""

import math
from collections.abc import Iterator

import numpy as np
import pytest
from ecu import BUILD

from fluxtrue_tools import faults
from fluxtrue_tools.sim import motor as sim_motor
from fluxtrue_tools.sim.build import MotorFolder
from fluxtrue_tools.sim.ecu_loop import RUN, EcuLoop

RPM = math.pi / 30.0
BATTERY_V = 350.0
LIMIT_V, RELEASE_V = 1.25 * BATTERY_V, 1.15 * BATTERY_V
SHORT_ON_EITHER = 3  # safe_t: an over-voltage or a gate fault brings the short circuit
FREEWHEEL_OR_GATE = (0, 2)
LOAD_OHM = 100.0  # what else takes current from the link: it is below the release 5 ms after the trip
RELEASE_MS = 200  # that the voltage is below the release before the short circuit ends
NAMES = ("truth.vdc_V", "truth.torque_mean_Nm", "fault_word", "truth.i_d_A", "truth.i_q_A")


def decision(loop: EcuLoop) -> int:
    """The safe state that the task commands for a fault, should one occur now."""
    generation = int(loop.read("drive.commands.generation"))
    return int(loop.read(f"drive.commands.slot[{generation & 1}].safe"))


@pytest.fixture(params=[1.0, -1.0])
def charging(request: pytest.FixtureRequest) -> Iterator[EcuLoop]:
    """At 3000 rpm in both directions, 34 kW into the battery; a load on the link, as of a dc-dc converter."""
    motor = sim_motor.read(MotorFolder("hsm1", BUILD / "motors" / "hsm1"))
    plant = {"speed_rad_s": request.param * 3000.0 * RPM, "dc_load_ohm": LOAD_OHM, "current_noise_A_rms": 0.5,
             "vdc_start_V": BATTERY_V}  # fmt: skip
    with EcuLoop(motor, plant) as loop:
        loop.power_up()
        loop.steps(150, TorqueRequested=-request.param * 110.0)
        loop.record(NAMES)
        yield loop


def run(loop: EcuLoop, milliseconds: int) -> dict[str, np.ndarray]:
    """Each name's values, one for each period."""
    rows = np.concatenate([loop.step_ms() for _ in range(milliseconds)])
    return {name: rows[:, k] for k, name in enumerate(NAMES)}


def test_the_short_circuit_is_decided_before_the_trip_and_ends_when_the_voltage_is_low(charging: EcuLoop) -> None:
    assert charging.state == RUN
    assert decision(charging) == SHORT_ON_EITHER
    charging.set("plant.contactor_open", 1.0)
    lost = run(charging, 6)
    over = int(np.argmax(lost["truth.vdc_V"] > LIMIT_V))
    first = int(np.argmax(lost["fault_word"] > 0.0))
    assert faults.named(int(lost["fault_word"][first])) == ["over_voltage"]
    assert 1 <= first - over <= 3  # two samples beyond the limit
    assert charging.read("drive.fast.short_circuit.holds") == 1.0
    assert lost["truth.vdc_V"].max() < 500.0

    held = run(charging, RELEASE_MS - 10)
    assert held["truth.vdc_V"][-1] < RELEASE_V
    assert charging.read("drive.fast.short_circuit.holds") == 1.0
    released = run(charging, 200)
    assert charging.read("drive.fast.short_circuit.holds") == 0.0
    assert decision(charging) in FREEWHEEL_OR_GATE
    assert released["truth.vdc_V"].max() < LIMIT_V
    assert np.abs(released["truth.torque_mean_Nm"][-500:]).max() < 2.0
