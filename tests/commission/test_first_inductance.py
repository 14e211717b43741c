# SPDX-License-Identifier: Apache-2.0
"""Inductances by pulses of a few samples: (CM-49), on recordings that are computed in small steps."""

from dataclasses import replace

import numpy as np
import pytest

from fluxtrue_tools.commission.bursts import Raw, integrate, legs_of
from fluxtrue_tools.commission.first_inductance import inductance_H, legs_in_time
from fluxtrue_tools.motor.flux_model import Array

PERIOD_S, LEG_V, L_H, THETA, STEPS = 1e-4, 10.0, 2e-4, 0.3, 500
PULSES = (30.0, 30.0, -30.0, -30.0, 30.0, 30.0, -30.0, -30.0)


def burst(axis: complex, knee_A: float, r_ohm: float = 0.0) -> tuple[Raw, Array]:
    """Currents of one axis, and the mean vector of the legs in each period."""
    turn = np.exp(1j * THETA)
    i, samples, means = 1e-3 * axis * turn, [], []
    for volts in PULSES:
        samples.append(i)
        legs = []
        for _ in range(STEPS):
            legs.append(legs_of(np.array(i), knee_A)[()])
            i = i + PERIOD_S / STEPS / L_H * (volts * axis * turn - LEG_V * legs[-1] - r_ohm * i)
        means.append(np.mean(legs))
    current = np.array([*samples, i]) / turn
    u = np.array([*PULSES, 0.0]) * axis
    some = np.full(len(current), THETA)
    return Raw(current, u, some, 0.0 * some, PERIOD_S), np.array(means)


@pytest.mark.parametrize("axis", [1.0, 1j])
@pytest.mark.parametrize("knee_A", [0.5, 2.0])
def test_a_current_is_fast_before_and_slow_after_its_legs_have_changed(axis: complex, knee_A: float) -> None:
    """The mean of the legs along the axis in each period, where a straight line in time has another one."""
    raw, means = burst(axis, knee_A)
    turn = np.exp(1j * THETA)
    by_path = legs_in_time(raw.i * turn, raw.u[:-1] * turn, LEG_V, knee_A)
    straight = -np.diff(integrate(raw, 0.0, knee_A).of_level * turn) / PERIOD_S
    error, of_straight = (float(np.abs(((each - means) * np.conj(axis * turn)).real).max())
                          for each in (by_path, straight))  # fmt: skip
    print(error, of_straight)
    assert error < 0.07
    assert of_straight > max(4.0 * error, 0.15)


@pytest.mark.parametrize("axis", [1.0, 1j])
def test_the_inductance_of_a_few_samples(axis: complex) -> None:
    raw, _ = burst(axis, 0.5, r_ohm=0.05)
    found_H = inductance_H(raw, 0.05, LEG_V, 0.5, of_q=axis == 1j)
    linkage = integrate(raw, 0.05, 0.5)
    slope_H = np.polyfit((raw.i / axis).real, ((linkage.psi + LEG_V * linkage.of_level) / axis).real, 1)[0]
    print(found_H, slope_H)
    assert found_H == pytest.approx(L_H, rel=0.01)
    assert slope_H > 1.04 * L_H


def test_noise_of_the_samples_changes_it_little() -> None:
    """1 A where the current changes by 6 to 20 A in a period."""
    rng = np.random.default_rng(5)
    raw, _ = burst(1.0, 0.5)
    noise = rng.normal(0.0, 1.0, (200, len(raw.i), 2)) @ np.array([1.0, 1.0j])
    found = np.array([inductance_H(replace(raw, i=raw.i + each), 0.0, LEG_V, 0.5, of_q=False) for each in noise])
    print(found.mean() / L_H, found.std() / L_H)
    assert found.mean() == pytest.approx(L_H, rel=0.05)
    assert found.std() < 0.06 * L_H


def test_without_a_change_of_the_current_there_is_none() -> None:
    raw, _ = burst(1.0, 0.5)
    assert inductance_H(replace(raw, i=0.0 * raw.i), 0.0, LEG_V, 0.5, of_q=False) == 0.0
