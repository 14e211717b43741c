# SPDX-License-Identifier: Apache-2.0
"""The plant behind a virtual ECU: what a test stand can do to it, and its true torque."""

import math
import threading
from typing import Final

from fluxtrue_tools.vecu.channel import Channel

RPM: Final = 2.0 * math.pi / 60.0
TRUTH: Final = "truth.torque_mean_Nm"
# Name: (plant parameter, factor, lowest, highest), in the unit of the page.
KNOBS: Final = {
    "speed_rpm": ("speed_rad_s", RPM, -10000.0, 10000.0),
    "magnet_percent": ("magnet_scale", 0.01, 80.0, 105.0),
    "winding_C": ("winding_C", 1.0, 20.0, 180.0),
}  # fmt: skip


class Stand:
    """The bench channel with a few knobs. Any thread."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self._lock = threading.Lock()

    def turn(self, knob: str, value: float) -> None:
        """One knob; beyond its range is its end."""
        parameter, factor, lo, hi = KNOBS[knob]
        with self._lock:
            self._channel.set(**{parameter: min(max(value, lo), hi) * factor})

    def truth_Nm(self) -> float:
        """The machine's air-gap torque now."""
        with self._lock:
            return self._channel.get(TRUTH)[0]

    def close(self) -> None:
        """Leave it as it is."""
        self._channel.close()
