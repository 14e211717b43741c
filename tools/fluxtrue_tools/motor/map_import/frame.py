# SPDX-License-Identifier: Apache-2.0
"""From units, counting and axes of the file to those of flux_map.csv.

flux_map.csv has peak values of the amplitude-invariant transformation, currents into the machine, and a d axis along
the magnet. The power-invariant transformation has sqrt(3/2) times its currents and fluxes. A synchronous reluctance
machine's axes (d = large inductance) are those turned by a right angle, to the side to which the magnet points.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.motor.map_import.coenergy import Points
from fluxtrue_tools.motor.map_import.source import Raw, place_of

TO_PEAK = {"peak": 1.0, "rms": math.sqrt(2.0), "power": math.sqrt(2.0 / 3.0)}
TO_VS = {"Vs": 1.0, "mVs": 1e-3}
POINTS_MIN, POINTS_MAX = 16, 200_000  # different currents
NEAR = 0.4  # of the largest current: where the flux is nearly a plane
MAGNET_MIN = 0.005  # of the largest flux: below it there is none
TORQUE_SLACK = 0.05  # measured torque lacks friction and iron loss


@dataclass(frozen=True)
class Convention:
    """How the file counts."""

    current: str = "peak"
    flux: str = "peak"
    flux_unit: str = "Vs"
    counting: str = "motor"
    axes: str = "pm"
    angle_from: str = "d"
    angle_unit: str = "deg"

    @property
    def amperes(self) -> float:
        """A peak per unit of the file, motor convention."""
        return TO_PEAK[self.current] * (-1.0 if self.counting == "generator" else 1.0)

    @property
    def volt_seconds(self) -> float:
        """V·s peak per unit of the file."""
        return TO_PEAK[self.flux] * TO_VS[self.flux_unit]


@dataclass(frozen=True)
class Framed:
    """The points in the frame of flux_map.csv, and what was done to get there."""

    points: Points
    turn: complex  # of the axes
    notes: list[str]


def currents(quantities: dict[str, Array], convention: Convention, pair: tuple[str, str]) -> Array:
    """i_d + j i_q as the file has its axes, in A peak, motor convention."""
    first, second = (quantities[name] for name in pair)
    if pair == ("i_d", "i_q"):
        return np.asarray(convention.amperes * (first + 1j * second))
    angle = second if convention.angle_unit == "rad" else np.deg2rad(second)
    if convention.angle_from == "q":
        angle = angle + 0.5 * math.pi
    vector = first * np.exp(1j * angle)
    # cos 90° is 6e-17 in a computer: on the axis it is meant to be zero
    tiny = 1e-12 * np.abs(first)
    real = np.where(np.abs(vector.real) <= tiny, 0.0, vector.real)
    return np.asarray(convention.amperes * (real + 1j * np.where(np.abs(vector.imag) <= tiny, 0.0, vector.imag)))


def _plane(i: Array, psi: Array) -> tuple[complex, float, float]:
    """Flux without current and the slopes of psi_d over i_d, psi_q over i_q, from the points of small currents."""
    size = np.abs(i)
    near = size <= max(NEAR * float(size.max()), float(np.sort(size)[min(11, len(size) - 1)]))
    x = i[near]
    columns = np.column_stack((np.ones(len(x)), x.real, x.imag, x.real**2, x.imag**2))
    d, q = (np.linalg.lstsq(columns, part, rcond=None)[0] for part in (psi[near].real, psi[near].imag))
    return complex(d[0], q[0]), float(d[1]), float(q[2])


def _turn(raw: Raw, convention: Convention, i: Array, psi: Array) -> complex:
    """The rotation of the axes, by the side to which the magnet points."""
    magnet, _, _ = _plane(i, psi)
    along, across = (magnet.imag, magnet.real) if convention.axes == "synrm" else (magnet.real, magnet.imag)
    largest = float(np.abs(psi).max())
    if abs(along) < max(MAGNET_MIN * largest, abs(across)):
        side = "q" if convention.axes == "synrm" else "d"
        other = "pm" if convention.axes == "synrm" else "synrm"
        hint = f"; with --axes {other} it has {abs(across):.3g} V·s" if abs(across) > MAGNET_MIN * largest else ""
        raise FluxtrueError(
            f"{raw.path}: psi_{side} = {along:.3g} V·s without current, allowed: at least {100 * MAGNET_MIN:g} % of "
            f"the largest flux, and a magnet along the {side} axis (--axes {convention.axes}){hint}"
        )
    sign = 1.0 if along > 0.0 else -1.0
    return complex(0.0, -sign) if convention.axes == "synrm" else complex(sign, 0.0)


TURNED = {
    1: "none",
    -1: "half a turn: the magnet pointed along -d",
    -1j: "our d = their q, our q = -(their d)",
    1j: "our d = -(their q), our q = their d",
}


def _check_slopes(raw: Raw, convention: Convention, i: Array, psi: Array) -> None:
    _, l_d, l_q = _plane(i, psi)
    if l_d > 0.0 and l_q > 0.0:
        return
    if l_d < 0.0 and l_q < 0.0:
        other = "motor" if convention.counting == "generator" else "generator"
        raise FluxtrueError(
            f"{raw.path}: both fluxes fall with their currents, as in the {other} convention; allowed with "
            f"--convention {convention.counting}: rising fluxes"
        )
    name = "psi_d does not rise with i_d" if l_d <= 0.0 else "psi_q does not rise with i_q"
    raise FluxtrueError(
        f"{raw.path}: {name} ({1e6 * min(l_d, l_q):.3g} µH at small currents), allowed: both inductances above 0; "
        "check the sign of the column and --axes"
    )


def _merged(points: Points) -> Points:
    """The mean of points that share their currents: rotor positions, repeated measurements."""
    places, index, counts = np.unique(np.column_stack((points.i_d, points.i_q)), axis=0, return_inverse=True,
                                      return_counts=True)  # fmt: skip
    if len(places) == len(points):
        return points
    index = index.ravel()

    def mean(values: Array) -> Array:
        return np.asarray(np.bincount(index, values) / counts)

    torque = None if points.torque is None else mean(points.torque)
    return Points(places[:, 0], places[:, 1], mean(points.psi_d), mean(points.psi_q), torque)


def _ratios(pole_pairs: int) -> Iterator[tuple[float, str]]:
    """Torque of the column over that of the fluxes, for the usual mistakes."""
    yield 2.0, "--current rms --flux rms"
    yield math.sqrt(2.0), "--current rms or --flux rms"
    yield 0.5, "--current peak --flux peak"
    yield math.sqrt(0.5), "--current peak or --flux peak"
    yield 2.0 / 3.0, "--current power --flux power"
    yield 1e-3, "--flux-unit mVs"
    yield 1e3, "--flux-unit Vs"
    yield 2e-3, "--current rms --flux rms --flux-unit mVs"
    yield 1e-3 * math.sqrt(2.0), "--flux-unit mVs, and --current rms or --flux rms"
    for count in range(1, 25):
        if count != pole_pairs:
            yield count / pole_pairs, f"machine.pole_pairs = {count}"


def check_torque(raw: Raw, points: Points, pole_pairs: int) -> tuple[Points, list[str]]:
    """The torque with the sign of the fluxes; refuses one that belongs to other units."""
    if points.torque is None:
        return points, []
    own = 1.5 * pole_pairs * (points.psi_d * points.i_q - points.psi_q * points.i_d)
    power = float(own @ own)
    ratio = float(points.torque @ own) / power if power > 0.0 else 0.0
    sign = -1.0 if ratio < 0.0 else 1.0
    if abs(abs(ratio) - 1.0) > TORQUE_SLACK:
        hints = [text for value, text in _ratios(pole_pairs) if abs(abs(ratio) / value - 1.0) < 0.02]
        hint = f"; it would fit with {' or '.join(hints[:3])}" if hints else ""
        raise FluxtrueError(
            f"{raw.path}: torque is {abs(ratio):.4g} times 1.5 p (psi_d i_q - psi_q i_d) with machine.pole_pairs = "
            f"{pole_pairs}, allowed: {1 - TORQUE_SLACK:g} to {1 + TORQUE_SLACK:g} times{hint}"
        )
    turned = Points(points.i_d, points.i_q, points.psi_d, points.psi_q, sign * points.torque)
    return turned, ["the file counts its torque as braking: sign changed"] if sign < 0.0 else []


def to_frame(raw: Raw, convention: Convention) -> Framed:
    """Points of flux_map.csv's frame from those of the file."""
    pair = place_of(set(raw.quantities), {}, raw.path, "--column")
    i = currents(raw.quantities, convention, pair)
    psi = convention.volt_seconds * (raw.quantities["psi_d"] + 1j * raw.quantities["psi_q"])
    if len(np.unique(i)) < POINTS_MIN:
        raise FluxtrueError(f"{raw.path}: {len(np.unique(i))} different currents, allowed: from {POINTS_MIN}")
    turn = _turn(raw, convention, i, psi)
    i, psi = turn * i, turn * psi
    _check_slopes(raw, convention, i, psi)
    points = _merged(Points(i.real + 0.0, i.imag + 0.0, psi.real, psi.imag, raw.quantities.get("torque")))
    if len(points) > POINTS_MAX:
        raise FluxtrueError(f"{raw.path}: {len(points)} different currents, allowed: up to {POINTS_MAX}")
    notes = [f"units              current {convention.current}, flux {convention.flux} in {convention.flux_unit}, "
             f"{convention.counting} convention",
             f"axes               {convention.axes}, turned: {TURNED[turn]}"]  # fmt: skip
    return Framed(points, turn, notes)
