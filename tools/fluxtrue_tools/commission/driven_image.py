# SPDX-License-Identifier: Apache-2.0
"""The written folder on the processor: python -m fluxtrue_tools.commission.driven_image [--machines 3].

Hidden machines are commissioned in software in the loop, in all steps and with an unknown connection. The image is
built for the folder that was written, and drives the machine on the emulated processor, first with the tables alone,
then with the torque correction. Leads and sensor are connected as the image assumes, but for the error of the offset
that was found.
"""

import math
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import click
import pandas as pd

from fluxtrue_tools.cli import run_module
from fluxtrue_tools.commission import driven, proof
from fluxtrue_tools.commission.campaign import FOLDER, draw
from fluxtrue_tools.commission.hidden import Truth
from fluxtrue_tools.commission.turning import TURN, Connection
from fluxtrue_tools.emulate import build
from fluxtrue_tools.motor.motor import Motor
from fluxtrue_tools.sim.build import ROOT
from fluxtrue_tools.sim.library import Loop
from fluxtrue_tools.sim.motor import Motor as Simulated

ANGLE = "resolver"  # absolute from the first period on
STRATA = (2, 1)  # windows in each quadrant at the lower and at the upper speeds
PLACE = ROOT / "build" / "commission" / "image"


@dataclass(frozen=True)
class Flashed:
    """A motor's folder with its image on the emulated processor."""

    motor: Motor
    emulated: Simulated

    def connected(self, machine: driven.Coupled) -> Loop:
        """Leads and sensor are those that the image assumes."""
        return Loop(self.emulated.library, machine.truth.plant | driven.IMPOSED, machine.flux_map)


def _put_right(truth: Truth, found: Connection) -> Truth:
    """The machine with leads and sensor as the report says; what is wrong with the offset that was found stays."""
    left_rad = math.remainder(found.offset_rad - truth.offset_rad, TURN)
    right = {"phases_swapped": 0.0, "angle_reversed": 0.0, "angle_offset_rad": left_rad}
    return replace(truth, plant=truth.plant | right)


def drive(name: str, seed: int, case: int, drive_s: float, strata: tuple[int, int], out: Path) -> pd.DataFrame:
    """A row for each window of both runs. The folder stays in `out`."""
    made = proof.commissioned(FOLDER, name, seed, False, out)
    assert made.found.spun is not None
    wired = made.found.spun.connection
    plan = driven.plan_of(made.motor, made.truth, case, drive_s, strata)
    image = Flashed(made.motor, build.prepare(str(out), angle=ANGLE).emulated())
    machine = driven.Coupled(_put_right(made.truth, wired), made.flux_map, wired)
    head: dict[str, Any] = {"case": case, "machine": name, "seed": seed}
    return pd.DataFrame([head | row for row in driven.fresh_rows(machine, image, plan)])


@click.command()
@click.option("--machines", type=click.IntRange(min=1), default=3, show_default=True)
@click.option(
    "--drive-s", type=click.FloatRange(min=0.0), default=proof.DRIVE_S, show_default=True, help="Of the warm-up."
)
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), default=PLACE, show_default=True,
              help="Folder of the written motors.")  # fmt: skip
def main(machines: int, drive_s: float, out: Path) -> None:
    """Commission and drive so many machines; the exit code tells whether the bounds are met."""
    tables = []
    for case, (name, seed) in enumerate(draw(machines)):
        tables.append(drive(name, seed, case, drive_s, STRATA, out / f"{name}-{seed}"))
        for controller, rows in tables[-1].groupby("controller"):
            error = rows["error_percent"]
            found = f"{proof.rms(error):.2f} / {proof.percentile(error, 95):.2f} %"
            click.echo(f"{name:10} {seed}  {controller:7} {found}  {len(rows)} windows, trips {proof.trips(rows)}")
    met = proof.of_drives(pd.concat(tables, ignore_index=True), 1.0)
    click.echo("\n".join(map(str, met)))
    sys.exit(0 if all(each.met for each in met) else 1)


if __name__ == "__main__":
    run_module(main)
