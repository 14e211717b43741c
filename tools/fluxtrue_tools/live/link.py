# SPDX-License-Identifier: Apache-2.0
"""The bus side of the page: listens, sends the protected command every 10 ms, moves the test stand."""

import contextlib
import logging
import threading
from dataclasses import dataclass
from typing import Any, Final

import can

from fluxtrue_tools.bus.interface import COMMAND, CONFIGURATION, REQUEST, Interface
from fluxtrue_tools.bus.protect import Protector
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.live.commander import Commander, Order, Wish
from fluxtrue_tools.live.last import LastValues
from fluxtrue_tools.live.pace import PERIOD_S, Pace
from fluxtrue_tools.live.stand import Stand

CLOSING_S: Final = 3.0  # the largest torque is ramped out in less
SILENT_S: Final = 0.1  # the inverter reports its state every 10 ms
LIMITS: Final = ("TorqueLimitDrive", "TorqueLimitRegen")  # as large as they can be: the slider limits the torque
NEEDED: Final = ("INV_Status", "INV_DcLink", CONFIGURATION)  # messages on which commands depend


@dataclass(frozen=True)
class Status:
    """What the pages show of the commands and of the inverter's answer."""

    state: str = ""  # empty while nothing is received
    wish: str = Wish.OFF.value
    target_Nm: float = 0.0
    stopped: str = ""  # why the drive does not run although it was requested
    knobs: tuple[tuple[str, float], ...] = ()  # of the test stand


# It warns of every frame that arrives in two reads, although it then joins the parts.
logging.getLogger("can.interfaces.socketcand").setLevel(logging.ERROR)


class Observer:
    """What happens on the bus side, for what shows or records it."""

    def sent(self, frame: can.Message) -> None:
        """A command was sent."""

    def truth(self, time_s: float, torque_Nm: float) -> None:
        """The torque of the simulated machine, once in a period."""

    def period(self, status: Status) -> None:
        """A period begins."""

    def ended(self, status: Status) -> None:
        """Nothing is commanded any more, and simulated time does not pass."""


class Link:
    """One bus connection and the thread that commands, at the pace of the time base."""

    def __init__(self, bus: can.BusABC, pace: Pace, interface: Interface, commander: Commander, values: LastValues,
                 stand: Stand | None = None, observer: Observer | None = None) -> None:  # fmt: skip
        self._bus, self._pace, self._commander, self._values = bus, pace, commander, values
        self._interface, self._message = interface, interface.message(COMMAND)
        self._protector = Protector(interface.data_id(COMMAND))
        self._open = {name: interface.largest(COMMAND, name) for name in LIMITS}
        self._stand, self._observer = stand, observer or Observer()
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._newest_s, self._heard_s = 0.0, pace.now_s
        self._state = ""
        self.send_errors = 0
        self.lost = ""  # why nothing is commanded any more
        self._thread = threading.Thread(target=self._command, name="command", daemon=True)
        self._thread.start()

    def act(self, action: str, *values: Any) -> None:
        """An action of a user: a method of the commander and its arguments but for the time."""
        with self._lock:
            getattr(self._commander, action)(*values, self._pace.now_s)

    def turn(self, knob: str, value: float) -> None:
        """Change one parameter of the test stand."""
        if self._stand is not None:
            self._stand.turn(knob, value)

    def status(self) -> Status:
        """What the pages show."""
        with self._lock:
            commander = self._commander
            return Status("" if self.lost else self._state, commander.wish.value, commander.target_Nm,
                          self.lost or commander.stopped,
                          tuple(self._stand.targets().items()) if self._stand else ())  # fmt: skip

    def standing_still(self) -> contextlib.AbstractContextManager[None]:
        """Time does not pass while another connection is made."""
        return self._pace.standing_still()

    def wait(self, seconds: float) -> None:
        """Wait until nothing is commanded any more, at most so long."""
        self._thread.join(seconds)

    def close(self) -> None:
        """Ramp the torque to zero, then close the connection."""
        self.act("ask", Wish.OFF)
        end_s = self._pace.now_s + CLOSING_S
        while self._commander.torque_requested_Nm != 0.0 and self._pace.now_s < end_s and self._thread.is_alive():
            self._stop.wait(PERIOD_S)
        self._stop.set()
        self._thread.join()
        self._pace.close()
        self._bus.shutdown()

    def _frame(self, order: Order) -> can.Message:
        data = self._message.encode({
            "Crc": 0, "Counter": 0, "Enable": int(order.enable), "FaultReset": int(order.fault_reset),
            "Mode": order.mode, REQUEST: order.torque_requested_Nm, **self._open,
        })  # fmt: skip
        return can.Message(arbitration_id=self._message.frame_id, is_extended_id=False, is_rx=False,
                           data=self._protector.protect(data), timestamp=self._values.newest_s)  # fmt: skip

    def _check(self) -> None:
        """Nothing is commanded in a scale that the inverter does not have."""
        problem = self._interface.mismatch(self._values.message(CONFIGURATION))
        if problem:
            raise FluxtrueError(problem)

    def _present_state(self) -> str:
        """The inverter's state; empty when nothing has been received for a while."""
        now_s = self._pace.now_s
        if self._values.newest_s != self._newest_s:
            self._newest_s, self._heard_s = self._values.newest_s, now_s
        return self._values.state() if now_s - self._heard_s <= SILENT_S else ""

    def _send(self) -> None:
        refused = self._values.choice("INV_DcLink", "RefusedReason")
        with self._lock:
            self._state = self._present_state()
            frame = self._frame(self._commander.step(self._pace.now_s, self._state, refused))
        try:
            self._pace.send(frame)
            self._observer.sent(frame)
        except (can.CanError, OSError):
            self.send_errors += 1

    def _move_stand(self) -> None:
        if self._stand is not None:
            self._stand.step(PERIOD_S)
            self._observer.truth(self._values.newest_s, self._stand.truth_Nm())

    def _command(self) -> None:
        try:
            while not self._stop.is_set():
                self._check()
                self._observer.period(self.status())
                self._send()
                self._move_stand()
                self._pace.next_period(self._stop)
        except (FluxtrueError, OSError) as error:
            self.lost = str(error)  # the virtual ECU has ended, or it has another scale
            self._observer.ended(self.status())
