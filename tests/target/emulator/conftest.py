# SPDX-License-Identifier: Apache-2.0
"""The emulated inverter, built once for all tests; without the cross compiler the tests are skipped."""

import ctypes
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from fluxtrue_tools.bench.build import ARM_CC, ARM_FLAGS, have_arm_compiler
from fluxtrue_tools.emulate import build
from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.sim import library as lib
from fluxtrue_tools.sim.library import Loop

LINK = ("-nostartfiles", "-nostdlib", "-Wl,-e,0,-Ttext=0x410", "-Wl,--section-start=.vectors=0")
Program = Callable[..., Path]


@pytest.fixture(scope="session")
def parts() -> Parts:
    if not have_arm_compiler():
        pytest.skip("no cross compiler: there is no image to emulate")
    return build.prepare("hsm1")


@pytest.fixture(scope="session")
def resolver_parts() -> Parts:
    if not have_arm_compiler():
        pytest.skip("no cross compiler: there is no image to emulate")
    return build.prepare("hsm1", angle="resolver")


@pytest.fixture
def drive(parts: Parts) -> Iterator[Loop]:
    """A drive at 3000 rpm, not enabled yet."""
    motor = parts.emulated()
    plant = motor.plant | {"imposed_speed": 1.0, "speed_rad_s": 314.16, "vdc_V": 350.0, "current_noise_A_rms": 0.5}
    with Loop(motor.library, plant, motor.flux_map) as loop:
        yield loop


@pytest.fixture(scope="session")
def here() -> Path:
    return Path(__file__).parent


@pytest.fixture(scope="session")
def library(parts: Parts) -> ctypes.CDLL:
    return lib.load(parts.motor.folder.folder / "libfluxtrue_emu.so")


@pytest.fixture(scope="session")
def program(here: Path, tmp_path_factory: pytest.TempPathFactory, parts: Parts) -> Program:
    """A function that compiles programs/<name>.c with additional flags, and perhaps another source file, its data at
    these addresses; returns the ELF file."""
    folder = tmp_path_factory.mktemp("programs")

    def compiled(
        name: str, *flags: str, data: int = 0x1FFF_8800, bss: int = 0x1FFF_8000, also: Path | None = None
    ) -> Path:
        sources = [here / "programs" / f"{name}.c", *([also] if also else [])]
        elf = folder / f"{'-'.join([source.stem for source in sources])}{''.join(flags).replace('/', '-')}.elf"
        options = ("-std=gnu11", "-O2", "-Wall", "-Werror", *flags)
        places = f"-Wl,-Tbss={bss:#x},-Tdata={data:#x}"
        command = [ARM_CC, *ARM_FLAGS, *options, *map(str, sources), *LINK, places, "-o", str(elf)]
        subprocess.run(command, check=True, capture_output=True)
        return elf

    return compiled
