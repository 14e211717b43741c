# SPDX-License-Identifier: Apache-2.0
"""The plant behind a virtual ECU: the parameters that a test stand can change, and its true torque."""

import contextlib
import math
import threading
from dataclasses import dataclass
from typing import Final

from fluxtrue_tools.vecu.channel import BenchRefused, Channel

RPM: Final = 2.0 * math.pi / 60.0
TRUTH: Final = "truth.torque_mean_Nm"


@dataclass(frozen=True)
class Knob:
    """One plant parameter in the page's unit, with the rate at which it may change."""

    parameter: str
    factor: float
    lo: float
    hi: float
    start: float
    per_s: float


KNOBS: Final = {
    "speed_rpm": Knob("speed_rad_s", RPM, -10000.0, 10000.0, 0.0, 2500.0),
    "magnet_percent": Knob("magnet_scale", 0.01, 80.0, 105.0, 100.0, 20.0),
    "winding_C": Knob("winding_C", 1.0, 20.0, 180.0, 20.0, 100.0),
}  # fmt: skip


class Stand:
    """The bench channel with a few knobs. Any thread; the thread that advances the time calls step()."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self._lock = threading.Lock()
        self._target = {name: knob.start for name, knob in KNOBS.items()}
        self._now = dict(self._target)

    def turn(self, name: str, value: float) -> None:
        """Change one knob; a value beyond its range is limited to it."""
        knob = KNOBS[name]
        self._target[name] = min(max(value, knob.lo), knob.hi)

    def targets(self) -> dict[str, float]:
        """Where each knob stands."""
        return dict(self._target)

    def step(self, seconds: float) -> None:
        """Move the plant's parameters towards their knobs."""
        values = {}
        for name, knob in KNOBS.items():
            step_max = knob.per_s * seconds
            change = min(max(self._target[name] - self._now[name], -step_max), step_max)
            if change:
                self._now[name] += change
                values[knob.parameter] = self._now[name] * knob.factor
        if values:
            with self._lock, contextlib.suppress(BenchRefused):
                self._channel.set(**values)

    def truth_Nm(self) -> float:
        """The machine's air-gap torque now."""
        with self._lock:
            return self._channel.get(TRUTH)[0]

    def close(self) -> None:
        """Close the connection; the plant keeps its parameters."""
        self._channel.close()
