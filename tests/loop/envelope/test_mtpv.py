# SPDX-License-Identifier: Apache-2.0
"""Maximum torque per volt, where more current would give less torque, and the use of the whole voltage hexagon."""

import math
from pathlib import Path

import numpy as np
import pytest
from rig import Rig

from fluxtrue_tools.sim.build import prepare
from fluxtrue_tools.sim.motor import Motor, read

GEM = Path(__file__).resolve().parents[2] / "motors" / "gem"
STEP_MS = 5.0
TOP_RPM, LOW_V, I_MAX_A = 8000.0, 250.0, 240.0
PLANNED = 0.92 / math.sqrt(3.0)


@pytest.fixture(scope="module")
def gem() -> Motor:
    """A machine whose magnet flux i_d can cancel within its current limit."""
    return read(prepare(str(GEM)))


def largest(motor: Motor, magnet: float, rpm: float, sign: int) -> tuple[float, float]:
    """Torque and current by search: the steady-state voltage equations with constant inductances."""
    p = motor.plant
    i_d, i_q = np.meshgrid(np.linspace(-I_MAX_A, 0.0, 961), np.linspace(0.0, I_MAX_A, 961))
    i_q = sign * i_q
    omega = p["pole_pairs"] * rpm * math.tau / 60.0
    psi_d, psi_q = p["ld_H"] * i_d + magnet * p["psi_f_Vs"], p["lq_H"] * i_q
    volts = np.hypot(p["r_ohm_20"] * i_d - omega * psi_q, p["r_ohm_20"] * i_q + omega * psi_d)
    current = np.hypot(i_d, i_q)
    torque = sign * 1.5 * p["pole_pairs"] * (psi_d * i_q - psi_q * i_d)
    best = int(np.argmax(np.where((volts <= PLANNED * LOW_V) & (current <= I_MAX_A), torque, 0.0)))
    return float(torque.flat[best]), float(current.flat[best])


@pytest.mark.parametrize("magnet", [0.8, 0.85, 0.9])
@pytest.mark.parametrize("sign", [1, -1])
def test_where_torque_per_volt_is_the_limit_the_current_stays_below_its_limit(
    gem: Motor, magnet: float, sign: int
) -> None:
    torque, current = largest(gem, magnet, TOP_RPM, sign)
    assert current < 0.96 * I_MAX_A  # the voltage alone is the limit, not the current circle
    trace = Rig(gem, TOP_RPM, sign * 132.0, magnet_scale=magnet, vdc_V=LOW_V).run(0.8)
    assert trace.faults == 0
    made = sign * trace.settled()
    assert made == pytest.approx(trace.settled("torque_max_Nm"), abs=1.0)  # the reported reach
    assert made >= 0.98 * torque
    measured = math.hypot(trace.settled("truth.i_d_A"), trace.settled("truth.i_q_A"))
    assert measured <= 1.05 * current


def test_a_reversal_through_maximum_torque_per_volt_neither_trips_nor_overshoots(gem: Motor) -> None:
    rig = Rig(gem, TOP_RPM, vdc_V=LOW_V)
    rig.run(0.3)
    for torque in (132.0, -132.0, 132.0, 0.0):
        trace = rig.set(torque_requested_Nm=torque).run(0.2)
        assert trace.faults == 0
        assert np.hypot(trace["truth.i_d_A"], trace["truth.i_q_A"]).max() <= 1.1 * I_MAX_A
    assert abs(trace.settled()) <= 2.0


def test_a_step_at_speed_uses_the_hexagon_beyond_its_inner_circle_and_returns_to_the_reserve(hsm1: Motor) -> None:
    rig = Rig(hsm1, 4500.0)
    rig.run(0.3)
    trace = rig.set(torque_requested_Nm=120.0).run(0.3)
    assert trace.faults == 0
    volts = np.hypot(trace["truth.u_d_V"], trace["truth.u_q_V"])
    circle, corner = 350.0 / math.sqrt(3.0), 2.0 / 3.0 * 350.0
    assert circle < volts[: trace.row(STEP_MS)].max() <= corner
    assert trace.voltage <= 1.01 * PLANNED * 350.0
