# SPDX-License-Identifier: Apache-2.0
"""The page's oscilloscope: one capture at a time, over the XCP session that also tunes."""

import asyncio
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from pyxcp.types import XcpResponseError

from fluxtrue_tools.a2l.elf import Description
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.live.xcp import BENCH_ANSWER_S, Xcp
from fluxtrue_tools.scope.scope import LEVELS, SIGNALS_MAX, TRIGGERS, WORDS, Capture, Scope, Setup
from fluxtrue_tools.scope.spectrum import SAMPLES_MIN, spectrum_of
from fluxtrue_tools.scope.xcp import XcpRefused

POLL_S: Final = 0.1  # between two readings of the capture's state
WAITING: Final = ("armed", "triggered")
DIGITS: Final = 6  # of a sample; the converter has fewer
OTHER: Final = "another tool is capturing; End ends its capture."
FIRST: Final = "A fault came first: these are the periods around it."
KEPT: Final = {True: "A fault has left these periods around it. End discards them in the inverter.",
               False: "Another tool has left this capture. End discards it in the inverter."}  # fmt: skip


@dataclass(frozen=True)
class ScopeStatus:
    """What every page shows of the oscilloscope."""

    state: str = "idle"  # idle, armed, triggered, reading
    capture: int = 0  # how many captures have been read: a page asks for the newest when this has changed
    text: str = ""


class _Commands:
    """The session as the scope's XCP master."""

    def __init__(self, xcp: Xcp) -> None:
        self._xcp = xcp

    def command(self, *data: int) -> bytes:
        """One command and its answer."""
        try:
            return self._xcp.command(*data)
        except XcpResponseError as error:
            if self._xcp.is_abandoned:
                raise
            raise XcpRefused(data[0], int(error.args[0])) from error

    def pass_time(self, seconds: float) -> None:
        """Time passes on the bench, or by the process that commands."""
        time.sleep(seconds)


def _rounded(column: NDArray[np.float64]) -> list[float]:
    return [float(f"{value:.{DIGITS}g}") for value in column]


def content(capture: Capture) -> dict[str, Any]:
    """A capture and its spectrum as the pages draw them."""
    step_s = float(capture.time_s[1] - capture.time_s[0]) if len(capture.time_s) > 1 else 0.0
    answer = {"trigger": capture.trigger, "step_s": step_s, "is_freeze_frame": capture.is_freeze_frame,
              "units": capture.units, "spectrum": None, "warning": capture.warning,
              "columns": {name: _rounded(column) for name, column in capture.columns.items()}}  # fmt: skip
    if len(capture.time_s) >= SAMPLES_MIN:
        spectrum = spectrum_of(capture)
        columns = {name: _rounded(column) for name, column in spectrum.columns.items()}
        answer["spectrum"] = {"step_Hz": spectrum.step_Hz, "columns": columns}
    return answer


class Oscilloscope:
    """Arms, follows and reads captures. The calls that need the ECU run in `thread`."""

    def __init__(self, xcp: Xcp, description: Description) -> None:
        self._xcp = xcp
        self._scope = Scope(_Commands(xcp), description)
        self._period_s = description.period_s
        self._setup: Setup | None = None
        self.repeats = False
        self.status = ScopeStatus()
        self.newest: tuple[int, Capture] | None = None  # with its number

    @property
    def thread(self) -> ThreadPoolExecutor:
        """Where the calls run."""
        return self._xcp.thread

    @property
    def signals(self) -> dict[str, Any]:
        """What can be captured, by name."""
        return self._scope.signals

    def offer(self) -> dict[str, Any]:
        """What the page lets the user choose from."""
        signals = [{"name": signal.name, "text": signal.text, "unit": signal.base.unit}
                   for signal in self._scope.signals.values()]  # fmt: skip
        return {"signals": signals, "signals_max": SIGNALS_MAX, "words": WORDS, "triggers": TRIGGERS,
                "levels": LEVELS, "period_s": self._period_s}  # fmt: skip

    def arm(self, setup: Setup, repeats: bool) -> None:
        """Start a capture, in place of one that still waits for its trigger."""
        self._setup, self.repeats = setup, repeats  # the page that closes meanwhile may end the repetition
        try:
            with self._xcp.reported():
                if self.status.state in WAITING:
                    self._scope.give_up()
                    self.status = replace(self.status, state="idle")
                self._arm(setup)
        except FluxtrueError:
            self.repeats = False
            raise

    def _arm(self, setup: Setup) -> None:
        self._scope.take(setup)
        try:
            self._scope.arm()
        except FluxtrueError as error:
            if isinstance(error.__cause__, XcpRefused):
                self._read_kept("Nothing was armed: ")
                raise FluxtrueError(self.status.text) from error
            raise
        self.status = replace(self.status, state="armed", text="")

    def read_kept(self) -> None:
        """Read what the inverter keeps although it was not armed here: the freeze frame of a fault, or the capture of
        another tool. It stays in the inverter until end(), so that every page may ask for it."""
        if self.status.state in WAITING:
            return  # follow() reads what a fault leaves
        with self._xcp.reported():
            self._read_kept()

    def _read_kept(self, result: str = "") -> None:
        """result: what becomes of the request in which the capture was found."""
        kept = self._scope.status()
        if kept.state == "idle":
            raise FluxtrueError("The inverter keeps no capture.")
        if kept.state != "done":
            raise FluxtrueError(f"{result}{OTHER}")
        self._take(result + KEPT[kept.is_freeze_frame], release=False)

    def _take(self, text: str, release: bool) -> None:
        """Read the complete capture, which every page then draws."""
        self.status = replace(self.status, state="reading")
        try:
            capture = self._scope.read(release)
        except Exception:
            self.status = replace(self.status, state="idle")
            raise
        self.newest = (self.status.capture + 1, capture)
        self.status = ScopeStatus("idle", self.newest[0], text)

    def trigger(self) -> None:
        """Trigger now."""
        with self._xcp.reported():
            self._scope.trigger()

    def end(self) -> None:
        """Give the capture up, also one that another tool or a fault has left in the ECU."""
        self.repeats = False
        with self._xcp.reported():
            self._scope.stop()
        self.status = replace(self.status, state="idle", text="The inverter holds no capture any more.")

    def abandon(self) -> None:
        """No call waits for an inverter that is silent. Any thread."""
        self._xcp.abandon()

    def follow(self) -> None:
        """Read the state of the capture that was armed, and the capture when it is complete."""
        if self.status.state not in WAITING:
            return
        try:
            with self._xcp.reported():
                self._follow()
        except Exception as error:  # this call has no caller that waits: the pages show how it ended
            self.repeats = False
            self.status = replace(self.status, state="idle", text=str(error))

    def _follow(self) -> None:
        try:
            status = self._scope.progress()
        except FluxtrueError:
            status = self._scope.status()
            if not status.is_freeze_frame:
                raise
            self.repeats = False  # a fault has come first; its freeze frame is read in place of the capture
        if status.state == "idle":
            raise FluxtrueError("another tool has ended the capture")
        if status.state != "done":
            self.status = replace(self.status, state=status.state)
            return
        self._take(FIRST if status.is_freeze_frame else "", release=True)
        if self.repeats and self._setup is not None:
            self._arm(self._setup)


async def watch(oscilloscope: Oscilloscope, is_silent: Callable[[], bool]) -> None:
    """Follow the captures; no call waits for an inverter that has been silent for longer than an answer may take."""
    run = asyncio.get_running_loop().run_in_executor
    following: asyncio.Future[None] | None = None
    silent = 0
    while True:
        await asyncio.sleep(POLL_S)
        silent = silent + 1 if is_silent() else 0
        if silent * POLL_S >= BENCH_ANSWER_S:
            oscilloscope.abandon()
        elif not silent and (following is None or following.done()):
            following = run(oscilloscope.thread, oscilloscope.follow)
