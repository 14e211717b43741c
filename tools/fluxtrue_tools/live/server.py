# SPDX-License-Identifier: Apache-2.0
"""The web side: one page, one WebSocket per viewer, one of them with its hand on the slider.

Bound to the loopback address. Requests that name another host, and WebSockets that another page opens, are refused: a
site in the same browser must not move a motor.
"""

import asyncio
import contextlib
import importlib.resources
import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from aiohttp import WSMsgType, web

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.live.commander import Commander, Wish
from fluxtrue_tools.live.link import Link, Recorder
from fluxtrue_tools.live.samples import Samples
from fluxtrue_tools.live.stand import KNOBS, Stand
from fluxtrue_tools.live.tuning import Tuning

HOST: Final = "127.0.0.1"
BATCH_S: Final = 0.04  # 25 per second
SLOW_EVERY: Final = 5  # last values, with every fifth batch
PAGE: Final = Path(__file__).parent / "static"
POLICY: Final = ("default-src 'self'; img-src 'self' data:; style-src 'self' 'unsafe-inline'; "
                 "frame-ancestors 'none'")  # fmt: skip


@dataclass
class Session:
    """Everything behind the page."""

    title: str
    commander: Commander
    samples: Samples
    recorder: Recorder
    faults: dict[str, list[str]]
    link: Link | None = None  # None: a replay, nothing can be commanded
    tuning: Tuning | None = None
    stand: Stand | None = None
    viewers: list[web.WebSocketResponse] = field(default_factory=list)
    hand: web.WebSocketResponse | None = None
    last_file: str = ""


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
            "replay": session.link is None, "tuning": session.tuning is not None, "stand": stand,
            "faults": session.faults}  # fmt: skip


def _number(value: Any, what: str) -> float:
    try:
        number = math.nan if isinstance(value, bool) or not isinstance(value, int | float) else float(value)
    except OverflowError:  # a whole number of three hundred digits
        number = math.inf
    if not math.isfinite(number):
        raise FluxtrueError(f"{what}: not a number")
    return number


def _drive(session: Session, socket: web.WebSocketResponse, message: dict[str, Any]) -> None:
    """Buttons, slider and signs of life."""
    link = session.link
    if link is None:
        raise FluxtrueError("a replay obeys nobody")
    kind = message["type"]
    if kind == "alive":
        if session.hand is socket:
            link.act(lambda commander, now: commander.hand(now))
        return
    if session.hand is not None and session.hand is not socket and not session.hand.closed and kind != "off":
        raise FluxtrueError("another page has its hand on the slider")
    session.hand = socket
    if kind == "torque":
        torque = _number(message.get("torque_Nm"), "torque_Nm")
        link.act(lambda commander, now: commander.slide(torque, now))
    elif kind == "reset":
        link.act(lambda commander, now: commander.reset_faults(now))
    else:
        link.act(lambda commander, now: commander.ask(Wish(kind), now))


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


async def _answer(session: Session, socket: web.WebSocketResponse, text: str) -> dict[str, Any] | None:
    """What one message of a page does; an answer for it alone."""
    message = json.loads(text)
    if not isinstance(message, dict):
        raise FluxtrueError("not an object")
    match message.get("type"):
        case "alive" | "torque" | "reset" | "off" | "ready" | "drive":
            _drive(session, socket, message)
        case "tune_list" | "tune":
            return await _tune(session, message)
        case "knob":
            _knob(session, message)
        case "record":
            return await _record(session, message)
        case other:
            raise FluxtrueError(f"unknown message {other!r}")
    return None


async def _viewer(request: web.Request) -> web.WebSocketResponse:
    session = request.app[SESSION]
    socket = web.WebSocketResponse(heartbeat=5.0, max_msg_size=4096)
    await socket.prepare(request)
    await socket.send_json(_hello(session))
    session.viewers.append(socket)
    try:
        async for message in socket:
            if message.type is not WSMsgType.TEXT:
                continue
            try:
                answer = await _answer(session, socket, message.data)
            except (FluxtrueError, ValueError, RecursionError, OSError) as error:  # bad JSON, a full disk
                answer = {"type": "refused", "text": str(error)}
            if answer is not None:
                await socket.send_json(answer)
    finally:
        session.viewers.remove(socket)
        if session.hand is socket:
            session.hand = None
            if session.link is not None:
                session.link.act(lambda commander, _: commander.let_go())
    return socket


def _batch(session: Session, number: int) -> dict[str, Any]:
    batch: dict[str, Any] = {"type": "rows", "groups": session.samples.take()}
    if number % SLOW_EVERY == 0:
        batch["last"] = session.samples.last()
        batch["state"] = session.samples.state()
        batch["wish"] = session.commander.wish.value
        batch["target_Nm"] = session.commander.target_Nm
    return batch


async def _broadcast(app: web.Application) -> None:
    session, number = app[SESSION], 0
    while True:
        await asyncio.sleep(BATCH_S)
        batch = _batch(session, number)
        if session.stand is not None and session.viewers:
            with contextlib.suppress(FluxtrueError, OSError):
                batch["truth_Nm"] = await asyncio.to_thread(session.stand.truth_Nm)
        number += 1
        text = json.dumps(batch)
        for viewer in list(session.viewers):
            with contextlib.suppress(ConnectionError, RuntimeError, TimeoutError):  # the others still read
                await asyncio.wait_for(viewer.send_str(text), 1.0)


async def _background(app: web.Application) -> Any:
    task = asyncio.create_task(_broadcast(app))
    yield
    task.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await task


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
    return app
