# SPDX-License-Identifier: Apache-2.0
"""`tools/fluxtrue live`: the page, before a virtual ECU, a bench or a recorded drive."""

import asyncio
import contextlib
import signal
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import cantools.database
import click
from aiohttp import web

from fluxtrue_tools.a2l.elf import read
from fluxtrue_tools.bus import DBC
from fluxtrue_tools.bus.address import BusAddress, parse_option
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.live.commander import Commander
from fluxtrue_tools.live.link import Link, Recorder
from fluxtrue_tools.live.replay import Replay, load
from fluxtrue_tools.live.samples import Samples
from fluxtrue_tools.live.server import HOST, Session, make_app
from fluxtrue_tools.live.stand import Stand
from fluxtrue_tools.live.tuning import Tuning
from fluxtrue_tools.motor.config import load_config
from fluxtrue_tools.sim.build import locate, prepare
from fluxtrue_tools.vecu.channel import Channel
from fluxtrue_tools.vecu.process import VirtualEcu

DRIVE_FAULTS: Final = 1  # FirstFault of bit 0
ECU_FAULTS: Final = 33


def _fault_names(database: cantools.database.Database) -> dict[str, list[str]]:
    """Name of every bit of the two fault words: FirstFault's value table counts them through."""
    choices = database.get_message_by_name("INV_Faults").get_signal_by_name("FirstFault").choices or {}
    words = {"DriveFaults": (DRIVE_FAULTS, 32), "EcuFaults": (ECU_FAULTS, 16)}
    return {word: [str(choices.get(first + bit, f"bit {bit}")).replace("_", " ") for bit in range(bits)]
            for word, (first, bits) in words.items()}  # fmt: skip


@contextlib.contextmanager
def _session(title: str, torque_max_Nm: float, record_dir: Path, address: BusAddress | None, frames: Any,
             elf: Path | None, stand: Stand | None) -> Iterator[Session]:  # fmt: skip
    database = cantools.database.load_file(DBC)
    samples, recorder = Samples(database), Recorder(record_dir, DBC)
    session = Session(title, Commander(torque_max_Nm), samples, recorder, _fault_names(database), stand=stand)
    with contextlib.ExitStack() as stack:
        if address is None:
            stack.callback(Replay(frames, [samples]).close)
        else:
            session.link = Link(address.connect(), database, session.commander, samples, recorder)
            stack.callback(session.link.close)
            if elf is not None:
                session.tuning = Tuning(address, read(elf))
                stack.callback(session.tuning.close)
        yield session


def _listen(port: int) -> socket.socket:
    listener = socket.socket()
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((HOST, port))
    except OSError as error:
        listener.close()
        raise FluxtrueError(f"--port {port}: {error.strerror}") from error
    return listener


def _serve(session: Session, port: int) -> None:
    listener = _listen(port)

    async def _run() -> None:
        runner = web.AppRunner(make_app(session), access_log=None)
        await runner.setup()
        await web.SockSite(runner, listener).start()
        click.echo(f"http://{HOST}:{listener.getsockname()[1]}/")
        stop = asyncio.Event()
        for number in (signal.SIGINT, signal.SIGTERM):  # the torque is ramped out, the virtual ECU ended
            asyncio.get_running_loop().add_signal_handler(number, stop.set)
        await stop.wait()
        await runner.cleanup()

    asyncio.run(_run())


@click.command()
@click.option("--motor", default="hsm1", show_default=True, help="A shipped name or a folder with a motor.toml.")
@click.option("--can-interface", help="python-can interface of a bench; without it a virtual ECU is started.")
@click.option("--can-channel", default="can0", show_default=True)
@click.option("--can-option", multiple=True, metavar="NAME=VALUE", help="Further argument of can.Bus.")
@click.option("--elf", type=click.Path(exists=True, dir_okay=False, path_type=Path),
              help="The bench's firmware image: its calibration values can then be tuned.")  # fmt: skip
@click.option("--replay", type=click.Path(path_type=Path), help="Show a recorded drive (MF4, BLF, ASC ...).")
@click.option("--port", type=click.IntRange(0, 65535), default=8137, show_default=True, help="Of the page; 0: any.")
@click.option("--record-dir", type=click.Path(file_okay=False, path_type=Path), default=Path("build/live"),
              show_default=True, help="Where recordings go.")  # fmt: skip
@click.option("--build-dir", type=click.Path(file_okay=False, path_type=Path),
              help="Take the virtual ECU from this build folder as it is.")  # fmt: skip
def live(motor: str, can_interface: str | None, can_channel: str, can_option: tuple[str, ...], elf: Path | None,
         replay: Path | None, port: int, record_dir: Path, build_dir: Path | None) -> None:  # fmt: skip
    """Serve a page that draws the drive live, commands torque, tunes and records. Loopback only."""
    if replay is not None and can_interface is not None:
        raise FluxtrueError("--replay and --can-interface exclude each other")
    torque_max = load_config(locate(motor, Path.cwd())[1]).machine.torque_max_Nm
    machine = prepare(motor, build_dir)
    with contextlib.ExitStack() as stack:
        stand, frames, address = None, None, None
        if replay is not None:
            frames, title = load(replay), f"{replay.name} (replay)"
        elif can_interface is not None:
            options = dict(map(parse_option, can_option))
            address, title = BusAddress(can_interface, can_channel, options), f"{can_interface} {can_channel}"
        else:
            ecu = stack.enter_context(VirtualEcu(machine.vecu, fast=False))
            options = {"host": HOST, "port": ecu.can_port, "tcp_tune": True}
            address, title = BusAddress("socketcand", "can0", options), f"{ecu.motor}, simulated"
            elf, stand = machine.vecu, Stand(Channel(HOST, ecu.bench_port))
            stack.callback(stand.close)
        session = stack.enter_context(
            _session(title, torque_max, record_dir, address, frames, elf, stand)
        )
        _serve(session, port)
