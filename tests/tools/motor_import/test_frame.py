# SPDX-License-Identifier: Apache-2.0
"""Units, counting, axes and angles of a file become those of flux_map.csv; mistakes are named with the way out."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from conftest import FULL, HALF, POLE_PAIRS, Array, psi, torque

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.map_import.coenergy import Points
from fluxtrue_tools.motor.map_import.frame import Convention, check_torque, to_frame
from fluxtrue_tools.motor.map_import.source import Raw

FILE = Path("map.csv")
D, Q = HALF
PSI = psi(D, Q)
TURN: dict[str, complex] = {"pm": 1.0, "-pm": -1.0, "synrm, magnet on q": 1j, "synrm, magnet on -q": -1j}


def raw(i: Array, flux: Array, **more: Array) -> Raw:
    return Raw(FILE, {"i_d": i.real, "i_q": i.imag, "psi_d": flux.real, "psi_q": flux.imag, **more})


def sorted_points(points: Points) -> Array:
    table = np.column_stack((points.i_d, points.i_q, points.psi_d, points.psi_q))
    return np.asarray(table[np.lexsort((table[:, 1].round(6), table[:, 0].round(6)))])


OURS = sorted_points(Points(D, Q, *PSI))


@pytest.mark.parametrize("turn", TURN)
@pytest.mark.parametrize("counting", ["motor", "generator"])
@pytest.mark.parametrize(("current", "flux", "unit"), [("peak", "peak", "Vs"), ("rms", "rms", "Vs"),
                                                       ("rms", "peak", "mVs"), ("power", "power", "mVs")])  # fmt: skip
def test_every_way_of_counting_gives_the_same_points(
    turn: str, counting: str, current: str, flux: str, unit: str
) -> None:
    """Their value = ours over the factor of hand: rms = peak/sqrt 2, power-invariant = sqrt(3/2) peak."""
    factors = {"peak": 1.0, "rms": 1.0 / math.sqrt(2.0), "power": math.sqrt(1.5)}
    i = (D + 1j * Q) * TURN[turn] * factors[current] * (-1.0 if counting == "generator" else 1.0)
    linked = (PSI[0] + 1j * PSI[1]) * TURN[turn] * factors[flux] * (1e3 if unit == "mVs" else 1.0)
    axes = "synrm" if turn.startswith("synrm") else "pm"
    framed = to_frame(raw(i, linked), Convention(current, flux, unit, counting, axes))
    assert sorted_points(framed.points) == pytest.approx(OURS, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(("angle_from", "unit"), [("d", "deg"), ("q", "deg"), ("q", "rad")])
def test_polar_points_are_counted_from_their_axis(angle_from: str, unit: str) -> None:
    """A phase advance of 90° from the q axis is i_d = -i_s, by hand."""
    gamma = np.arctan2(Q, D) - (0.5 * math.pi if angle_from == "q" else 0.0)
    given = {"i_s": np.hypot(D, Q), "gamma": gamma if unit == "rad" else np.rad2deg(gamma), "psi_d": PSI[0],
             "psi_q": PSI[1]}  # fmt: skip
    framed = to_frame(Raw(FILE, given), Convention(angle_from=angle_from, angle_unit=unit))
    assert sorted_points(framed.points) == pytest.approx(OURS, rel=1e-9, abs=1e-9)
    assert np.count_nonzero(framed.points.i_q == 0.0) == np.count_nonzero(Q == 0.0)


def test_rotor_positions_are_averaged() -> None:
    """Three rotor positions with a ripple of the flux whose mean is zero."""
    ripple = np.repeat([1e-3, -3e-3, 2e-3], len(D))
    three = [np.tile(values, 3) for values in (D, Q, *PSI)]
    framed = to_frame(raw(three[0] + 1j * three[1], three[2] + ripple + 1j * three[3]), Convention())
    assert sorted_points(framed.points) == pytest.approx(OURS, abs=1e-12)


@pytest.mark.parametrize(
    ("turn", "convention", "words"),
    [
        (-1j, Convention(), r"map.csv: psi_d = .* V·s without current, allowed: at least 0.5 % .*--axes pm.; with "
                            "--axes synrm it has 0.0"),
        (1.0, Convention(axes="synrm"), "psi_q = .* without current, .*with --axes pm it has 0.0"),
        (1.0, Convention(counting="generator"), "both fluxes fall with their currents, as in the motor convention; "
                                                "allowed with --convention generator: rising fluxes"),
    ],
)  # fmt: skip
def test_wrong_axes_and_counting_are_refused_with_the_right_ones(
    turn: complex, convention: Convention, words: str
) -> None:
    with pytest.raises(FluxtrueError) as error:
        to_frame(raw((D + 1j * Q) * turn, (PSI[0] + 1j * PSI[1]) * turn), convention)
    assert re.search(words, str(error.value)), error.value


def test_a_turned_sign_of_one_flux_is_refused() -> None:
    with pytest.raises(
        FluxtrueError, match="map.csv: psi_q does not rise with i_q .* allowed: both inductances above 0"
    ):
        to_frame(raw(D + 1j * Q, PSI[0] - 1j * PSI[1]), Convention())


def test_too_few_currents_are_refused() -> None:
    with pytest.raises(FluxtrueError, match="map.csv: 15 different currents, allowed: from 16"):
        to_frame(raw((D + 1j * Q)[:15], (PSI[0] + 1j * PSI[1])[:15]), Convention())


@pytest.mark.parametrize(
    ("factor", "pole_pairs", "hint"),
    [
        (2.0, POLE_PAIRS, "it would fit with --current rms --flux rms or machine.pole_pairs = 8"),
        (math.sqrt(2.0), POLE_PAIRS, "it would fit with --current rms or --flux rms"),
        (2.0 / 3.0, POLE_PAIRS, "--current power --flux power"),
        (1e-3, POLE_PAIRS, "--flux-unit mVs"),
        (2e-3, POLE_PAIRS, "it would fit with --current rms --flux rms --flux-unit mVs"),
        (1e-3 * math.sqrt(2.0), POLE_PAIRS, "it would fit with --flux-unit mVs, and --current rms or --flux rms"),
        (1.0, 3, "machine.pole_pairs = 4"),
        (0.789, POLE_PAIRS, "allowed: 0.95 to 1.05 times$"),
    ],
)
def test_a_torque_of_other_units_is_refused_with_what_would_fit(factor: float, pole_pairs: int, hint: str) -> None:
    points = Points(D, Q, *PSI, torque=factor * torque(D, Q))
    with pytest.raises(FluxtrueError, match=r"map.csv: torque is [\d.]+ times 1.5 p") as error:
        check_torque(raw(D + 1j * Q, D), points, pole_pairs)
    assert re.search(hint, str(error.value)), error.value


def test_a_braking_torque_is_turned_and_said() -> None:
    d, q = FULL
    points, notes = check_torque(raw(d + 1j * q, d), Points(d, q, *psi(d, q), torque=-torque(d, q)), POLE_PAIRS)
    assert points.torque == pytest.approx(torque(d, q))
    assert notes == ["the file counts its torque as braking: sign changed"]
