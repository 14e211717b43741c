# SPDX-License-Identifier: Apache-2.0
"""The web side: one page, one WebSocket per viewer, one of which may command.

Bound to the loopback address. Requests that name another host, and WebSockets that another page opens, are refused: a
site in the same browser must not move a motor.
"""

import asyncio
import contextlib
import importlib.resources
import itertools
import json
import math
from collections.abc import Awaitable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from aiohttp import WSCloseCode, WSMsgType, web

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.live.commander import Commander, Wish
from fluxtrue_tools.live.link import Link, Recorder
from fluxtrue_tools.live.pace import InStep
from fluxtrue_tools.live.samples import Samples
from fluxtrue_tools.live.stand import KNOBS, Stand
from fluxtrue_tools.live.tuning import Tuning

HOST: Final = "127.0.0.1"
BATCH_S: Final = 0.04  # 25 per second
SEND_S: Final = 1.0  # a page that does not accept a batch in this time does not get it
HEARTBEAT_S: Final = 5.0  # of a connection
SLOW_EVERY: Final = 5  # last values, with every fifth batch
PAGE: Final = Path(__file__).parent / "static"
REFUSED: Final = (FluxtrueError, ValueError, RecursionError, OSError)  # bad JSON and a full disk among them
POLICY: Final = ("default-src 'self'; img-src 'self' data:; style-src 'self' 'unsafe-inline'; "
                 "frame-ancestors 'none'")  # fmt: skip


@dataclass
class Session:
    """Everything behind the page."""

    title: str
    commander: Commander
    samples: Samples
    recorder: Recorder
    explanations: dict[str, dict[int, tuple[str, str]]]  # of fault bits and checks: name, sentence
    link: Link | None = None  # None in a replay, where nothing can be commanded
    tuning: Tuning | None = None
    stand: Stand | None = None
    in_step: InStep | None = None  # simulated time waits for the pages
    viewers: list[web.WebSocketResponse] = field(default_factory=list)
    drawn: dict[web.WebSocketResponse, int] = field(default_factory=dict)  # number of the last batch, page by page
    changed: asyncio.Event = field(default_factory=asyncio.Event)  # a page has connected, drawn or disconnected
    hand: web.WebSocketResponse | None = None
    last_file: str = ""

    def stopped(self) -> str:
        """Why the drive does not run although it was requested."""
        return (self.link.lost if self.link is not None else "") or self.commander.stopped

    def wall_s(self, seconds: float) -> float | None:
        """A time-out by the wall clock: none where simulated time waits for the pages."""
        return None if self.in_step is not None else seconds


SESSION: Final = web.AppKey("session", Session)


@web.middleware
async def same_origin(request: web.Request, handler: Any) -> web.StreamResponse:
    """Only this page, asked for by this machine's name."""
    port = request.url.port
    hosts = {f"{HOST}:{port}", f"localhost:{port}"}
    origin = request.headers.get("Origin")
    if request.host not in hosts:
        raise web.HTTPForbidden(text=f"host {request.host} is not this machine's own")
    if origin is not None and origin != f"http://{request.host}":
        raise web.HTTPForbidden(text=f"origin {origin} may not connect")
    if request.path == "/ws" and origin is None:
        raise web.HTTPForbidden(text="a WebSocket without an origin may not connect")
    response: web.StreamResponse = await handler(request)
    if not response.prepared:
        response.headers["Content-Security-Policy"] = POLICY
        response.headers["Cache-Control"] = "no-store"
    return response


async def _page(request: web.Request) -> web.FileResponse:
    return web.FileResponse(PAGE / "index.html")


def _hello(session: Session) -> dict[str, Any]:
    stand = {name: [knob.lo, knob.hi, knob.start] for name, knob in KNOBS.items()} if session.stand else {}
    return {"type": "hello", "title": session.title, "torque_max_Nm": session.commander.torque_max_Nm,
            "factors": session.samples.factors(), "replay": session.link is None,
            "tuning": session.tuning is not None, "stand": stand,
            "explanations": session.explanations}  # fmt: skip


def _number(value: Any, what: str) -> float:
    try:
        number = math.nan if isinstance(value, bool) or not isinstance(value, int | float) else float(value)
    except OverflowError:  # an integer of three hundred digits
        number = math.inf
    if not math.isfinite(number):
        raise FluxtrueError(f"{what}: not a number")
    return number


def _drive(session: Session, socket: web.WebSocketResponse, message: dict[str, Any]) -> None:
    """Buttons and slider."""
    link = session.link
    if link is None:
        raise FluxtrueError("a replay takes no commands")
    kind = message["type"]
    if session.hand is not None and session.hand is not socket and not session.hand.closed and kind != "off":
        raise FluxtrueError("another page has its hand on the slider")
    session.hand = socket
    if kind == "torque":
        torque = _number(message.get("torque_requested_Nm"), "torque_requested_Nm")
        link.act(lambda commander, now: commander.slide(torque, now))
    elif kind == "reset":
        link.act(lambda commander, now: commander.reset_faults(now))
    else:
        link.act(lambda commander, now: commander.ask(Wish(kind), now))


def _drawn(session: Session, socket: web.WebSocketResponse, message: dict[str, Any]) -> None:
    """A page has drawn a batch, which is also a sign of life."""
    session.drawn[socket] = int(_number(message.get("batch"), "batch"))
    session.changed.set()
    if message.get("visible") and session.hand is socket and session.link is not None:
        session.link.act(lambda commander, now: commander.hand(now))


async def _tune(session: Session, message: dict[str, Any]) -> dict[str, Any]:
    if session.tuning is None:
        raise FluxtrueError("no calibration values: the ECU's ELF file is not known (--elf)")
    run = asyncio.get_running_loop().run_in_executor
    if message["type"] == "tune_list":
        return {"type": "tune_list", "values": await run(session.tuning.thread, session.tuning.table)}
    name, value = str(message.get("name")), _number(message.get("value"), "value")
    held = await run(session.tuning.thread, session.tuning.write, name, value)
    return {"type": "tuned", "name": name, "value": held}


def _knob(session: Session, message: dict[str, Any]) -> None:
    name = str(message.get("name"))
    if session.stand is None or name not in KNOBS:
        raise FluxtrueError(f"no knob '{name}'")
    session.stand.turn(name, _number(message.get("value"), name))


async def _record(session: Session, message: dict[str, Any]) -> dict[str, Any]:
    if message.get("on"):
        session.recorder.start()
    else:
        path = await asyncio.to_thread(session.recorder.stop)
        session.last_file = str(path) if path else ""
    return {"type": "recording", "on": session.recorder.running, "file": session.last_file}


def _obey(session: Session, socket: web.WebSocketResponse, message: dict[str, Any]) -> Awaitable[dict[str, Any]] | None:
    """Carry out one message of a page. A slow action is returned, to be awaited for its answer."""
    match message.get("type"):
        case "drawn":
            _drawn(session, socket, message)
        case "torque" | "reset" | "off" | "ready" | "drive":
            _drive(session, socket, message)
        case "knob":
            _knob(session, message)
        case "tune_list" | "tune":
            return _tune(session, message)
        case "record":
            return _record(session, message)
        case other:
            raise FluxtrueError(f"unknown message {other!r}")
    return None


def _refusal(error: Exception) -> dict[str, Any]:
    return {"type": "refused", "text": str(error)}


async def _answer_later(socket: web.WebSocketResponse, answer: Awaitable[dict[str, Any]]) -> None:
    """Send the answer of a slow action, while the page keeps sending signs of life."""
    with contextlib.suppress(ConnectionError, RuntimeError):  # the page has disconnected meanwhile
        try:
            await socket.send_json(await answer)
        except REFUSED as error:
            await socket.send_json(_refusal(error))


async def _converse(session: Session, socket: web.WebSocketResponse, tasks: asyncio.TaskGroup) -> None:
    async for message in socket:
        if message.type is not WSMsgType.TEXT:
            continue
        try:
            asked = json.loads(message.data)
            if not isinstance(asked, dict):
                raise FluxtrueError("not an object")
            later = _obey(session, socket, asked)
        except REFUSED as error:
            await socket.send_json(_refusal(error))
            continue
        if later is not None:
            tasks.create_task(_answer_later(socket, later))


async def _viewer(request: web.Request) -> web.WebSocketResponse:
    session = request.app[SESSION]
    socket = web.WebSocketResponse(heartbeat=session.wall_s(HEARTBEAT_S), max_msg_size=4096)
    await socket.prepare(request)
    await socket.send_json(_hello(session))
    session.viewers.append(socket)
    session.changed.set()
    async with asyncio.TaskGroup() as tasks:
        try:
            await _converse(session, socket, tasks)
        finally:
            session.viewers.remove(socket)
            session.drawn.pop(socket, None)
            session.changed.set()
            if session.hand is socket:
                session.hand = None
                if session.link is not None:
                    session.link.act(lambda commander, _: commander.let_go())
    return socket


def _batch(session: Session, number: int) -> dict[str, Any]:
    batch: dict[str, Any] = {"type": "rows", "batch": number, "groups": session.samples.take()}
    if number % SLOW_EVERY == 0:
        batch["last"] = session.samples.last()
        batch["state"] = session.samples.state()
        batch["wish"] = session.commander.wish.value
        batch["target_Nm"] = session.commander.target_Nm
        batch["stopped"] = session.stopped()
    return batch


async def _send_batch(session: Session, number: int) -> list[web.WebSocketResponse]:
    """Send a batch to every page; the result is the set of pages that accepted it."""
    batch = _batch(session, number)
    if session.stand is not None and session.viewers:
        with contextlib.suppress(FluxtrueError, OSError):
            batch["truth_Nm"] = await asyncio.to_thread(session.stand.truth_Nm)
    text, taken = json.dumps(batch), []
    for viewer in list(session.viewers):
        with contextlib.suppress(ConnectionError, RuntimeError, TimeoutError):  # the other pages still read
            await asyncio.wait_for(viewer.send_str(text), session.wall_s(SEND_S))
            taken.append(viewer)
    return taken


async def _broadcast(session: Session) -> None:
    for number in itertools.count():
        await asyncio.sleep(BATCH_S)
        await _send_batch(session, number)


async def _broadcast_in_step(session: Session, in_step: InStep) -> None:
    """Send the batches in step with simulated time, which stops while no page is connected."""
    number = 0
    while await asyncio.to_thread(in_step.due):
        while not session.viewers:
            await _change(session)
        taken = await _send_batch(session, number)
        while any(viewer in session.viewers and session.drawn.get(viewer, -1) < number for viewer in taken):
            await _change(session)
        in_step.done()
        number += 1


async def _change(session: Session) -> None:
    await session.changed.wait()
    session.changed.clear()


async def _background(app: web.Application) -> Any:
    session = app[SESSION]
    in_step = session.in_step
    task = asyncio.create_task(_broadcast_in_step(session, in_step) if in_step else _broadcast(session))
    yield
    if in_step is not None:
        in_step.release()
    task.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await task


async def _farewell(app: web.Application) -> None:
    """Close the pages' connections: the server waits for them."""
    for viewer in list(app[SESSION].viewers):
        await viewer.close(code=WSCloseCode.GOING_AWAY)


def make_app(session: Session) -> web.Application:
    """The page's server, not yet listening."""
    app = web.Application(middlewares=[same_origin])
    app[SESSION] = session
    plotter = importlib.resources.files("uplot") / "static"
    app.router.add_get("/", _page)
    app.router.add_get("/ws", _viewer)
    app.router.add_static("/uplot", Path(str(plotter)))
    app.router.add_static("/static", PAGE)
    app.cleanup_ctx.append(_background)
    app.on_shutdown.append(_farewell)
    return app
