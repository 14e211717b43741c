# SPDX-License-Identifier: Apache-2.0
"""Current control at the voltage limit, (CC-4) to (CC-14) with R = 0: from every flux that the voltage can hold the
target is reached, (CC-26). In periods, and in radii of the voltage circle."""

import numpy as np
import pytest
from numpy.typing import NDArray

SIGMA, SHARE, WEIGHT = 1 / 3, 11 / 32, 0.8
A = 0.2 * SIGMA
A_I = 0.16 * SIGMA
PERIODS = 10  # of a step of the task
TURNS = 6
FIELD_TURNS = (0.02, 0.069, 0.1, 0.15, 0.2, 0.3)
TARGETS_DEG = (23.0, 0.0, -18.2)

Flux = NDArray[np.complex128]


def remaining(x: NDArray[np.float64]) -> NDArray[np.float64]:
    end = (np.minimum(np.floor(np.abs(x) * 256.0), 255.0) + 1.0) / 256.0
    return np.maximum(np.sqrt(1.0 - end * end), 0.25)


def limited(v: Flux, e_d: NDArray[np.float64]) -> Flux:
    """The voltage circle of a field that turns backwards."""
    d_first = (v.real < 0.0) & (e_d < 0.0)
    d_max = np.where(d_first, 1.0, np.maximum(remaining(np.clip(v.imag, -1.0, 1.0)), 0.7))
    d = np.clip(v.real, -d_max, d_max)
    q = v.imag - np.clip(v.real - d, -1.0, 1.0)
    return d + 1j * np.clip(q, -remaining(d), remaining(d))


def fluxes(theta: float, psi_begin: Flux, target: Flux, psi_f: float, waits: bool) -> Flux:
    """The flux of each period. waits: (CC-26)."""
    w, w_rest = -theta, -theta * (1.0 - SHARE)

    def weighted(psi: Flux) -> Flux:
        return psi_f + WEIGHT * (psi.real - psi_f) + 1j * WEIGHT * psi.imag

    def unlimited(s: Flux, to: Flux, psi: Flux) -> Flux:
        return SIGMA * (weighted(to) - psi) + 1j * w_rest * weighted(to) + 1j * SHARE * w * psi + s

    psi, acting = psi_begin, 1j * w * psi_begin
    s = acting - unlimited(0j * psi, psi, psi)
    to, steps = target, np.zeros(psi.shape)
    found = []
    for k in range(int(TURNS * 2.0 * np.pi / theta)):
        if k % PERIODS == 0 and waits:
            held = (steps >= 2) & (acting.real > 0.0)
            to = np.where(held, np.minimum(target.real, psi.real), target.real) + 1j * target.imag
        e, u = to - psi, unlimited(s, to, psi)
        v = limited(u, e.real)
        cut = v - u
        s = s + A_I * (SIGMA + 1j * w_rest) * e
        s = s + A * (np.clip(cut.real, -4.0, 4.0) + 1j * np.clip(cut.imag, -4.0, 4.0))
        if k % PERIODS == PERIODS - 1:
            steps = np.where(np.abs(u) > 1.0, steps + 1, 0)
        psi, acting = np.exp(-1j * w) * psi + np.exp(-0.5j * w) * acting, v
        found.append(psi)
    return np.array(found)


def longest_and_deepest(theta: float, waits: bool) -> tuple[float, float]:
    """Angle of the field until the last one is within 0.1 of the target for good; largest fall of psi_d."""
    angle, length = np.meshgrid(np.radians(np.arange(5.0, 90.0)), [0.95, 1.0, 1.1, 1.15])
    begin = (length * np.exp(1j * angle)).ravel() / theta
    longest, deepest = 0.0, 0.0
    for planned in (0.885, 0.96):
        for degrees in TARGETS_DEG:
            target = planned / theta * np.exp(1j * np.radians(degrees)) + 0.0 * begin
            psi = fluxes(theta, begin, target, 0.9 * planned / theta, waits)
            far = (np.abs(psi - target) * theta > 0.1).any(axis=1)
            longest = max(longest, theta * (np.flatnonzero(far).max() + 1))
            deepest = max(deepest, theta * float((begin.real - psi.real.min(axis=0)).max()))
    return longest, deepest


@pytest.mark.parametrize("theta", FIELD_TURNS)
def test_the_target_is_reached_from_every_flux_and_the_d_flux_falls_no_further(theta: float) -> None:
    longest, deepest = longest_and_deepest(theta, True)
    _, without = longest_and_deepest(theta, False)
    assert longest < 10.0
    assert deepest < without + 0.01


@pytest.mark.parametrize("theta", FIELD_TURNS[:-1])
def test_without_waiting_a_machine_may_stay_at_one_voltage_of_the_circle(theta: float) -> None:
    longest, _ = longest_and_deepest(theta, False)
    assert longest > 0.99 * TURNS * 2.0 * np.pi
