# SPDX-License-Identifier: Apache-2.0
"""fluxtrue vecu: serve the virtual ECU."""

import os
from pathlib import Path

import click

from fluxtrue_tools import paths
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim.build import prepare, sources

_PORT = click.IntRange(0, 65535)


@click.command(cls=paths.Command)
@click.option("--motor", default="hsm1", show_default=True, help="A shipped name or a folder with a motor.toml.")
@click.option("--realtime/--fast", default=True, show_default=True,
              help="Keep pace with the wall clock, or let time pass only when a bench client asks for it.")  # fmt: skip
@click.option("--port", type=_PORT, default=29536, show_default=True, help="socketcand, on 127.0.0.1; 0: any.")
@click.option("--bench-port", type=_PORT, default=29537, show_default=True, help="Bench channel; 0: any.")
@click.option("--bit-rate", type=click.IntRange(10000, 1000000), default=500000, show_default=True)
@click.option("--seed", type=click.IntRange(0, 2**53 - 1), default=1, show_default=True,
              help="Of the plant's random numbers.")  # fmt: skip
@click.option("--nvm", type=paths.StateFile(),
              help="Keep what is identified in this file; without it nothing survives a power cycle.")  # fmt: skip
@click.option("--build-dir", type=paths.InputFolder(),
              help="Take the program from this build folder as it is.")  # fmt: skip
def vecu(
    motor: str,
    realtime: bool,
    port: int,
    bench_port: int,
    bit_rate: int,
    seed: int,
    nvm: Path | None,
    build_dir: Path | None,
) -> None:
    """Serve application and plant in one process: CAN by the socketcand protocol, and a bench channel.

    Any python-can program reaches it with interface=socketcand, host=127.0.0.1, channel=can0.
    """
    files = paths.outputs()
    files.reads(*sources(motor, Path.cwd(), "--motor"))
    program = prepare(motor, build_dir, where="--motor").vecu
    files.reads(program)
    if not program.is_file():
        raise FluxtrueError(f"{program} is missing: build it first")
    options = ["--realtime" if realtime else "--fast", "--port", port, "--bench-port", bench_port,
               "--bit-rate", bit_rate, "--seed", seed]  # fmt: skip
    options += ["--nvm", nvm] if nvm is not None else []
    os.execv(program, [str(program), *map(str, options)])
