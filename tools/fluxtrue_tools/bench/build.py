# SPDX-License-Identifier: Apache-2.0
"""Compiles C files for the emulated Cortex-M4, and the same files for this computer."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from fluxtrue_tools.bench.machine import CODE, DATA
from fluxtrue_tools.errors import FluxtrueError

ROOT = Path(__file__).resolve().parents[3]
FIRMWARE = ROOT / "firmware"
FX_SOURCES = (Path(__file__).with_name("fx_kernels.c"), *sorted((FIRMWARE / "fx").glob("*.c")))
ARM_CC = "arm-none-eabi-gcc"
# As tools/cmake/arm-none-eabi.cmake compiles the firmware.
ARM_FLAGS = (
    "-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16", "-fno-schedule-insns", "-fno-caller-saves",
)  # fmt: skip
COMMON = ("-std=c11", "-O2", "-ffp-contract=off", f"-I{FIRMWARE}")
SMALL = (
    "-Os", "-fcaller-saves", "-fno-reorder-blocks", "-fno-partial-inlining", "-fno-schedule-insns2",
    "-fno-move-loop-invariants",
)  # fmt: skip
_LIST = (FIRMWARE / "fast_sources.txt").read_text(encoding="utf-8").splitlines()
FAST = frozenset(FIRMWARE / line for line in _LIST if not line.startswith("#"))


def have_arm_compiler() -> bool:
    """True if the cross compiler is on the PATH."""
    return shutil.which(ARM_CC) is not None


def _run(command: Sequence[str], output: Path) -> Path:
    output.parent.mkdir(parents=True, exist_ok=True)
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise FluxtrueError(f"cannot compile {output.name}: {done.stderr.strip()[:600]}")
    return output


def build_target(
    output: Path, sources: Sequence[Path], flags: Sequence[str] = (), also_small: Sequence[Path] = ()
) -> Path:
    """An ELF file without start-up code, for calls of single functions; optimised for speed or for size."""
    if not have_arm_compiler():
        raise FluxtrueError(f"{ARM_CC} not found: install gcc-arm-none-eabi or run tools/setup")
    link = (
        "-nostartfiles",
        "--specs=nano.specs",
        f"-Wl,-Ttext={CODE[0] + 0x1000:#x},-Tdata={DATA[0]:#x},-e,0",
    )
    objects = output.parent / f"{output.stem}.objects"
    objects.mkdir(parents=True, exist_ok=True)
    compiled = []
    for path in sources:
        compiled.append(objects / f"{path.stem}.o")
        small = SMALL if path in also_small or (FIRMWARE in path.parents and path not in FAST) else ()
        _run([ARM_CC, *ARM_FLAGS, *COMMON, *flags, *small, "-c", str(path), "-o", str(compiled[-1])], compiled[-1])
    return _run([ARM_CC, *ARM_FLAGS, *COMMON, *flags, *map(str, compiled), *link, "-o", str(output)], output)


def build_constants(output: Path, source: Path, address: int) -> Path:
    """An ELF file with nothing but the constants of one file, for the address."""
    place = ("-nostdlib", f"-Wl,--section-start=.rodata={address:#x},-e,0")
    return _run([ARM_CC, *ARM_FLAGS, *COMMON, f"-I{ROOT}", str(source), *place, "-o", str(output)], output)


def build_host(output: Path, sources: Sequence[Path], flags: Sequence[str] = ()) -> Path:
    """The same functions in a shared library."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        raise FluxtrueError("gcc not found: install gcc or run tools/setup")
    files = [str(path) for path in sources]
    command = [compiler, *COMMON, *flags, "-fPIC", "-shared", *files, "-lm", "-o", str(output)]
    return _run(command, output)
