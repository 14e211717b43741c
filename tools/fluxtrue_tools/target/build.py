# SPDX-License-Identifier: Apache-2.0
"""Builds the image of a preset."""

from __future__ import annotations

import hashlib
import re
import shutil
import subprocess
from pathlib import Path

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim.build import build_lock

ROOT = Path(__file__).resolve().parents[3]
ARM_CC = "arm-none-eabi-gcc"
MOTORS = ROOT / "firmware" / "motors"
PRESETS = ("CMakePresets.json", "CMakeUserPresets.json")
CACHE, RULES = "CMakeCache.txt", "build.ninja"  # what cmake writes into the build folder
STAMP = "configured"  # in the build folder: the hash of what the last configuration depended on


def image(preset: str, folder: Path, motor: Path | None = None) -> Path:
    """Configure and build the preset in the folder (quick when nothing changed); its ELF file.

    motor   folder of the motor's data; none: those of the preset
    """
    options = [] if motor is None else [f"-DFLUXTRUE_MOTOR={motor}"]
    if shutil.which(ARM_CC) is None:
        raise FluxtrueError(f"{ARM_CC} not found: install gcc-arm-none-eabi or run tools/setup")
    with build_lock():
        configure(preset, folder, options, motor or MOTORS)
        _run(["cmake", "--build", str(folder), "-j", "2"], preset)
    return folder / "fluxtrue.elf"


def configure(preset: str, folder: Path, options: list[str], motors: Path) -> None:
    """Configure the folder, unless nothing has changed since: it takes seconds, and the build itself repeats it when a
    file of CMake has changed."""
    command = ["cmake", "--preset", preset, "-B", str(folder), *options]
    stamp, cache = folder / STAMP, folder / CACHE
    inputs = _inputs(command, cache, motors)  # before cmake reads them: what is edited meanwhile is not configured
    is_complete = stamp.is_file() and (folder / RULES).is_file()
    if not is_complete or stamp.read_text(encoding="utf-8") != _state(inputs, cache):
        _run(command, preset)
        stamp.write_text(_state(inputs, cache), encoding="utf-8")


def _inputs(command: list[str], cache: Path, motors: Path) -> str:
    """A hash of the command, the presets and the motors' data, with those of a motor that only the cache names."""
    files = [ROOT / name for name in PRESETS]
    kinds = ("*.toml", "*.csv")
    files += sorted(path for kind in kinds for path in motors.rglob(kind))
    motor = _cached_motor(cache)
    if motor is not None and not motor.is_relative_to(motors.resolve()):
        files += sorted(path for kind in kinds for path in motor.glob(kind))
    digest = hashlib.sha256("\0".join([*command, str(ROOT)]).encode())
    for path in files:
        content = path.read_bytes() if path.is_file() else b""
        digest.update(f"\0{path}\0{len(content)}\0".encode() + content)
    return digest.hexdigest()


def _state(inputs: str, cache: Path) -> str:
    """The hash of the inputs, and one of the options that the folder has now."""
    content = cache.read_bytes() if cache.is_file() else b""
    return f"{inputs} {hashlib.sha256(content).hexdigest()}"


def _cached_motor(cache: Path) -> Path | None:
    """The folder of the motor's data with which the build folder was configured."""
    content = cache.read_text(encoding="utf-8", errors="replace") if cache.is_file() else ""
    found = re.search(r"^FLUXTRUE_MOTOR:\w+=(.+)$", content, re.MULTILINE)
    return None if found is None else (ROOT / found[1]).resolve()


def _run(command: list[str], preset: str) -> None:
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise FluxtrueError(f"cannot build preset {preset}: {(done.stderr or done.stdout)[-600:]}")
