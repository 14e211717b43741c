# SPDX-License-Identifier: Apache-2.0
"""The child process of the wizard: it has the bus and measures, one step at a time, as `fluxtrue commission` does.

The server may stall or crash. The commands do not depend on it, except that a step ends without reports from the page
that has started it. With a virtual ECU simulated time waits for the pages, so that no page is late.
"""

import contextlib
import queue
import signal
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any, Final

import can

from fluxtrue_tools.commission import steps
from fluxtrue_tools.commission.bus import OverTheBus
from fluxtrue_tools.commission.drive import Capture
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.on_the_bus import Bench, connected
from fluxtrue_tools.commission.steps import Found, Step
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.live.bus_process import Outbox, Reporter, Turns
from fluxtrue_tools.live.link import SILENT_S, Status
from fluxtrue_tools.live.pace import BATCH_PERIODS, PERIOD_S
from fluxtrue_tools.live.wizard.consent import GONE, Consent
from fluxtrue_tools.sim.build import MotorFolder
from fluxtrue_tools.sim.motor import read

BATCH_S: Final = BATCH_PERIODS * PERIOD_S
MEASURING_BATCH_S: Final = 0.2  # of simulated time; shorter than the time after which a page counts as silent
CLOSED: Final = "The server of the page has ended."


@dataclass(frozen=True)
class Setup:
    """The data that the child process needs."""

    bench: Bench
    motor: MotorFolder
    known: Nameplate
    in_step: bool  # simulated time waits for the pages


@dataclass(frozen=True)
class Job:
    """One step to be done, after those that have been accepted."""

    step: Step
    done: tuple[str, ...]
    found: Found
    known: Nameplate


class EndedByUser(FluxtrueError):
    """Stop, or the page is gone."""


class _Child:
    """The drive and what is done with it, in the main thread; hear() belongs to the thread that receives."""

    def __init__(self, drive: OverTheBus, outbox: Outbox, in_step: bool) -> None:
        self._drive, self._line = drive, drive.line
        self._outbox, self._reporter, self._turns = outbox, Reporter(outbox), Turns(outbox, in_step)
        self._batch_s = MEASURING_BATCH_S if in_step else BATCH_S
        self._consent, self._ending = Consent(), threading.Lock()
        self._jobs: queue.Queue[Job | None] = queue.Queue()  # None: reset the faults
        self._is_closing = threading.Event()
        self._is_watched = self._is_measuring = False
        self._newest: dict[int, can.Message] = {}
        self._since_s = self._silent_s = self._step_s = 0.0
        self._line.heard, self._line.passed = self._heard, self._passed

    def hear(self, connection: Connection) -> None:
        """Carry out what the server asks for, until it closes or has crashed."""
        with contextlib.suppress(EOFError, OSError):
            while (message := connection.recv()) is not None:
                self._obey(message)
        self._withdraw(CLOSED)
        self.close()

    def close(self) -> None:
        """No step begins any more, and nothing waits for a page. Any thread."""
        self._is_closing.set()
        self._turns.release()

    def _obey(self, message: tuple[Any, ...]) -> None:
        match message:
            case "act", "hand":
                self._consent.hand(self._line.now_s)
            case "act", "stop", why:
                self._withdraw(why)
            case "act", "let_go":
                self._withdraw(GONE)
            case "act", "reset_faults":
                self._jobs.put(None)
            case "do", job:
                self._jobs.put(job)
            case ("done",):
                self._turns.done()

    def _withdraw(self, why: str) -> None:
        """From the next command on switching is disabled, whatever the step is doing."""
        with self._ending:
            if self._consent.withdraw(why):
                self._line.is_barred = True
                self._turns.free(True)

    def _end(self) -> str:
        """The step has ended and switching is disabled; why it had to end, or empty."""
        with self._ending:
            self._line.is_barred = False
            self._turns.free(False)
            return self._consent.end()

    def _heard(self, frame: can.Message) -> None:
        """The pages show the newest values only."""
        self._newest[frame.arbitration_id] = frame
        self._silent_s = 0.0

    def _passed(self, seconds: float) -> None:
        """The inverter has run for this time."""
        self._since_s += seconds
        self._silent_s += seconds
        self._step_s += seconds
        if self._since_s >= (self._batch_s if self._is_measuring else BATCH_S) - 1e-9:
            self._report()
        why = self._consent.check(self._line.now_s) if self._is_watched else ""
        if why:
            self._is_watched = False
            self._withdraw(why)
            raise EndedByUser(why)

    def _report(self) -> None:
        self._since_s = 0.0
        frames, self._newest = self._newest, {}
        for frame in frames.values():
            self._reporter.received(frame)
        self._reporter.period(Status(self._line.state if self._silent_s < SILENT_S else ""))
        if self._is_measuring:
            self._outbox.put("progress", self._step_s)
        self._turns.turn()

    @contextlib.contextmanager
    def _watched(self, _drive: Capture, _step: Step) -> Iterator[None]:
        """Only here a step is interrupted: what follows it, to switch off, is done to its end."""
        self._is_watched = True
        try:
            yield
        finally:
            self._is_watched = False

    def _measure(self, job: Job) -> tuple[Any, ...]:
        self._step_s, self._is_measuring = 0.0, True
        self._consent.give(self._line.now_s)
        try:
            # The accepted steps came through a pipe: what this step changes in them is its own.
            found = steps.run(self._drive, [job.step], job.known, lambda _: None, earlier=(job.done, job.found),
                              shown=self._watched)  # fmt: skip
            answer: tuple[Any, ...] = ("found", job.step.name, found)
        except FluxtrueError as error:
            answer = ("refused", job.step.name, str(error))
        self._drive.switch_off()
        self._is_measuring = False
        why = self._end()
        return ("refused", job.step.name, why) if why else answer

    def serve(self) -> None:
        """Do what is asked for; between two steps time passes, not faster than the wall clock."""
        self._reporter.period(Status(self._line.state))
        while not self._is_closing.is_set() and not self._line.is_lost:
            try:
                job = self._jobs.get(timeout=PERIOD_S)
            except queue.Empty:
                self._drive.rest(PERIOD_S)
                continue
            if job is None:
                self._drive.reset_faults()
            else:
                self._outbox.put(*self._measure(job))
        if self._line.is_lost:
            self._reporter.ended(Status(stopped="The connection to the inverter is closed. Without commands it stops "
                                                "by itself."))  # fmt: skip


def run(setup: Setup, connection: Connection) -> None:
    """The child's process."""
    for number in (signal.SIGINT, signal.SIGTERM):  # the server ends the child, after switching has been disabled
        signal.signal(number, signal.SIG_IGN)
    outbox = Outbox(connection)
    with contextlib.ExitStack() as stack:
        stack.callback(outbox.close)
        try:
            drive = stack.enter_context(connected(setup.bench, read(setup.motor), setup.known))
        except FluxtrueError as error:
            outbox.put("failed", str(error))
            return
        child = _Child(drive, outbox, setup.in_step)
        threading.Thread(target=child.hear, args=(connection,), name="hear", daemon=True).start()
        try:
            child.serve()
        except FluxtrueError as error:  # for example another node that commands the inverter, too
            outbox.put("ended", Status(stopped=str(error)))
        finally:
            child.close()
