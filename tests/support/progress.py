# SPDX-License-Identifier: Apache-2.0
"""How tests wait: for progress, never for the clock.

tools/checks/waits.py refuses clocks, pauses and time-outs of one's own in every other file below tests/. What is here
fails neither on a slow computer nor on a busy one:
  until()     fails when something else has gone on long enough, for example simulated time
  polled()    waits for something that must come; a test that hangs is ended by ctest (tests/idle_seconds.txt)
  HANG_S      for calls that want a time-out: it only ends a hang
  BenchTime   a bench has no other time than the wall clock's; nothing in the test gate uses it to decide anything
"""

import asyncio
import time
from collections.abc import Callable
from typing import Final

import can

HANG_S: Final = 3600.0
PAUSE_S: Final = 0.02  # between two checks


def until(true: Callable[[], bool], progress: Callable[[], float], most: float, what: str) -> None:
    """Wait until something holds; give up when `progress` has advanced by `most`."""
    begin = progress()
    while not true():
        gone = progress() - begin
        # Checked again: this process may have been paused between the two checks.
        assert gone <= most or true(), f"waited for: {what}; {gone:g} later it was still not so"
        time.sleep(PAUSE_S)


def polled(true: Callable[[], bool]) -> None:
    """Wait until something holds that cannot fail to come."""
    while not true():
        time.sleep(PAUSE_S)


async def polled_async(true: Callable[[], bool]) -> None:
    """The same in an event loop."""
    while not true():
        await asyncio.sleep(PAUSE_S)


def cpu_seconds() -> float:
    """Of this process: for measurements that a user asks for, not for verdicts of the test gate."""
    return time.process_time()


class BenchTime:
    """The wall clock, for a suite before hardware."""

    @property
    def now_s(self) -> float:
        """Its time."""
        return time.monotonic()

    def receive(self, bus: can.BusABC, until_s: float, take: Callable[[can.Message | None], None]) -> None:
        """Everything that comes until then."""
        while (left_s := until_s - time.monotonic()) > 0.0:
            take(bus.recv(left_s))
