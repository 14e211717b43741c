# SPDX-License-Identifier: Apache-2.0
"""The evaluation of direct currents and of bursts, on recordings that are computed here from a machine's equations."""

import cmath
import math

import numpy as np
import pytest

from fluxtrue_tools.commission import levels, plan
from fluxtrue_tools.commission.bursts import Raw, integrate
from fluxtrue_tools.motor.flux_model import Array

PERIOD_S, PERIODS = 1e-4, 500
R_OHM, LEG_V, PSI_F, LD, LQ = 0.005, 8.0, 0.16, 3e-4, 5e-4
AXES = [cmath.exp(2j * cmath.pi * k / 3.0) for k in range(3)]


def flux(i: Array, saturation: float) -> Array:
    """A machine whose co-energy has a cubic part: psi_d falls with i_q^2 and with i_d^2."""
    d, q = i.real, i.imag
    return PSI_F + LD * d - saturation * (d * d + q * q) + 1j * (LQ * q - 2.0 * saturation * d * q)


def level(
    mean_A: float, angle_rad: float, moved_rad: float = 0.0, saturation: float = 0.0, offset_V: float = 0.0
) -> Raw:
    """A triangular ripple about a direct current, with its corners at the samples. The mean voltages of the periods
    follow from the change of the flux linkages in the stationary frame, R and the signs of the phase currents."""
    fine = 40
    t = np.arange(PERIODS * fine + 1) / fine
    ripple_d = 10.0 * (2.0 * np.abs((t / 14.0) % 1.0 * 2.0 - 1.0) - 1.0)
    ripple_q = 12.0 * (2.0 * np.abs(((t + 3.0) / 18.0) % 1.0 * 2.0 - 1.0) - 1.0)
    theta = angle_rad + moved_rad * (t / PERIODS) ** 2
    i = mean_A + ripple_d + 1j * ripple_q
    turn = np.exp(1j * theta)
    i_s = i * turn
    lost = sum(2.0 / 3.0 * axis * LEG_V * np.sign((i_s * axis.conjugate()).real) for axis in AXES)
    psi_s = flux(i, saturation) * turn
    rest = (R_OHM * i_s + lost)[:-1].reshape(PERIODS, fine).mean(axis=1)
    u_s = np.diff(psi_s[::fine]) / PERIOD_S + rest
    middle = np.exp(-0.5j * (theta[:-1:fine] + theta[fine::fine]))
    return Raw(i[:-1:fine], u_s * middle - offset_V, theta[:-1:fine], np.zeros(PERIODS), PERIOD_S)


def all_levels(angle_rad: float, **errors: float) -> list[Raw]:
    return [level(sign * share * 250.0, angle_rad, **errors) for share in levels.LEVELS for sign in (1.0, -1.0)]


# 1 mV of the 0.9 V that R drops at the largest level; the worst of these cases has 0.7 mV, by the signs of the currents
@pytest.mark.parametrize("angle_deg", [3.0, 25.0, 91.0])
@pytest.mark.parametrize(
    "errors",
    [{}, {"moved_rad": 0.12}, {"saturation": 2e-7}, {"offset_V": 0.012}, {"moved_rad": -0.1, "saturation": 2e-7}],
)
def test_resistance_and_leg_follow_from_levels_with_ripple(angle_deg: float, errors: dict[str, float]) -> None:
    found = levels.solve(all_levels(math.radians(angle_deg), **errors), PSI_F)
    assert found.r_ohm == pytest.approx(R_OHM, rel=1e-3)
    assert found.level_V == pytest.approx(LEG_V, abs=0.02)


def test_what_the_drive_compensates_is_counted_by_the_currents_that_its_sensors_show() -> None:
    """Phase a has 1 A, which the sensors show as -1 A: the compensation has the wrong sign there."""
    i = np.array([1.0 + 200.0j] * 3)
    raw = Raw(i, np.zeros(3, complex), np.zeros(3), np.zeros(3), PERIOD_S)
    with_it = raw.compensated(-2.0 + 0.0j, 6.0, 0.5)
    signs = [-1.0, 1.0, -1.0]  # b: -0.5 + 173; c: -0.5 - 173
    wanted = sum(2.0 / 3.0 * axis * 6.0 * sign for axis, sign in zip(AXES, signs, strict=True))
    assert with_it.u == pytest.approx([wanted] * 2)
    assert len(with_it.i) == len(with_it.theta) == len(with_it.zero) == 2


def test_the_leg_of_a_current_that_changes_its_sign_is_counted_in_parts() -> None:
    """From -1 A to 3 A a quarter of the period is negative: mean sign 1/2."""
    i = np.array([-1.0 + 0.0j, 3.0 + 0.0j])
    raw = Raw(i, np.zeros(2, complex), np.zeros(2), np.zeros(2), PERIOD_S)
    others = 2.0 / 3.0 * (AXES[1] + AXES[2]) * -0.5  # b and c change theirs at the same time
    assert integrate(raw, 0.0).of_level[1] == pytest.approx(-PERIOD_S * (2.0 / 3.0 * 0.5 + others))


@pytest.mark.parametrize(
    ("first", "wanted"),
    [(math.sqrt(0.5), 0.6), (0.9, 0.6 * math.sqrt(0.5) / 0.9), (0.5, 0.6 * math.sqrt(2.0)), (0.4, 0.9)],
)
def test_the_first_half_wave_gets_half_of_the_impulse(first: float, wanted: float) -> None:
    """Triangles: the impulse is the square of the amplitude; a share of 0.6 is to be corrected by that."""

    def triangle(top: float) -> Array:
        n = round(100 * abs(top))
        return math.copysign(1.0, top) * np.concatenate((np.arange(n), n - np.arange(n))) / 100.0

    i_q = np.concatenate((np.zeros(30), triangle(first), triangle(-1.0), triangle(1.0)))
    raw = Raw(1j * i_q, np.zeros(len(i_q), complex), np.zeros(len(i_q)), np.zeros(len(i_q)), PERIOD_S)
    assert plan._balanced(0.6, raw) == pytest.approx(wanted, rel=0.03)
