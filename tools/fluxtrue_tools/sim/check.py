# SPDX-License-Identifier: Apache-2.0
"""Checks of a scenario before its first period: keys without effect, ranges of all values, number of rows."""

import difflib
import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from fluxtrue_tools import strict
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim import effects, profiles
from fluxtrue_tools.sim import library as lib
from fluxtrue_tools.sim.motor import Motor
from fluxtrue_tools.sim.scenario import Scenario

VALUES_MAX: Final = 100_000_000  # of a recording in memory, 800 MB
SMALL, HUGE = 1e-9, 1e30
ROUNDING: Final = 1e-5  # more than the error of six digits
HALVINGS: Final = 60  # bisections between an accepted and a refused value, down to the last digit of a float

# Keys of a scenario for parameters that have another name in the plant.
GIVEN_AS: Final = {
    "plant.speed_rad_s": "profile.speed_rpm", "plant.vdc_V": "profile.vdc_V", "plant.winding_C": "profile.winding_C",
    "plant.magnet_scale": "profile.magnet_scale", "plant.load_Nm": "profile.load_Nm",
    "plant.inertia_kgm2": "mechanics.inertia_kgm2", "plant.viscous_Nms": "mechanics.viscous_Nms",
    "plant.seed": "seed", "torque_requested_Nm": "profile.torque_Nm",
}  # fmt: skip


def effective(scenario: Scenario, motor: Motor, where: str) -> None:
    """Refuse keys that have no effect with this motor."""
    found = effects.for_motor(scenario, motor.flux_map is not None)
    if found is not None:
        raise FluxtrueError(f"{where}: {found}")


def _edge(accepts: Callable[[float], bool], good: float, sign: float) -> float:
    """The last accepted value in a direction; infinite without a limit."""
    step = SMALL * max(abs(good), 1.0)
    while accepts(good + sign * step):
        if step > HUGE:
            return sign * math.inf
        step *= 10.0
    inside, outside = good + sign * step / 10.0 if step > SMALL * max(abs(good), 1.0) else good, good + sign * step
    for _ in range(HALVINGS):
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if accepts(middle) else (inside, middle)
    return 0.0 if abs(inside) < SMALL * abs(good) else inside


@dataclass(frozen=True)
class Range:
    """Smallest and largest value that a name takes, whether they are taken themselves, and whether zero is, too."""

    low: float
    high: float
    takes_low: bool = True
    takes_high: bool = True
    or_zero: bool = False

    def text(self, unit: str) -> str:
        """The range in words."""
        low = f"{'from' if self.takes_low else 'above'} {self.low:g}" if math.isfinite(self.low) else ""
        high = f"{'up to' if self.takes_high else 'below'} {self.high:g}" if math.isfinite(self.high) else ""
        if low.startswith("from") and high.startswith("up"):
            zero = "0, or " if self.or_zero else ""
            return f"{zero}{self.low:g} to {self.high:g} {unit}".rstrip()
        words = " and ".join(part for part in (low, high) if part)
        return f"{words} {unit}".rstrip() if words else "a finite number"


def limits(loop: lib.Loop, name: str, factor: float = 1.0) -> Range:
    """Range that a name accepts now, found by trial; in the unit of a key that is `factor` times smaller."""

    def accepts(value: float) -> bool:
        try:
            loop.set(name, factor * value)
        except lib.LoopError:
            return False
        return True

    # Around zero a value may be refused because its format has no step so small: the search starts elsewhere.
    present = loop.get(name) / factor
    good = next((value for value in (present, 1.0) if value != 0.0 and accepts(value)), 0.0)
    low, high = (float(f"{_edge(accepts, good, sign):.6g}") for sign in (-1.0, 1.0))
    or_zero = low > 0.0 and accepts(0.0)
    if or_zero and not accepts(low):
        low = float(f"{low * (1.0 + ROUNDING):.6g}")  # six digits had rounded the smallest step down
    found = Range(low, high, accepts(low), accepts(high), or_zero)
    accepts(present)
    return found


def _key(scenario: Scenario, name: str) -> str:
    """The scenario's key for a name of the simulation."""
    given = GIVEN_AS.get(name, name if name.startswith("plant.") else f"controller.{name}")
    return scenario.profile.key(given.removeprefix("profile.")) if given.startswith("profile.") else given


def tidy(value: float) -> float | int:
    """A number as a user writes it: 3 instead of 3.0."""
    return int(value) if value.is_integer() and abs(value) < 1e6 else value


def complaint(error: lib.LoopError, key: str, motor: Motor, loop: lib.Loop | None = None) -> str:
    """The library's refusal in terms of a file: key, value, unit, what is allowed."""
    shown = strict.quantity(key, tidy(error.value)) if error.value is not None else key
    if error.code == lib.UNKNOWN_NAME:
        names = motor.names()
        if error.name in names:
            return f"{shown}: the twin has no such name; allowed with controller.kind = 'firmware'"
        near = difflib.get_close_matches(error.name, names, n=3) or names
        return f"{shown}: no such name, allowed: {', '.join(near)}"
    if error.code != lib.OUT_OF_RANGE or error.value is None:
        return f"{shown}: {lib.REASONS.get(error.code, f'error {error.code}')}"
    unit = strict.unit_of(error.name)
    if loop is not None:
        return f"{shown}, allowed: {limits(loop, error.name).text(unit)}"
    with lib.Loop(motor.library, motor.plant, motor.flux_map) as healthy:
        return f"{shown}, allowed: {limits(healthy, error.name).text(unit)}"


def refused(error: lib.LoopError, scenario: Scenario, motor: Motor, where: str) -> FluxtrueError:
    """The complaint about an initial value that the library refuses."""
    return FluxtrueError(f"{where}: {complaint(error, _key(scenario, error.name), motor)}")


def rows(scenario: Scenario, period_s: float, columns: int, where: str) -> int:
    """PWM periods per row; the window must have a row to average, and all of them must fit the memory."""
    wanted, (first, last) = scenario.record_every_s, scenario.averaged()
    if wanted < period_s * (1.0 - ROUNDING):
        raise FluxtrueError(f"{where}: record_every_s = {wanted:g} s, allowed: from {period_s:g} s (a PWM period)")
    every = max(1, round(min(wanted, 2.0 * scenario.duration_s) / period_s))
    row_s = every * period_s
    whole = round(scenario.duration_s / period_s) // every
    count = min(whole, math.ceil((last + 0.5 * wanted) / row_s) - 1)
    if count < 1 or count * row_s <= first + 0.5 * wanted:
        raise FluxtrueError(
            f"{where}: record_every_s = {wanted:g} s: no row in the window {first:g} to {last:g} s (PWM period "
            f"{period_s:g} s), allowed: one row at least"
        )
    if whole * columns > VALUES_MAX:
        least = scenario.duration_s * columns / VALUES_MAX
        raise FluxtrueError(f"{where}: record_every_s = {wanted:g} s: {whole} rows in duration_s = "
                            f"{scenario.duration_s:g} s, allowed: from {least:.3g} s")  # fmt: skip
    return every


def speed(scenario: Scenario, motor: Motor, period_s: float, where: str) -> None:
    """Beyond half an electrical turn per period a sampled angle does not determine the speed."""
    limit = 60.0 / (2.0 * period_s * motor.plant["pole_pairs"])
    key = scenario.profile.key("speed_rpm")
    for _, rpm in scenario.profile.speed_rpm:
        if abs(rpm) > limit:
            raise FluxtrueError(
                f"{where}: {key} = {rpm:g} rpm, allowed: up to {limit:g} rpm (half an electrical turn per period)"
            )


def ranges(scenario: Scenario, motor: Motor, loop: lib.Loop, where: str) -> None:
    """Check every value of profiles and events in the order of the run, without simulating a period."""
    moving = profiles.moving(scenario)
    events = sorted(enumerate(scenario.event), key=lambda item: item[1].t)
    times = profiles.breakpoints(scenario)
    for start, stop in pairwise(times):
        while events and events[0][1].t <= start:
            index, event = events.pop(0)
            for name, value in event.set.items():
                _try(loop, motor, name, value, f"{where}: event.{index}.set.{name}")
        for name, (profile, points, factor) in moving.items():
            for now, after in ((start, True), (stop, False)):
                value = profiles.value_at(points, now, after)
                _point(loop, motor, name, value, factor, f"{where}: {scenario.profile.key(profile)}", now)


def _try(loop: lib.Loop, motor: Motor, name: str, value: float, key: str) -> None:
    try:
        loop.set(name, value)
    except lib.LoopError as error:
        raise FluxtrueError(complaint(error, key, motor, loop)) from None


def _point(loop: lib.Loop, motor: Motor, name: str, value: float, factor: float, key: str, now: float) -> None:
    try:
        loop.set(name, factor * value)
    except lib.LoopError:
        key_unit = strict.unit_of(key)
        unit = key_unit or strict.unit_of(name)
        raise FluxtrueError(f"{key} reaches {value:g} {unit} at t = {now:g} s, allowed: "
                            f"{limits(loop, name, factor).text(unit)}") from None  # fmt: skip
