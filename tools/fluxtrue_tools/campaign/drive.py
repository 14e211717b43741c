# SPDX-License-Identifier: Apache-2.0
"""The warm-up drive: synthesised from the published phase statistics of WLTC class 3b, docs/howto/campaign.md.

Source   UN GTR No. 15, statistics of the class 3b cycle; no second of its speed trace is copied
Units    SI, motor quantities: mechanical rad/s, N·m at the rotor
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools.campaign.envelope import Envelope
from fluxtrue_tools.campaign.spec import Drive, Vehicle

Array = NDArray[np.float64]
STEP_S: Final = 0.1
STANDSTILL_S: Final = 2.0  # standstill before every trip, in the vehicle's time


@dataclass(frozen=True)
class Phase:
    """Statistics of a phase in GTR 15; speeds in km/h, accelerations in m/s²."""

    duration_s: float
    top_kmh: float
    moving_kmh: float  # mean without stops
    accelerate: float
    brake: float


PHASES: Final = (
    Phase(589.0, 56.5, 25.3, 1.611, 1.5),
    Phase(433.0, 76.6, 44.5, 1.611, 1.5),
    Phase(455.0, 97.4, 60.7, 1.666, 1.5),
    Phase(323.0, 131.3, 94.0, 1.055, 1.44),
)


@dataclass(frozen=True)
class Profile:
    """Points every STEP_S; straight lines between them."""

    speed_rad_s: Array
    torque_Nm: Array


def _ramp(start: float, stop: float, rate: float) -> Array:
    """Speeds from the first to the last, one per STEP_S, without the first."""
    count = max(1, math.ceil(abs(stop - start) / (rate * STEP_S)))
    return np.linspace(start, stop, count + 1)[1:]


def _cruise(speed: float, rate: float, seconds: float, rng: np.random.Generator) -> Array:
    """Traffic: the speed oscillates with a period of 4 to 8 s and a sixth of the phase's acceleration."""
    period = rng.uniform(4.0, 8.0)
    t = np.arange(STEP_S, seconds, STEP_S)
    amplitude = min(rate / 6.0 * period / (2.0 * math.pi), 0.2 * speed)
    return speed + amplitude * np.sin(2.0 * math.pi * t / period)


def _trip(phase: Phase, rng: np.random.Generator) -> Array:
    """Standstill, acceleration, cruise near the mean speed, acceleration to the top speed, braking to standstill."""
    mean, top = phase.moving_kmh / 3.6 * rng.uniform(0.85, 1.15), phase.top_kmh / 3.6
    up, down = (rate * rng.uniform(0.6, 1.0) for rate in (phase.accelerate, phase.brake))
    parts = [
        np.zeros(round(STANDSTILL_S / STEP_S)),
        _ramp(0.0, mean, up),
        _cruise(mean, up, 0.03 * phase.duration_s, rng),
        _ramp(mean, top, up),
        _cruise(top, up, 0.015 * phase.duration_s, rng),
        _ramp(top, 0.0, down),
    ]
    return np.concatenate(parts)


def _torque(speed: Array, vehicle: Vehicle) -> Array:
    """Road load and acceleration at the motor's shaft; zero at standstill."""
    acceleration = np.gradient(speed, STEP_S)
    rolling = vehicle.rolling_N * np.tanh(speed / 0.3)
    force = rolling + vehicle.drag_N_per_m2_s2 * speed**2 + vehicle.mass_kg * acceleration
    return np.asarray(force * vehicle.wheel_radius_m / vehicle.gear_ratio)


def make_profile(drive: Drive, envelope: Envelope, rng: np.random.Generator) -> Profile:
    """A trip per phase, low to extra high, then the time axis compressed to the requested duration."""
    speed = np.concatenate([_trip(phase, rng) for phase in PHASES] + [np.zeros(2)])
    torque = _torque(speed, drive.vehicle)
    motor = np.minimum(speed / drive.vehicle.wheel_radius_m * drive.vehicle.gear_ratio,
                       envelope.speed_rpm[-1] * 2.0 * math.pi / 60.0)  # fmt: skip
    steps = round(drive.duration_s / STEP_S)
    at = np.linspace(0.0, speed.size - 1.0, steps + 1)
    pressed = [np.interp(at, np.arange(speed.size), values) for values in (motor, torque)]
    top = np.array([envelope.at(rpm) for rpm in pressed[0] * 60.0 / (2.0 * math.pi)])
    return Profile(pressed[0], np.clip(pressed[1], -top, top))
