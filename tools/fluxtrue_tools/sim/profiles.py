# SPDX-License-Identifier: Apache-2.0
"""A scenario's profiles as the simulation takes them: names, values at a time, times at which something changes."""

import bisect
import math
from typing import Final

from fluxtrue_tools.sim.scenario import Points, Scenario

RPM: Final = 2.0 * math.pi / 60.0

# Profile, name in the simulation, factor.
NAMED: Final = (
    ("torque_Nm", "torque_requested_Nm", 1.0),
    ("speed_rpm", "plant.speed_rad_s", RPM),
    ("vdc_V", "plant.vdc_V", 1.0),
    ("winding_C", "plant.winding_C", 1.0),
    ("magnet_scale", "plant.magnet_scale", 1.0),
    ("load_Nm", "plant.load_Nm", 1.0),
)


def moving(scenario: Scenario) -> dict[str, tuple[str, Points, float]]:
    """Name in the simulation: (profile, points, factor) of every profile that moves."""
    given = ((name, profile, getattr(scenario.profile, profile), factor) for profile, name, factor in NAMED)
    return {name: (profile, points, factor) for name, profile, points, factor in given if points and len(points) > 1}


def value_at(points: Points, now: float, after: bool) -> float:
    """A profile's value; at a step, the one before or the one after it."""
    times = [t for t, _ in points]
    side = bisect.bisect_right if after else bisect.bisect_left
    index = side(times, now)
    if index == 0:
        return points[0][1]
    if index == len(points):
        return points[-1][1]
    (t0, v0), (t1, v1) = points[index - 1], points[index]
    return v0 + (v1 - v0) * (now - t0) / (t1 - t0)


def breakpoints(scenario: Scenario, chunk_s: float | None = None) -> list[float]:
    """Times of the beginning, the end, events and points of moving profiles, and ends of the chunks of a long run."""
    end = scenario.duration_s
    times = {0.0, end} | {event.t for event in scenario.event}
    for _, points, _ in moving(scenario).values():
        times |= {t for t, _ in points}
    if chunk_s is not None:
        times |= {chunk_s * k for k in range(1, math.ceil(end / chunk_s))}
    return sorted(t for t in times if t <= end)
