# SPDX-License-Identifier: Apache-2.0
"""The bus during a commissioning: the protected command every 10 ms, XCP between the commands, and the reports of the
inverter.

With a virtual ECU that has a bench channel, time passes only here, so that no command can be late. On a bench a thread
sends the commands while the results are evaluated; it ends switching if the evaluation has not responded for a second.
"""

import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, Protocol

import can

from fluxtrue_tools.bus.interface import COMMAND, COMMISSION, CONFIGURATION, REQUEST, Interface
from fluxtrue_tools.bus.protect import Protector
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.live.last import LastValues
from fluxtrue_tools.scope.xcp import is_answer
from fluxtrue_tools.vecu.stepped import SteppedBus

PERIOD_S: Final = 0.010  # of the command
STEP_S: Final = 0.001  # what is waited for at once
ANSWER_S: Final = 2.0
BATCH_S: Final = 0.1  # received at once
HEARD_S: Final = 1.0  # without a sign of life from the evaluation switching ends
LIMITS: Final = ("TorqueLimitDrive", "TorqueLimitRegen")
NEEDED: Final = ("INV_Status", "INV_DcLink", CONFIGURATION)
RUNNING: Final = ("run", "derate")
TURN_RAD: Final = 2.0 * math.pi
OFFSETS: Final = 65536  # steps of the offset in a turn
CLOSED: Final = "the connection to the inverter is closed"


@dataclass(frozen=True)
class Order:
    """The content of the command frame."""

    mode: str = "off"
    enable: bool = False
    torque_Nm: float = 0.0
    limit_Nm: float = 0.0
    fault_reset: bool = False


@dataclass(frozen=True)
class Movement:
    """The content of the frame that commands a movement of the shaft and agrees to voltage pulses."""

    kind: str = "none"
    agrees_to_pulses: bool = False
    pole_pairs: int = 1
    is_reversed: bool = False
    is_damped: bool = False
    offset_rad: float = 0.0
    d_percent: float = 0.0  # of the largest current
    q_percent: float = 0.0
    direction: str = "stand"


class Clock(Protocol):
    """A bus with its own time."""

    @property
    def now_s(self) -> float: ...
    def send(self, frame: can.Message) -> None: ...
    def receive(self, seconds: float) -> list[can.Message]: ...
    def close(self) -> None: ...


Beat = Callable[[], list[can.Message]]  # what is sent every PERIOD_S


class SimulatedTime:
    """A virtual ECU whose time passes only in receive()."""

    def __init__(self, bus: SteppedBus, beat: Beat) -> None:
        self._bus, self._beat, self._due_s = bus, beat, bus.now_s

    @property
    def now_s(self) -> float:
        """The time of the virtual ECU."""
        return self._bus.now_s

    def send(self, frame: can.Message) -> None:
        """Send the frame; time does not pass."""
        self._bus.send(frame)

    def receive(self, seconds: float) -> list[can.Message]:
        """Let time pass."""
        end_s, frames = self._bus.now_s + seconds, []
        while end_s - self._bus.now_s > 0.5 * STEP_S:
            if self._bus.now_s >= self._due_s - 0.5 * STEP_S:
                for frame in self._beat():
                    self.send(frame)
                self._due_s += PERIOD_S
            step_s = min(end_s, max(self._due_s, self._bus.now_s + STEP_S)) - self._bus.now_s
            frames += self._bus.run(round(1e3 * step_s, 6))[0]
        return frames

    def close(self) -> None:
        """Nothing has to be ended: time passes only in receive()."""


class WallTime:
    """A bench, or a virtual ECU that keeps pace with the wall clock."""

    def __init__(self, bus: can.BusABC, beat: Beat) -> None:
        self._bus, self._beat = bus, beat
        self._sending, self._stop = threading.Lock(), threading.Event()
        self._lost: Exception | None = None
        self._thread = threading.Thread(target=self._command, name="command", daemon=True)
        self._thread.start()

    @property
    def now_s(self) -> float:
        """The time of this computer."""
        return time.monotonic()

    def send(self, frame: can.Message) -> None:
        """Send one frame."""
        if self._lost is not None:
            raise self._lost
        with self._sending:
            self._bus.send(frame)

    def receive(self, seconds: float) -> list[can.Message]:
        """The frames that arrive in this time."""
        end_s, frames = time.monotonic() + seconds, []
        while (left_s := end_s - time.monotonic()) > 0.0:
            frame = self._bus.recv(left_s)
            if frame is not None:
                frames.append(frame)
        return frames

    def _command(self) -> None:
        due_s = time.monotonic()
        while not self._stop.is_set():
            try:
                for frame in self._beat():
                    self.send(frame)
            except (can.CanError, OSError) as error:
                self._lost = error
                return
            due_s = max(due_s + PERIOD_S, time.monotonic())
            self._stop.wait(due_s - time.monotonic())

    def close(self) -> None:
        """Stop the commands and wait until the last one has been sent."""
        self._stop.set()
        self._thread.join()


class Line:
    """Commands, XCP and state of one inverter; scope/xcp.py's Line."""

    def __init__(self, make_clock: Callable[[Beat], Clock], interface: Interface) -> None:
        self._interface, self._message = interface, interface.message(COMMAND)
        self._protector = Protector(interface.data_id(COMMAND))
        self._moving = interface.message(COMMISSION)
        self._moving_protector = Protector(interface.data_id(COMMISSION))
        self._values = LastValues(interface.database, NEEDED)
        self._answers: list[bytes] = []
        self._heard_s = time.monotonic()
        self._evaluator = threading.get_ident()
        self.order = Order()
        self.movement: Movement | None = None  # none: its frame is not sent
        self.is_lost = False
        self.is_barred = False  # the user has stopped: whatever is asked for, switching stays disabled
        self.passed: Callable[[float], None] = lambda _: None
        self.heard: Callable[[can.Message], None] = lambda _: None
        self._clock = make_clock(self._beat)

    @property
    def now_s(self) -> float:
        """The inverter's time, as far as it is known here."""
        return self._clock.now_s

    @property
    def state(self) -> str:
        """The name of the inverter's state."""
        return self._values.state()

    @property
    def refused(self) -> str:
        """Why the inverter last refused to run."""
        return self._values.choice("INV_DcLink", "RefusedReason").replace("_", " ")

    def ask(self, **changed: float | str | bool) -> None:
        """Change the command."""
        self.order = replace(self.order, **changed)  # type: ignore[arg-type]

    def move(self, **changed: float | str | bool) -> None:
        """Change the movement; its frame is sent from now on."""
        self.movement = replace(self.movement or Movement(), **changed)  # type: ignore[arg-type]

    def _beat(self) -> list[can.Message]:
        """The next commands; without a sign of life from the evaluation they no longer enable or move anything."""
        obeys = self._is_evaluating() and not self.is_barred
        frames = [self._command(self.order if obeys else Order())]
        if self.movement is not None and obeys:
            frames.insert(0, self._movement(self.movement))
        return frames

    def _is_evaluating(self) -> bool:
        """In simulated time the evaluation itself sends the commands, however long that takes."""
        is_own = threading.get_ident() == self._evaluator
        return is_own or time.monotonic() - self._heard_s < HEARD_S

    def _movement(self, movement: Movement) -> can.Message:
        data = self._moving.encode({"Crc": 0, "Counter": 0, "Movement": movement.kind,
                                    "Reversed": int(movement.is_reversed), "Damped": int(movement.is_damped),
                                    "CurrentD": movement.d_percent, "CurrentQ": movement.q_percent,
                                    "PolePairs": movement.pole_pairs, "Direction": movement.direction,
                                    "Pulses": int(movement.agrees_to_pulses),
                                    "Offset": round(movement.offset_rad / TURN_RAD * OFFSETS) % OFFSETS
                                    * (360.0 / OFFSETS)})  # fmt: skip
        return can.Message(arbitration_id=self._moving.frame_id, is_extended_id=False,
                           data=self._moving_protector.protect(data))  # fmt: skip

    def _command(self, order: Order) -> can.Message:
        limits = {name: min(order.limit_Nm, self._interface.largest(COMMAND, name)) for name in LIMITS}
        data = self._message.encode({"Crc": 0, "Counter": 0, "Enable": int(order.enable),
                                     "FaultReset": int(order.fault_reset), "Mode": order.mode,
                                     REQUEST: order.torque_Nm, **limits})  # fmt: skip
        return can.Message(arbitration_id=self._message.frame_id, is_extended_id=False,
                           data=self._protector.protect(data))  # fmt: skip

    def _take(self, frame: can.Message) -> None:
        if is_answer(frame):
            self._answers.append(bytes(frame.data))
        elif frame.arbitration_id == self._message.frame_id and not frame.is_extended_id:
            raise FluxtrueError("commission: something else on this bus commands the inverter, too")
        self._values(frame)
        self.heard(frame)

    def pass_time(self, seconds: float) -> None:
        """Let the inverter run, and receive its frames. A long time is no silence of the evaluation."""
        left_s = seconds
        while left_s > BATCH_S:
            self._pass(BATCH_S)
            left_s -= BATCH_S
        self._pass(left_s)

    def _pass(self, seconds: float) -> None:
        self._heard_s = time.monotonic()
        try:
            frames = self._clock.receive(seconds)
        except (can.CanError, OSError, FluxtrueError) as error:
            self._lose(error)
        for frame in frames:
            self._take(frame)
        problem = self._interface.mismatch(self._values.message(CONFIGURATION))
        if problem:
            raise FluxtrueError(problem)
        self.passed(seconds)

    def exchange(self, frame: can.Message) -> bytes:
        """Send one XCP command and return its answer."""
        self._answers.clear()
        try:
            self._clock.send(frame)
        except (can.CanError, OSError) as error:
            self._lose(error)
        waited_s = 0.0
        while not self._answers:
            if waited_s > ANSWER_S:
                raise FluxtrueError(f"XCP: no answer within {ANSWER_S:g} s: is the ECU on this bus?")
            self.pass_time(STEP_S)
            waited_s += STEP_S
        return self._answers[0]

    def _lose(self, error: Exception) -> None:
        self.is_lost = True
        raise FluxtrueError(f"commission: {CLOSED} ({error}); without commands it stops by itself") from error

    def wait_for(self, wanted: tuple[str, ...], seconds: float, what: str) -> None:
        """Let time pass until the inverter is in one of the states."""
        waited_s = 0.0
        while self.state not in wanted:
            if waited_s > seconds:
                why = f": {self.refused}" if self.refused not in ("", "none") else ""
                raise FluxtrueError(f"commission: {what}: the inverter is in state {self.state or 'unknown'}{why}")
            self.pass_time(PERIOD_S)
            waited_s += PERIOD_S

    def close(self) -> None:
        """Stop the commands."""
        self._clock.close()
