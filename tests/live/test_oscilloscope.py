# SPDX-License-Identifier: Apache-2.0
"""The page's oscilloscope without a browser and without an ECU: what it refuses, repeats, and does not wait for."""

import asyncio
import threading
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pytest
from aiohttp.test_utils import TestClient
from masters import ConnectedMaster
from progress import polled
from pyxcp.types import Command, XcpResponseError
from test_server import Drive, page, serve

from fluxtrue_tools.a2l.elf import Base, Description, Signal, Value
from fluxtrue_tools.bus.address import BusAddress
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.live import xcp
from fluxtrue_tools.live.oscilloscope import Oscilloscope, content
from fluxtrue_tools.live.session import Session
from fluxtrue_tools.scope.scope import BUSY, STATES, USER, Capture, Setup, Status
from fluxtrue_tools.scope.spectrum import spectrum_of
from fluxtrue_tools.scope.xcp import XcpRefused

CURRENT = Base("CURRENT", "A", 400.0)
DESCRIPTION = Description(
    "hsm1", (), (), (), (CURRENT,), 1e-3, period_s=1e-4,
    scope=(Value("scope_state", "", "", "U8", "", 0.0, 0.0, 0x1000),),
    signals=(Signal("i_d_A", "Current", CURRENT, 0), Signal("i_q_A", "Current", CURRENT, 1)),
)  # fmt: skip
SETUP = Setup((0,), "manual", 0, 0, 1, 64, 16)
WANTED = {"type": "scope_arm", "signals": ["i_d_A"], "trigger": "rising", "on": "i_q_A", "level": 10, "before": 0.25,
          "samples": 64, "divisor": 1}  # fmt: skip
SAMPLES, SINE_A, SINE_Hz, MEAN_A = 500, 3.0, 400.0, -2.0


def captured() -> Capture:
    """A sine and a mean value at 10 kHz."""
    time_s = 1e-4 * (np.arange(SAMPLES) - 100)
    column = MEAN_A + SINE_A * np.sin(2.0 * np.pi * SINE_Hz * time_s)
    return Capture(time_s, {"i_d_A": column}, {"i_d_A": "A"}, {"i_d_A": ""}, 100, 5000, False, 3)


def test_a_spectrum_has_the_amplitudes_of_a_sine_and_the_mean() -> None:
    spectrum = spectrum_of(captured())
    amplitudes = spectrum.columns["i_d_A"]
    frequencies = spectrum.step_Hz * np.arange(len(amplitudes))
    assert frequencies[-1] == pytest.approx(5000.0)
    assert amplitudes[0] == pytest.approx(-MEAN_A, abs=1e-3)
    assert frequencies[1 + amplitudes[1:].argmax()] == pytest.approx(SINE_Hz)
    assert amplitudes[1:].max() == pytest.approx(SINE_A, rel=1e-3)
    assert amplitudes[frequencies > SINE_Hz + 3.0 * spectrum.step_Hz].max() < 1e-3 * SINE_A


def test_a_ripple_from_sample_to_sample_has_its_amplitude_in_the_spectrum() -> None:
    whole = captured()
    ripple = replace(whole, columns={"i_d_A": SINE_A * (-1.0) ** np.arange(SAMPLES)})
    assert spectrum_of(ripple).columns["i_d_A"][-1] == pytest.approx(SINE_A)


def test_a_capture_of_a_few_samples_has_no_spectrum() -> None:
    whole = captured()
    few = replace(whole, time_s=whole.time_s[:7], columns={"i_d_A": whole.columns["i_d_A"][:7]})
    assert content(few)["spectrum"] is None and len(content(few)["columns"]["i_d_A"]) == 7
    with pytest.raises(FluxtrueError, match="7 samples, a spectrum needs 8"):
        spectrum_of(few)


@pytest.mark.parametrize(("lost", "times"), [(1, "lost samples once:"), (3, "lost samples 3 times:")])
def test_a_capture_with_lost_samples_has_a_warning(lost: int, times: str) -> None:
    assert content(captured())["warning"] == ""
    assert times in content(replace(captured(), lost=lost))["warning"]


class Transport:
    """A connection on which nothing answers."""

    def __init__(self) -> None:
        self.resQueue: deque[bytes] = deque()
        self.resQueue_condition = threading.Condition()
        self.is_waiting = False

    def request(self, command: Command, *data: int) -> NoReturn:
        """Waits for an answer, as pyxcp does."""
        with self.resQueue_condition:
            self.is_waiting = True
            self.resQueue_condition.wait_for(lambda: self.resQueue)
            self.is_waiting = False
            assert self.resQueue.popleft()[0] == 0xFE
        raise XcpResponseError("ERR_CMD_SYNCH")


class Master(ConnectedMaster):
    """A master before an ECU that answers nothing after it has been connected."""

    def __init__(self) -> None:
        super().__init__()
        self.transport = Transport()


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[Master]:
    """Every master that a session has made."""
    masters: list[Master] = []

    def connect(*_: object) -> Master:
        masters.append(Master())
        return masters[-1]

    monkeypatch.setattr(xcp, "_connect", connect)
    monkeypatch.setattr(xcp, "CLOSE_S", 0.01)
    return masters


@pytest.fixture
def session(made: list[Master]) -> xcp.Xcp:
    return xcp.Xcp(BusAddress("virtual", "none", {}), xcp.SIMULATED_ANSWER_S)


def test_no_call_waits_for_an_inverter_that_is_silent(session: xcp.Xcp, made: list[Master]) -> None:
    scope = Oscilloscope(session, DESCRIPTION)
    for count in (1, 2):
        scope.status = replace(scope.status, state="armed")
        call = scope.thread.submit(scope.follow)
        polled(lambda count=count: len(made) == count and made[-1].transport.is_waiting)  # type: ignore[misc]
        scope.abandon()
        call.result()
        assert scope.status.state == "idle" and scope.status.text == "XCP: the inverter does not answer any more"
        assert made[-1].is_closed
    scope.abandon()  # nothing waits
    session.close()


def test_a_session_ends_although_a_call_waits(session: xcp.Xcp, made: list[Master]) -> None:
    scope = Oscilloscope(session, DESCRIPTION)
    scope.status = replace(scope.status, state="armed")
    call = scope.thread.submit(scope.follow)
    polled(lambda: bool(made) and made[-1].transport.is_waiting)
    session.close()
    assert call.done() and made[-1].is_closed


class Ecu:
    """In place of a Scope: gives the answers of the test."""

    def __init__(self) -> None:
        self.state, self.is_freeze_frame, self.armed = "idle", False, 0

    def take(self, setup: Setup) -> None:
        assert setup is SETUP

    def stop(self) -> None:
        self.state = "idle"

    def arm(self) -> None:
        if self.state != "idle":
            raise FluxtrueError("in use") from XcpRefused(USER, BUSY)
        self.armed, self.state = self.armed + 1, "armed"

    def progress(self) -> Status:
        if self.is_freeze_frame:
            raise FluxtrueError("the capture was given up")
        return self.status()

    def status(self) -> Status:
        return Status(self.state, self.is_freeze_frame, 1, (0,), "manual", 0, 0, 1, 64, 16, 0, 16, 64, 0, 0)

    def read(self, release: bool) -> Capture:
        self.state = "idle" if release else self.state
        return replace(captured(), is_freeze_frame=self.is_freeze_frame)


@pytest.fixture
def ecu() -> Ecu:
    return Ecu()


@pytest.fixture
def scope(session: xcp.Xcp, ecu: Ecu) -> Iterator[Oscilloscope]:
    made = Oscilloscope(session, DESCRIPTION)
    made._scope = ecu  # type: ignore[assignment]
    yield made
    session.close()


@pytest.mark.parametrize("repeats", [False, True])
def test_after_a_capture_it_is_armed_again_only_if_wanted(scope: Oscilloscope, ecu: Ecu, repeats: bool) -> None:
    scope.arm(SETUP, repeats)
    for state in STATES[1:3]:
        ecu.state = state
        scope.follow()
        assert (scope.status.state, scope.status.capture) == (state, 0)
    ecu.state = "done"
    scope.follow()
    assert scope.status.capture == 1 and scope.newest is not None
    assert (scope.status.state, ecu.armed) == (("armed", 2) if repeats else ("idle", 1))


def test_a_fault_that_comes_first_leaves_its_freeze_frame_and_ends_the_repetition(
    scope: Oscilloscope, ecu: Ecu
) -> None:
    scope.arm(SETUP, True)
    ecu.is_freeze_frame, ecu.state = True, "done"
    scope.follow()
    assert scope.newest is not None and scope.newest[1].is_freeze_frame
    assert (scope.status.state, ecu.armed) == ("idle", 1)
    assert scope.status.text == "A fault came first: these are the periods around it."


def kept(scope: Oscilloscope) -> None:
    scope.read_kept()


def armed(scope: Oscilloscope) -> None:
    with pytest.raises(FluxtrueError, match="^Nothing was armed: "):
        scope.arm(SETUP, True)


@pytest.mark.parametrize("ask", [kept, armed])
@pytest.mark.parametrize(("is_freeze_frame", "what"), [(True, "A fault has left"), (False, "Another tool has left")])
def test_what_was_not_armed_here_is_read_and_stays_in_the_inverter_until_it_is_ended(
    scope: Oscilloscope, ecu: Ecu, ask: Callable[[Oscilloscope], None], is_freeze_frame: bool, what: str
) -> None:
    ecu.is_freeze_frame, ecu.state = is_freeze_frame, "done"
    ask(scope)
    assert scope.newest is not None and scope.newest[0] == 1
    assert scope.newest[1].is_freeze_frame == is_freeze_frame
    assert (scope.status.state, scope.status.capture, ecu.state) == ("idle", 1, "done")
    assert what in scope.status.text and not scope.repeats
    scope.end()
    scope.arm(SETUP, False)
    assert (scope.status.state, scope.status.text, ecu.armed) == ("armed", "", 1)


@pytest.mark.parametrize(("state", "why"), [("idle", "keeps no capture"), ("armed", "another tool is capturing"),
                                            ("triggered", "another tool is capturing")])  # fmt: skip
def test_without_a_complete_capture_nothing_is_read(scope: Oscilloscope, ecu: Ecu, state: str, why: str) -> None:
    ecu.state = state
    with pytest.raises(FluxtrueError, match=why):
        scope.read_kept()
    if state != "idle":
        with pytest.raises(FluxtrueError, match=f"Nothing was armed: {why}"):
            scope.arm(SETUP, False)
    assert scope.newest is None and scope.status.state == "idle"


def test_a_capture_that_waits_for_its_trigger_is_not_read_before(scope: Oscilloscope, ecu: Ecu) -> None:
    scope.arm(SETUP, False)
    scope.read_kept()
    assert (scope.status.state, scope.newest) == ("armed", None)


def test_a_kept_capture_that_cannot_be_read_leaves_an_oscilloscope_that_can_be_armed(
    scope: Oscilloscope, ecu: Ecu, monkeypatch: pytest.MonkeyPatch
) -> None:
    def read(_: bool) -> Capture:
        raise FluxtrueError("another checksum")

    monkeypatch.setattr(ecu, "read", read)
    ecu.state = "done"
    with pytest.raises(FluxtrueError, match="another checksum"):
        scope.read_kept()
    assert (scope.status.state, scope.newest) == ("idle", None)


def test_a_capture_that_another_tool_has_ended_is_told(scope: Oscilloscope, ecu: Ecu) -> None:
    scope.arm(SETUP, True)
    ecu.state = "idle"
    scope.follow()
    assert (scope.status.state, scope.status.text) == ("idle", "another tool has ended the capture")


async def answer(socket: Any, message: dict[str, Any]) -> dict[str, Any]:
    """The answer to one message."""
    await socket.send_json(message)
    while (got := await socket.receive_json())["type"] == "rows":
        pass
    return dict(got)


@pytest.mark.parametrize(("change", "why"), [
    ({"signals": "i_d_A"}, "not a list of names"), ({"signals": []}, "0 signals, allowed: 1 to 8"),
    ({"signals": ["nothing"]}, "no signal 'nothing'"), ({"samples": 2.5}, "samples 2.5: not a whole number"),
    ({"samples": 6145}, "1 to 6144"), ({"level": 500}, "level 500 A of i_q_A, allowed: -400 to 400"),
    ({"before": 1}, "share 1 before the trigger"), ({"divisor": None}, "divisor: not a number"),
    ({"trigger": "soon"}, "trigger 'soon', allowed"), ({"on": 7}, "no signal '7'"),
])  # fmt: skip
def test_a_setting_that_is_not_possible_arms_nothing_and_takes_no_control(
    scope: Oscilloscope, ecu: Ecu, tmp_path: Path, change: dict[str, Any], why: str
) -> None:
    scope._scope.signals = {signal.name: signal for signal in DESCRIPTION.signals}

    async def talk(client: TestClient[Any, Any], session: Session) -> None:
        session.oscilloscope = scope
        got = await answer(await page(client), WANTED | change)
        assert got["type"] == "scope" and why in got["text"]
        assert ecu.armed == 0 and session.hand is None

    serve(Drive(), tmp_path, talk)


def test_only_the_page_with_control_arms_and_every_page_gets_the_capture(
    scope: Oscilloscope, ecu: Ecu, tmp_path: Path
) -> None:
    async def talk(client: TestClient[Any, Any], session: Session) -> None:
        session.oscilloscope = scope
        first, second = await page(client), await page(client)
        assert (await client.get("/capture.csv")).status == 404
        assert (await answer(first, {"type": "capture"}))["text"] == "no capture has been read"
        session.hand = session.viewers[0]
        for kind in ("scope_arm", "scope_trigger", "scope_end"):
            assert (await answer(second, WANTED | {"type": kind}))["text"] == "another page has control"
        assert ecu.armed == 0
        kept = await answer(second, {"type": "scope_kept"})
        assert kept["text"] == "The inverter keeps no capture.", "to look for one changes nothing: any page may"
        scope.arm(SETUP, False)
        ecu.state = "done"
        await asyncio.to_thread(scope.follow)
        got = await answer(second, {"type": "capture"})
        assert got["number"] == 1 and got["trigger"] == 100 and len(got["columns"]["i_d_A"]) == SAMPLES
        file = await client.get("/capture.csv")
        assert "capture-1.csv" in file.headers["Content-Disposition"]
        assert len((await file.text()).splitlines()) == 1 + SAMPLES

    scope._scope.signals = {signal.name: signal for signal in DESCRIPTION.signals}
    serve(Drive(), tmp_path, talk)


def test_without_the_firmwares_image_there_is_no_oscilloscope(tmp_path: Path) -> None:
    async def talk(client: TestClient[Any, Any], _: Session) -> None:
        assert "(--elf)" in (await answer(await page(client), WANTED))["text"]

    serve(Drive(), tmp_path, talk)
