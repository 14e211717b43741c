# SPDX-License-Identifier: Apache-2.0
"""What is asked of the inverter, and what becomes of it when the hand on the slider is gone.

Pure decisions on a clock that the caller brings: called every 10 ms, it says what the next command frame holds.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

HAND_TIMEOUT_S: Final = 0.3  # a page that is closed, asleep or cut off
RAMP_Nm_per_s: Final = 150.0
RUNNING: Final = ("run", "derate")


class Wish(StrEnum):
    """What the user has pressed last."""

    OFF = "off"  # dc link discharged
    READY = "ready"  # dc link charged, no torque
    DRIVE = "drive"


@dataclass(frozen=True)
class Order:
    """One command frame, in the DBC's units."""

    mode: str = "off"
    enable: bool = False
    fault_reset: bool = False
    torque_Nm: float = 0.0


@dataclass
class Commander:
    """Slider and buttons in, command frames out."""

    torque_max_Nm: float
    wish: Wish = Wish.OFF
    target_Nm: float = 0.0
    torque_Nm: float = 0.0
    _seen_s: float = float("-inf")
    _stepped_s: float | None = None
    _reset: bool = False

    def hand(self, now_s: float) -> None:
        """A sign of life from the page that has control."""
        self._seen_s = now_s

    def ask(self, wish: Wish, now_s: float) -> None:
        """A button. Drive begins with no torque."""
        self.hand(now_s)
        if wish is not self.wish:
            self.target_Nm = 0.0
        self.wish = wish

    def slide(self, torque_Nm: float, now_s: float) -> None:
        """The slider; a value beyond the machine is its limit."""
        self.hand(now_s)
        self.target_Nm = min(max(torque_Nm, -self.torque_max_Nm), self.torque_max_Nm)

    def reset_faults(self, now_s: float) -> None:
        """One edge of the reset bit, with enable off."""
        self.ask(Wish.READY, now_s)
        self._reset = True

    def let_go(self) -> None:
        """The page with control has gone: no need to wait whether it says something again."""
        self._seen_s = float("-inf")
        if self.wish is Wish.DRIVE:
            self.wish, self.target_Nm = Wish.READY, 0.0  # it must be pressed again

    def alive(self, now_s: float) -> bool:
        """Whether the page with control has been heard of lately."""
        return now_s - self._seen_s <= HAND_TIMEOUT_S

    def step(self, now_s: float, state: str) -> Order:
        """The next command frame, given the inverter's state."""
        if not self.alive(now_s):
            self.let_go()
        step_s = 0.0 if self._stepped_s is None else max(now_s - self._stepped_s, 0.0)
        self._stepped_s = now_s
        wanted = self.target_Nm if self.wish is Wish.DRIVE and state in RUNNING else 0.0
        most = RAMP_Nm_per_s * step_s
        self.torque_Nm += min(max(wanted - self.torque_Nm, -most), most)
        if state not in RUNNING:
            self.torque_Nm = 0.0
        # The gates open only after the torque is gone.
        enable = (self.wish is Wish.DRIVE and state in ("ready", *RUNNING)) or self.torque_Nm != 0.0
        mode = "off" if self.wish is Wish.OFF and not enable else "torque"
        reset, self._reset = self._reset and not enable, self._reset and enable
        return Order(mode, enable, reset, self.torque_Nm)
