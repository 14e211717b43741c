# SPDX-License-Identifier: Apache-2.0
"""The written folder on the processor: python -m fluxtrue_tools.commission.driven_image [--machines 3].

Hidden machines are commissioned in software in the loop, in all steps and with an unknown connection. The image is
built for the folder that was written, and drives the machine on the emulated processor, first with the tables alone,
then with the torque correction. Leads and sensor are connected as the image assumes, but for the error of the offset
that was found.
"""

import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import pandas as pd

from fluxtrue_tools.commission import driven, folder, hidden, proof
from fluxtrue_tools.commission.campaign import FOLDER, draw
from fluxtrue_tools.commission.cli import nameplate_of
from fluxtrue_tools.commission.drive import SoftwareInTheLoop
from fluxtrue_tools.commission.steps import chosen, run
from fluxtrue_tools.commission.turning import TURN
from fluxtrue_tools.emulate import build
from fluxtrue_tools.sim import motor as motors
from fluxtrue_tools.sim.build import ROOT
from fluxtrue_tools.sim.library import Loop
from fluxtrue_tools.sim.motor import Motor

ANGLE = "resolver"  # absolute from the first period on
STRATA = (2, 1)  # windows in each quadrant at the lower and at the upper speeds
PLACE = ROOT / "build" / "commission" / "image"
RUNS = ((driven.TABLES, driven.ALONE, False), (driven.ROBUST, driven.CORRECTED, True))


@dataclass(frozen=True)
class OnTheProcessor(driven.Coupled):
    """A machine behind the emulated inverter."""

    emulated: Motor

    @property
    def forward(self) -> float:
        """The leads are those that the image assumes."""
        return 1.0

    def connected(self, firmware: driven.Built) -> Loop:
        """The image of the folder, whatever `firmware` has been compiled for the host."""
        left_rad = math.remainder(self.connection.offset_rad - self.truth.offset_rad, TURN)
        right = {"phases_swapped": 0.0, "angle_reversed": 0.0, "angle_offset_rad": left_rad}
        return Loop(self.emulated.library, self.truth.plant | right | driven.IMPOSED, self.flux_map)


def drive(name: str, seed: int, case: int, drive_s: float, strata: tuple[int, int], out: Path) -> pd.DataFrame:
    """A row for each window of both runs. The folder stays in `out`."""
    nameplate = motors.load(str(FOLDER))
    known = nameplate_of(FOLDER, nameplate)
    truth, flux_map, plant = hidden.draw(name, seed, nameplate, known.i_max_A, connected=False)
    found = run(SoftwareInTheLoop(Loop(nameplate.library, plant, flux_map)), chosen(("all",)), known, lambda _: None)
    assert found.spun is not None
    out.mkdir(parents=True, exist_ok=True)
    _, made = folder.write(found, found.known(known), FOLDER, out, out)
    plan = driven.plan_of(made, truth, case, drive_s, strata)
    emulated = build.prepare(str(out), angle=ANGLE).emulated()
    machine = OnTheProcessor(truth, flux_map, found.spun.connection, emulated)
    host = driven.built(made, out)
    head: dict[str, Any] = {"case": case, "machine": name, "seed": seed, "middle_rpm": plan.middle_rpm}
    return pd.DataFrame([head | {"controller": controller} | row for controller, values, warm_up in RUNS
                         for row in machine.rows(host, plan, plan.windows, values, warm_up)])  # fmt: skip


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
    main()
