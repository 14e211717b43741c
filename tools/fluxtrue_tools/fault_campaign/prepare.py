# SPDX-License-Identifier: Apache-2.0
"""What a campaign runs: the libraries of its machines and, on the emulated processor, their images."""

from pathlib import Path

from fluxtrue_tools.emulate import build as emulation
from fluxtrue_tools.emulate.ecu_loop import is_possible
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.fault_campaign.fmea import Row
from fluxtrue_tools.fault_campaign.spec import Faults
from fluxtrue_tools.paths import Outputs
from fluxtrue_tools.sim.build import prepare, sources

ANGLE = "resolver"  # of the images: an absolute angle, and the default of the port
Names = tuple[tuple[str, str], ...]


def possible(campaign: Faults, rows: tuple[Row, ...], line: str | None, lines: str) -> tuple[Row, ...]:
    """The lines whose names exist where the campaign runs.

    line, lines   options of the command line, of which one is refused if nothing of it is possible
    """
    if not campaign.is_emulated:
        return rows
    found = tuple(row for row in rows if all(is_possible(step.name) for step in (*row.setup, *row.injection)))
    left_out = {row.id for row in rows if row not in found}
    if line in left_out:
        raise FluxtrueError(f"--line {line}: not possible on the emulated processor")
    if not found:
        raise FluxtrueError(f"--lines {lines}: not possible on the emulated processor")
    return found


def machines(campaign: Faults, file: Path, build_dir: Path | None, outputs: Outputs) -> tuple[Names, Names]:
    """Name and built folder of each machine; image and layout of its data of each on the emulated processor."""
    folders, images = [], []
    for index, machine in enumerate(campaign.machine):
        where = f"{file}: machine.{index}.motor"
        outputs.reads(*sources(machine.motor, file.parent, where))
        if campaign.is_emulated:
            parts = emulation.prepare(machine.motor, None, ANGLE, build_dir, file.parent, flashed=True, where=where)
            folder = parts.motor.folder
            outputs.reads(parts.image, parts.layout)
            images.append((str(parts.image), str(parts.layout)))
        else:
            folder = prepare(machine.motor, build_dir, file.parent, where)
        outputs.reads(folder.library, folder.data)
        folders.append((folder.name, str(folder.folder)))
    return tuple(folders), tuple(images)
