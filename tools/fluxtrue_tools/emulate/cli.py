# SPDX-License-Identifier: Apache-2.0
"""fluxtrue emulate: run a scenario on the emulated microcontroller."""

import os
from pathlib import Path

import click

from fluxtrue_tools import paths
from fluxtrue_tools.errors import FluxtrueError

DEFAULT = Path(__file__).resolve().parents[3] / "docs" / "howto" / "scenarios" / "warm-up.toml"
SENSORS = ["encoder", "resolver", "as5047", "sincos", "windings"]
RUN_ONLY = ("scenario", "out", "json_path", "plot")
SERVE_ONLY = ("port", "bench_port", "realtime")


@click.command(cls=paths.Command)
@click.option("--scenario", type=paths.InputFile(), default=DEFAULT, help="What to run (TOML); left out: warm-up.toml.")
@click.option("--elf", type=paths.InputFile(), help="The image; left out: it is built for the S32K144.")
@click.option("--angle", type=click.Choice(SENSORS), default="encoder", help="Which image to build.")
@click.option("--serve", is_flag=True, help="Instead: the flashed image on the bus, with a bench channel.")
@click.option("--port", type=click.IntRange(0, 65535), default=29536, show_default=True, help="--serve: socketcand.")
@click.option("--bench-port", type=click.IntRange(0, 65535), default=29537, show_default=True, help="--serve: bench.")
@click.option("--realtime/--fast", default=True, show_default=True, help="--serve: as of tools/fluxtrue vecu.")
@click.option("--out", type=paths.OutputFile(), help="Every recorded quantity over time, CSV.")
@click.option("--json", "json_path", type=paths.OutputFile(), help="Means over the window and errors, JSON.")
@click.option(
    "--plot", type=paths.OutputFile(*paths.PICTURES), help="Torque, currents, flux, resistance: PNG, SVG or PDF."
)
@click.option("--build-dir", type=paths.InputFolder(), help="Take the libraries from this build folder as they are.")
def emulate(
    scenario: Path,
    elf: Path | None,
    angle: str,
    serve: bool,
    port: int,
    bench_port: int,
    realtime: bool,
    out: Path | None,
    json_path: Path | None,
    plot: Path | None,
    build_dir: Path | None,
) -> int:
    """Run a scenario with the unmodified S32K144 image on an emulated processor, coupled at its registers."""
    if serve:
        paths.refuse_given("with --serve", *RUN_ONLY)
    else:
        paths.refuse_given("without --serve", *SERVE_ONLY)
    if elf is not None:
        paths.refuse_given("with --elf", "angle")
    from fluxtrue_tools.emulate import build
    from fluxtrue_tools.sim import scenario as scenarios
    from fluxtrue_tools.sim.build import sources
    from fluxtrue_tools.sim.cli import run_and_report

    if serve:
        parts = build.prepare("hsm1", elf, angle, build_dir, flashed=True)
        options = ["--realtime" if realtime else "--fast", "--port", str(port), "--bench-port", str(bench_port)]
        os.execve(parts.program, [str(parts.program), *options], os.environ | parts.environment)
    read = scenarios.read(scenario)
    if read.controller.kind != "firmware":
        raise FluxtrueError(f"{scenario}: controller.kind = {read.controller.kind!r}, allowed: 'firmware'")
    where = f"{scenario}: motor"
    paths.outputs().reads(*sources(read.motor, scenario.parent, where))
    parts = build.prepare(read.motor, elf, angle, build_dir, scenario.parent, where=where)
    return run_and_report(read, parts.emulated(), scenario, out, json_path, plot, f"emulated {parts.image.name}")
