# SPDX-License-Identifier: Apache-2.0
"""The back-EMF from which diodes can keep currents flowing, and the level of the safe state that follows."""

import math

import numpy as np
import pytest
from conftest import MOTORS

from fluxtrue_tools.motor.flux_model import ConstantModel
from fluxtrue_tools.motor.motor import load_motor
from fluxtrue_tools.motor.rectifier import PULSE_SHARE, largest_flux_share, sustained_share

SIX_STEP = 1.10266  # 2 sqrt(3)/pi


@pytest.mark.parametrize(("saliency", "kappa"), [(3.0, 1.0607), (4.0, 1.1547), (10.0, 1.6667)])
def test_constant_inductances_give_the_closed_form(saliency: float, kappa: float) -> None:
    """xi/(2 sqrt(xi - 1)), whatever the size of inductance and flux."""
    for l_d, psi_f in ((1e-4, 0.05), (5e-3, 0.3)):
        model = ConstantModel(l_d, saliency * l_d, psi_f)
        assert largest_flux_share(model) == pytest.approx(kappa, abs=1e-4)
        assert sustained_share(model) == pytest.approx(SIX_STEP / kappa, abs=1e-4)


@pytest.mark.parametrize("saliency", [0.8, 1.0, 1.9, 2.0])
def test_without_much_saliency_no_current_adds_to_the_magnets_flux(saliency: float) -> None:
    assert largest_flux_share(ConstantModel(2e-4, saliency * 2e-4, 0.1)) == pytest.approx(1.0, abs=1e-9)


def test_the_flux_at_that_current_is_the_largest_of_all_whose_voltage_opposes_the_current() -> None:
    """By brute force over the plane of the saturated map: within 1 degree of perpendicular."""
    model = load_motor(MOTORS / "hsm1").model
    i_d, i_q = np.meshgrid(np.linspace(-160.0, -1.0, 400), np.linspace(0.5, 120.0, 400))
    psi_d, psi_q = model.psi_d(i_d, i_q), model.psi_q(i_d, i_q)
    flux = np.hypot(psi_d, psi_q)
    cosine = (psi_d * i_d + psi_q * i_q) / (flux * np.hypot(i_d, i_q))
    largest = flux[np.abs(cosine) < math.sin(math.radians(1.0))].max() / float(model.psi_d(0.0, 0.0))
    assert largest_flux_share(model) == pytest.approx(largest, rel=0.02)


@pytest.mark.parametrize(("name", "short", "opened"), [("hsm1", 0.9, 0.8), ("paper", 1.06, 0.96)])
def test_the_level_of_the_short_circuit_follows_from_it(name: str, short: float, opened: float) -> None:
    derived = load_motor(MOTORS / name).derived
    assert (derived.share_short, derived.share_open) == (
        pytest.approx(short, abs=1e-4),
        pytest.approx(opened, abs=1e-4),
    )


def test_the_pulses_of_the_diodes_join_where_the_level_is_limited() -> None:
    """A pulse begins where the line back-EMF reaches v_dc and ends when the current is zero again: an integral of the
    difference, by brute force."""
    theta = np.linspace(-math.pi / 2.0, math.pi / 2.0, 200_001)
    for share, joined in ((PULSE_SHARE - 0.001, False), (PULSE_SHARE + 0.001, True)):
        begin = math.acos(1.0 / share)
        on = theta[theta >= -begin]
        current = np.cumsum(share * np.cos(on) - 1.0)
        end = on[np.flatnonzero(current[1:] < 0.0)[0] + 1]
        assert (end + begin > math.pi / 3.0) == joined


def test_the_level_is_never_above_that_of_pulses() -> None:
    motor = load_motor(MOTORS.parent.parent / "tests" / "motors" / "prius")
    assert sustained_share(motor.model) > 1.1
    assert motor.derived.share_short == 1.06


def test_the_most_saliency_has_the_lowest_level() -> None:
    """tests/fault/test_braking.py has what its diodes do above it."""
    motor = load_motor(MOTORS.parent.parent / "tests" / "motors" / "pmsyrm")
    assert motor.derived.share_short == pytest.approx(sustained_share(motor.model), abs=0.005)
    assert motor.derived.share_short < 0.78
