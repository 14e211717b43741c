# SPDX-License-Identifier: Apache-2.0
"""Dead-man function, control by one page only, and bad messages: without a browser, with the clock of the test."""

import asyncio
import json
import threading
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from pathlib import Path
from typing import Any

import can
import pytest
from aiohttp import ClientWebSocketResponse
from aiohttp.test_utils import TestClient, TestServer
from asammdf import MDF
from progress import HANG_S, polled_async

from fluxtrue_tools.bus.interface import read_interface
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.live import server
from fluxtrue_tools.live.cli import _listen
from fluxtrue_tools.live.commander import Commander, Order, Wish
from fluxtrue_tools.live.link import Status
from fluxtrue_tools.live.pace import InStep
from fluxtrue_tools.live.recorder import Recorder
from fluxtrue_tools.live.samples import Samples
from fluxtrue_tools.live.server import make_app
from fluxtrue_tools.live.session import Session

TICK_S = 0.01
RAMP_S = 0.4  # 60 N·m at 150 N·m/s
STOP_S = 0.08  # from 132 N·m to zero


class Drive:
    """The bus side, in place of a Link: the test steps the commander, and a model of the inverter follows it.

    The model has two rules of docs/howto/can.md: enable acts on its edge, and 30 ms without a command disable.
    """

    lost = ""

    def __init__(self) -> None:
        self.commander = Commander(132.0)
        self.now_s, self.state, self.refused = 100.0, "standby", "none"
        self.order = Order()
        self.obeys = True
        self._enable_seen = self._enabled = False

    def act(self, action: str, *values: Any) -> None:
        """Replaces Link.act(), with the clock of the test."""
        getattr(self.commander, action)(*values, self.now_s)

    def status(self) -> Status:
        """Replaces Link.status()."""
        return Status(self.state, self.commander.wish.value, self.commander.target_Nm, self.commander.stopped)

    def run(self, seconds: float, alive: bool = False) -> list[float]:
        """Let time pass; the requested torque of each step. The states ready and run follow the command at once."""
        torques = []
        for _ in range(round(seconds / TICK_S)):
            self.now_s += TICK_S
            if alive:
                self.commander.hand(self.now_s)
            self.order = self.commander.step(self.now_s, self.state, self.refused)
            self._follow()
            torques.append(self.order.torque_requested_Nm)
        return torques

    def _follow(self) -> None:
        edge = self.order.enable and not self._enable_seen
        self._enabled = self.order.enable and (self._enabled or (edge and self.obeys))
        self._enable_seen = self.order.enable
        self.state = "run" if self._enabled else "ready" if self.order.mode == "torque" else "standby"

    def gap(self, seconds: float) -> None:
        """Let time pass without a command."""
        self.now_s += seconds
        self.commander.hand(self.now_s)
        if seconds > 0.03 and self._enabled:
            self._enabled, self._enable_seen, self.state, self.refused = False, True, "ready", "command_timed_out"


@pytest.fixture
def driving() -> Drive:
    """A drive at 60 N·m, whose page has just reported."""
    drive = Drive()
    drive.act("ask", Wish.READY)
    drive.run(0.1, alive=True)
    drive.act("ask", Wish.DRIVE)
    drive.run(0.1, alive=True)
    drive.act("slide", 60.0)
    assert drive.run(RAMP_S + 0.1, alive=True)[-1] == 60.0
    return drive


def test_signs_of_life_keep_the_torque(driving: Drive) -> None:
    for _ in range(50):
        driving.act("hand")
        assert set(driving.run(0.29)) == {60.0}


def test_a_page_silent_for_300_ms_loses_the_torque_by_a_ramp_and_must_press_enable_again(
    driving: Drive,
) -> None:
    assert set(driving.run(0.29)) == {60.0}
    torques = [60.0, *driving.run(0.05 + STOP_S)]
    steps = [before - after for before, after in pairwise(torques)]
    assert min(steps) >= 0.0 and max(steps) <= 132.0 * TICK_S / STOP_S + 1e-9
    assert torques[-1] == 0.0 and not driving.order.enable and driving.state == "ready"
    driving.act("slide", 60.0)  # the page is back, its slider at the old value
    assert driving.commander.target_Nm == 0.0
    assert set(driving.run(1.0, alive=True)) == {0.0} and not driving.order.enable
    assert "closed or silent for 0.3 s. Press Enable" in driving.commander.stopped
    press(driving, Wish.DRIVE)
    assert driving.state == "run"


def press(drive: Drive, wish: Wish) -> None:
    """Press a button once, and let the page report for 0.1 s."""
    drive.act("ask", wish)
    drive.run(0.1, alive=True)


def test_a_gap_in_the_commands_disables_with_a_reason_and_one_press_continues(driving: Drive) -> None:
    driving.gap(0.05)
    driving.run(0.05, alive=True)
    commander = driving.commander
    assert driving.state == "ready" and not driving.order.enable
    assert (commander.wish, commander.target_Nm, driving.order.torque_requested_Nm) == (Wish.READY, 0.0, 0.0)
    assert commander.stopped == ("The inverter stopped: command timed out. No command for 60 ms; it waits 30 ms. "
                                 "Press Enable to go on.")  # fmt: skip
    driving.run(2.0, alive=True)
    assert driving.state == "ready" and commander.stopped
    press(driving, Wish.DRIVE)
    assert driving.state == "run" and commander.stopped == "" and driving.order.torque_requested_Nm == 0.0


def test_a_gap_shorter_than_the_time_out_changes_nothing(driving: Drive) -> None:
    driving.gap(0.015)
    assert set(driving.run(0.2, alive=True)) == {60.0}
    assert driving.commander.stopped == "" and driving.state == "run"


@pytest.mark.parametrize(("state", "why"), [
    ("fault", "The inverter reports fault. Reset its faults first. Press Enable to go on."),
    ("safe_state", "The inverter reports safe state. Reset its faults first. Press Enable to go on."),
    ("ready", "The inverter stopped. Its state is ready. Press Enable to go on."),
    ("discharge", "The inverter stopped. Its state is discharge. Press Enable to go on."),
])  # fmt: skip
def test_an_inverter_that_stops_by_itself_ends_the_request_and_the_reason_names_its_state(
    driving: Drive, state: str, why: str
) -> None:
    driving.state = state
    driving.run(TICK_S, alive=True)
    assert (driving.commander.wish, driving.commander.stopped) == (Wish.READY, why)


def test_an_enable_without_effect_is_withdrawn_after_half_a_second_with_the_inverters_reason() -> None:
    drive = Drive()
    press(drive, Wish.READY)
    drive.obeys, drive.refused = False, "dc_voltage_out_of_range"
    press(drive, Wish.DRIVE)
    assert drive.commander.wish is Wish.DRIVE
    drive.run(0.5, alive=True)
    assert drive.commander.wish is Wish.READY
    assert drive.commander.stopped == ("The inverter did not start: dc voltage out of range. Its state is ready. "
                                       "Press Enable to go on.")  # fmt: skip
    drive.obeys = True
    press(drive, Wish.DRIVE)
    assert drive.state == "run"


Talk = Callable[[TestClient[Any, Any], Session], Awaitable[None]]


def serve(drive: Drive, folder: Path, talk: Talk, in_step: InStep | None = None) -> None:
    """Run a server as long as talk() takes."""

    async def conversation() -> None:
        samples = Samples(read_interface().database)
        session = Session("test", 132.0, samples, Recorder(folder, read_interface()), {})
        session.link = drive  # type: ignore[assignment]
        session.in_step = in_step
        async with TestClient(TestServer(make_app(session))) as client:
            await talk(client, session)

    asyncio.run(conversation())


class Unconnected:
    """A viewer without a connection: only its send_str() matters."""

    async def close(self, **_: Any) -> None:
        """Do nothing."""


async def page(client: TestClient[Any, Any]) -> ClientWebSocketResponse:
    """Open a page: connect a socket and receive the greeting."""
    socket = await client.ws_connect("/ws", headers={"Origin": f"http://127.0.0.1:{client.port}"})
    assert (await socket.receive_json(timeout=HANG_S))["type"] == "hello"
    return socket


async def refusal(socket: ClientWebSocketResponse, text: str) -> str:
    """Send one message and return the text of its refusal."""
    await socket.send_str(text)
    while (answer := await socket.receive_json(timeout=HANG_S))["type"] != "refused":
        assert answer["type"] == "rows", answer
    return str(answer["text"])


async def obeyed(socket: ClientWebSocketResponse) -> None:
    """Wait until every earlier message has been read: messages are answered in their order."""
    assert "unknown message" in await refusal(socket, '{"type": "are you there"}')


async def until_gone(session: Session, viewers: int) -> None:
    """Wait until the server has noticed that a page has closed."""
    await polled_async(lambda: len(session.viewers) <= viewers)


@pytest.mark.parametrize("cut", [False, True], ids=["closed", "cut off"])
def test_a_lost_page_ramps_out_at_once_and_no_other_page_takes_over_its_torque(tmp_path: Path, cut: bool) -> None:
    drive = Drive()

    async def talk(client: TestClient[Any, Any], session: Session) -> None:
        first, second = await page(client), await page(client)
        await first.send_json({"type": "ready"})
        await obeyed(first)
        drive.run(0.1)
        await first.send_json({"type": "drive"})
        await obeyed(first)
        drive.run(0.1)
        await first.send_json({"type": "torque", "torque_requested_Nm": 60.0})
        await obeyed(first)
        assert drive.run(0.2)[-1] == pytest.approx(30.0)
        assert "another page has control" in await refusal(second, '{"type": "torque", "torque_requested_Nm": 90}')
        if cut:
            assert first._response.connection is not None and first._response.connection.transport is not None
            first._response.connection.transport.abort()
        else:
            await first.close()
        await until_gone(session, 1)
        await second.send_json({"type": "torque", "torque_requested_Nm": 90.0})
        await obeyed(second)
        torques = [30.0, *drive.run(0.3)]
        assert torques == sorted(torques, reverse=True) and torques[-1] == 0.0
        assert not drive.order.enable

    serve(drive, tmp_path, talk)


@pytest.mark.parametrize("text", [
    "{", "[]", "[" * 4000, '{"type": ["torque"]}', '{"type": "launch"}', '{"type": "torque"}',
    '{"type": "torque", "torque_requested_Nm": "40"}', '{"type": "torque", "torque_requested_Nm": NaN}',
    '{"type": "torque", "torque_requested_Nm": true}', '{"type": "torque", "torque_requested_Nm": 1' + "0" * 400 + "}",
    '{"type": "knob", "name": ["speed_rpm"], "value": 1}', '{"type": "tune", "name": "observer_m", "value": 3}',
], ids=range(12))  # fmt: skip
def test_a_bad_message_is_answered_and_changes_nothing(driving: Drive, tmp_path: Path, text: str) -> None:
    async def talk(client: TestClient[Any, Any], session: Session) -> None:
        socket = await page(client)
        assert await refusal(socket, text)
        assert driving.commander.target_Nm == 60.0
        await obeyed(socket)

    serve(driving, tmp_path, talk)


def test_a_page_that_does_not_read_does_not_delay_the_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Stuck(Unconnected):
        """A viewer that never takes a batch."""

        sent = 0

        async def send_str(self, text: str) -> None:
            Stuck.sent += 1
            assert json.loads(text)["type"] == "rows"
            await asyncio.Event().wait()

    async def talk(client: TestClient[Any, Any], session: Session) -> None:
        session.viewers.append(Stuck())  # type: ignore[arg-type]
        socket = await page(client)
        for _ in range(5):
            assert (await socket.receive_json(timeout=HANG_S))["type"] == "rows"
        assert Stuck.sent == 1

    monkeypatch.setattr(server, "SEND_S", 10.0 * HANG_S)
    serve(Drive(), tmp_path, talk)


def test_signs_of_life_are_received_during_a_long_answer(driving: Drive, tmp_path: Path) -> None:
    """Reading all calibration values takes longer than a page may go without a report."""
    read = threading.Event()

    class Slow:
        """An ECU that answers when the test allows it."""

        thread = ThreadPoolExecutor(1)

        def table(self) -> list[dict[str, Any]]:
            read.wait()
            return []

    async def talk(client: TestClient[Any, Any], session: Session) -> None:
        session.tuning = Slow()  # type: ignore[assignment]
        socket = await page(client)
        await socket.send_json({"type": "torque", "torque_requested_Nm": 60.0})
        await socket.send_json({"type": "tune_list"})
        await socket.send_json({"type": "drawn", "batch": 0, "visible": True})
        await obeyed(socket)
        assert driving.commander.alive(driving.now_s)
        read.set()
        while (answer := await socket.receive_json(timeout=HANG_S))["type"] == "rows":
            pass
        assert answer == {"type": "parameters", "values": [], "told": ""}

    driving.run(0.2)
    serve(driving, tmp_path, talk)


def test_each_change_of_parameters_is_told_in_its_own_answer(driving: Drive, tmp_path: Path) -> None:
    """Also when the next change is requested before the ECU has carried out the first."""
    both = threading.Event()

    class Ecu:
        """An ECU with one value, which waits until both changes have been requested."""

        thread = ThreadPoolExecutor(1)
        gain = 1.0

        def present(self) -> dict[str, float]:
            return {"gain": self.gain}

        def table(self) -> list[dict[str, Any]]:
            return [{"name": "gain", "value": self.gain}]

        def load(self, values: dict[str, float]) -> None:
            both.wait()
            self.gain = values["gain"]

    async def talk(client: TestClient[Any, Any], session: Session) -> None:
        session.tuning = Ecu()  # type: ignore[assignment]
        socket = await page(client)
        for gain in (2.0, 3.0, 3.0):
            await socket.send_json({"type": "tune_load", "values": {"gain": gain}})
        await obeyed(socket)
        both.set()
        told: list[str] = []
        while len(told) < 3:
            answer = await socket.receive_json(timeout=HANG_S)
            told += [answer["told"]] if answer["type"] == "parameters" else []
        assert told == ["Written: gain = 2", "Written: gain = 3", "Nothing changed: the inverter held these values."]

    driving.run(0.2)
    serve(driving, tmp_path, talk)


def test_what_was_recorded_is_written_although_the_ecu_no_longer_answers(tmp_path: Path) -> None:
    class Silent:
        """An ECU that answers nothing."""

        thread = ThreadPoolExecutor(1)

        def measure(self) -> None:
            """Let it send nothing."""

        def measure_no_more(self) -> None:
            raise FluxtrueError("XCP: no answer")

    async def recording(socket: ClientWebSocketResponse, on: bool) -> dict[str, Any]:
        await socket.send_json({"type": "record", "on": on})
        while (answer := await socket.receive_json(timeout=HANG_S))["type"] == "rows":
            pass
        return dict(answer)

    async def talk(client: TestClient[Any, Any], session: Session) -> None:
        session.tuning = Silent()  # type: ignore[assignment]
        socket = await page(client)
        assert (await recording(socket, True))["on"]
        session.recorder(can.Message(arbitration_id=0x100, is_extended_id=False, data=bytes(8), timestamp=1.0))
        answer = await recording(socket, False)
        assert (answer["type"], answer["on"]) == ("recording", False)
        assert Path(answer["file"]).is_file()

    serve(Drive(), tmp_path, talk)


def test_a_recording_that_starts_while_another_is_written_does_not_change_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorder, make = Recorder(tmp_path / "new", read_interface()), Path.mkdir

    def start_another(self: Path, *arguments: Any, **options: Any) -> None:
        make(self, *arguments, **options)
        recorder.start()

    recorder.start()
    recorder(can.Message(arbitration_id=0x100, is_extended_id=False, data=bytes(8), timestamp=1.0))
    for k in range(3):
        recorder.truth(1.0 + k, 60.0)
    monkeypatch.setattr(Path, "mkdir", start_another)
    path = recorder.stop()
    assert path is not None
    with MDF(path) as log:
        assert log.get("truth.torque_mean_Nm").samples.size == 3


@pytest.mark.parametrize("visible", [True, False])
def test_only_a_visible_page_gives_a_sign_of_life(driving: Drive, tmp_path: Path, visible: bool) -> None:
    async def talk(client: TestClient[Any, Any], session: Session) -> None:
        socket = await page(client)
        await socket.send_json({"type": "torque", "torque_requested_Nm": 60.0})
        await obeyed(socket)
        driving.run(0.25)
        await socket.send_json({"type": "drawn", "batch": 0, "visible": visible})
        await obeyed(socket)
        assert (driving.run(0.2)[-1] == 60.0) == visible

    serve(driving, tmp_path, talk)


def test_in_step_time_waits_for_a_page_and_until_each_page_has_drawn(tmp_path: Path) -> None:
    in_step, batches = InStep(), []

    async def batch(socket: ClientWebSocketResponse) -> int:
        while (message := await socket.receive_json(timeout=HANG_S))["type"] != "rows":
            pass
        return int(message["batch"])

    async def talk(client: TestClient[Any, Any], session: Session) -> None:
        def time_passes() -> None:
            while len(batches) < 2:
                in_step.turn()
                batches.append(1)

        first, second = await page(client), await page(client)
        passing = asyncio.get_running_loop().run_in_executor(None, time_passes)
        assert (await batch(first), await batch(second)) == (0, 0)
        await first.send_json({"type": "drawn", "batch": 0, "visible": True})
        await obeyed(first)
        assert not batches  # the second page has not drawn yet
        await second.send_json({"type": "drawn", "batch": 0, "visible": False})
        assert (await batch(first), await batch(second)) == (1, 1)
        assert len(batches) == 1
        await second.close()  # a closed page is not waited for
        await first.send_json({"type": "drawn", "batch": 1, "visible": True})
        await passing
        assert len(batches) == 2

    serve(Drive(), tmp_path, talk, in_step)


def test_in_step_no_time_passes_between_the_failure_of_a_connection_and_the_end_of_its_page(tmp_path: Path) -> None:
    """The server notices first that it cannot send, and then that the page has closed, which ends the torque."""
    failed = asyncio.Event()

    class Counting(InStep):
        """Counts how often time was let go on."""

        turns = 0

        def done(self) -> None:
            self.turns += 1
            super().done()

    class Failed(Unconnected):
        """A viewer whose connection is lost."""

        async def send_str(self, _text: str) -> None:
            failed.set()
            raise ConnectionResetError

    async def talk(client: TestClient[Any, Any], session: Session) -> None:
        socket = await page(client)
        session.viewers.append(Failed())  # type: ignore[arg-type]
        passing = asyncio.get_running_loop().run_in_executor(None, in_step.turn)
        await socket.send_json({"type": "drawn", "batch": 0, "visible": True})
        await failed.wait()
        await obeyed(socket)
        assert in_step.turns == 0
        session.viewers.pop()  # what the handler does at its end
        session.changed.set()
        await passing
        assert in_step.turns == 1

    in_step = Counting()
    serve(Drive(), tmp_path, talk, in_step)


def test_it_listens_on_the_loopback_address_only() -> None:
    with _listen(0) as listener:
        assert listener.getsockname()[0] == "127.0.0.1"
