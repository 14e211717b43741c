# SPDX-License-Identifier: Apache-2.0
"""A derived number that does not fit the firmware, reported by the user's keys with the values that would be accepted.

Which keys a number depends on, and how, is found by trying: each key alone is moved away from its value until the
number fits, the first accepted value on the way is found in smaller steps, its edge by halving, and what is offered has
been accepted once by all that motor build does.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from pydantic import ValidationError

from fluxtrue_tools import strict
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.config import MotorConfig

# Order of keys that help equally: first those with a single effect, then the inverter's, last the machine's.
KEYS = (
    "machine.iron_loss_hysteresis", "machine.iron_loss_eddy", "inverter.v_dc_full_scale_V", "inverter.dead_time_s",
    "inverter.min_pulse_s", "inverter.device_drop_V", "control.observer_m", "control.flux_bandwidth_rad_s",
    "control.resistance_bandwidth_rad_s", "control.torque_loop_bandwidth_rad_s", "control.torque_slew_Nm_per_s",
    "identification.magnet_uncertainty", "identification.resistance_uncertainty", "identification.flux_uncertainty",
    "identification.voltage_uncertainty", "identification.device_drop_uncertainty_V", "magnet.i_d_demag_A",
    "magnet.i_d_demag_A_per_K", "magnet.psi_temp_coeff_per_K", "machine.speed_max_rpm",
    "inverter.current_full_scale_A", "inverter.pwm_hz", "machine.torque_max_Nm", "machine.i_max_A", "inverter.vdc_V",
    "machine.r_ohm",
)  # fmt: skip
FACTORS = (1.0005, 1.002, 1.01, 1.03, 1.1, 1.3, 1.6, 2.0, 3.0, 5.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 1e4)
GAP = 1.05  # ratio of the factors tried below the first accepted one: what is accepted may have gaps
GAPS_MOST = 60
HALVINGS = 24
SHOWN = 3
Test = Callable[[MotorConfig], object]  # raises FluxtrueError where the configuration does not fit


@dataclass(frozen=True)
class Change:
    """One key and the nearest value that is accepted."""

    key: str
    now: float
    value: float

    @property
    def size(self) -> float:
        """Distance of the change, as a ratio."""
        return abs(math.log(self.value / self.now))

    def text(self) -> str:
        """The change as part of a sentence."""
        unit = strict.unit_of(self.key)
        return f"{self.key} {'up to' if self.value < self.now else 'from'} {self.value:g} {unit}".rstrip()


def changed(config: MotorConfig, key: str, value: float) -> MotorConfig | None:
    """The configuration with another value; None where the key's own range forbids it."""
    section, name = key.split(".")
    data = config.model_dump(exclude_unset=True)
    data.setdefault(section, {})[name] = value
    try:
        return MotorConfig.model_validate(data)
    except ValidationError:
        return None


def _passes(test: Test, config: MotorConfig, key: str, value: float) -> bool:
    other = changed(config, key, value)
    if other is None:
        return False
    try:
        test(other)
    except FluxtrueError:
        return False
    return True


def _rounded(now: float, value: float) -> float:
    """Three digits, rounded away from the present value, because a value that is offered must be accepted."""
    step = 10.0 ** (math.floor(math.log10(abs(value))) - 2)
    whole = value / step
    return (math.floor(whole + 1e-9) if value < now else math.ceil(whole - 1e-9)) * step


def _bracket(accepts: Callable[[float], bool], whole: float) -> tuple[float, float]:
    """Logarithms of a refused factor and of the next accepted one, the first below an accepted one."""
    count = min(math.ceil(whole / math.log(GAP)), GAPS_MOST)
    first = next(k for k in range(1, count + 1) if k == count or accepts(whole * k / count))
    return whole * (first - 1) / count, whole * first / count


def _nearest(test: Test, config: MotorConfig, key: str, now: float, up: bool) -> float | None:
    """The accepted value nearest to the present one, in one direction."""
    sign = 1.0 if up else -1.0

    def accepts(exponent: float) -> bool:
        return _passes(test, config, key, now * math.exp(sign * exponent))

    found = next((math.log(factor) for factor in FACTORS if accepts(math.log(factor))), None)
    if found is None:
        return None
    outside, inside = _bracket(accepts, found)
    for _ in range(HALVINGS):
        middle = 0.5 * (outside + inside)
        outside, inside = (outside, middle) if accepts(middle) else (middle, inside)
    return _rounded(now, now * math.exp(sign * inside))


def _changes(config: MotorConfig, test: Test) -> Iterator[Change]:
    for key in KEYS:
        section, name = key.split(".")
        now = getattr(getattr(config, section), name)
        if now is None or now <= 0.0:
            continue
        for up in (False, True):
            value = _nearest(test, config, key, now, up)
            if value is not None:
                yield Change(key, now, value)


def advice(config: MotorConfig, quick: Test, whole: Test) -> str:
    """What to change, nearest first, and after `allowed:`; empty where no single key helps."""
    found = sorted(_changes(config, quick), key=lambda change: round(change.size, 1))
    offered = []
    for change in found:
        if _passes(whole, config, change.key, change.value):
            offered.append(change)
        if len(offered) == SHOWN:
            break
    if not offered:
        return ""
    first = offered[0]
    now = f"{first.key} = {first.now:g} {strict.unit_of(first.key)}".rstrip()
    more = "".join(f", or {change.text()}" for change in offered[1:])
    return f"{now}, allowed: {first.text().removeprefix(first.key + ' ')}{more}"
