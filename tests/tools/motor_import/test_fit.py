# SPDX-License-Identifier: Apache-2.0
"""One smooth co-energy: exact for a machine that has one, and what happens to points that belong to none."""

import numpy as np
import pytest
from conftest import FULL, HALF, KNEE, POLE_PAIRS, Array, plane, polar, psi, torque

from fluxtrue_tools.motor import doubts
from fluxtrue_tools.motor.map_import.coenergy import CoEnergy, Points, fit, fit_separately
from fluxtrue_tools.motor.map_import.grid import make_grid, reach_of

I_MAX = 250.0
SCATTERED = np.random.default_rng(5).uniform(0.0, 1.0, (2, 400))
D, Q = plane(np.linspace(-I_MAX, 0.0, 40), np.linspace(0.0, I_MAX, 41))
INSIDE = np.hypot(D, Q) <= I_MAX
TORQUE_MAX = float(torque(D, Q)[INSIDE].max())


def points_at(d: Array, q: Array) -> Points:
    return Points(d, q, *psi(d, q))


def torque_error(model: CoEnergy) -> float:
    found = 1.5 * POLE_PAIRS * (model.psi_d(D, Q) * Q - model.psi_q(D, Q) * D)
    return float(np.abs(found - torque(D, Q))[INSIDE].max()) / TORQUE_MAX


@pytest.mark.parametrize("places", [HALF, FULL, polar(), (-260.0 * SCATTERED[0], 260.0 * SCATTERED[1])],
                         ids=["half", "full", "polar", "scattered"])  # fmt: skip
def test_a_machine_with_a_co_energy_is_met(places: tuple[Array, Array]) -> None:
    """Between the points: 0.02 % of the largest torque, of the promised 0.2 %, and 0.1 % of the largest flux."""
    model = fit(points_at(*places), I_MAX).model
    assert torque_error(model) < 2e-4
    psi_d, psi_q = psi(D, Q)
    assert np.abs(model.psi_d(D, Q) - psi_d)[INSIDE].max() < 1e-3 * psi_q.max()
    assert np.abs(model.psi_q(D, Q) - psi_q)[INSIDE].max() < 1e-3 * psi_q.max()


def test_a_grid_of_programs_with_many_points_is_no_burden() -> None:
    """SyR-e writes 256 x 256 points."""
    fine = np.linspace(0.0, I_MAX, 256)
    assert torque_error(fit(points_at(*plane(-fine[::-1], fine)), I_MAX).model) < 2e-5


def test_the_surface_is_reciprocal_and_symmetric_whatever_the_points_are() -> None:
    """Noise of 2 mV·s: no energy belongs to it. Both mixed derivatives are one sum of splines."""
    noise = np.random.default_rng(1).normal(0.0, 2e-3, (2, len(FULL[0])))
    psi_d, psi_q = psi(*FULL)
    model = fit(Points(*FULL, psi_d + noise[0], psi_q + noise[1]), I_MAX).model
    assert model.psi_d(D, Q, nq=1) == pytest.approx(model.psi_q(D, Q, nd=1), rel=1e-12, abs=1e-18)
    assert model.psi_d(D, Q) == pytest.approx(model.psi_d(D, -Q), rel=1e-12)
    assert model.psi_q(D, Q) == pytest.approx(-model.psi_q(D, -Q), rel=1e-9, abs=1e-15)


def test_slopes_are_those_of_the_values() -> None:
    """Central differences of 0.5 A against the derivatives of the splines."""
    model, h = fit(points_at(*HALF), I_MAX).model, 0.25
    d, q = plane(np.linspace(-200.0, -50.0, 7), np.linspace(50.0, 200.0, 7))
    for of in (model.psi_d, model.psi_q):
        assert of(d, q, nd=1) == pytest.approx((of(d + h, q) - of(d - h, q)) / (2 * h), rel=1e-4, abs=1e-8)
        assert of(d, q, nq=1) == pytest.approx((of(d, q + h) - of(d, q - h)) / (2 * h), rel=1e-4, abs=1e-8)


def test_noise_is_smoothed() -> None:
    """1 mV·s rms on 435 points; a surface through all of them would err by as much, and leave nothing of it."""
    noise = np.random.default_rng(2).normal(0.0, 1e-3, (2, len(FULL[0])))
    psi_d, psi_q = psi(*FULL)
    fitted = fit(Points(*FULL, psi_d + noise[0], psi_q + noise[1]), I_MAX)
    true_d, true_q = psi(D, Q)
    errors = np.concatenate([(fitted.model.psi_d(D, Q) - true_d)[INSIDE], (fitted.model.psi_q(D, Q) - true_q)[INSIDE]])
    assert float(np.sqrt(np.mean(errors**2))) < 0.8e-3
    assert fitted.unknowns < 0.7 * fitted.count
    assert 0.4e-3 < float(np.std(fitted.psi_d_left)) < 1.2e-3


@pytest.mark.parametrize("places", [HALF, FULL], ids=["half", "full"])
def test_an_offset_of_psi_q_is_found_and_taken_away(places: tuple[Array, Array]) -> None:
    psi_d, psi_q = psi(*places)
    fitted = fit(Points(*places, psi_d, psi_q + 0.004), I_MAX)
    assert fitted.offset_Vs == pytest.approx(0.004, abs=2e-5)
    assert torque_error(fitted.model) < 5e-4


def test_the_torque_of_a_map_without_energy_is_kept() -> None:
    """psi_d falls by another 1e-7 V·s/A² i_q² without a counterpart in psi_q: a curl above the 5 % of the warning."""
    psi_d, psi_q = psi(*FULL)
    twisted = Points(*FULL, psi_d - 1e-7 * FULL[1] ** 2, psi_q)
    assert doubts.curl(fit_separately(twisted, I_MAX), I_MAX) > 0.05
    model = fit(twisted, I_MAX).model
    assert doubts.curl(model, I_MAX) < 1e-12
    wanted = 1.5 * POLE_PAIRS * (twisted.psi_d * FULL[1] - twisted.psi_q * FULL[0])
    found = 1.5 * POLE_PAIRS * (model.psi_d(*FULL) * FULL[1] - model.psi_q(*FULL) * FULL[0])
    inside = np.hypot(*FULL) <= I_MAX
    assert np.abs(found - wanted)[inside].max() < 2e-3 * np.abs(wanted[inside]).max()


@pytest.mark.parametrize("places", [HALF, FULL, polar()], ids=["half", "full", "polar"])
def test_the_reciprocity_of_the_points_is_measured(places: tuple[Array, Array]) -> None:
    assert doubts.curl(fit_separately(points_at(*places), I_MAX), I_MAX) < 0.005


def test_beyond_the_points_the_map_goes_on_and_is_marked(tmp_path) -> None:
    """Points to 200 A, a circle of 250 A: by hand 1 - (200/250)² = 36 % of it, less the 1 % that counts as its edge."""
    points = points_at(*polar(200.0))
    model = fit(points, I_MAX).model
    grid = make_grid(model, points, I_MAX, 31, tmp_path / "map.csv")
    assert grid.circle_outside == pytest.approx(0.35, abs=0.03)
    assert reach_of(points) == pytest.approx(200.0)
    d, q = np.meshgrid(grid.id_A, grid.iq_A, indexing="ij")
    assert grid.extrapolated[np.hypot(d, q) > 205.0].all()
    assert not grid.extrapolated[np.hypot(d, q) < 195.0].any()
    assert model.psi_d(D, Q, nd=1)[INSIDE].min() > 0.0 and model.psi_q(D, Q, nq=1)[INSIDE].min() > 0.0
    assert torque_error(model) < 0.01


def test_the_invented_machine_saturates() -> None:
    """So that the tests above say something: the inductance of the q axis falls to less than a third."""
    slope = psi(np.zeros(2), np.array([1.0, KNEE * 2.2]))[1] - psi(np.zeros(2), np.array([0.0, KNEE * 2.2 - 1.0]))[1]
    assert slope[1] < slope[0] / 3.0
