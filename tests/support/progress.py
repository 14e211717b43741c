# SPDX-License-Identifier: Apache-2.0
"""How tests wait: for progress, for example of simulated time, never for the wall clock.

tools/checks/waits.py refuses clocks, pauses and time-outs in every other file below tests/. The functions of this file
do not fail because the computer is slow or busy:
  until()     fails when a progress value, for example simulated time, has advanced too far
  polled()    waits for a condition that must come true; ctest ends a test that hangs (time-outs: tests/seconds.txt)
  HANG_S      for calls that require a time-out: long enough to end nothing but a hang
  BenchTime   the wall clock, because a bench with hardware has no other time; no test of the gate depends on it
"""

import asyncio
import time
from collections.abc import Callable
from typing import Final

import can

HANG_S: Final = 3600.0
PAUSE_S: Final = 0.02  # between two checks


def until(condition: Callable[[], bool], progress: Callable[[], float], max_advance: float, what: str) -> None:
    """Wait until the condition is true; fail when `progress` has advanced by more than `max_advance`."""
    begin = progress()
    while not condition():
        advance = progress() - begin
        # The condition is checked again, because this process may have been paused between the two checks.
        assert advance <= max_advance or condition(), f"waited in vain for: {what}; progress advanced by {advance:g}"
        time.sleep(PAUSE_S)


def polled(condition: Callable[[], bool]) -> None:
    """Wait until a condition that must come true is true."""
    while not condition():
        time.sleep(PAUSE_S)


async def polled_async(condition: Callable[[], bool]) -> None:
    """The same as polled() in an event loop."""
    while not condition():
        await asyncio.sleep(PAUSE_S)


def cpu_seconds() -> float:
    """Processor time of this process, for measurements that a user requests. No test of the gate depends on it."""
    return time.process_time()


class BenchTime:
    """The wall clock, for the bench suite that runs against hardware."""

    @property
    def now_s(self) -> float:
        """The time of the wall clock."""
        return time.monotonic()

    def receive(self, bus: can.BusABC, until_s: float, take: Callable[[can.Message | None], None]) -> None:
        """Pass every message that arrives before `until_s` to `take`."""
        while (left_s := until_s - time.monotonic()) > 0.0:
            take(bus.recv(left_s))
