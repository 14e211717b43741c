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
from collections.abc import Awaitable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from aiohttp import WSCloseCode, WSMsgType, web

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.live.control import give_up, obey
from fluxtrue_tools.live.downloads import capture_file
from fluxtrue_tools.live.oscilloscope import watch
from fluxtrue_tools.live.pace import InStep
from fluxtrue_tools.live.session import SESSION, Session
from fluxtrue_tools.live.stand import KNOBS
from fluxtrue_tools.live.wizard.files import PICTURES, folder_file, picture

if TYPE_CHECKING:
    from fluxtrue_tools.live.wizard.wizard import Wizard

HOST: Final = "127.0.0.1"
BATCH_S: Final = 0.04  # 25 per second
STALE_S: Final = 1.0  # a page that has received nothing for this time shows no value any more
SEND_S: Final = 1.0  # a page that does not accept a batch in this time does not get it
HEARTBEAT_S: Final = 5.0  # of a connection
SLOW_EVERY: Final = 5  # last values, with every fifth batch
MESSAGE_MAX: Final = 16384  # bytes of a message of a page
PAGE: Final = Path(__file__).parent / "static"
REFUSED: Final = (FluxtrueError, ValueError, RecursionError, OSError)  # bad JSON and a full disk among them
POLICY: Final = ("default-src 'self'; img-src 'self' data:; style-src 'self' 'unsafe-inline'; "
                 "frame-ancestors 'none'")  # fmt: skip


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


def _offer(wizard: "Wizard") -> dict[str, Any]:
    return {"steps": wizard.offer(), "pictures": PICTURES, "measures_magnet": wizard.measures_magnet,
            "most_rpm": wizard.most_rpm}  # fmt: skip


def _hello(session: Session) -> dict[str, Any]:
    knobs = session.link.status().knobs if session.link is not None else ()
    stand = {name: [KNOBS[name].lo, KNOBS[name].hi] for name, _ in knobs}
    offer = session.oscilloscope.offer() if session.oscilloscope is not None else None
    return {"type": "hello", "title": session.title, "torque_max_Nm": session.torque_max_Nm, "scope": offer,
            "factors": session.samples.factors(), "replay": session.link is None,
            "tuning": session.tuning is not None, "stand": stand, "words": session.words,
            "commission": _offer(session.wizard) if session.wizard else None,
            "stale_s": session.wall_s(STALE_S)}  # fmt: skip


def _refusal(error: Exception) -> dict[str, Any]:
    return {"type": "refused", "text": str(error)}


async def _answer_later(socket: web.WebSocketResponse, answer: Awaitable[dict[str, Any]]) -> None:
    """Send the answer of a slow action, while the page keeps reporting."""
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
            later = obey(session, socket, asked)
        except REFUSED as error:
            await socket.send_json(_refusal(error))
            continue
        if later is not None:
            tasks.create_task(_answer_later(socket, later))


async def _viewer(request: web.Request) -> web.WebSocketResponse:
    session = request.app[SESSION]
    socket = web.WebSocketResponse(heartbeat=session.wall_s(HEARTBEAT_S), max_msg_size=MESSAGE_MAX)
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
            give_up(session, socket)
    return socket


def _batch(session: Session, number: int) -> dict[str, Any]:
    run, groups = session.samples.take()
    batch: dict[str, Any] = {"type": "rows", "batch": number, "run": run, "groups": groups}
    status = session.status()
    if number % SLOW_EVERY == 0 or status != session.status_sent:
        session.status_sent = status
        batch["last"] = session.samples.last()
        batch["scope"] = asdict(session.oscilloscope.status) if session.oscilloscope is not None else None
        batch["status"] = {**asdict(status), "knobs": dict(status.knobs), "recording": session.recorder.running}
    if session.replay is not None:
        batch["replay"] = session.replay.state()
    if session.wizard is not None:
        batch["commission"] = session.wizard.shown()
    return batch


async def _send(session: Session, viewer: web.WebSocketResponse, text: str) -> None:
    """Send a batch to one page. A page that does not accept it is late or has disconnected."""
    try:
        with contextlib.suppress(ConnectionError, RuntimeError, TimeoutError):
            await asyncio.wait_for(viewer.send_str(text), session.wall_s(SEND_S))
    finally:
        del session.sending[viewer]


def _begin_batch(session: Session, number: int) -> dict[web.WebSocketResponse, asyncio.Task[None]]:
    """Begin to send a batch to every page that has accepted the one before: a page that does not read delays none."""
    rows, begun = json.dumps(_batch(session, number)).removesuffix("}"), {}
    for viewer in session.viewers:
        if viewer not in session.sending:
            text = f'{rows}, "control": "{session.control(viewer)}"}}'
            begun[viewer] = session.sending[viewer] = asyncio.create_task(_send(session, viewer, text))
    return begun


async def _send_batch(session: Session, number: int) -> list[web.WebSocketResponse]:
    """Send a batch to every page; the result is the pages to which it was sent."""
    begun = _begin_batch(session, number)
    await asyncio.gather(*begun.values())
    return list(begun)


async def _broadcast(session: Session) -> None:
    for number in itertools.count():
        await asyncio.sleep(BATCH_S)
        _begin_batch(session, number)


async def _broadcast_in_step(session: Session, in_step: InStep) -> None:
    """Send the batches in step with simulated time, which stops while no page is connected.

    A page whose connection has failed is waited for until its handler has ended: only the end of the handler ends the
    request to drive, and no simulated time may pass before.
    """
    number = 0
    while await asyncio.to_thread(in_step.due):
        while not session.viewers:
            await _change(session)
        pages = await _send_batch(session, number)
        while any(viewer in session.viewers and session.drawn.get(viewer, -1) < number for viewer in pages):
            await _change(session)
        in_step.done()
        number += 1
    while True:  # time has ended, for example with the virtual ECU; the pages are told so
        await asyncio.sleep(BATCH_S)
        await _send_batch(session, number)
        number += 1


async def _change(session: Session) -> None:
    await session.changed.wait()
    session.changed.clear()


async def _background(app: web.Application) -> Any:
    session = app[SESSION]
    in_step = session.in_step
    tasks = [asyncio.create_task(_broadcast_in_step(session, in_step) if in_step else _broadcast(session))]
    if session.oscilloscope is not None:
        tasks.append(asyncio.create_task(watch(session.oscilloscope, lambda: not session.status().state)))
    yield
    if in_step is not None:
        in_step.release()
    for sent in session.sending.values():
        sent.cancel()
    for task in tasks:
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
    app.router.add_get("/capture.{kind:csv|mf4}", capture_file)
    app.router.add_get("/commission.zip", folder_file)
    app.router.add_get(r"/commission/{step:[a-z]+}-{panel:\d}.png", picture)
    app.router.add_static("/uplot", Path(str(plotter)))
    app.router.add_static("/static", PAGE)
    app.cleanup_ctx.append(_background)
    app.on_shutdown.append(_farewell)
    return app
