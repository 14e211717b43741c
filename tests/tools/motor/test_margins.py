# SPDX-License-Identifier: Apache-2.0
"""Margins of both laws of current control, computed from the generator's constants: docs/theory/current-control.md."""

import math

import numpy as np
import pytest

from fluxtrue_tools.motor.config import ANGLE_PER_PERIOD_MAX, ANGLE_TURNING
from fluxtrue_tools.motor.derived import (
    CLOSED_LOOP_SHARE,
    DELAY_PERIODS,
    LOOP_MISSING_PERIODS,
    TURNING_APPROACH,
    TURNING_FEEDBACK,
    TURNING_INTEGRAL,
)

SIGMA = 1.0 / (2.0 * DELAY_PERIODS)  # per period
INTEGRAL = CLOSED_LOOP_SHARE * (1.0 - CLOSED_LOOP_SHARE) * SIGMA
PHASE_MARGIN_MIN_DEG = 40.0
# As in the document: phase margins of both, largest sensitivity, largest table slope over the true one.
TABLE = {0.0: (52, 57, 1.50, 3.5), 0.2: (30, 48, 1.57, 3.3), 0.4: (17, 44, 1.63, 3.2), 0.6: (9, 48, 1.63, 3.1),
         0.8: (4, 57, 1.68, 2.5), 1.0: (None, 56, 1.76, 2.3), 1.2: (None, 57, 1.77, 2.3)}  # fmt: skip


class Loop:
    """The loop at the machine's voltage: feedback k and integral part i per period, R = 0, (CC-12)."""

    def __init__(self, theta: float, k: complex, i: complex, slope: float = 1.0) -> None:
        self.pole, self.k, self.i, self.slope = np.exp(-1j * theta), k, i, slope

    def margins(self, points: int = 20001) -> tuple[float, float]:
        """Phase margin in degrees over all frequencies of both signs, largest sensitivity."""
        z = np.exp(1j * np.linspace(-np.pi, np.pi, points))
        z = z[np.abs(z - 1.0) > 1e-3]
        loop = self.slope * (self.k + self.i / (z - 1.0)) / (z * (z - self.pole))
        crossings = np.flatnonzero(np.diff(np.sign(np.abs(loop) - 1.0)))
        return float(np.abs(np.angle(-loop[crossings], deg=True)).min()), float(1.0 / np.abs(1.0 + loop).min())

    def largest_pole(self) -> float:
        """Magnitude of the slowest eigenvalue."""
        plant = np.polymul([1.0, -self.pole], [1.0, -1.0, 0.0])
        return float(np.abs(np.roots(np.polyadd(plant, self.slope * np.array([0, 0, self.k, self.i - self.k])))).max())


def usual(theta: float, share: float = 1.0, advance: float = 0.0, sigma: float = SIGMA) -> Loop:
    """Section 3, with a share of the feed-forward and an additional advance of the angle."""
    turn = np.exp(1j * (advance - 0.5) * theta)
    return Loop(theta, turn * (sigma - 1j * share * theta), turn * sigma * INTEGRAL)


def turning(theta: float, slope: float = 1.0) -> Loop:
    """Section 8: the voltage is stated half a period before the end of the one in which it acts."""
    half = np.exp(-0.5j * theta)
    k = TURNING_FEEDBACK * np.exp(-1.5j * theta)
    return Loop(theta, half * k, half * TURNING_INTEGRAL * (k + 2j * math.sin(0.5 * theta)), slope)


def test_the_phase_margin_is_40_degrees_and_more_at_every_speed_that_is_accepted() -> None:
    for theta in np.arange(-ANGLE_PER_PERIOD_MAX, ANGLE_PER_PERIOD_MAX + 0.01, 0.02):
        margin, sensitivity = turning(theta).margins()
        assert margin >= PHASE_MARGIN_MIN_DEG, theta
        assert sensitivity < 1.8, theta
        assert turning(theta).largest_pole() < 0.952, theta


def test_inductances_wrong_by_half_in_either_direction_keep_the_loop_stable() -> None:
    for theta in np.arange(0.0, ANGLE_PER_PERIOD_MAX + 0.01, 0.05):
        assert all(turning(theta, slope).largest_pole() < 0.995 for slope in (0.5, 0.75, 1.25, 1.5, 2.0)), theta


@pytest.mark.parametrize("theta", TABLE)
def test_the_documents_table(theta: float) -> None:
    before, margin, sensitivity, slope = TABLE[theta]
    law = usual(theta)
    if before is None:
        assert law.largest_pole() > 1.0
    else:
        assert law.margins()[0] == pytest.approx(before, abs=0.6)
    assert turning(theta).margins() == (pytest.approx(margin, abs=1.0), pytest.approx(sensitivity, abs=0.01))
    assert turning(theta, slope).largest_pole() < 1.0 < turning(theta, slope + 0.15).largest_pole()


def test_the_usual_law_ends_before_its_margins_do() -> None:
    assert usual(ANGLE_TURNING).margins()[0] > 19.0
    assert usual(0.8).largest_pole() < 1.0 < usual(0.9).largest_pole()


def test_no_share_of_the_feed_forward_and_no_advance_replace_the_other_law() -> None:
    for share in np.arange(0.0, 1.01, 0.1):
        for advance in np.arange(-1.5, 1.01, 0.25):
            for sigma in (SIGMA, 0.28, 0.22):
                laws = [usual(theta, share, advance, sigma) for theta in (0.0, 0.4, 0.8, 1.2)]
                assert min(law.margins(2001)[0] if law.largest_pole() < 1.0 else 0.0 for law in laws) < 30.0


def test_both_laws_lag_as_far_behind_a_reference() -> None:
    lag = 1.0 + 1.0 / TURNING_APPROACH
    assert lag == pytest.approx(LOOP_MISSING_PERIODS, abs=1e-9)
