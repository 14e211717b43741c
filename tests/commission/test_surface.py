# SPDX-License-Identifier: Apache-2.0
"""The energy through all bursts, where an error of another kind looks like a detail of the machine."""

import numpy as np
import pytest

from fluxtrue_tools.commission.surface import INTERVALS, MARGIN_D, Rising
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.motor.map_import.coenergy import Basis, System

L_D, L_Q = 0.4, 1.0  # flux linkages per unit of i_max
WAVE, WAVES = 0.02, 5.0  # amplitude along i_d, which an error of the voltage has left; its slope is 0.63 at most
PLANE = (-1.0, MARGIN_D, 1.0)


@pytest.fixture
def system() -> tuple[Basis, System]:
    """A machine without saturation, measured along i_d at eleven i_q."""
    basis = Basis(PLANE, INTERVALS)
    d, q = (axis.ravel() for axis in np.meshgrid(np.linspace(-1.0, 0.0, 201), np.linspace(0.0, 1.0, 11)))
    system = System(basis.count)
    system.add(basis.rows(d, q, 1, 0), L_D * d + WAVE * np.sin(2.0 * np.pi * WAVES * d))
    system.add(basis.rows(d, q, 0, 1), L_Q * q)
    return basis, system


def slopes_d(basis: Basis, x: Array) -> Array:
    u_d = np.linspace(-1.0, 0.0, 201)
    return np.asarray(basis.rows(u_d, np.full_like(u_d, 0.5), 2, 0) @ x)


def test_a_map_that_falls_is_left_out_if_there_is_another_one(system: tuple[Basis, System]) -> None:
    """Its own folder would be refused: a flux linkage that falls while its current rises is of no machine."""
    basis, equations = system
    rising = Rising(basis)
    _, free = equations.solve(basis.penalty(), slack=1.0)
    assert not rising(free)
    assert slopes_d(basis, free).min() < 0.0
    _, chosen = equations.solve(basis.penalty(), slack=1.0, accepted=rising)
    assert rising(chosen)
    assert slopes_d(basis, chosen).min() > 0.0


def test_the_best_of_all_is_taken_if_every_one_falls(system: tuple[Basis, System]) -> None:
    basis, equations = system
    _, best = equations.solve(basis.penalty(), slack=1.0)
    _, chosen = equations.solve(basis.penalty(), slack=1.0, accepted=lambda _: False)
    assert chosen == pytest.approx(best)
