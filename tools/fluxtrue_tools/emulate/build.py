# SPDX-License-Identifier: Apache-2.0
"""What the emulation needs: the motor's libraries, the layout of the target's data, and the image."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from elftools.elf.elffile import ELFFile

from fluxtrue_tools.emulate import library
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.foreign import reading
from fluxtrue_tools.sim import build as sim_build
from fluxtrue_tools.sim import motor as motors
from fluxtrue_tools.sim.motor import Motor
from fluxtrue_tools.target.build import image

ROOT: Final = sim_build.ROOT
MOTOR: Final = "hsm1"  # FLUXTRUE_MOTOR's default
# The image without the bus: scenarios write the requests into its memory themselves.
PRESETS: Final = {"encoder": "s32k144-direct", "resolver": "s32k144-resolver-direct",
                  "as5047": "s32k144-as5047-direct", "sincos": "s32k144-sincos-direct",
                  "windings": "s32k144-windings-direct"}  # fmt: skip
FLASHED: Final = {"encoder": "s32k144", "resolver": "s32k144-resolver", "as5047": "s32k144-as5047",
                  "sincos": "s32k144-sincos", "windings": "s32k144-windings"}  # fmt: skip


@dataclass(frozen=True)
class Parts:
    """A motor, and the paths of its emulation's files."""

    motor: Motor
    image: Path
    layout: Path

    @property
    def program(self) -> Path:
        """The stand of the virtual ECU around the emulated processor."""
        return self.motor.folder.folder / "fluxtrue_emulated_ecu"

    @property
    def environment(self) -> dict[str, str]:
        """The environment variables that name the program's files."""
        return {"FLUXTRUE_IMAGE": str(self.image), "FLUXTRUE_LAYOUT": str(self.layout)}

    def emulated(self, mode: int = library.FAST) -> Motor:
        """The motor with the image as its controller."""
        return library.emulated(self.motor, self.image, self.layout, mode)


def _check_who_commands(elf: Path, flashed: bool) -> None:
    """Refuse the flashed image without a bus, on which it would wait for ever, and the other image with one."""
    try:
        with reading(f"--elf {elf}", "an ELF file"), elf.open("rb") as file:
            symbols = ELFFile(file).get_section_by_name(".symtab")
            ours = symbols is not None and bool(symbols.get_symbol_by_name("ecu"))
            direct = ours and bool(symbols.get_symbol_by_name("commanded_directly"))
    except FluxtrueError:
        return  # the emulator's own loader, which comes next, says what it misses
    if ours and direct == flashed:
        raise FluxtrueError(
            f"--elf {elf}: takes no commands from the bus, allowed with --serve: the image that is flashed (s32k144)"
            if direct
            else f"--elf {elf}: takes its commands from the bus, allowed without --serve: an image s32k144-direct"
        )


def _image(preset: str, name: str, folder: Path) -> Path:
    """The image for a motor; that of another motor than the presets' in a build folder of its own."""
    build = ROOT / "build" / "emulated"
    if folder == sim_build.SHIPPED / MOTOR:
        return image(preset, build / preset)
    return image(preset, build / f"{preset}-{name}-{sim_build.tag(folder)}", folder)


def prepare(
    motor: str,
    elf: Path | None = None,
    angle: str = "encoder",
    build_dir: Path | None = None,
    base: Path | None = None,
    flashed: bool = False,
    where: str = "motor",
) -> Parts:
    """Build what is missing, without `elf` the image for this motor, too.

    `flashed` chooses the image that the bus commands.
    """
    built = motors.load(motor, build_dir, base, where)
    host = built.folder.folder.parents[1]
    shared = built.folder.folder / library.NAME
    if not shared.is_file() or "FLUXTRUE_BUILD_DIR" not in os.environ:
        log = host / "emulation.log"
        with sim_build.build_lock():
            name = built.folder.folder.name
            targets = [f"fluxtrue_emu_{name}", f"fluxtrue_emulated_ecu_{name}"]
            sim_build.run_logged(
                ["cmake", "--build", str(host), "-j2", "--target", *targets], log, "building the emulation"
            )
    if elf is None:
        preset = (FLASHED if flashed else PRESETS)[angle]
        elf = _image(preset, *sim_build.locate(motor, base or Path.cwd(), where))
    elif not elf.is_file():
        raise FluxtrueError(f"--elf {elf}: no such file")
    else:
        _check_who_commands(elf, flashed)
    return Parts(built, elf.resolve(), host / "emulator" / "layout.bin")
