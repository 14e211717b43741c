# SPDX-License-Identifier: Apache-2.0
"""One switch shorted: the drive shorts the phases on the side of that switch. Checked with the plant's currents and
torque."""

import numpy as np
import pytest
from rig import FAULTED, Rig

from fluxtrue_tools.sim.motor import Motor

GATE = 1 << 15
SWITCHES = tuple(f"{side}_{leg}" for side in ("upper", "lower") for leg in "abc")
LARGEST_A = 830.0  # docs/theory/safe-state.md, section 5
STEADY_MS = 50.0  # at the end of a run
STEADY_A = 250.0  # psi_f/L_d of the saturated machine, and the least of the demagnetisation limit
REPORT_J = 2000.0 * 3e-6 * 350.0  # energy from the dc link until the drivers have blocked one short circuit


@pytest.mark.parametrize("torque", [-60.0, 0.0, 60.0])
@pytest.mark.parametrize("rpm", [-7000.0, 0.0, 200.0, 300.0, 600.0, 1000.0, 3000.0, 6000.0, 7900.0, 10000.0])
@pytest.mark.parametrize("switch", SWITCHES)
def test_a_shorted_switch_ends_in_a_symmetrical_short_circuit(
    hsm1: Motor, switch: str, rpm: float, torque: float
) -> None:
    rig = Rig(hsm1, rpm, torque * (0.6 if abs(rpm) > 9000.0 else 1.0))
    rig.run(0.3)
    trace = rig.set(**{f"plant_switch_shorted_{switch}": 1.0}).run(0.2)
    current = np.hypot(trace["truth.i_d_A"], trace["truth.i_q_A"])
    assert trace.faults & GATE
    assert trace["run_state"][-1] == FAULTED
    assert trace.fault_ms(GATE) <= 0.6
    assert current.max() <= LARGEST_A
    steady = current[trace.row(-STEADY_MS) :]
    assert steady.max() <= STEADY_A
    # An unsymmetrical short circuit would draw half waves between zero and the peak. The margin is for the voltage drop
    # of the switches at low speed.
    assert steady.max() - steady.min() <= 0.17 * STEADY_A
    assert np.ptp(trace.torque[trace.row(-STEADY_MS) :]) <= 20.0
    assert rig.get("truth.e_short_circuit_J") <= 3.0 * REPORT_J  # two reports, and pulses too short for one


@pytest.mark.parametrize("rpm", [300.0, 3000.0, 7000.0])
@pytest.mark.parametrize("torque", [-100.0, 100.0])
def test_the_decaying_currents_of_a_sound_bridge_are_no_shorted_switch(hsm1: Motor, rpm: float, torque: float) -> None:
    """Switching is disabled under torque: the currents take up to 2.3 ms to decay at 7900 rpm."""
    rig = Rig(hsm1, rpm, torque)
    rig.run(0.3)
    trace = rig.set(enable=0.0).run(0.1)
    assert trace.faults == 0
    assert abs(trace.torque[-1]) < 1.0


def test_after_a_gate_fault_of_a_sound_bridge_switching_is_disabled_when_the_machine_is_slow(hsm1: Motor) -> None:
    """The drivers report one short fault: a switch is shorted for 200 us."""
    rig = Rig(hsm1, 3000.0, 40.0)
    rig.run(0.2)
    rig.set(plant_switch_shorted_upper_b=1.0).run(2e-4)
    fast = rig.set(plant_switch_shorted_upper_b=0.0).run(0.3)
    assert fast.faults & GATE
    assert np.ptp(fast.torque[fast.row(-STEADY_MS) :]) < 1.0
    assert fast.settled() < -2.0  # short circuit
    rig.run(1.0, plant_speed_rad_s=(314.0, 30.0))
    slow = rig.run(0.1)
    current = np.hypot(slow["truth.i_d_A"], slow["truth.i_q_A"])
    assert current[slow.row(-STEADY_MS) :].max() < 0.1  # switching disabled, no current
