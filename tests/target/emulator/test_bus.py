# SPDX-License-Identifier: Apache-2.0
"""The image that would be flashed, on the bus: a part of the suite for bench and virtual ECU."""

import ctypes
import os
import re
import struct
import subprocess
import sys
from pathlib import Path

import pytest

from fluxtrue_tools.a2l.elf import read
from fluxtrue_tools.bench.build import have_arm_compiler
from fluxtrue_tools.bench.can_command import Frame
from fluxtrue_tools.bench.image import Stand
from fluxtrue_tools.emulate import build
from fluxtrue_tools.emulate.build import ROOT, Parts
from fluxtrue_tools.sim.library import Loop

SUITE_PART = ("test_boot.py", "test_states.py")
# The image takes its angle from the emulated encoder, whose index tests/target/s32k144/test_index.py withholds.
OTHERWISE = "test_enable_before_the_angle_is_absolute_is_refused"
XCP_COMMAND_ID, XCP_CONNECT = 0x650, 0xFF  # docs/howto/xcp.md: the values are measured while a tool is connected
SCOPE_PART = "torque_step or leaves_the_periods"


@pytest.fixture(scope="module")
def flashed() -> Parts:
    if not have_arm_compiler():
        pytest.skip("no cross compiler: there is no image to emulate")
    return build.prepare("hsm1", flashed=True)


def suite(flashed: Parts, folder: Path, *arguments: str) -> str:
    """Run files of the bench suite with the image; they pass, and their output is the result."""
    settings = ["-c", str(ROOT / "tests" / "pytest.ini"), "-p", "no:cacheprovider"]
    target = [f"--vecu={flashed.program}", f"--elf={flashed.image}", f"--report={folder}"]
    command = [sys.executable, "-m", "pytest", "-q", *settings, *target, *arguments]
    done = subprocess.run(
        command, cwd=ROOT, env=os.environ | flashed.environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-1000:]
    assert " passed" in done.stdout and "skipped" not in done.stdout, done.stdout[-300:]
    return done.stdout


def test_the_flashed_image_passes_the_bench_suite_over_can(flashed: Parts, tmp_path: Path) -> None:
    suite(flashed, tmp_path, *(str(ROOT / "tests" / "hil" / name) for name in SUITE_PART), "-k", f"not {OTHERWISE}")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert re.search(r"<th>unused stack</th><td>[1-9]\d+ bytes", page), "the unused stack was not measured"


def test_the_scope_of_the_flashed_image_captures_what_the_plant_does(flashed: Parts, tmp_path: Path) -> None:
    said = suite(flashed, tmp_path, str(ROOT / "tests" / "hil" / "test_scope.py"), "-k", SCOPE_PART)
    assert "2 passed" in said


@pytest.mark.parametrize("celsius", [-20.0, 60.0, 125.0])
def test_the_temperature_of_the_processor_s_die_is_measured(flashed: Parts, celsius: float) -> None:
    motor = flashed.emulated()
    with Loop(motor.library, motor.plant, motor.flux_map) as loop:
        stand = Stand(loop)
        core = stand.core
        loop.set("emulator.processor_C", celsius)
        connect = Frame(XCP_COMMAND_ID, False, 2, (ctypes.c_uint8 * 8)(XCP_CONNECT))
        loop.run(300)
        stand.library.can_frame_arrives(stand.handle, ctypes.byref(connect))
        loop.run(30)
        address = next(m.address for m in read(flashed.image).measurements if m.name == "processor_dC")
        (measured_dC,) = struct.unpack("<h", core.read(address, 2))
    # Resolution 0.78 K per count; the offset is rounded by 0.3 K.
    assert measured_dC / 10 == pytest.approx(celsius, abs=1.1)


def test_without_an_image_the_program_says_what_it_needs(flashed: Parts) -> None:
    done = subprocess.run([flashed.program, "--fast", "--port", "0", "--bench-port", "0"], capture_output=True,
                          text=True, check=False)  # fmt: skip
    assert done.returncode != 0
    assert "FLUXTRUE_IMAGE and FLUXTRUE_LAYOUT must name files" in done.stderr
