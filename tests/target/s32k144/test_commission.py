# SPDX-License-Identifier: Apache-2.0
"""The image that would be flashed turns the shaft of a hidden machine by commands of the bus, on the emulated
processor."""

import math

import pytest

from fluxtrue_tools.bench.build import have_arm_compiler
from fluxtrue_tools.commission import bus_turning, emulated, turning
from fluxtrue_tools.commission.steps import Found, chosen, run
from fluxtrue_tools.commission.turning import Connection
from fluxtrue_tools.emulate.build import Parts

NAME, SEED = "saturated", 101
ROUGH_DEG = 10.0  # of the offset by the slow turn: the spin needs no better one
OFFSET_DEG, PSI_F = 0.2, 0.005  # the bounds of tests/commission/test_turning.py


@pytest.fixture(scope="module")
def flashed() -> Parts:
    if not have_arm_compiler():
        pytest.skip("no cross compiler: there is no image to emulate")
    return emulated.parts()


def test_the_image_finds_pole_pairs_direction_and_offset(flashed: Parts) -> None:
    with emulated.connected(flashed, NAME, SEED) as (drive, truth, known):
        found = run(drive, chosen(("phases",)), known, lambda _: None).followed
        assert drive.get("fault_word") == 0.0 and drive.get("run_state") == 0.0
    assert found is not None
    assert (found.connection.pole_pairs, found.connection.reversed) == (truth.plant["pole_pairs"], truth.reversed)
    error = math.remainder(found.connection.offset_rad - truth.offset_rad, turning.TURN)
    assert abs(math.degrees(error)) <= ROUGH_DEG


def test_the_image_spins_and_finds_the_magnet(flashed: Parts) -> None:
    """One direction, with the true connection: a lag of the angle would be an error of the offset."""
    with emulated.connected(flashed, NAME, SEED) as (drive, truth, known):
        found = Found()
        run(drive, chosen(("offsets",)), known, lambda _: None, earlier=((), found))
        wired = Connection(int(truth.plant["pole_pairs"]), truth.reversed, truth.offset_rad)
        wanted = turning.SPEED_SHARE * known.speed_max_rpm * math.pi / 30.0
        magnet = bus_turning.direction(drive, found.known(known), wanted, wired)
        turning.release(drive)
        assert drive.get("fault_word") == 0.0 and drive.get("run_state") == 0.0
    assert abs(abs(magnet.psi_Vs) / (truth.psi_f_Vs * truth.plant["vdc_gain"]) - 1.0) <= PSI_F
    assert abs(math.degrees(magnet.error_rad)) <= OFFSET_DEG
