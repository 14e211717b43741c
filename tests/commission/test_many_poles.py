# SPDX-License-Identifier: Apache-2.0
"""Rotors with many pole pairs: the same torque over the inertia moves them by more electrical degrees, (CM-28)."""

import math

import numpy as np
import pytest
from watched import Watched

from fluxtrue_tools.commission import hidden
from fluxtrue_tools.commission.connection import Followed
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.spin import Spun
from fluxtrue_tools.commission.steps import Found, chosen, run
from fluxtrue_tools.commission.turning import Connection
from fluxtrue_tools.sim.library import Loop
from fluxtrue_tools.sim.motor import Motor

START_DEG_S = 40.0  # electrical: a third of a degree in a burst of the map
SECONDS = 10.0  # of resistance and map together
MOST_DEG = {("hsm1", 110): 1.3, ("pmasynrm", 112): 1.0, ("hsm1", 120): 1.0}
EARLIER = ("phases", "spin", "drag")


def measured(name: str, seed: int, unknown: Motor, known: Nameplate) -> tuple[Watched, Found, int]:
    """The map of a machine whose connection is given, its pole pairs."""
    truth, flux_map, plant = hidden.draw(name, seed, unknown, known.i_max_A, connected=False)
    pairs = round(plant["pole_pairs"])
    connection = Connection(pairs, truth.reversed, truth.offset_rad)
    spun = Spun(connection, truth.psi_f_Vs, 0.0, 0.0, 0.0, 1.0)
    drive = Watched(Loop(unknown.library, plant, flux_map))
    earlier = EARLIER, Found(followed=Followed(1.0, pairs, 0.0, connection), spun=spun)
    return drive, run(drive, chosen(("map",)), known, lambda _: None, earlier=earlier), pairs


@pytest.mark.parametrize(("name", "seed"), list(MOST_DEG))
def test_a_rotor_with_many_pole_pairs_stands_before_the_pulses(
    name: str, seed: int, unknown: Motor, known: Nameplate
) -> None:
    """A small reference of the current control made no current for a tenth of a second, as long as the legs lost all of
    its voltage, and then too much of it: hsm1 110 began with up to 200 electrical degrees in a second and moved by 4.8
    degrees, and resistance and map took 14 s."""
    drive, found, pairs = measured(name, seed, unknown, known)
    starts_deg_s = pairs * np.degrees(np.abs(drive.starts_rad_s[-len(found.bursts) :]))
    moved_deg = pairs * np.degrees(drive.moves_rad[-len(found.bursts) :])
    print(name, seed, pairs, np.round(starts_deg_s), np.round(moved_deg, 2), f"{drive.seconds:.1f} s")
    assert starts_deg_s.max() <= START_DEG_S
    assert drive.seconds <= SECONDS
    assert math.degrees(found.moved_rad) <= MOST_DEG[name, seed]
    assert found.largest_A <= known.i_max_A
