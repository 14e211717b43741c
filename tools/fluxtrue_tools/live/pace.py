# SPDX-License-Identifier: Apache-2.0
"""The clock that the commands follow: the wall clock on a bench, simulated time with a virtual ECU.

With a virtual ECU time passes only between two commands. If the computer stalls, the simulated inverter and machine
stall with it, so that no command is late. On a bench nothing waits, and a command may be late.
"""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Final, Protocol

import can

from fluxtrue_tools.vecu.stepped import SteppedBus

PERIOD_S: Final = 0.010
BATCH_PERIODS: Final = 4  # time that one batch for the page covers

Listener = Callable[[can.Message], None]


class Turn(Protocol):
    """What simulated time in step with the pages waits for."""

    def turn(self) -> None: ...


class Pace(Protocol):
    """A bus with its own time."""

    @property
    def now_s(self) -> float: ...
    def send(self, frame: can.Message) -> None: ...
    def next_period(self, stop: threading.Event) -> None: ...
    def standing_still(self) -> AbstractContextManager[None]: ...
    def close(self) -> None: ...


class WallClock:
    """The time of a bench: the wall clock.

    clock, wait   what tells the time, and waits at most so long for an event; a test brings its own
    """

    def __init__(self, bus: can.BusABC, listeners: list[Listener], clock: Callable[[], float] = time.monotonic,
                 wait: Callable[[threading.Event, float], object] = threading.Event.wait) -> None:  # fmt: skip
        self._bus, self._clock, self._wait = bus, clock, wait
        self._notifier = can.Notifier(bus, listeners, timeout=0.1)
        self._due_s = clock()

    @property
    def now_s(self) -> float:
        """The time of commands and of the reports of the pages."""
        return self._clock()

    def send(self, frame: can.Message) -> None:
        """One command."""
        self._bus.send(frame, timeout=PERIOD_S)

    def next_period(self, stop: threading.Event) -> None:
        """Wait until the next command is due. After a stall it is due at once, and of the periods that were missed at
        most two are made up for."""
        self._due_s = max(self._due_s + PERIOD_S, self._clock() - PERIOD_S)
        self._wait(stop, max(self._due_s - self._clock(), 0.0))

    @contextmanager
    def standing_still(self) -> Iterator[None]:
        """Nothing: the time of a bench cannot be held."""
        yield

    def close(self) -> None:
        """Stop listening."""
        self._notifier.stop()


class InStep:
    """Holds simulated time until every page has drawn what there was, instead of until the wall clock has caught up.

    The link's thread calls turn() each so many periods; the web server waits for due(), sends a batch, and answers with
    done() when all pages have drawn it.
    """

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._due = self._open = False

    def turn(self) -> None:
        """A batch is due; returns when the pages have drawn it."""
        with self._changed:
            self._due = not self._open
            self._changed.notify_all()
            self._changed.wait_for(lambda: not self._due)

    def due(self) -> bool:
        """Wait for the next batch; False after release()."""
        with self._changed:
            self._changed.wait_for(lambda: self._due or self._open)
            return not self._open

    def done(self) -> None:
        """The pages have drawn the batch; time continues."""
        with self._changed:
            self._due = False
            self._changed.notify_all()

    def release(self) -> None:
        """Let time continue without pages."""
        with self._changed:
            self._open, self._due = True, False
            self._changed.notify_all()


class SimulatedTime:
    """A virtual ECU whose time passes only here: not faster than the wall clock, or in step with the pages."""

    def __init__(self, bus: SteppedBus, listeners: list[Listener], in_step: Turn | None = None) -> None:
        self._bus, self._listeners, self._in_step = bus, listeners, in_step
        self._due_s = time.monotonic()
        self._periods = 0

    @property
    def now_s(self) -> float:
        """The time of commands and of the reports of the pages."""
        return self._bus.now_s

    def send(self, frame: can.Message) -> None:
        """Send one command, which the ECU receives before time continues."""
        self._bus.send(frame)

    def next_period(self, stop: threading.Event) -> None:
        """Let 10 ms pass and receive the frames that were sent meanwhile."""
        for message in self._bus.run(1e3 * PERIOD_S)[0]:
            for listener in self._listeners:
                listener(message)
        self._periods += 1
        if self._in_step is None:
            self._due_s = max(self._due_s + PERIOD_S, time.monotonic() - PERIOD_S)
            stop.wait(max(self._due_s - time.monotonic(), 0.0))
        elif self._periods % BATCH_PERIODS == 0:
            self._in_step.turn()

    def standing_still(self) -> AbstractContextManager[None]:
        """Time does not pass while another connection is made."""
        return self._bus.standing_still()

    def close(self) -> None:
        """Nothing to stop: time passes only in next_period()."""
