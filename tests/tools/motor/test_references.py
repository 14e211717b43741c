# SPDX-License-Identifier: Apache-2.0
"""MTPA, field weakening and MTPV against formulas and an independent search."""

import math

import numpy as np
import pytest
from conftest import MOTORS
from scipy.interpolate import RegularGridInterpolator
from scipy.optimize import fsolve

from fluxtrue_tools.motor.motor import load_motor

L_D, L_Q, PSI, P, I_MAX = 0.2e-3, 0.5e-3, 0.084, 4, 250.0  # the paper machine


@pytest.fixture(scope="module")
def paper():
    return load_motor(MOTORS / "paper")


@pytest.fixture(scope="module")
def hsm1():
    return load_motor(MOTORS / "hsm1")


def mtpa(current):
    """i_d of the MTPA point with this current: psi/(4 dL) - sqrt((psi/4 dL)^2 + i^2/2), dL = L_q - L_d."""
    k = PSI / (4 * (L_Q - L_D))
    return k - math.sqrt(k * k + current * current / 2)


@pytest.mark.parametrize("current", [20.0, 60.0, 120.0, 200.0, 245.0])
def test_mtpa_of_constant_inductances_is_the_textbook_formula(paper, current):
    d = mtpa(current)
    q = math.sqrt(current**2 - d**2)
    torque = 1.5 * P * (PSI * q + (L_D - L_Q) * d * q)
    contour = paper.solver.contours(np.array([torque]))[0]
    # The minimum is flat: a parabola through three points 0.83 A apart finds it within a few mA.
    assert contour.id_A[0] == pytest.approx(d, abs=0.02)
    assert contour.iq_A[0] == pytest.approx(q, abs=0.02)


def test_the_largest_torque_is_where_mtpa_meets_the_current_circle(paper):
    d = mtpa(I_MAX)
    q = math.sqrt(I_MAX**2 - d**2)
    assert paper.solver.torque_top_Nm == pytest.approx(1.5 * P * (PSI + (L_D - L_Q) * d) * q, rel=1e-9)


@pytest.mark.parametrize(("torque", "psi"), [(0.0, 0.06), (30.0, 0.05), (60.0, 0.08), (100.0, 0.1)])
def test_weakening_of_constant_inductances_solves_both_equations(paper, torque, psi):
    def residual(x):
        return [1.5 * P * (PSI + (L_D - L_Q) * x[0]) * x[1] - torque,
                1e3 * (math.hypot(PSI + L_D * x[0], L_Q * x[1]) - psi)]  # fmt: skip

    d, q = fsolve(residual, [-60.0, torque / (1.5 * P * PSI)], xtol=1e-12)
    i_d, i_q = paper.solver.contours(np.array([torque]))[0].at(np.array([psi]))
    assert (i_d[0], i_q[0]) == (pytest.approx(d, abs=0.01), pytest.approx(q, abs=0.01))


@pytest.fixture(scope="module")
def brute(hsm1):
    """Torque, flux and current of hsm1 on a grid of 0.5 A, by linear interpolation instead of the splines."""
    m = hsm1.flux_map
    d, q = np.meshgrid(np.linspace(-250, 0, 501), np.linspace(0, 250, 501), indexing="ij")
    psi_d, psi_q = (RegularGridInterpolator((m.id_A, m.iq_A), z)((d, q)) for z in (m.psi_d_Vs, m.psi_q_Vs))
    return d, q, 4.5 * (psi_d * q - psi_q * d), np.hypot(psi_d, psi_q), np.hypot(d, q)


@pytest.mark.parametrize("torque", [10.0, 40.0, 80.0, 120.0])
def test_hsm1_mtpa_needs_no_more_current_than_an_exhaustive_search_finds(hsm1, brute, torque):
    _, _, t, _, current = brute
    best = current[(t >= torque) & (current <= 250)].min()
    contour = hsm1.solver.contours(np.array([torque]))[0]
    # The grid of 0.5 A makes up to 0.7 A too much, and linear interpolation between nodes 10 A apart up to 0.5 %.
    assert best - 0.7 - 0.005 * best <= math.hypot(contour.id_A[0], contour.iq_A[0]) <= best + 0.005 * best


@pytest.mark.parametrize(("torque", "psi"), [(20.0, 0.05), (60.0, 0.09), (90.0, 0.11), (40.0, 0.05)])
def test_hsm1_weakening_needs_no_more_current_than_an_exhaustive_search_finds(hsm1, brute, torque, psi):
    _, _, t, flux, current = brute
    best = current[(t >= torque) & (flux <= psi) & (current <= 250)].min()
    i_d, i_q = hsm1.solver.contours(np.array([torque]))[0].at(np.array([psi]))
    # The contours of torque and flux cross at a small angle: 0.5 A across them is up to 2.5 A along them.
    assert best - 3.0 - 0.005 * best <= math.hypot(i_d[0], i_q[0]) <= best + 0.005 * best


@pytest.mark.parametrize("psi", [0.035, 0.06, 0.09, 0.12])
def test_hsm1_largest_torque_at_a_flux_is_what_an_exhaustive_search_finds(hsm1, brute, psi):
    _, _, t, flux, current = brute
    best = t[(flux <= psi) & (current <= 250)].max()
    assert float(hsm1.limits.torque_max(np.array([psi]))[0]) == pytest.approx(best, abs=0.8)


@pytest.mark.parametrize("name", ["hsm1", "paper"])
def test_stored_references_keep_torque_current_and_flux(name):
    motor = load_motor(MOTORS / name)
    e, torque_max = motor.reference_errors, motor.config.machine.torque_max_Nm
    assert e.torque_mtpa_max_Nm <= 0.0025 * torque_max
    assert e.torque_weak_max_Nm <= 0.005 * torque_max
    assert e.current_excess <= 0.005
    assert e.flux_excess <= 0.01


def bilinear(table, x, y):
    """Bilinear interpolation in floating point."""
    i, j = min(int(x), table.shape[0] - 2), min(int(y), table.shape[1] - 2)
    a, b = x - i, y - j
    return ((1 - a) * (1 - b) * table[i, j] + (1 - a) * b * table[i, j + 1]
            + a * (1 - b) * table[i + 1, j] + a * b * table[i + 1, j + 1])  # fmt: skip


def test_the_paper_machines_stored_table_gives_the_torque_asked_for_by_its_own_formula(paper):
    refs, b = paper.references, paper.bases
    unit = 2.0**refs.shift / 32768
    rng = np.random.default_rng(7)
    for _ in range(2000):
        psi = rng.uniform(refs.psi_Vs[0], refs.psi_Vs[-1])
        j = (psi - refs.psi_Vs[0]) / (unit * b.flux_Vs)
        limit = np.interp(psi, refs.psi_Vs, refs.stored["torque_max"] / 32768 * b.torque_Nm)
        torque = rng.uniform(0, limit)
        i = torque / (unit * b.torque_Nm)
        d, q = (bilinear(refs.stored[k], i, j) / 32768 * b.current_A for k in ("i_d", "i_q"))
        assert 1.5 * P * (PSI + (L_D - L_Q) * d) * q == pytest.approx(torque, abs=0.01 * 150.0)
        assert math.hypot(d, q) <= 1.005 * I_MAX


@pytest.mark.parametrize("name", ["hsm1", "paper"])
def test_the_torque_limit_rises_with_the_available_flux(name):
    stored = load_motor(MOTORS / name).references.stored["torque_max"]
    assert np.all(np.diff(stored) >= 0)


@pytest.mark.parametrize("name", ["hsm1", "paper"])
def test_above_the_largest_mtpa_flux_the_table_is_mtpa(name):
    motor = load_motor(MOTORS / name)
    for torque, d, q in zip(motor.references.torque_Nm, motor.references.id_A[:, -1],
                            motor.references.iq_A[:, -1], strict=True):  # fmt: skip
        if torque < motor.solver.torque_top_Nm:
            contour = motor.solver.contours(np.array([torque]))[0]
            assert (d, q) == (pytest.approx(contour.id_A[0], abs=1e-6), pytest.approx(contour.iq_A[0], abs=1e-6))


def test_a_machine_without_reluctance_torque_uses_no_d_current_at_low_speed(write):
    motor = load_motor(write(machine={"ld_H": 0.4e-3, "lq_H": 0.4e-3, "torque_max_Nm": 100.0}))
    rows = int(motor.solver.torque_top_Nm / motor.references.torque_Nm[1])
    assert np.all(motor.references.stored["i_d"][:rows, -1] == 0)


def test_a_machine_that_cannot_weaken_enough_is_told(write):
    from fluxtrue_tools.motor.report import report_text

    text = report_text(load_motor(write(machine={"ld_H": 0.15e-3, "lq_H": 0.2e-3, "torque_max_Nm": 100.0})))
    assert "cannot go below" in text


def test_flux_that_no_current_can_reach_does_not_count_as_an_error_of_the_table(write):
    """The smallest |psi| within 250 A is 46.5 mVs: less flux than that cannot be reached by any entry of the table."""
    motor = load_motor(write(machine={"ld_H": 0.15e-3, "lq_H": 0.2e-3, "torque_max_Nm": 100.0}))
    assert motor.references.psi_Vs[0] < 0.0465 < motor.references.psi_Vs[-1]
    assert motor.references.torque_max_Nm[0] == 0.0
    assert motor.reference_errors.flux_excess < 0.02


def test_the_tightest_allowed_full_scale_still_holds_the_reference_tables(write):
    motor = load_motor(write(inverter={"current_full_scale_A": 1.35 * 250.0, "pwm_hz": 16000.0}))
    assert motor.reference_errors.current_excess <= 0.005
    assert motor.references.stored["i_d"].min() >= -32768
