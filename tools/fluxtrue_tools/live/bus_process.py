# SPDX-License-Identifier: Apache-2.0
"""The bus side in a process of its own, so that the work of the page's server delays no command.

The child has the bus, the commander and the test stand; it passes what it receives on to the server. When the server
ends, even by a crash, the child ramps the torque out and ends, too.
"""

import multiprocessing
import queue
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any, Final, Protocol

import can

from fluxtrue_tools.bus.address import BusAddress
from fluxtrue_tools.bus.interface import Interface
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.live.commander import Commander
from fluxtrue_tools.live.last import LastValues
from fluxtrue_tools.live.link import NEEDED, Link, Observer, Status
from fluxtrue_tools.live.pace import InStep, Listener, Pace, SimulatedTime, WallClock
from fluxtrue_tools.live.stand import Stand
from fluxtrue_tools.vecu.channel import Channel
from fluxtrue_tools.vecu.stepped import SteppedBus

WAITING_MAX: Final = 100_000  # messages that wait for a server that stands still; further ones are dropped
ENDED: Final = "The process that commands has ended."
END_S: Final = 10.0


@dataclass(frozen=True)
class Setup:
    """The data that the child process needs."""

    address: BusAddress
    interface_name: str
    interface_text: str
    torque_max_Nm: float
    bench: tuple[str, int] | None = None  # bench channel of a virtual ECU
    is_stepped: bool = False
    in_step: bool = False


class Outbox:
    """Messages to the server, sent by a thread of their own: a server that does not read delays no command."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._waiting: queue.Queue[Any] = queue.Queue(WAITING_MAX)
        self._thread = threading.Thread(target=self._send, name="outbox", daemon=True)
        self._thread.start()

    def put(self, kind: str, *content: Any) -> bool:
        """Send a message soon; False: it is dropped."""
        try:
            self._waiting.put_nowait((kind, *content))
        except queue.Full:
            return False  # the server has stood still for minutes; commands go on
        return True

    def close(self) -> None:
        """Send what waits."""
        self._waiting.put(None)
        self._thread.join(END_S)

    def _send(self) -> None:
        try:
            while (message := self._waiting.get()) is not None:
                self._connection.send(message)
        except OSError:
            return  # the server has ended


class Turns:
    """The child's end of InStep. A turn that is not waited for is answered, too: they are counted."""

    def __init__(self, outbox: Outbox, is_used: bool = True) -> None:
        self._outbox = outbox
        self._changed = threading.Condition()
        self._asked = self._drawn = 0
        self._is_free = self._is_released = not is_used

    def turn(self) -> None:
        """A batch is due; returns when the pages have drawn it."""
        with self._changed:
            if self._is_free or not self._outbox.put("turn"):
                return
            self._asked += 1
            self._changed.wait_for(lambda: self._is_free or self._drawn == self._asked)

    def done(self) -> None:
        """The pages have drawn a batch."""
        with self._changed:
            self._drawn += 1
            self._changed.notify_all()

    def free(self, on: bool) -> None:
        """Whether time continues without pages: a step that has to end must not wait for one."""
        with self._changed:
            self._is_free = on or self._is_released
            self._changed.notify_all()

    def release(self) -> None:
        """Time never waits for pages any more."""
        with self._changed:
            self._is_free = self._is_released = True
            self._changed.notify_all()


class Reporter(Observer):
    """Reports to the server what happens on the bus side."""

    def __init__(self, outbox: Outbox) -> None:
        self._outbox = outbox
        self._sent: Status | None = None

    def sent(self, frame: can.Message) -> None:
        """A command goes into recordings."""
        self.received(frame)

    def received(self, frame: can.Message) -> None:
        """A frame of the bus."""
        self._outbox.put("frame", frame.timestamp, frame.arbitration_id, bytes(frame.data), frame.is_extended_id,
                         frame.is_error_frame, frame.is_remote_frame, frame.is_rx)  # fmt: skip

    def truth(self, time_s: float, torque_Nm: float) -> None:
        """The torque of the simulated machine."""
        self._outbox.put("truth", time_s, torque_Nm)

    def period(self, status: Status) -> None:
        """Only a changed status is sent."""
        if status != self._sent and self._outbox.put("status", status):
            self._sent = status

    def ended(self, status: Status) -> None:
        """The pages need not wait for the next batch."""
        self._outbox.put("ended", status)


def _link(setup: Setup, reporter: Reporter, turns: Turns, stack: ExitStack) -> Link:
    """Bus, time and test stand of the child."""
    interface = Interface(setup.interface_name, setup.interface_text)
    values = LastValues(interface.database, NEEDED)
    listeners: list[Listener] = [values, reporter.received]
    bus = setup.address.connect()
    channel = Channel(*setup.bench) if setup.bench is not None else None
    stand = Stand(channel) if channel is not None else None
    pace: Pace = WallClock(bus, listeners) if channel is None or not setup.is_stepped else SimulatedTime(
        SteppedBus(bus, channel.another()), listeners, turns if setup.in_step else None)  # fmt: skip
    if stand is not None:
        stack.callback(stand.close)
    link = Link(bus, pace, interface, Commander(setup.torque_max_Nm), values, stand, reporter)
    stack.callback(link.close)
    stack.callback(turns.release)  # first: closing needs time that passes
    return link


def _obey(link: Link, turns: Turns, connection: Connection, outbox: Outbox) -> None:
    """Carry out what the server asks for, until it closes."""
    with ExitStack() as held:  # simulated time, while the server makes another connection
        while (message := connection.recv()) is not None:
            match message:
                case "act", name, *values:
                    link.act(name, *values)
                case "turn", knob, value:
                    link.turn(knob, value)
                case ("done",):
                    turns.done()
                case ("hold",):
                    held.enter_context(link.standing_still())
                    outbox.put("held")
                case ("go",):
                    held.close()


def _run(setup: Setup, connection: Connection) -> None:
    """The child's process."""
    for number in (signal.SIGINT, signal.SIGTERM):  # the server ends the child, after the torque
        signal.signal(number, signal.SIG_IGN)
    outbox = Outbox(connection)
    turns = Turns(outbox)
    with ExitStack() as stack:
        stack.callback(outbox.close)
        try:
            link = _link(setup, Reporter(outbox), turns, stack)
        except FluxtrueError as error:
            outbox.put("failed", str(error))
            return
        try:
            _obey(link, turns, connection, outbox)
        except (EOFError, OSError):
            return  # the server has crashed: the torque is ramped out all the same


class Receiver(Protocol):
    """What takes the frames and the truth in the server."""

    def __call__(self, frame: can.Message) -> None: ...
    def truth(self, time_s: float, torque_Nm: float) -> None: ...


class BusProcess:
    """The server's end: the same calls as a Link. `run` is what the child does; it first reports a status."""

    def __init__(self, setup: Any, receivers: list[Receiver], in_step: InStep | None,
                 run: Callable[[Any, Connection], None] = _run) -> None:  # fmt: skip
        context = multiprocessing.get_context("spawn")
        self._connection, theirs = context.Pipe()
        self._receivers, self._in_step = receivers, in_step
        self._status = Status()
        self._sending, self._held = threading.Lock(), threading.Event()
        self._process = context.Process(target=run, args=(setup, theirs), name="fluxtrue-bus", daemon=True)
        self._process.start()
        theirs.close()
        self._begin()
        self._thread = threading.Thread(target=self._receive, name="bus", daemon=True)
        self._thread.start()

    def _begin(self) -> None:
        """Wait for the first status, which comes before any frame."""
        try:
            kind, content = self._connection.recv()
            if kind == "failed":
                raise FluxtrueError(content)
            self._status = content
        except EOFError as error:
            raise FluxtrueError(ENDED) from error

    def act(self, action: str, *values: Any) -> None:
        """An action of a user."""
        self.send("act", action, *values)

    def turn(self, knob: str, value: float) -> None:
        """Change one parameter of the test stand."""
        self.send("turn", knob, value)

    def status(self) -> Status:
        """What the pages show."""
        return self._status

    @contextmanager
    def standing_still(self) -> Iterator[None]:
        """Time does not pass while another connection is made."""
        self._held.clear()
        self.send("hold")
        self._held.wait(END_S)
        try:
            yield
        finally:
            self.send("go")

    def close(self) -> None:
        """Ramp the torque to zero, then end the child."""
        if self._in_step is not None:
            self._in_step.release()
        with self._sending, suppress(OSError):
            self._connection.send(None)
        self._thread.join()
        self._process.join(END_S)

    def send(self, *message: Any) -> None:
        """One message to the child."""
        with self._sending, suppress(OSError):  # the child has ended: the status says so
            self._connection.send(message)

    def _receive(self) -> None:
        try:
            with suppress(EOFError, OSError):
                while True:
                    self.take(self._connection.recv())
        finally:
            # Also after an error in take(): the child switches off when its connection ends, and no page waits for it.
            self._status = Status(stopped=self._status.stopped if not self._status.state else ENDED)
            if self._in_step is not None:
                self._in_step.release()
            with self._sending:
                self._connection.close()

    def take(self, message: tuple[Any, ...]) -> None:
        """One message of the child."""
        match message:
            case "frame", time_s, number, data, extended, error, remote, received:
                frame = can.Message(time_s, number, extended, remote, error, data=data, is_rx=received)
                for receiver in self._receivers:
                    receiver(frame)
            case "truth", time_s, torque_Nm:
                for receiver in self._receivers:
                    receiver.truth(time_s, torque_Nm)
            case "status", status:
                self._status = status
            case "ended", status:
                self._status = status
                if self._in_step is not None:
                    self._in_step.release()
            case ("held",):
                self._held.set()
            case ("turn",):
                if self._in_step is not None:
                    self._in_step.turn()
                self.send("done")
