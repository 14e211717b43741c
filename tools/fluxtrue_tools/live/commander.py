# SPDX-License-Identifier: Apache-2.0
"""The commands to the inverter, and their end when the page with control is gone.

Pure decisions on a clock that the caller brings: called every 10 ms, it says what the next command frame holds.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

HAND_TIMEOUT_S: Final = 0.3  # longer than this is a page that is closed, suspended or disconnected
START_S: Final = 0.5  # the inverter answers an enable within milliseconds
GAP_S: Final = 0.03  # between two commands: the inverter's time-out, docs/howto/can.md
RAMP_S: Final = 0.88  # from zero to the machine's torque
STOP_S: Final = 0.08  # from the machine's torque to zero once the request to drive has ended
RUNNING: Final = ("run", "derate")
FAULTED: Final = ("fault", "safe_state")
AGAIN: Final = "Press Enable to go on."


class Wish(StrEnum):
    """The button that the user pressed last."""

    OFF = "off"  # dc link discharged
    READY = "ready"  # dc link charged, no torque
    DRIVE = "drive"


@dataclass(frozen=True)
class Order:
    """One command frame, in the DBC's units."""

    mode: str = "off"
    enable: bool = False
    fault_reset: bool = False
    torque_requested_Nm: float = 0.0


@dataclass
class Commander:
    """Slider and buttons in, command frames out.

    The request to drive ends when the user ends it, when the page with control reports nothing any more, and when the
    inverter does not drive or no longer does. In the last two cases `stopped` says why, and one more press on Enable
    continues: the inverter must receive enable off before it accepts it again, and it has been off since. Torque that
    is left when the request ends is ramped out in STOP_S or less.
    """

    torque_max_Nm: float
    wish: Wish = Wish.OFF
    target_Nm: float = 0.0
    torque_requested_Nm: float = 0.0
    stopped: str = ""  # why the request to drive was withdrawn; empty since the last press on a button
    _seen_s: float = float("-inf")
    _stepped_s: float | None = None
    _reset: bool = False
    _running: bool = False  # the inverter has followed the request to drive
    _enabled_s: float = 0.0  # how long enable has been sent without that
    _gap_s: float = 0.0  # longest time between two commands since the last press on a button

    def hand(self, now_s: float) -> None:
        """Record a report from the page that has control."""
        self._seen_s = now_s

    def ask(self, wished: str, now_s: float) -> None:
        """A button was pressed. After Enable the requested torque is zero."""
        self.hand(now_s)
        wish = Wish(wished)
        if wish is not self.wish:
            self.target_Nm = 0.0
            self._running, self._enabled_s, self._gap_s = False, 0.0, 0.0
        self.wish, self.stopped = wish, ""

    def slide(self, torque_requested_Nm: float, now_s: float) -> None:
        """The slider was moved; a value beyond the machine's torque is limited to it. Without the request to
        drive it is ignored: the message may have been on its way when the request ended."""
        self.hand(now_s)
        if self.wish is not Wish.DRIVE:
            return
        self.target_Nm = min(max(torque_requested_Nm, -self.torque_max_Nm), self.torque_max_Nm)

    def reset_faults(self, now_s: float) -> None:
        """Send one edge of the reset bit, with enable off."""
        self.ask(Wish.READY, now_s)
        self._reset = True

    def stop(self, why: str, _now_s: float) -> None:
        """Torque to zero, switching disabled; the dc link stays as it is. Any page may ask for it."""
        self._take_back(why)
        self._reset = False

    def let_go(self, _now_s: float) -> None:
        """The page with control has closed; the command ends without waiting for its time-out."""
        self._seen_s = float("-inf")
        self._take_back(f"The page with control was closed or silent for {HAND_TIMEOUT_S:g} s.")

    def alive(self, now_s: float) -> bool:
        """Whether the page with control has been heard of lately."""
        return now_s - self._seen_s <= HAND_TIMEOUT_S

    def step(self, now_s: float, state: str, refused: str = "") -> Order:
        """The next command frame, given the inverter's state and why it last refused to drive."""
        step_s = 0.0 if self._stepped_s is None else max(now_s - self._stepped_s, 0.0)
        self._stepped_s = now_s
        self._gap_s = max(self._gap_s, step_s)
        if not self.alive(now_s):
            self.let_go(now_s)
        self._follow(state, refused, step_s)
        wanted = self.target_Nm if self.wish is Wish.DRIVE and state in RUNNING else 0.0
        step_max = self.torque_max_Nm * step_s / (RAMP_S if self.wish is Wish.DRIVE else STOP_S)
        self.torque_requested_Nm += min(max(wanted - self.torque_requested_Nm, -step_max), step_max)
        if state not in RUNNING:
            self.torque_requested_Nm = 0.0
        # Switching ends only after the torque is gone.
        enable = (self.wish is Wish.DRIVE and state in ("ready", *RUNNING)) or self.torque_requested_Nm != 0.0
        mode = "off" if self.wish is Wish.OFF and not enable else "torque"
        reset, self._reset = self._reset and not enable, self._reset and enable
        return Order(mode, enable, reset, self.torque_requested_Nm)

    def _follow(self, state: str, refused: str, step_s: float) -> None:
        """Withdraw the request to drive when the inverter does not follow it."""
        if self.wish is not Wish.DRIVE:
            return
        if state in RUNNING:
            self._running = True
            return
        self._enabled_s += step_s if state == "ready" else 0.0
        shown = state.replace("_", " ") or "not known"
        why = f": {refused.replace('_', ' ')}" if refused not in ("", "none") else ""
        if not state:
            self._take_back("Nothing is received from the inverter any more.")
        elif state in FAULTED:
            self._take_back(f"The inverter reports {shown}. Reset its faults first.")
        elif self._running and self._gap_s > GAP_S:
            self._take_back(f"The inverter stopped{why}. No command for {1e3 * self._gap_s:.0f} ms; "
                            f"it waits {1e3 * GAP_S:.0f} ms.")  # fmt: skip
        elif self._running:
            self._take_back(f"The inverter stopped{why}. Its state is {shown}.")
        elif self._enabled_s > START_S:
            self._take_back(f"The inverter did not start{why}. Its state is {shown}.")

    def _take_back(self, why: str) -> None:
        if self.wish is Wish.DRIVE:
            self.wish, self.target_Nm, self.stopped = Wish.READY, 0.0, f"{why} {AGAIN}"
