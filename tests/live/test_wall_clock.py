# SPDX-License-Identifier: Apache-2.0
"""The commands by the wall clock of a bench, where nothing waits for a computer that is late.

The clock is the test's own: it advances when the link waits for its next period, and when the test lets the computer be
busy. So neither result nor duration depends on the computer that runs the test.
"""

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import can
import numpy as np
import pytest
from progress import HANG_S

from fluxtrue_tools.bus.interface import COMMAND, REQUEST, read_interface
from fluxtrue_tools.live.commander import Commander, Wish
from fluxtrue_tools.live.last import LastValues
from fluxtrue_tools.live.link import NEEDED, Link, Observer, Status
from fluxtrue_tools.live.pace import WallClock

PERIOD_S, TIME_OUT_S = 0.010, 0.030  # of the commands; without one the inverter disables: docs/howto/can.md
HAND_TIMEOUT_S, STOP_S = 0.3, 0.08
RUN_S = 2.0
EARLY = 2  # commands after a stall that come before their period is over
INTERFACE = read_interface()
Command = dict[str, Any]


@dataclass
class Inverter(Observer):
    """Clock, inverter and page of one drive, all in the link's thread.

    The inverter has two rules of docs/howto/can.md: enable acts on its edge, and 30 ms without a command disable.
    """

    busy: Callable[[float], float] = lambda _: 0.0  # how long the computer is busy after a command at this time
    is_page_alive: Callable[[float], bool] = lambda _: True
    now_s: float = 50.0
    commands: list[tuple[float, Command]] = field(default_factory=list)
    told: list[tuple[float, Status]] = field(default_factory=list)
    link: Link | None = None
    values: LastValues = field(default_factory=lambda: LastValues(INTERFACE.database, NEEDED))
    is_enabled: bool = False

    def sent(self, frame: can.Message) -> None:
        """The inverter receives a command."""
        command: Any = INTERFACE.message(COMMAND).decode(bytes(frame.data), decode_choices=False)
        last_s, last = self.commands[-1] if self.commands else (self.now_s, {"Enable": 0})
        if self.now_s - last_s > TIME_OUT_S:
            self.is_enabled = False
        edge = command["Enable"] and not last["Enable"]
        self.is_enabled = bool(command["Enable"] and (self.is_enabled or edge))
        self.commands.append((self.now_s, command))

    def period(self, status: Status) -> None:
        """What the pages are told."""
        self.told.append((self.now_s, status))

    def wait(self, stop: threading.Event, seconds: float) -> None:
        """In place of Event.wait(): the computer was busy, then time passes until the next command is due."""
        late_s = self.busy(self.now_s)
        self.now_s += max(seconds, late_s)
        self._report()
        assert self.link is not None
        if self.is_page_alive(self.now_s):
            self.link.act("hand")
        if len(self.commands) in ACTIONS:
            self.link.act(*ACTIONS[len(self.commands)])
        if self.now_s > 50.0 + RUN_S:
            stop.set()

    def _report(self) -> None:
        """The inverter's state, which arrives in each period."""
        status = INTERFACE.message("INV_Status")
        state = "run" if self.is_enabled else "ready" if self.commands[-1][1]["Mode"] else "standby"
        content = {signal.name: 0 for signal in status.signals} | {"State": state}
        self.values(can.Message(self.now_s, status.frame_id, False, data=status.encode(content, strict=False)))

    def torques(self) -> np.ndarray:
        """Times and requested torques of the commands."""
        return np.array([[at_s, command[REQUEST]] for at_s, command in self.commands]).T


ACTIONS: dict[int, tuple[Any, ...]] = {5: ("ask", Wish.READY), 10: ("ask", Wish.DRIVE), 15: ("slide", 60.0)}


@pytest.fixture
def bus() -> Iterator[can.BusABC]:
    """Takes the commands; the inverter of the test reads them from the link."""
    with can.Bus("wall clock", interface="virtual") as made:
        yield made


def driven(bus: can.BusABC, inverter: Inverter) -> Inverter:
    """Two seconds of a drive by the clock of the test."""
    begun = threading.Event()

    def wait(stop: threading.Event, seconds: float) -> None:
        begun.wait()
        inverter.wait(stop, seconds)

    pace = WallClock(bus, [], lambda: inverter.now_s, wait)
    inverter.link = Link(bus, pace, INTERFACE, Commander(132.0), inverter.values, observer=inverter)
    begun.set()
    inverter.link.wait(HANG_S)
    inverter.link.close()
    assert inverter.link.send_errors == 0 and inverter.link.lost == ""
    return inverter


def test_commands_are_10_ms_apart_however_long_the_work_between_them_takes(bus: can.BusABC) -> None:
    """Work of 0 to 9 ms, which would add up if each period began after it."""
    work_s = iter(np.random.default_rng(1).uniform(0.0, 0.009, 1000))

    class Working(Inverter):
        def sent(self, frame: can.Message) -> None:
            super().sent(frame)
            self.now_s += next(work_s)

    times_s, torques = driven(bus, Working()).torques()
    assert len(times_s) == round(RUN_S / PERIOD_S) + 1
    assert times_s - 50.0 == pytest.approx(PERIOD_S * np.arange(len(times_s)), abs=1e-9)
    assert torques[-1] == pytest.approx(60.0)


def test_a_stall_that_the_inverter_tolerates_changes_nothing_and_is_not_made_up_for(bus: can.BusABC) -> None:
    inverter = driven(bus, Inverter(busy=lambda now_s: 0.029 if abs(now_s - 51.0) < 0.004 else 0.0))
    times_s, torques = inverter.torques()
    gaps_s = np.diff(times_s)
    assert gaps_s.max() == pytest.approx(0.029) and (gaps_s > 0.0101).sum() == 1
    assert (gaps_s < 0.0099).sum() <= EARLY, "what was missed is not made up for"
    assert torques[-1] == pytest.approx(60.0) and inverter.told[-1][1].stopped == ""


def test_a_stall_that_is_too_long_ends_the_drive_and_the_page_is_told_how_long_it_was(bus: can.BusABC) -> None:
    """By simulated time this cannot happen: it stands still while the computer is busy."""
    inverter = driven(bus, Inverter(busy=lambda now_s: 0.25 if abs(now_s - 51.0) < 0.004 else 0.0))
    times_s, torques = inverter.torques()
    stalled_s = times_s[np.diff(times_s).argmax()]
    after = times_s > stalled_s + 0.25 + 2.0 * PERIOD_S
    assert torques[times_s <= stalled_s][-1] == pytest.approx(60.0)
    assert not torques[after].any() and not [one for at_s, one in inverter.commands if at_s > stalled_s + 0.28
                                             and one["Enable"]]  # fmt: skip
    assert inverter.told[-1][1].state == "ready" and inverter.told[-1][1].wish == Wish.READY
    assert "No command for 250 ms; it waits 30 ms." in inverter.told[-1][1].stopped
    assert (np.diff(times_s) < 0.0099).sum() <= EARLY, "no burst of the 25 commands that were missed"


def test_a_page_that_falls_silent_loses_its_torque_by_the_wall_clock(bus: can.BusABC) -> None:
    inverter = driven(bus, Inverter(is_page_alive=lambda now_s: now_s < 51.0))
    times_s, torques = inverter.torques()
    held = (times_s > 50.9) & (times_s < 51.0 + HAND_TIMEOUT_S - PERIOD_S)
    assert torques[held] == pytest.approx(60.0)
    assert not torques[times_s > 51.0 + HAND_TIMEOUT_S + STOP_S].any()
    assert "closed or silent for 0.3 s" in inverter.told[-1][1].stopped
