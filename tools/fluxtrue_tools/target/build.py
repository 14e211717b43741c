# SPDX-License-Identifier: Apache-2.0
"""Builds the image of a preset."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim.build import build_lock

ROOT = Path(__file__).resolve().parents[3]
ARM_CC = "arm-none-eabi-gcc"


def image(preset: str, folder: Path, motor: Path | None = None) -> Path:
    """Configure and build the preset in the folder (quick when nothing changed); its ELF file.

    motor   folder of the motor's data; none: those of the preset
    """
    options = [] if motor is None else [f"-DFLUXTRUE_MOTOR={motor}"]
    if shutil.which(ARM_CC) is None:
        raise FluxtrueError(f"{ARM_CC} not found: install gcc-arm-none-eabi or run tools/setup")
    with build_lock():
        _run(["cmake", "--preset", preset, "-B", str(folder), *options], preset)
        _run(["cmake", "--build", str(folder), "-j", "2"], preset)
    return folder / "fluxtrue.elf"


def _run(command: list[str], preset: str) -> None:
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise FluxtrueError(f"cannot build preset {preset}: {(done.stderr or done.stdout)[-600:]}")
