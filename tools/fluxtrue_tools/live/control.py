# SPDX-License-Identifier: Apache-2.0
"""Requests that pages may send. At most one page has control, and only that page changes anything."""

import asyncio
import contextlib
import math
from collections.abc import Awaitable
from typing import TYPE_CHECKING, Any, Final

from aiohttp import web

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.live.commander import RUNNING
from fluxtrue_tools.live.oscilloscope import Oscilloscope, content
from fluxtrue_tools.live.session import Session
from fluxtrue_tools.live.stand import KNOBS
from fluxtrue_tools.live.tuning import Tuning
from fluxtrue_tools.scope.scope import Setup, make_setup

if TYPE_CHECKING:
    from fluxtrue_tools.live.wizard.wizard import Wizard

OTHER: Final = "another page has control"
STOPPED: Final = {True: "Stop was pressed.", False: "Stop was pressed on another page."}
NO_COMMANDS: Final = "an unknown motor is measured here: no torque is commanded, nothing is tuned or recorded"
Answer = dict[str, Any]


def number(value: Any, what: str) -> float:
    """A finite number of a message."""
    try:
        found = math.nan if isinstance(value, bool) or not isinstance(value, int | float) else float(value)
    except OverflowError:  # an integer of three hundred digits
        found = math.inf
    if not math.isfinite(found):
        raise FluxtrueError(f"{what}: not a number")
    return found


def take(session: Session, socket: web.WebSocketResponse) -> None:
    """Control goes to the page that first asks for something; it stays there until the page closes."""
    if session.hand is not None and session.hand is not socket and not session.hand.closed:
        raise FluxtrueError(OTHER)
    session.hand = socket


def give_up(session: Session, socket: web.WebSocketResponse) -> None:
    """The page has closed."""
    if session.hand is socket:
        session.hand = None
        if session.link is not None:
            session.link.act("let_go")
        if session.oscilloscope is not None:
            session.oscilloscope.repeats = False


def _drive(session: Session, socket: web.WebSocketResponse, message: dict[str, Any]) -> None:
    """Buttons and slider."""
    link, kind = session.link, message["type"]
    if link is None:
        raise FluxtrueError("a replay takes no commands")
    if kind == "stop":  # any page may
        link.act("stop", STOPPED[session.hand in (None, socket)])
        return
    take(session, socket)
    if kind == "torque":
        link.act("slide", number(message.get("torque_requested_Nm"), "torque_requested_Nm"))
    elif kind == "reset":
        link.act("reset_faults")
    elif kind == "drive" and link.status().state not in ("ready", *RUNNING):
        raise FluxtrueError("Enable is possible in state ready: press Ready first")
    else:
        link.act("ask", kind)


def _knob(session: Session, socket: web.WebSocketResponse, message: dict[str, Any]) -> None:
    name = str(message.get("name"))
    if session.link is None or name not in KNOBS or not session.link.status().knobs:
        raise FluxtrueError(f"no knob '{name}'")
    value = number(message.get("value"), name)
    take(session, socket)
    session.link.turn(name, value)


def drawn(session: Session, socket: web.WebSocketResponse, message: dict[str, Any]) -> None:
    """A page reports that it has drawn a batch: it is still there."""
    session.drawn[socket] = int(number(message.get("batch"), "batch"))
    session.changed.set()
    if message.get("visible") and session.hand is socket and session.link is not None:
        session.link.act("hand")


def _tuning(session: Session) -> Tuning:
    if session.tuning is None:
        raise FluxtrueError("no calibration values: the ECU's ELF file is not known (--elf)")
    return session.tuning


def _changed(tuning: Tuning, call: Any, *values: Any) -> Answer:
    """Change values; the answer has all of them as the ECU then holds them, also after a refusal.

    One call of the tuning's thread: between the change and its answer no other change can act, so that each answer
    tells what its own request has changed.
    """
    before, refusal = tuning.present(), ""
    try:
        call(*values)
    except FluxtrueError as error:
        refusal = str(error)
    table = tuning.table()
    written = ", ".join(f"{row['name']} = {row['value']:.6g}" for row in table if row["value"] != before[row["name"]])
    told = f"Written: {written}" if written else "" if refusal else "Nothing changed: the inverter held these values."
    return {"type": "parameters", "values": table, "told": ". ".join(text for text in (refusal, told) if text)}


async def _calibrate(tuning: Tuning, call: Any, *values: Any) -> Answer:
    run = asyncio.get_running_loop().run_in_executor
    return await run(tuning.thread, _changed, tuning, call, *values)


def _tune(session: Session, socket: web.WebSocketResponse, message: dict[str, Any]) -> Awaitable[Answer]:
    tuning = _tuning(session)
    match message["type"]:
        case "tune":
            name, value = str(message.get("name")), number(message.get("value"), "value")
            take(session, socket)
            return _calibrate(tuning, tuning.write, name, value)
        case "tune_load":
            values = message.get("values")
            if not isinstance(values, dict):
                raise FluxtrueError("values: not an object")
            values = {str(name): number(value, str(name)) for name, value in values.items()}
            take(session, socket)
            return _calibrate(tuning, tuning.load, values)
        case _:
            take(session, socket)
            return _calibrate(tuning, tuning.restore)


async def _read(session: Session, message: dict[str, Any]) -> Answer:
    """What changes nothing: any page may."""
    tuning, run = _tuning(session), asyncio.get_running_loop().run_in_executor
    if message["type"] == "freeze":
        return {"type": "freeze", **await run(tuning.thread, tuning.freeze)}
    return {"type": "parameters", "values": await run(tuning.thread, tuning.table), "told": ""}


async def _record(session: Session, on: bool) -> Answer:
    run, tuning = asyncio.get_running_loop().run_in_executor, session.tuning
    if on:
        layout = await run(tuning.thread, tuning.measure) if tuning is not None else None
        session.recorder.start(layout)
    else:
        if tuning is not None and session.status().state:  # an ECU that has ended would never answer
            with contextlib.suppress(FluxtrueError):  # what was recorded is kept, also of an ECU that does not answer
                await run(tuning.thread, tuning.measure_no_more)
        path = await asyncio.to_thread(session.recorder.stop)
        session.last_file = str(path) if path else ""
    return {"type": "recording", "on": session.recorder.running, "file": session.last_file}


def _wanted(scope: Oscilloscope, message: dict[str, Any]) -> Setup:
    """What a page wants to capture, in the numbers of the firmware."""
    names = message.get("signals")
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise FluxtrueError("signals: not a list of names")
    whole = {}
    for name in ("samples", "divisor"):
        whole[name] = int(value := number(message.get(name), name))
        if whole[name] != value:
            raise FluxtrueError(f"{name} {value:g}: not a whole number")
    trigger, on = str(message.get("trigger")), str(message.get("on") or names[0] if names else "")
    return make_setup(scope.signals, names, trigger, on, number(message.get("level"), "level"),
                      number(message.get("before"), "before"), whole["samples"], whole["divisor"])  # fmt: skip


async def _scope_answer(text: str) -> Answer:
    """An answer that the page shows where its oscilloscope is operated."""
    return {"type": "scope", "text": text}


async def _scoped(scope: Oscilloscope, call: Any, *values: Any) -> Answer:
    try:
        await asyncio.get_running_loop().run_in_executor(scope.thread, call, *values)
    except FluxtrueError as error:
        return await _scope_answer(str(error))
    return await _scope_answer("")


def _capture(session: Session, socket: web.WebSocketResponse, message: dict[str, Any]) -> Awaitable[Answer]:
    scope = session.oscilloscope
    if scope is None:
        raise FluxtrueError("no oscilloscope: the ECU's ELF file is not known (--elf)")
    match message["type"]:
        case "scope_arm":
            try:
                wanted = _wanted(scope, message)
            except FluxtrueError as error:
                return _scope_answer(str(error))
            take(session, socket)
            return _scoped(scope, scope.arm, wanted, bool(message.get("repeat")))
        case "scope_trigger":
            take(session, socket)
            return _scoped(scope, scope.trigger)
        case "scope_end":
            take(session, socket)
            return _scoped(scope, scope.end)
        case "scope_kept":  # changes nothing in the inverter: any page may
            return _scoped(scope, scope.read_kept)
        case _:
            return _newest(scope)


async def _newest(scope: Oscilloscope) -> Answer:
    """The newest capture: any page may see it."""
    if scope.newest is None:
        raise FluxtrueError("no capture has been read")
    number, capture = scope.newest
    return {"type": "capture", "number": number, **await asyncio.to_thread(content, capture)}


def _replay(session: Session, message: dict[str, Any]) -> None:
    if session.replay is None:
        raise FluxtrueError("not a replay")
    if message["type"] == "seek":
        session.replay.seek(number(message.get("position_s"), "position_s"))
    else:
        session.replay.paused = bool(message.get("on"))


def _commission(session: Session, socket: web.WebSocketResponse, wizard: "Wizard",
                message: dict[str, Any]) -> None:  # fmt: skip
    """The wizard's buttons. Everything else but Stop and the reset of faults belongs to a motor that is known."""
    kind, step = message.get("type"), str(message.get("step"))
    if kind == "stop":
        _drive(session, socket, message)
        return
    if kind == "reset":
        take(session, socket)
        assert session.link is not None
        session.link.act("reset_faults")
        return
    if kind not in ("commission_do", "commission_accept", "commission_know"):
        raise FluxtrueError(NO_COMMANDS)
    take(session, socket)
    if kind == "commission_do":
        wizard.do(step, message.get("may_turn") is True)
    elif kind == "commission_accept":
        wizard.accept(step)
    elif wizard.measures_magnet:
        wizard.call(str(message.get("name")))
    else:
        psi_f_mVs = number(message.get("psi_f_mVs"), "psi_f")
        wizard.know(str(message.get("name")), psi_f_mVs, str(message.get("source")))


def obey(session: Session, socket: web.WebSocketResponse, message: dict[str, Any]) -> Awaitable[Answer] | None:
    """Carry out one message of a page. A slow action is returned, to be awaited for its answer."""
    match message.get("type"):
        case "drawn":
            drawn(session, socket, message)
        case _ if session.wizard is not None:
            _commission(session, socket, session.wizard, message)
        case "torque" | "reset" | "off" | "ready" | "drive" | "stop":
            _drive(session, socket, message)
        case "knob":
            _knob(session, socket, message)
        case "tune" | "tune_load" | "tune_restore":
            return _tune(session, socket, message)
        case "tune_list" | "freeze":
            return _read(session, message)
        case "scope_arm" | "scope_trigger" | "scope_end" | "scope_kept" | "capture":
            return _capture(session, socket, message)
        case "record":
            if session.link is None:
                raise FluxtrueError("a replay is not recorded")
            take(session, socket)
            return _record(session, bool(message.get("on")))
        case "seek" | "pause":
            _replay(session, message)
        case other:
            raise FluxtrueError(f"unknown message {other!r}")
    return None
