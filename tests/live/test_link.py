# SPDX-License-Identifier: Apache-2.0
"""The bus side of the page with the virtual ECU, without a browser. The test advances time, 40 ms at a time."""

import multiprocessing
from collections.abc import Callable, Iterator
from contextlib import suppress
from decimal import Decimal
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fluxtrue_tools.bus.interface import Interface, read_interface
from fluxtrue_tools.bus.scales import dbc_of, standard_factors
from fluxtrue_tools.live.bus_process import ENDED, BusProcess, Reporter, Turns
from fluxtrue_tools.live.commander import Commander, Wish
from fluxtrue_tools.live.link import Link, Status
from fluxtrue_tools.live.pace import InStep, SimulatedTime
from fluxtrue_tools.live.samples import Samples
from fluxtrue_tools.live.stand import Stand
from fluxtrue_tools.vecu.channel import Channel
from fluxtrue_tools.vecu.process import HOST, VirtualEcu
from fluxtrue_tools.vecu.stepped import SteppedBus, connect

BATCH_S = 0.04
STOP_S = 0.08  # from 132 N·m to zero
STOP_Nm_PER_PERIOD = 132.0 * 0.01 / STOP_S
HANG_S = 60.0  # the wait for what must come ends only if it does not
TIME_OUT_S = 5.0  # of simulated time; every change of state takes less


class Drive:
    """The objects of the server; the test takes the place of the pages and of the server's loop."""

    def __init__(self, ecu: VirtualEcu, folder: Path) -> None:
        interface = read_interface()
        self.channel, bus = Channel(HOST, ecu.bench_port), connect(ecu.can_port)
        self.commander, self.samples, self.in_step = Commander(132.0), Samples(interface.database), InStep()
        pace = SimulatedTime(SteppedBus(bus, self.channel.another()), [self.samples], self.in_step)
        self.stand = Stand(self.channel.another())
        self.link = Link(bus, pace, interface, self.commander, self.samples, self.stand)
        assert self.in_step.due()

    def pass_batch(self, alive: bool = True) -> None:
        """Advance time by 40 ms. If alive, the page reports at the beginning."""
        if alive:
            self.link.act("hand")
        self.in_step.done()
        assert self.in_step.due(), self.link.lost

    def until(self, true: Callable[[], bool], alive: bool = True) -> None:
        for _ in range(round(TIME_OUT_S / BATCH_S)):
            if true():
                return
            self.pass_batch(alive)
        pytest.fail(f"after {TIME_OUT_S} s: state {self.samples.state()}, {self.commander}")

    def press(self, wish: Wish) -> None:
        self.link.act("ask", wish)

    def torques(self) -> np.ndarray:
        """Times and commanded torques that the inverter has reported since the last call."""
        columns = self.samples.take()[1]["INV_Status"]
        return np.array([columns["t"], columns["TorqueCommanded"]])

    def close(self) -> None:
        self.in_step.release()
        self.link.close()
        self.stand.close()
        self.channel.close()


def test_an_inverter_of_another_scale_is_not_commanded(request: pytest.FixtureRequest, tmp_path: Path) -> None:
    truck = Interface("truck.dbc", dbc_of(standard_factors() | {"torque_Nm": Decimal("0.2")}))
    with VirtualEcu(Path(request.config.getoption("--vecu"))) as ecu:
        channel, bus = Channel(HOST, ecu.bench_port), connect(ecu.can_port)
        samples = Samples(truck.database)
        pace = SimulatedTime(SteppedBus(bus, channel.another()), [samples])
        link = Link(bus, pace, truck, Commander(1150.0), samples)
        link.wait(HANG_S)
        assert link.lost.startswith(f"truck.dbc (interface hash 0x{truck.hash:08X}) does not describe this inverter")
        assert samples.newest_s < 0.2
        link.close()
        channel.close()


@pytest.fixture
def driving(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Drive]:
    """A drive at 2000 rpm and 60 N·m."""
    with VirtualEcu(Path(request.config.getoption("--vecu"))) as ecu:
        drive = Drive(ecu, tmp_path)
        for wish, state in ((Wish.READY, "ready"), (Wish.DRIVE, "run")):
            drive.press(wish)
            drive.until(lambda state=state: drive.samples.state() == state)
        drive.stand.turn("speed_rpm", 2000.0)
        drive.link.act("slide", 60.0)
        drive.until(lambda: abs(drive.stand.truth_Nm() - 60.0) < 1.0)
        yield drive
        drive.close()


def test_a_gap_in_the_commands_disables_and_one_press_on_enable_continues(driving: Drive) -> None:
    driving.channel.run(60.0)  # time passes without a command
    driving.until(lambda: driving.samples.state() == "ready")
    driving.pass_batch()
    assert (driving.commander.wish, driving.commander.target_Nm) == (Wish.READY, 0.0)
    assert "The inverter stopped: command timed out. No command for 70 ms" in driving.commander.stopped
    for _ in range(25):
        driving.pass_batch()
    assert driving.samples.state() == "ready"
    driving.press(Wish.DRIVE)
    driving.until(lambda: driving.samples.state() == "run")
    assert driving.commander.stopped == ""


def test_without_a_sign_of_life_the_torque_stays_for_300_ms_and_ramps_to_zero(driving: Drive) -> None:
    driving.pass_batch()
    gone_s = driving.samples.newest_s
    driving.link.act("hand")
    driving.torques()
    driving.until(lambda: driving.samples.newest_s > gone_s + 1.0, alive=False)
    times, torques = driving.torques()
    # The status is sent every 10 ms and reports a command that arrived up to 10 ms before.
    held = torques[times < gone_s + 0.3]
    assert abs(held - 60.0).max() < 0.1
    assert abs(torques[times > gone_s + 0.3 + STOP_S + 0.03]).max() < 0.1
    assert np.diff(torques[times > gone_s + 0.3]).min() > -1.1 * STOP_Nm_PER_PERIOD
    assert driving.samples.state() == "ready"
    assert "closed or silent for 0.3 s" in driving.commander.stopped


@pytest.mark.parametrize("end", [("stop", "Stop was pressed."), ("ask", Wish.OFF), ("let_go",)], ids=lambda end: end[0])
def test_stop_off_and_a_closed_page_end_the_torque_within_150_ms(driving: Drive, end: tuple[str, ...]) -> None:
    driving.link.act("slide", 125.0)
    driving.until(lambda: driving.stand.truth_Nm() > 123.0)
    ended_s = driving.link._pace.now_s
    driving.link.act(*end)
    while driving.link._pace.now_s < ended_s + 0.15:
        driving.in_step.done()
        assert driving.in_step.due()
    estimated = driving.samples.take()[1]["INV_Status"]
    late = [
        torque for t, torque in zip(estimated["t"], estimated["TorqueEstimated"], strict=True) if t > ended_s + 0.14
    ]
    assert late and max(map(abs, late)) < 0.5 and abs(driving.stand.truth_Nm()) < 0.5


def test_closing_the_link_while_it_drives_ramps_the_torque_out_first(driving: Drive) -> None:
    driving.torques()
    driving.in_step.release()
    driving.link.close()
    _, torques = driving.torques()
    assert driving.commander.torque_requested_Nm == 0.0
    assert torques[-1] < STOP_Nm_PER_PERIOD  # the status after the last command may not have been received
    assert np.diff(torques).min() > -1.1 * STOP_Nm_PER_PERIOD


def test_a_status_that_could_not_be_told_is_told_later() -> None:
    class Outbox:
        """The way to a server that stands still, then reads again."""

        is_full, told = True, 0

        def put(self, *_: object) -> bool:
            self.told += not self.is_full
            return not self.is_full

    outbox = Outbox()
    reporter = Reporter(outbox)  # type: ignore[arg-type]
    reporter.period(Status("fault"))
    outbox.is_full = False
    reporter.period(Status("fault"))
    reporter.period(Status("fault"))
    assert outbox.told == 1


def test_the_end_of_the_virtual_ecu_is_reported_and_nothing_hangs(
    request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    with VirtualEcu(Path(request.config.getoption("--vecu"))) as ecu:
        drive = Drive(ecu, tmp_path)
    drive.in_step.release()
    drive.link._thread.join()
    assert "bench" in drive.link.lost
    drive.close()


class Strange(BusProcess):
    """A server's end that fails at a message of its child."""

    def take(self, message: tuple[Any, ...]) -> None:
        """Fails always."""
        raise ValueError(message)


def waits_for_a_page(_: Any, connection: Connection) -> None:
    """A child whose time stands until an answer comes; it ends when its connection does."""
    connection.send(("status", Status(state="standby")))
    connection.send(("turn",))
    with suppress(EOFError):
        connection.recv()


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_an_error_of_the_server_ends_the_child_and_lets_the_pages_go_on() -> None:
    """Otherwise the child would wait for an answer without end, with switching enabled."""
    in_step = InStep()
    process = Strange(None, [], in_step, waits_for_a_page)
    assert not in_step.due()  # waits until it has been released
    process.close()
    assert process.status().stopped == ENDED
    assert multiprocessing.active_children() == []


class Full:
    """The messages of a child whose server has stood still for minutes."""

    def put(self, _kind: str, *_content: Any) -> bool:
        """Nothing more can wait."""
        return False


def test_time_does_not_wait_for_an_answer_to_a_message_that_was_dropped() -> None:
    Turns(Full()).turn()  # type: ignore[arg-type]
