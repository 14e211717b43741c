# SPDX-License-Identifier: Apache-2.0
"""Commissioning over CAN: a virtual ECU with a hidden machine, and the errors of what was found.

python -m fluxtrue_tools.commission.over_can --machine saturated --seed 12 --step map

If a step turns the shaft, sensor and leads are connected at random.
"""

import math
import time

import click

from fluxtrue_tools.cli import run_module
from fluxtrue_tools.commission import hidden, on_the_bus
from fluxtrue_tools.commission.bus import OverTheBus
from fluxtrue_tools.commission.campaign import FOLDER
from fluxtrue_tools.commission.cli import nameplate_of
from fluxtrue_tools.commission.dc_zero import DcZero
from fluxtrue_tools.commission.hidden import Truth
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.score import (
    Score,
    Turned,
    dc_zero_error,
    harmonics_deg,
    resistance_error,
    score,
    turned,
    waves_rad,
)
from fluxtrue_tools.commission.steps import Step, chosen, run
from fluxtrue_tools.sim import motor as motors


def score_text(found: Score) -> str:
    """The errors of the map."""
    return (f"map: {100.0 * found.map_rms:.2f} % rms, {100.0 * found.map_worst:.2f} % at worst, of the largest flux "
            f"linkage; its torque {100.0 * found.torque_rms:.2f} % rms of the largest")  # fmt: skip


def turned_text(found: Turned) -> str:
    """The errors of the steps that turn the shaft."""
    return (f"connection: {'right' if found.is_connected else 'WRONG'}; offset {found.offset_deg:+.3f} degrees; "
            f"psi_f beyond the gain of the dc voltage {100.0 * found.psi_f:+.2f} %; inertia "
            f"{100.0 * found.inertia:+.1f} %; drag {100.0 * found.drag:.1f} % rms")  # fmt: skip


def dc_zero_text(found: DcZero, truth: Truth) -> str:
    """The error of the dc-voltage sensor's offset, or why there is none: what is left then is no error of a step."""
    said = (f"not found: {found.unknown}" if found.unknown else
            f"{100.0 * dc_zero_error(found, truth):+.3f} % of the full scale")  # fmt: skip
    return f"offset of the dc voltage's sensor: {said}"


def measure(drive: OverTheBus, truth: Truth, known: Nameplate, steps: list[Step]) -> None:
    """Run the steps and print their errors."""
    begun = time.process_time()
    found = run(drive, steps, known, click.echo)
    click.echo(f"{drive.line.now_s:.0f} s of the bus, {time.process_time() - begun:.0f} s of the evaluation")
    click.echo(dc_zero_text(found.dc_zero, truth))
    if found.followed is not None:
        click.echo(f"connection: {found.followed.connection}, true: {truth.plant['pole_pairs']:.0f} pole pairs, "
                   f"reversed {truth.reversed}, {truth.offset_rad:.4f} rad")  # fmt: skip
    if found.spun is not None:
        true = ", ".join(f"{math.degrees(abs(wave)):.3f}" for wave in waves_rad(truth))
        click.echo(f"harmonics of the angle sensor: wrong by {harmonics_deg(found.spun, truth):.4f} degrees, true: "
                   f"{true} degrees")  # fmt: skip
    if found.drag is not None:
        click.echo(turned_text(turned(found, truth)))
    if found.resistance is not None:
        whole, beyond = resistance_error(found.resistance.r_ohm, truth)
        click.echo(f"resistance: {100.0 * whole:+.2f} %, beyond the sensors' gains {100.0 * beyond:+.2f} %")
    if found.surface is not None:
        psi_f_Vs = found.spun.psi_f_Vs if found.spun is not None else truth.psi_f_Vs
        click.echo(score_text(score(found.surface.model, truth, known.i_max_A, psi_f_Vs)))


@click.command()
@click.option("--machine", default="saturated", show_default=True, help="One of the project's, changed at random.")
@click.option("--seed", default=12, show_default=True, help="Of these changes.")
@click.option("--step", "steps", default="map", show_default=True, help="As of `tools/fluxtrue commission`.")
@click.option("--other-errors", is_flag=True, help="Also errors of other kinds, as harmonics of the angle sensor.")
def main(machine: str, seed: int, steps: str, other_errors: bool) -> None:
    """Measure the machine and print the errors."""
    wanted = chosen(tuple(steps.split(",")))
    hidden.folder_of(machine)  # refuses an unknown one before anything is built
    as_assumed = all(step.name != "phases" for step in wanted)
    motor = motors.load(str(FOLDER))
    known = nameplate_of(FOLDER, motor)
    truth, _, _ = hidden.draw(machine, seed, motor, known.i_max_A, as_assumed, other_errors)
    with (on_the_bus.hidden_machine(motor, machine, seed, known.i_max_A, as_assumed, other_errors) as bench,
          on_the_bus.connected(bench, motor, known) as drive):  # fmt: skip
        measure(drive, truth, known, wanted)


if __name__ == "__main__":
    run_module(main)
