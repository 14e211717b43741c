# SPDX-License-Identifier: Apache-2.0
"""The pulses that move a light rotor little, where no higher voltage does: (CM-41)."""

import math

import numpy as np
import pytest
from watched import Watched

from fluxtrue_tools.commission import hidden, plan, swing
from fluxtrue_tools.commission.bursts import Raw, record
from fluxtrue_tools.commission.impulse import Losses
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.steps import _enable
from fluxtrue_tools.commission.swing import LONG, SHORT, Response, Waves
from fluxtrue_tools.sim.library import Loop
from fluxtrue_tools.sim.motor import Motor

VOLTS, TOP = 20.0, 40.0
LEFT_RAD = 0.005  # electrical: of a speed before the pulses of 40 degrees in a second, and of noise
EVEN = Response(0.005, 0.0, 0.0, 0.0, 1e-6)  # 0.1 A in a period: the bounds are met
RIPPLED = Response(0.1, -0.005, -0.2, 0.13, 1.3e-6)  # 2 A: about that of anaheim 104


def farthest(of: Response, waves: Waves) -> float:
    first, other = np.array([waves.first]), np.array([-waves.low_A / waves.high_A])
    return float(swing.farthest_rad(of, VOLTS, waves.high_A, first, other, waves.reversals)[0])


def test_three_half_waves_move_the_rotor_as_the_theory_says(monkeypatch: pytest.MonkeyPatch) -> None:
    """(CM-28): by 0.69 of the torque over the inertia at the largest current, times the square of t_A."""
    monkeypatch.setattr(swing, "UNCERTAIN", 0.0)
    monkeypatch.setattr(swing, "PERIODS", 6000)
    rise = TOP / (EVEN.per_volt * VOLTS)
    moved = farthest(EVEN, Waves(-TOP, TOP, math.sqrt(0.5), SHORT))
    assert moved == pytest.approx(0.687 * EVEN.rad_per_A * TOP * rise**2, rel=0.02)


def test_five_half_waves_move_it_by_half_to_each_side(monkeypatch: pytest.MonkeyPatch) -> None:
    """(CM-41)."""
    monkeypatch.setattr(swing, "UNCERTAIN", 0.0)
    monkeypatch.setattr(swing, "PERIODS", 6000)
    rise = TOP / (EVEN.per_volt * VOLTS)
    moved = farthest(EVEN, Waves(-TOP * math.sqrt(0.808), TOP, math.sqrt(0.308), LONG))
    assert moved == pytest.approx(0.335 * EVEN.rad_per_A * TOP * rise**2, rel=0.03)


def test_the_shape_that_is_needed_is_chosen() -> None:
    """A heavy rotor has three half waves up to the whole bound, a lighter one five, the lightest a smaller bound."""
    chosen = [swing.quietest(Response(0.1, -0.005, -0.2, 0.05, rad), VOLTS, TOP) for rad in (5e-7, 1.6e-6, 3e-6)]
    print(chosen)
    assert [waves.reversals for waves in chosen[:2]] == [SHORT, LONG]
    assert [waves.high_A < TOP for waves in chosen] == [False, False, True]
    assert farthest(RIPPLED, Waves(-TOP, TOP, math.sqrt(0.5), SHORT)) > swing.SWING_RAD
    assert farthest(RIPPLED, swing.quietest(RIPPLED, VOLTS, TOP)) <= swing.SWING_RAD


def test_the_response_of_a_recorded_burst(small: Motor, plate: Nameplate) -> None:
    """Inductance and inertia of the plant; the firmware's own pulses move it as far as was computed."""
    _, flux_map, plant = hidden.draw("anaheim", 101, small, plate.i_max_A)
    drive = Watched(Loop(small.library, plant, flux_map))
    _enable(drive)
    drive.set("dead_time_compensation", 0.0)
    raw = record(drive, plan._along_q(0.0, 0.69, (-40.0, 40.0), Waves(-TOP, TOP, 0.7, SHORT)), plate)
    of = swing.response(raw)
    print(of, math.degrees(raw.moved_rad))
    assert of.per_volt == pytest.approx(drive.period_s / (plant["lq_H"] * plant["lq_scale"]), rel=0.02)
    psi_f_Vs, pairs = plant["psi_f_Vs"] * plant["magnet_scale"], plant["pole_pairs"]
    assert of.rad_per_A == pytest.approx(
        1.5 * pairs**2 * psi_f_Vs / plant["inertia_kgm2"] * drive.period_s**2, rel=0.05
    )
    volts = float(np.abs(raw.u.imag).max())
    worst = swing.farthest_rad(of, volts, TOP, np.array([0.7]), np.array([1.0]), SHORT)[0]
    assert raw.moved_rad == pytest.approx(worst, abs=LEFT_RAD)


@pytest.mark.parametrize(("share", "is_planned"), [(plan.UNSEEN, False), (plan.VOLTAGES[1], True)])
def test_only_at_the_highest_voltage_another_shape_is_needed(
    share: float, is_planned: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    wanted = Waves(-30.0, 35.0, 0.5, LONG)
    monkeypatch.setattr(plan, "response", lambda _: RIPPLED)
    monkeypatch.setattr(plan, "quietest", lambda *_: wanted)
    monkeypatch.setattr(plan, "magnet_Vs", lambda *_: 0.02)
    monkeypatch.setattr(plan, "balanced", lambda *_: 0.6)
    nothing = np.zeros(3)
    last = plan.Taken(Raw(nothing + 0j, nothing + 0j, nothing, nothing, 5e-5), share, Waves(-TOP, TOP, 0.7, SHORT))
    waves = plan._waves([last], share, 27.0, TOP, Losses(0.0, 0.0), 0.02)
    assert (waves is wanted) == is_planned
    assert is_planned or waves == Waves(-TOP, TOP, 0.6, SHORT)
