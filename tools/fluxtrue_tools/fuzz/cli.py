# SPDX-License-Identifier: Apache-2.0
"""fluxtrue fuzz: the campaign of random and mutated frames."""

import os
from pathlib import Path
from typing import Final

import click

from fluxtrue_tools import paths
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim.build import ROOT, build_lock, configure_build, run_logged

PROGRAM: Final = Path("tests", "fuzz", "fuzz_bus")


def _program(build_dir: Path | None) -> Path:
    """The fuzzing program: of the given build folder as it is, or of build/host, which is built first."""
    if build_dir is None and "FLUXTRUE_BUILD_DIR" in os.environ:
        build_dir = Path(os.environ["FLUXTRUE_BUILD_DIR"])
    if build_dir is None:
        build_dir = ROOT / "build" / "host"
        log = build_dir / "fuzz.log"
        build_dir.mkdir(parents=True, exist_ok=True)
        with build_lock():
            log.unlink(missing_ok=True)
            configure_build(build_dir, None, log)
            command = ["cmake", "--build", str(build_dir), "-j2", "--target", "fuzz_bus"]
            run_logged(command, log, "building the fuzzer")
    program = build_dir / PROGRAM
    if not program.is_file():
        raise FluxtrueError(f"{program} is missing: cmake --build {build_dir} --target fuzz_bus (with gcc)")
    return program


@click.command(cls=paths.Command)
@click.option("--frames", type=click.IntRange(100_000, 10**12), default=10_000_000, show_default=True,
              help="With fewer the drive may hardly ever run, which would prove little.")  # fmt: skip
@click.option("--seed", type=click.IntRange(0, 2**63 - 1), default=2, show_default=True, help="Of the random numbers.")
@click.option("--build-dir", type=paths.InputFolder(),
              help="Take the program from this build folder as it is.")  # fmt: skip
def fuzz(frames: int, seed: int, build_dir: Path | None) -> None:
    """Send random and mutated frames through the whole ECU, with sanitizers; a model checks each millisecond.

    Ends with exit code 1 at the first frame that was wrongly accepted or refused; the seed repeats it.
    """
    program = _program(build_dir)
    click.echo(f"{frames} frames, seed {seed}", err=True)
    os.execv(program, [str(program), str(frames), str(seed)])
