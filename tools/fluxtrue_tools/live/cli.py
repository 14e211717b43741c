# SPDX-License-Identifier: Apache-2.0
"""`tools/fluxtrue live`: the page, before a virtual ECU, a bench or a recorded drive."""

import asyncio
import contextlib
import signal
import socket
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
from aiohttp import web

from fluxtrue_tools import kinds, paths
from fluxtrue_tools.a2l.elf import Description, read
from fluxtrue_tools.bus.address import BusAddress
from fluxtrue_tools.bus.interface import Interface, read_interface
from fluxtrue_tools.bus.options import can_bus
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.live.bus_process import BusProcess, Setup
from fluxtrue_tools.live.oscilloscope import Oscilloscope
from fluxtrue_tools.live.pace import InStep
from fluxtrue_tools.live.recorder import Recorder
from fluxtrue_tools.live.replay import Drive, Replay, load
from fluxtrue_tools.live.samples import Samples
from fluxtrue_tools.live.server import HOST, make_app
from fluxtrue_tools.live.session import Session
from fluxtrue_tools.live.tuning import Tuning
from fluxtrue_tools.live.words import words
from fluxtrue_tools.live.xcp import BENCH_ANSWER_S, SIMULATED_ANSWER_S, Xcp
from fluxtrue_tools.motor.config import load_config
from fluxtrue_tools.sim.build import locate, prepare
from fluxtrue_tools.vecu.channel import Channel
from fluxtrue_tools.vecu.process import VirtualEcu


@dataclass
class Source:
    """What the page shows: a bench, a virtual ECU with its bench channel, or a recorded drive."""

    title: str
    interface: Interface
    address: BusAddress | None = None
    channel: Channel | None = None
    recording: Drive | None = None
    firmware: Description | None = None
    in_step: bool = False

    @property
    def is_stepped(self) -> bool:
        """Whether time passes only when it is asked to."""
        return self.channel is not None and self.channel.is_fast()


def _connect(source: Source, torque_max_Nm: float, session: Session, stack: contextlib.ExitStack) -> None:
    """The process that commands, and the calibration of whatever can be commanded."""
    assert source.address is not None
    is_stepped, interface = source.is_stepped, source.interface
    session.in_step = InStep() if source.in_step else None
    bench = source.channel.address if source.channel is not None else None
    setup = Setup(source.address, interface.name, interface.text, torque_max_Nm, bench, is_stepped, source.in_step)
    session.link = link = BusProcess(setup, [session.samples, session.recorder], session.in_step)
    stack.callback(link.close)
    if source.firmware is not None:
        answer_s = SIMULATED_ANSWER_S if is_stepped else BENCH_ANSWER_S
        held = link.standing_still if is_stepped else contextlib.nullcontext
        xcp = Xcp(source.address, answer_s, held)
        session.tuning = Tuning(xcp, source.firmware)
        session.oscilloscope = Oscilloscope(xcp, source.firmware) if source.firmware.signals else None
        stack.callback(session.tuning.close)


@contextlib.contextmanager
def _session(source: Source, torque_max_Nm: float, record_dir: Path) -> Iterator[Session]:
    samples, recorder = Samples(source.interface.database), Recorder(record_dir, source.interface)
    session = Session(source.title, torque_max_Nm, samples, recorder, words())
    with contextlib.ExitStack() as stack:
        if source.recording is not None:
            session.replay = Replay(source.recording, samples)
            stack.callback(session.replay.close)
        else:
            _connect(source, torque_max_Nm, session, stack)
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
        stop = asyncio.Event()
        for number in (signal.SIGINT, signal.SIGTERM):  # the torque is ramped out, the virtual ECU ended
            asyncio.get_running_loop().add_signal_handler(number, stop.set)
        click.echo(f"http://{HOST}:{listener.getsockname()[1]}/")  # it can be ended from here on
        await stop.wait()
        await runner.cleanup()

    asyncio.run(_run())


def _refuse_without_effect(commission: bool, can_interface: str | None, replay: Path | None) -> None:
    """Options that the rest of the command line leaves without effect."""
    if replay is not None and can_interface is not None:
        raise FluxtrueError("--replay and --can-interface exclude each other")
    if replay is not None:
        paths.refuse_given("with --replay", "elf", "record_dir", "commission", "turning", "machine", "seed")
    if can_interface is None:
        paths.refuse_given("without --can-interface", "elf", "can_channel", "can_option", "bench")
    if not commission:
        paths.refuse_given("without --commission", "turning", "machine", "seed")
        return
    paths.refuse_given("with --commission", "in_step", "record_dir")
    if can_interface is not None:
        paths.refuse_given("with --can-interface", "machine", "seed")


def _commission(motor: str, machine: str, seed: int, turning: bool, address: BusAddress | None,
                bench: tuple[str, int] | None, elf: Path | None, port: int, record_dir: Path,
                build_dir: Path | None) -> None:  # fmt: skip
    """The wizard for an unknown motor."""
    from fluxtrue_tools.commission.hidden import folder_of  # scipy: only when it is needed
    from fluxtrue_tools.live.wizard import start
    from fluxtrue_tools.sim import motor as motors

    if elf is not None:
        read(elf)  # a file that is given is read before anything is built or started
    folder_of(machine)
    nameplate = locate(motor, Path.cwd(), "--motor")[1]
    built = motors.load(motor, build_dir, where="--motor")
    terminals = start.Terminals(machine, seed, address, bench, elf, turning)
    with start.session(nameplate, built, terminals, record_dir) as session:
        _serve(session, port)


@click.command(cls=paths.Command)
@click.option("--motor", default="hsm1", show_default=True, help="A shipped name or a folder with a motor.toml.")
@can_bus
@click.option(
    "--bench",
    type=kinds.Address(),
    metavar="HOST:PORT",
    help="Bench channel of the virtual ECU behind that interface: its plant, and with --fast its time.",
)
@click.option("--in-step", is_flag=True, help="Simulated time waits until the pages have drawn it, for tests.")
@click.option("--elf", type=paths.InputFile(),
              help="The bench's firmware image: its calibration values can then be tuned.")  # fmt: skip
@click.option("--commission", is_flag=True,
              help="Measure an unknown motor, step by step; --motor is the folder of its nameplate.")  # fmt: skip
@click.option("--turning", is_flag=True,
              help="With --commission: also the steps that turn the shaft (connection, magnet, drag).")  # fmt: skip
@click.option("--machine", default="hsm1", show_default=True, metavar="NAME",
              help="With --commission: the simulated machine, one of the project's, changed at random.")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Of these changes.")
@click.option("--replay", type=paths.InputFile(), help="Show a recorded drive (MF4, BLF, ASC ...).")
@click.option("--port", type=click.IntRange(0, 65535), default=8137, show_default=True, help="Of the page; 0: any.")
@click.option("--record-dir", type=paths.BuildFolder(), default=Path("build/live"),
              show_default=True, help="Where recordings go.")  # fmt: skip
@click.option("--build-dir", type=paths.InputFolder(),
              help="Take the virtual ECU from this build folder as it is.")  # fmt: skip
def live(motor: str, can_interface: str | None, can_channel: str, can_option: tuple[tuple[str, Any], ...],
         bench: tuple[str, int] | None, in_step: bool, elf: Path | None, commission: bool, turning: bool, machine: str,
         seed: int, replay: Path | None, port: int, record_dir: Path, build_dir: Path | None) -> None:  # fmt: skip
    """Serve a page that draws the drive live, commands torque, tunes and records. Loopback only."""
    _refuse_without_effect(commission, can_interface, replay)
    if commission:
        address = None if can_interface is None else BusAddress(can_interface, can_channel, dict(can_option))
        _commission(motor, machine, seed, turning, address, bench, elf, port, record_dir, build_dir)
        return
    # Files that are given are read before anything is built or started.
    recording = None if replay is None else load(replay)
    firmware = None if elf is None else read(elf)
    torque_max = load_config(locate(motor, Path.cwd(), "--motor")[1]).machine.torque_max_Nm
    built = prepare(motor, build_dir, where="--motor")
    interface = read_interface(built.dbc)
    with contextlib.ExitStack() as stack:
        if replay is not None:
            source = Source(f"{replay.name} (replay)", recording.interface, recording=recording)
        elif can_interface is not None:
            address = BusAddress(can_interface, can_channel, dict(can_option))
            channel = None if bench is None else Channel.greeted(*bench)
            source = Source(f"{can_interface} {can_channel}", interface, address, channel, firmware=firmware)
        else:
            ecu = stack.enter_context(VirtualEcu(built.vecu))
            options = {"host": HOST, "port": ecu.can_port, "tcp_tune": True}
            address, channel = BusAddress("socketcand", "can0", options), Channel(HOST, ecu.bench_port)
            source = Source(f"{ecu.motor}, simulated", interface, address, channel, firmware=read(built.vecu))
        source.in_step = in_step
        if in_step and not source.is_stepped:
            raise FluxtrueError("--in-step: allowed before a virtual ECU with --fast only")
        _serve(stack.enter_context(_session(source, torque_max, record_dir)), port)
