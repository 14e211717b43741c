# SPDX-License-Identifier: Apache-2.0
"""Dead man, one hand on the slider, and bad messages: without a browser, and on a clock of the test's own."""

import asyncio
import json
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import cantools.database
import pytest
from aiohttp import ClientWebSocketResponse
from aiohttp.test_utils import TestClient, TestServer
from fluxtrue_tools.bus import DBC
from fluxtrue_tools.live.cli import _listen
from fluxtrue_tools.live.commander import Commander, Order, Wish
from fluxtrue_tools.live.link import Recorder
from fluxtrue_tools.live.samples import Samples
from fluxtrue_tools.live.server import Session, make_app

TICK_S = 0.01
RAMP_S = 0.4  # 60 N·m at 150 N·m/s


class Drive:
    """The bus side, in place of a Link: the commander is stepped by the test, the inverter does what it is told."""

    def __init__(self) -> None:
        self.commander = Commander(132.0)
        self.now_s, self.state = 100.0, "standby"
        self.order = Order()

    def act(self, action: Callable[[Commander, float], None]) -> None:
        """As Link.act(), with the test's clock."""
        action(self.commander, self.now_s)

    def run(self, seconds: float, alive: bool = False) -> list[float]:
        """Time passes; the torque asked for on the way. Ready and run follow the command at once."""
        torques = []
        for _ in range(round(seconds / TICK_S)):
            self.now_s += TICK_S
            if alive:
                self.commander.hand(self.now_s)
            self.order = self.commander.step(self.now_s, self.state)
            self.state = "run" if self.order.enable else "ready" if self.order.mode == "torque" else "standby"
            torques.append(self.order.torque_Nm)
        return torques


@pytest.fixture
def driving() -> Drive:
    """60 N·m, and a hand that has just said so."""
    drive = Drive()
    drive.act(lambda commander, now: commander.ask(Wish.READY, now))
    drive.run(0.1, alive=True)
    drive.act(lambda commander, now: commander.ask(Wish.DRIVE, now))
    drive.run(0.1, alive=True)
    drive.act(lambda commander, now: commander.slide(60.0, now))
    assert drive.run(RAMP_S + 0.1, alive=True)[-1] == 60.0
    return drive


def test_signs_of_life_keep_the_torque(driving: Drive) -> None:
    for _ in range(50):
        driving.act(lambda commander, now: commander.hand(now))
        assert set(driving.run(0.29)) == {60.0}


def test_a_page_that_says_nothing_for_300_ms_loses_the_torque_by_a_ramp_and_must_press_enable_again(
    driving: Drive,
) -> None:
    assert set(driving.run(0.29)) == {60.0}
    torques = [60.0, *driving.run(0.05 + RAMP_S)]
    steps = [before - after for before, after in zip(torques, torques[1:], strict=False)]
    assert 0.0 <= min(steps) and max(steps) <= 150.0 * TICK_S + 1e-9
    assert torques[-1] == 0.0 and not driving.order.enable and driving.state == "ready"
    driving.act(lambda commander, now: commander.slide(60.0, now))  # it wakes up, its slider still there
    assert set(driving.run(1.0, alive=True)) == {0.0} and not driving.order.enable


Talk = Callable[[TestClient[Any, Any], Session], Awaitable[None]]


def serve(drive: Drive, folder: Path, talk: Talk) -> None:
    """A server for the length of one conversation."""

    async def conversation() -> None:
        samples = Samples(cantools.database.load_file(DBC))
        session = Session("test", drive.commander, samples, Recorder(folder, DBC), {})
        session.link = drive  # type: ignore[assignment]
        async with TestClient(TestServer(make_app(session))) as client:
            await talk(client, session)

    asyncio.run(conversation())


async def page(client: TestClient[Any, Any]) -> ClientWebSocketResponse:
    """A page that has just been opened."""
    socket = await client.ws_connect("/ws", headers={"Origin": f"http://127.0.0.1:{client.port}"})
    assert (await socket.receive_json(timeout=10.0))["type"] == "hello"
    return socket


async def refusal(socket: ClientWebSocketResponse, text: str) -> str:
    """What the page is told about one message."""
    await socket.send_str(text)
    while (answer := await socket.receive_json(timeout=10.0))["type"] != "refused":
        assert answer["type"] == "rows", answer
    return str(answer["text"])


async def obeyed(socket: ClientWebSocketResponse) -> None:
    """Everything sent before has been read: messages are answered in their order."""
    assert "unknown message" in await refusal(socket, '{"type": "are you there"}')


async def until_gone(session: Session, viewers: int) -> None:
    """The server has noticed that a page has gone."""
    async with asyncio.timeout(10.0):
        while len(session.viewers) > viewers:
            await asyncio.sleep(0.01)


@pytest.mark.parametrize("cut", [False, True], ids=["closed", "cut off"])
def test_a_lost_page_lets_go_at_once_and_no_other_page_inherits_its_torque(tmp_path: Path, cut: bool) -> None:
    drive = Drive()

    async def talk(client: TestClient[Any, Any], session: Session) -> None:
        first, second = await page(client), await page(client)
        await first.send_json({"type": "ready"})
        await obeyed(first)
        drive.run(0.1)
        await first.send_json({"type": "drive"})
        await obeyed(first)
        drive.run(0.1)
        await first.send_json({"type": "torque", "torque_Nm": 60.0})
        await obeyed(first)
        assert drive.run(0.2)[-1] == pytest.approx(30.0)
        assert "hand on the slider" in await refusal(second, '{"type": "torque", "torque_Nm": 90}')
        if cut:
            assert first._response.connection is not None and first._response.connection.transport is not None
            first._response.connection.transport.abort()
        else:
            await first.close()
        await until_gone(session, 1)
        await second.send_json({"type": "torque", "torque_Nm": 90.0})
        await obeyed(second)
        torques = [30.0, *drive.run(0.3)]
        assert torques == sorted(torques, reverse=True) and torques[-1] == 0.0
        assert not drive.order.enable

    serve(drive, tmp_path, talk)


@pytest.mark.parametrize("text", [
    "{", "[]", "[" * 4000, '{"type": ["torque"]}', '{"type": "launch"}', '{"type": "torque"}',
    '{"type": "torque", "torque_Nm": "40"}', '{"type": "torque", "torque_Nm": NaN}',
    '{"type": "torque", "torque_Nm": true}', '{"type": "torque", "torque_Nm": 1' + "0" * 400 + "}",
    '{"type": "knob", "name": ["speed_rpm"], "value": 1}', '{"type": "tune", "name": "observer_m", "value": 3}',
], ids=range(12))  # fmt: skip
def test_a_bad_message_is_answered_and_moves_nothing(driving: Drive, tmp_path: Path, text: str) -> None:
    async def talk(client: TestClient[Any, Any], session: Session) -> None:
        socket = await page(client)
        assert await refusal(socket, text)
        assert driving.commander.target_Nm == 60.0
        await obeyed(socket)

    serve(driving, tmp_path, talk)


def test_a_page_that_does_not_read_leaves_the_others_their_pictures(tmp_path: Path) -> None:
    class Stuck:
        """A viewer that never takes a batch."""

        sent = 0

        async def send_str(self, text: str) -> None:
            Stuck.sent += 1
            assert json.loads(text)["type"] == "rows"
            raise TimeoutError

    async def talk(client: TestClient[Any, Any], session: Session) -> None:
        session.viewers.append(Stuck())  # type: ignore[arg-type]
        socket = await page(client)
        for _ in range(5):
            assert (await socket.receive_json(timeout=10.0))["type"] == "rows"
        assert Stuck.sent >= 4

    serve(Drive(), tmp_path, talk)


def test_it_listens_on_the_loopback_address_only() -> None:
    with _listen(0) as listener:
        assert listener.getsockname()[0] == "127.0.0.1"
