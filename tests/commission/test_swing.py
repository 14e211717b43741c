# SPDX-License-Identifier: Apache-2.0
"""The pulses that move a rotor little: (CM-28), (CM-45)."""

import math
from dataclasses import replace

import numpy as np
import pytest
from watched import Watched

from fluxtrue_tools.commission import along_q, hidden, shown, swing
from fluxtrue_tools.commission.bursts import Raw, record, shift
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.shown import Losses
from fluxtrue_tools.commission.steps import _enable
from fluxtrue_tools.commission.swing import Drift, Machine, Waves
from fluxtrue_tools.sim.library import Loop
from fluxtrue_tools.sim.motor import Motor

VOLTS, TOP = 20.0, 40.0
LEFT_RAD = 0.005  # electrical: of a speed before the pulses of 40 degrees in a second, and of noise
NONE = Drift()


def linear(per_volt: float, per_A: float, of_legs_A: float, noise_A: float, rad_per_A: float) -> Machine:
    """By what changes its current in a period of 1 s, and its angle by a current."""
    inductance, far = 1.0 / per_volt, 10.0 * TOP
    legs = -of_legs_A * inductance * np.array([-1.0, -1.0, 1.0, 1.0])
    line = np.array([0.0, 2.0 * TOP, far])  # shown up to twice the bound
    return Machine(line, inductance * line, line, -per_A * inductance, np.array([-far, -1e-6, 1e-6, far]), legs,
                   rad_per_A, noise_A, 1.0)  # fmt: skip


EVEN = linear(0.005, 0.0, 0.0, 0.0, 1e-6)  # 0.1 A in a period: the bounds are met
RIPPLED = linear(0.1, -0.005, -0.2, 0.13, 1.3e-6)  # 2 A: about that of anaheim 104


def farthest(of: Machine, waves: Waves, drift: Drift = NONE, sign: float = 1.0) -> float:
    return float(swing.course(of, VOLTS, [waves], drift, sign).moved_rad[0])


@pytest.fixture
def certain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(swing, "UNCERTAIN", 0.0)
    monkeypatch.setattr(swing, "UNCERTAIN_DRIFT", 0.0)
    monkeypatch.setattr(swing, "UNCERTAIN_BEYOND", 0.0)
    monkeypatch.setattr(swing, "PERIODS", 6000)


@pytest.mark.usefixtures("certain")
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_three_half_waves_move_the_rotor_as_the_theory_says(sign: float) -> None:
    """(CM-28): by 0.69 of the torque over the inertia at the largest current, times the square of t_A."""
    rise = TOP / (0.005 * VOLTS)
    moved = farthest(EVEN, Waves(-TOP, TOP, math.sqrt(0.5)), NONE, sign)
    assert moved == pytest.approx(0.687 * 1e-6 * TOP * rise**2, rel=0.02)


@pytest.mark.usefixtures("certain")
def test_a_drift_before_the_pulses_moves_the_rotor_on() -> None:
    """A speed that is there before them stays for the whole burst."""
    waves = Waves(-TOP, TOP, math.sqrt(0.5))
    still = farthest(EVEN, waves)
    periods = 2.0 * (1.0 + math.sqrt(2.0)) * TOP / (0.005 * VOLTS)  # rise and fall: two small half waves, a large one
    per_period = 0.3 * still / periods
    with_it, against = (farthest(EVEN, waves, Drift(0.0, sign * per_period, 0.0)) for sign in (1.0, -1.0))
    print(still, with_it, against)
    assert 1.1 * still < with_it < 1.3 * still
    assert 0.7 * still < against < 0.9 * still
    assert farthest(EVEN, waves, Drift(0.0, per_period, 0.0), -1.0) == pytest.approx(against, rel=1e-9)


def test_what_is_not_known_makes_the_computed_movement_larger(monkeypatch: pytest.MonkeyPatch) -> None:
    """A speed that braking has left, and a saturation beyond what was shown: the worst of the draws counts."""
    knee = np.array([0.0, 0.6 * TOP, 10.0 * TOP])
    saturated = replace(RIPPLED, i_A=knee, psi_Vs=10.0 * np.array([0.0, 0.6 * TOP, 2.5 * TOP]), torque=knee)
    waves = Waves(-TOP, TOP, 0.5)
    still = farthest(saturated, waves)
    assert farthest(saturated, waves, Drift(uncertain_rad=2e-4)) > still + 1e-3
    assert saturated.current_A(np.array([8.0 * TOP])) == pytest.approx(
        0.6 * TOP + 0.5 * (saturated.current_A(np.array([8.0 * TOP]), 0.5) - 0.6 * TOP)
    )
    monkeypatch.setattr(swing, "UNCERTAIN_BEYOND", 0.0)
    assert farthest(saturated, waves) < still


@pytest.mark.parametrize("rad_per_A", [1e-7, 2e-6])
def test_the_bounds_that_are_needed_are_chosen(rad_per_A: float) -> None:
    """A heavy rotor has the whole bound. With a lighter one the half waves against the first one are smaller: it swings
    to both sides, by less than a degree in place of 1.2."""
    of = linear(0.1, -0.005, -0.2, 0.05, rad_per_A)
    found = swing.quietest(of, [VOLTS], TOP, 2.0 * TOP, NONE)
    assert found is not None
    waves = found[1]
    moved = farthest(of, waves if waves.high_A >= -waves.low_A else waves.mirrored())
    plain = farthest(of, Waves(-TOP, TOP, math.sqrt(0.5)))
    print(waves, math.degrees(moved), math.degrees(plain))
    assert moved <= swing.SWING_RAD
    assert (plain <= swing.SWING_RAD) == (rad_per_A < 1e-6) == (min(waves.high_A, -waves.low_A) > 0.99 * TOP)


def test_a_current_that_may_become_too_large_is_not_chosen() -> None:
    """With a higher voltage the current of a machine that saturates misses its bound by more. Where no current is small
    enough there is no burst."""
    knee = TOP * np.array([0.0, 0.6, 3.0, 10.0])
    saturated = replace(RIPPLED, i_A=knee, psi_Vs=10.0 * TOP * np.array([0.0, 0.6, 1.1, 2.5]), torque=knee)
    loose, strict = (swing.quietest(saturated, [VOLTS, 6.0 * VOLTS], TOP, limit * TOP, NONE) for limit in (3.0, 1.15))
    print(loose, strict)
    assert loose is not None
    assert strict is not None
    assert (loose[0], strict[0]) == (6.0 * VOLTS, VOLTS)
    assert swing.quietest(saturated, [VOLTS], TOP, 0.5 * TOP, NONE) is None


@pytest.mark.parametrize("offset_A", [0.3, -0.3])
@pytest.mark.parametrize("low_A", [-TOP, -0.9 * TOP])
def test_an_offset_of_the_sensors_leaves_the_direction_of_the_first_half_wave(low_A: float, offset_A: float) -> None:
    """The firmware begins towards the bound that is further from zero, and knows nothing of the offset."""
    upwards = Waves(low_A, TOP, 0.7)
    for waves in (upwards, upwards.mirrored()):
        asked = along_q.burst(0.0, 0.5, (-TOP, TOP), waves).shifted(1j * offset_A)
        assert (asked.q[1] >= -asked.q[0]) == (waves is upwards)
        assert asked.q == pytest.approx((waves.low_A + offset_A, waves.high_A + offset_A), abs=0.65)


@pytest.mark.usefixtures("certain")
def test_an_offset_of_the_sensors_changes_what_the_firmware_sums() -> None:
    """Bounds that are shifted by it would be met as without it; the balance of the impulses is another one."""
    waves = Waves(-0.9 * TOP, TOP, math.sqrt(0.5))
    moved = [farthest(replace(EVEN, offset_A=0.02 * TOP * each), waves) for each in (0.0, 1.0, -1.0)]
    print(moved)
    assert max(moved) > 1.03 * min(moved)
    mirrored = farthest(replace(EVEN, offset_A=-0.02 * TOP), waves, NONE, -1.0)
    assert mirrored == pytest.approx(moved[1], rel=1e-9)


def recorded(small: Motor, plate: Nameplate) -> tuple[Watched, dict[str, float], float, Raw]:
    """A burst of 40 A along q, and what the sensors show along q without current: 2 A at most."""
    _, flux_map, plant = hidden.draw("anaheim", 101, small, plate.i_max_A)
    plant |= {f"current_offset_A_{phase}": value for phase, value in zip("abc", (-2.0, 1.0, 1.0), strict=True)}
    plant["vdc_offset_V"] = 0.0  # no step has measured it
    drive = Watched(Loop(small.library, plant, flux_map))
    known = replace(plate, offset_A=-2.0 + 0.0j)
    _enable(drive)
    drive.set("dead_time_compensation", 0.0)
    wanted = along_q.burst(0.0, 0.69, (-40.0, 40.0), Waves(-TOP, TOP, 0.7))
    offset_A = shift(drive, known).imag
    return drive, plant, offset_A, record(drive, wanted, known)


def test_the_machine_of_a_recorded_burst(small: Motor, plate: Nameplate, monkeypatch: pytest.MonkeyPatch) -> None:
    """Inductance and inertia of the plant; the firmware's own pulses move it as far as is computed, and with the
    largest current that is computed."""
    monkeypatch.setattr(swing, "UNCERTAIN", 0.0)
    drive, plant, offset_A, raw = recorded(small, plate)
    losses = Losses(plant["r_ohm_20"], plant["dead_time_s"] * plant["pwm_hz"] * plant["vdc_V"])
    psi_f_Vs, pairs = plant["psi_f_Vs"] * plant["magnet_scale"], plant["pole_pairs"]
    last = shown.shown(raw, losses)
    turns = shown.rad_per_torque([last], psi_f_Vs)
    of = replace(shown.machine(last, losses, psi_f_Vs, turns, plate.i_max_A), offset_A=offset_A)
    print(offset_A, of, math.degrees(raw.moved_rad))
    assert of.linkage_Vs(np.array([20.0, -20.0])) == pytest.approx(
        plant["lq_H"] * plant["lq_scale"] * np.array([20.0, -20.0]), rel=0.03
    )
    assert turns == pytest.approx(1.5 * pairs**2 / plant["inertia_kgm2"] * drive.period_s**2, rel=0.06)
    found = swing.course(of, float(np.abs(raw.u.imag).max()), [Waves(-TOP, TOP, 0.7)], NONE)
    assert raw.moved_rad == pytest.approx(found.moved_rad[0], abs=LEFT_RAD)
    assert float(np.abs(raw.i.imag).max()) == pytest.approx(found.reach_A[0], rel=0.03)


def test_at_a_bias_the_legs_lose_what_the_current_along_d_makes_them_lose(small: Motor, plate: Nameplate) -> None:
    """Without a current along q there is a voltage along it, unless the rotor stands symmetrically to the legs."""
    raw = recorded(small, plate)[3]
    raw = replace(raw, theta=raw.theta - raw.theta[-1] + 0.3)
    losses = Losses(0.05, 1.5)
    last = shown.shown(raw, losses)
    of = [shown.machine(last, losses, 0.01, 1e-9, plate.i_max_A, along_d_A=bias) for bias in (0.0, -20.0)]
    at_zero = [float(each.lost_V(np.array([0.0]))[0]) for each in of]
    theta = float(raw.theta[-1])
    phases = [-math.copysign(1.0, math.cos(theta - 2.0 * math.pi * k / 3.0)) for k in range(3)]
    wanted = sum(2.0 / 3.0 * 1.5 * sign * math.sin(2.0 * math.pi * k / 3.0 - theta) for k, sign in enumerate(phases))
    assert at_zero[0] == pytest.approx(0.0, abs=1e-12)
    assert at_zero[1] == pytest.approx(wanted, abs=0.1)
    assert abs(wanted) > 0.2
