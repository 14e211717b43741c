# SPDX-License-Identifier: Apache-2.0
"""`tools/fluxtrue scope`: a capture at PWM rate, or the freeze frame around a fault."""

import contextlib
from pathlib import Path
from typing import Any

import click

from fluxtrue_tools import kinds, paths
from fluxtrue_tools.a2l.elf import Description, read
from fluxtrue_tools.bus.address import BusAddress
from fluxtrue_tools.bus.options import can_bus
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.scope import export
from fluxtrue_tools.scope.scope import DIVISOR_MAX, LEVELS, TRIGGERS, Capture, Scope, Setup, make_setup
from fluxtrue_tools.scope.xcp import Line, SteppedLine, WallLine, XcpMaster
from fluxtrue_tools.sim.build import prepare
from fluxtrue_tools.vecu.channel import Channel
from fluxtrue_tools.vecu.process import HOST, VirtualEcu
from fluxtrue_tools.vecu.stepped import SteppedBus

FREEZE_FRAME = ("i_d_A", "i_q_A", "u_d_V", "u_q_V", "v_dc_V", "omega_rad_s", "theta_e_deg", "i_zero_A")
CAPTURE_ONLY = ("signals", "trigger", "on", "level", "before", "samples", "divisor", "seconds")


def _line(address: BusAddress, channel: Channel | None, stack: contextlib.ExitStack) -> Line:
    bus = address.connect()
    stack.callback(bus.shutdown)
    if channel is None:
        return WallLine(bus)
    stack.callback(channel.close)
    return SteppedLine(SteppedBus(bus, channel)) if channel.is_fast() else WallLine(bus)


def _list(description: Description) -> None:
    width = max(len(signal.name) for signal in description.signals)
    for signal in description.signals:
        click.echo(f"{signal.name:<{width}}  ±{signal.base.full:<8.5g} {signal.base.unit:<6} {signal.text}".rstrip())


def _capture(scope: Scope, setup: Setup, seconds: float) -> Capture:
    scope.take(setup)
    armed = scope.arm()
    try:
        if setup.trigger == "manual":
            scope.pass_periods(armed.wanted * setup.divisor)
            scope.trigger()
        scope.until_complete(seconds)
    except (FluxtrueError, KeyboardInterrupt):
        scope.give_up()
        raise
    return scope.read()


def _tell(capture: Capture) -> None:
    what = "freeze frame around a fault" if capture.is_freeze_frame else "capture"
    click.echo(f"{what} {capture.number}: {len(capture.time_s)} samples, {capture.trigger} before the trigger in "
               f"period {capture.trigger_period}")  # fmt: skip
    if capture.warning:
        click.echo(f"warning: {capture.warning}", err=True)
    width = max(len(name) for name in capture.columns)
    for name, column in capture.columns.items():
        click.echo(f"{name:<{width}}  {column.min():>11.5g}  {column.max():>11.5g}  {capture.units[name]}")


@click.command(cls=paths.Command)
@click.option("--motor", default="hsm1", show_default=True, help="A shipped name or a folder with a motor.toml.")
@can_bus
@click.option("--bench", type=kinds.Address(), metavar="HOST:PORT",
              help="Bench channel of the virtual ECU behind that interface, for its time with --fast.")  # fmt: skip
@click.option("--elf", type=paths.InputFile(), help="The ECU's firmware image; default: the virtual ECU's program.")
@click.option("--build-dir", type=paths.InputFolder(),
              help="Take the virtual ECU from this build folder as it is.")  # fmt: skip
@click.option("--list", "list_only", is_flag=True, help="List the signals with their range, then exit.")
@click.option("--freeze-frame", is_flag=True, help="Read the freeze frame that a fault has left; arm nothing.")
@click.option("--signal", "signals", type=kinds.Text(), multiple=True, metavar="NAME", help="To capture, up to eight.")
@click.option("--trigger", type=click.Choice(TRIGGERS), default="manual", show_default=True)
@click.option(
    "--on", type=kinds.Text(), metavar="NAME", help="Signal whose level triggers; default: the first captured."
)
@click.option("--level", type=kinds.Finite(), default=0.0, show_default=True, help="In the unit of that signal.")
@click.option(
    "--before",
    type=kinds.Finite(0.0, 1.0, max_open=True),
    default=0.25,
    show_default=True,
    help="Share of the samples before the trigger.",
)
@click.option("--samples", type=click.IntRange(min=1), help="Of each signal; default: as many as the memory holds.")
@click.option("--divisor", type=click.IntRange(1, DIVISOR_MAX), default=1, show_default=True,
              help="PWM periods from one sample to the next.")  # fmt: skip
@click.option("--wait", "seconds", type=kinds.Finite(min=0.0), default=10.0, show_default=True,
              help="For a complete capture, seconds.")  # fmt: skip
@click.option("--csv", type=paths.OutputFile(".csv"), help="Write the samples as text.")
@click.option("--mdf", type=paths.OutputFile(".mf4"), help="Write them as MDF4.")
@click.option("--plot", type=paths.OutputFile(*paths.PICTURES), help="Draw them: PNG, SVG or PDF.")
def scope(motor: str, can_interface: str | None, can_channel: str, can_option: tuple[tuple[str, Any], ...],
          bench: tuple[str, int] | None, elf: Path | None, build_dir: Path | None, list_only: bool,
          freeze_frame: bool, signals: tuple[str, ...],
          trigger: str, on: str | None, level: float, before: float, samples: int | None, divisor: int,
          seconds: float, csv: Path | None, mdf: Path | None, plot: Path | None) -> None:  # fmt: skip
    """Capture up to eight signals of the drive at PWM rate around a trigger, over XCP on CAN."""
    if can_interface is None:
        paths.refuse_given("without --can-interface", "can_channel", "can_option", "bench")
    if trigger not in LEVELS:
        paths.refuse_given(f"with --trigger {trigger}", "on", "level")
    if freeze_frame:
        paths.refuse_given("with --freeze-frame", *CAPTURE_ONLY)
    with contextlib.ExitStack() as stack:
        outputs = stack.enter_context(paths.outputs())
        program = prepare(motor, build_dir, where="--motor").vecu if elf is None or can_interface is None else elf
        description = read(elf or program)
        if list_only:
            return _list(description)
        known = {signal.name: signal for signal in description.signals}
        setup = None if freeze_frame else make_setup(
            known, signals or FREEZE_FRAME, trigger, on, level, before, samples, divisor)  # fmt: skip
        if can_interface is None:
            ecu = stack.enter_context(VirtualEcu(program))
            options = {"host": HOST, "port": ecu.can_port, "tcp_tune": True}
            address, channel = BusAddress("socketcand", "can0", options), Channel(HOST, ecu.bench_port)
        else:
            address = BusAddress(can_interface, can_channel, dict(can_option))
            channel = None if bench is None else Channel.greeted(*bench)
        connected = Scope(XcpMaster(_line(address, channel, stack)), description)
        capture = connected.read() if setup is None else _capture(connected, setup, seconds)
        if csv is not None:
            export.write_csv(capture, outputs.scratch(csv))
        if mdf is not None:
            export.write_mdf(capture, outputs.scratch(mdf))
        if plot is not None:
            export.draw(capture, outputs.scratch(plot), f"Scope, capture {capture.number}")
    return _tell(capture)
