# SPDX-License-Identifier: Apache-2.0
"""The iron's current from the angle by which the flux linkage of a coasting machine is behind its magnet."""

import math
from types import SimpleNamespace
from typing import Any

import pytest

from fluxtrue_tools.commission import iron, report
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.spin import Spun
from fluxtrue_tools.commission.steps import Found
from fluxtrue_tools.commission.turning import Connection
from fluxtrue_tools.motor.flux_model import Array, ConstantModel

I_MAX_A, L_Q_H, PSI_VS, OMEGA = 250.0, 6e-4, 0.08, 500.0
SIGMA_RAD = 1e-4


def spun(behind_rad: float, sigma_rad: float = SIGMA_RAD) -> Spun:
    """A machine whose flux linkage is behind by this angle in either direction: as if the sensor were early."""
    return Spun(Connection(4, False, 0.0), PSI_VS, 1e-4, sigma_rad, -behind_rad / OMEGA, OMEGA)


def behind(per_flux: float) -> float:
    """The iron takes i = j psi per_flux/1.5, so that psi_q = -L_q per_flux/1.5 psi_d."""
    return math.atan(L_Q_H * per_flux / 1.5)


@pytest.mark.parametrize("per_flux", [5.0, 20.0, 60.0])
def test_the_loss_follows_from_angle_and_inductance(per_flux: float) -> None:
    found = iron.measure(spun(behind(per_flux)), ConstantModel(2e-4, L_Q_H, PSI_VS), I_MAX_A)
    assert found is not None
    assert found.per_flux == pytest.approx(per_flux, rel=1e-6)
    assert found.hysteresis + found.eddy * OMEGA == pytest.approx(per_flux, rel=1e-6)
    assert found.hysteresis == pytest.approx(found.eddy * OMEGA, rel=1e-9)
    # d per_flux / d angle = 1.5 / (L_q cos^2): to first order in the small angle.
    assert found.sigma == pytest.approx(1.5 * SIGMA_RAD / L_Q_H, rel=1e-2)


class Saturating(ConstantModel):
    """psi_q = 50 mV s tanh(i_q / 80 A)."""

    def psi_q(self, i_d: float, i_q: float, nd: int = 0, nq: int = 0) -> Array:
        assert nd == nq == 0
        return 0.05 * math.tanh(i_q / 80.0)


def test_the_saturation_of_the_q_axis_is_in_the_loss() -> None:
    """40 A of the iron: psi_q = 50 mV s tanh(0.5)."""
    found = iron.measure(spun(math.atan2(0.05 * math.tanh(0.5), PSI_VS)), Saturating(2e-4, L_Q_H, PSI_VS), I_MAX_A)
    assert found is not None
    assert found.per_flux == pytest.approx(1.5 * 40.0 / PSI_VS, rel=1e-6)


@pytest.mark.parametrize("behind_rad", [0.0, 4.9e-4, -0.05])
def test_a_late_sensor_and_an_angle_within_the_errors_are_no_loss(behind_rad: float) -> None:
    assert iron.measure(spun(behind_rad), ConstantModel(2e-4, L_Q_H, PSI_VS), I_MAX_A) is None


def test_less_than_three_deviations_are_no_loss() -> None:
    model = ConstantModel(2e-4, L_Q_H, PSI_VS)
    assert iron.measure(spun(2.9e-3, 1e-3), model, I_MAX_A) is None
    assert iron.measure(spun(3.1e-3, 1e-3), model, I_MAX_A) is not None


def test_a_current_beyond_that_of_any_iron_ends_at_the_limit() -> None:
    found = iron.measure(spun(1.2), ConstantModel(2e-4, L_Q_H, PSI_VS), I_MAX_A)
    assert found is not None
    assert found.per_flux == pytest.approx(1.5 * iron.LIMIT_SHARE * I_MAX_A / PSI_VS)


@pytest.mark.parametrize(("per_flux", "said"), [(20.0, "k_h + k_e w = 20 W"), (0.0, "none seen")])
def test_the_report_says_what_was_seen_of_the_iron(per_flux: float, said: str, known: Nameplate) -> None:
    surface: Any = SimpleNamespace(with_magnet=lambda psi_f_Vs: ConstantModel(2e-4, L_Q_H, PSI_VS))
    (line,) = report._iron(Found(spun=spun(behind(per_flux)), surface=surface), known)
    assert said in line
    assert report._iron(Found(surface=surface), known) == []
