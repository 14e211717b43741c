# SPDX-License-Identifier: Apache-2.0
"""Where torque is measured: stratified random points, visited without large steps of speed."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fluxtrue_tools.campaign.envelope import Envelope
from fluxtrue_tools.campaign.spec import Windows

QUADRANTS = ((1, 1), (1, -1), (-1, 1), (-1, -1))  # (direction, sign of torque)


@dataclass(frozen=True)
class Window:
    """One measurement: approach, settle, average over whole turns."""

    speed_rpm: float
    torque_Nm: float
    measure_s: float


def _measure_s(windows: Windows, speed_rpm: float) -> float:
    """Time of whole mechanical turns, so that errors that depend on the angle average out."""
    turn_s = 60.0 / abs(speed_rpm)
    return math.ceil(windows.measure_s / turn_s - 1e-9) * turn_s


def _speeds(windows: Windows, rng: np.random.Generator) -> list[tuple[float, int, int]]:
    """One speed for every stratum and quadrant, uniform in its logarithm."""
    points = []
    for low, high, count in windows.speed_rpm:
        edges = np.geomspace(low, high, count + 1)
        for first, last in pairwise(edges):
            for direction, sign in QUADRANTS:
                points.append((float(np.exp(rng.uniform(np.log(first), np.log(last)))), direction, sign))
    for speed in windows.low_speed_rpm:
        points += [(speed, direction, sign) for direction, sign in QUADRANTS]
    return points


def _tour(points: list[Window]) -> list[Window]:
    """Order of the windows: forwards up and down, then backwards up and down; every other speed on the way down."""
    tour: list[Window] = []
    for direction in (1.0, -1.0):
        side = sorted((w for w in points if direction * w.speed_rpm > 0.0), key=lambda w: abs(w.speed_rpm))
        tour += side[::2] + side[1::2][::-1]
    return tour


def plan(windows: Windows, envelope: Envelope, rng: np.random.Generator) -> list[Window]:
    """The windows of a case. A point whose smallest torque cannot be reached is left out, for every controller."""
    points = _speeds(windows, rng)
    shares = (rng.permutation(len(points)) + rng.random(len(points))) / len(points)
    planned = []
    for (speed, direction, sign), share in zip(points, shares, strict=True):
        top = envelope.at(speed)
        if top < windows.torque_min_Nm:
            continue
        torque = windows.torque_min_Nm + share * (top - windows.torque_min_Nm)
        planned.append(Window(direction * speed, sign * torque, _measure_s(windows, speed)))
    return _tour(planned)
