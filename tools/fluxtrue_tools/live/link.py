# SPDX-License-Identifier: Apache-2.0
"""The bus side of the page: listens, sends the protected command every 10 ms, records."""

import logging
import threading
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Final

import can

from fluxtrue_tools.bus.interface import COMMAND, CONFIGURATION, REQUEST, Interface
from fluxtrue_tools.bus.protect import Protector
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.live.commander import Commander, Order, Wish
from fluxtrue_tools.live.pace import PERIOD_S, Pace
from fluxtrue_tools.live.samples import Samples
from fluxtrue_tools.live.stand import Stand
from fluxtrue_tools.outputs import atomic
from fluxtrue_tools.vecu.mdf import BusLog

CLOSING_S: Final = 3.0  # the largest torque is ramped out in less
LIMITS: Final = ("TorqueLimitDrive", "TorqueLimitRegen")  # as large as they can be: the slider limits the torque


class Recorder:
    """Keeps frames from start() to stop(), then writes one MDF4 file."""

    def __init__(self, folder: Path, interface: Interface) -> None:
        self._folder, self._interface = folder, interface
        self._log: BusLog | None = None
        self._lock = threading.Lock()

    @property
    def running(self) -> bool:
        """Whether frames are kept."""
        return self._log is not None

    def __call__(self, frame: can.Message) -> None:
        with self._lock:
            if self._log is not None:
                self._log(frame)

    def start(self) -> None:
        """Start a new recording."""
        with self._lock:
            self._log = BusLog()

    def stop(self) -> Path | None:
        """The file written; None when nothing was recorded."""
        with self._lock:
            log, self._log = self._log, None
        if log is None or len(log) == 0:
            return None
        self._folder.mkdir(parents=True, exist_ok=True)
        path = self._folder / f"live-{datetime.now():%Y%m%d-%H%M%S}.mf4"
        with atomic(path) as scratch:
            log.write(scratch, self._interface)
        return path


# It warns of every frame that arrives in two reads, although it then joins the parts.
logging.getLogger("can.interfaces.socketcand").setLevel(logging.ERROR)


class Link:
    """One bus connection and the thread that commands, at the pace of the time base."""

    def __init__(self, bus: can.BusABC, pace: Pace, interface: Interface, commander: Commander,
                 samples: Samples, recorder: Recorder, stand: Stand | None = None) -> None:  # fmt: skip
        self._bus, self._pace, self._commander, self._samples = bus, pace, commander, samples
        self._interface, self._message = interface, interface.message(COMMAND)
        self._protector = Protector(interface.data_id(COMMAND))
        self._open = {name: interface.largest(COMMAND, name) for name in LIMITS}
        self._recorder, self._stand = recorder, stand
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self.send_errors = 0
        self.lost = ""  # why nothing is commanded any more
        self._thread = threading.Thread(target=self._command, name="command", daemon=True)
        self._thread.start()

    def act(self, action: Callable[[Commander, float], None]) -> None:
        """An action of a user."""
        with self._lock:
            action(self._commander, self._pace.now_s)

    def wait(self, seconds: float) -> None:
        """Wait until nothing is commanded any more, at most so long."""
        self._thread.join(seconds)

    def close(self) -> None:
        """Ramp the torque to zero, then close the connection."""
        self.act(lambda commander, now: commander.ask(Wish.OFF, now))
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
                           data=self._protector.protect(data), timestamp=self._samples.newest_s)  # fmt: skip

    def _check(self) -> None:
        """Nothing is commanded in a scale that the inverter does not have."""
        problem = self._interface.mismatch(self._samples.message(CONFIGURATION))
        if problem:
            raise FluxtrueError(problem)

    def _send(self) -> None:
        state, refused = self._samples.state(), self._samples.choice("INV_DcLink", "RefusedReason")
        with self._lock:
            frame = self._frame(self._commander.step(self._pace.now_s, state, refused))
        try:
            self._pace.send(frame)
            self._recorder(frame)
        except (can.CanError, OSError):
            self.send_errors += 1

    def _command(self) -> None:
        try:
            while not self._stop.is_set():
                self._check()
                self._send()
                if self._stand is not None:
                    self._stand.step(PERIOD_S)
                self._pace.next_period(self._stop)
        except (FluxtrueError, OSError) as error:
            self.lost = str(error)  # the virtual ECU has ended, or it has another scale
