# SPDX-License-Identifier: Apache-2.0
"""The plant behind a virtual ECU: what a test stand can do to it, and its true torque."""

import contextlib
import math
import threading
from dataclasses import dataclass
from typing import Final

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.vecu.channel import Channel

RPM: Final = 2.0 * math.pi / 60.0
TRUTH: Final = "truth.torque_mean_Nm"
STEP_S: Final = 0.02


@dataclass(frozen=True)
class Knob:
    """One plant parameter in the page's unit; no stand changes its speed in an instant."""

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
    """The bench channel with a few knobs. Any thread."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self._lock = threading.Lock()
        self._target = {name: knob.start for name, knob in KNOBS.items()}
        self._now = dict(self._target)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._follow, name="stand", daemon=True)
        self._thread.start()

    def turn(self, name: str, value: float) -> None:
        """One knob; beyond its range is its end."""
        knob = KNOBS[name]
        self._target[name] = min(max(value, knob.lo), knob.hi)

    def _follow(self) -> None:
        while not self._stop.wait(STEP_S):
            values = {}
            for name, knob in KNOBS.items():
                most = knob.per_s * STEP_S
                step = min(max(self._target[name] - self._now[name], -most), most)
                if step:
                    self._now[name] += step
                    values[knob.parameter] = self._now[name] * knob.factor
            if values:
                with self._lock, contextlib.suppress(FluxtrueError, OSError):
                    self._channel.set(**values)

    def truth_Nm(self) -> float:
        """The machine's air-gap torque now."""
        with self._lock:
            return self._channel.get(TRUTH)[0]

    def close(self) -> None:
        """Leave it as it is."""
        self._stop.set()
        self._thread.join(1.0)
        self._channel.close()
