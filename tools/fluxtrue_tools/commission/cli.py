# SPDX-License-Identifier: Apache-2.0
"""fluxtrue commission."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from fluxtrue_tools import paths

if TYPE_CHECKING:
    from fluxtrue_tools.commission.nameplate import Nameplate
    from fluxtrue_tools.sim.motor import Motor

WRITTEN = ("motor.toml", "flux_map.csv", "commission.txt", "commission.png")


def nameplate_of(folder: Path, motor: "Motor") -> "Nameplate":
    """What the folder says, with the values that follow from it."""
    from fluxtrue_tools.commission.nameplate import Nameplate
    from fluxtrue_tools.motor.config import load_config

    config = load_config(folder)
    machine, inverter = config.machine, config.inverter
    level_V = inverter.dead_time_s * inverter.pwm_hz * inverter.vdc_V + inverter.device_drop_V
    return Nameplate(machine.i_max_A, machine.speed_max_rpm, motor.r_ohm, motor.psi_f_Vs, machine.pole_pairs,
                     machine.inertia_kgm2, level_V)  # fmt: skip


@click.command("commission", cls=paths.Command)
@click.option("--motor", "nameplate", required=True, type=paths.InputFolder(), metavar="DIR",
              help="The folder that `fluxtrue motor start` has made.")  # fmt: skip
@click.option("--machine", default="hsm1", show_default=True, metavar="NAME",
              help="The simulated machine at the terminals: one of the project's, changed at random.")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Of these changes.")
@click.option("--step", "steps", default="map", show_default=True, metavar="STEP,...",
              help="offsets, phases, spin, drag, resistance, map, or all; a step brings what it needs.")  # fmt: skip
@click.option("--out", type=paths.OutputFolder(*WRITTEN), metavar="DIR", help="The motor's folder.")
@click.option("--dry-run", is_flag=True, help="Only say what will move and how much current will flow.")
def commission(nameplate: Path, machine: str, seed: int, steps: str, out: Path | None, dry_run: bool) -> None:
    """Measure an unknown motor with an uncoupled shaft, by software in the loop.

    The steps phases, spin and drag turn the shaft; the simulated machine's sensor and leads are then connected at
    random. The others keep it at standstill and need the connection to be right.
    """
    from fluxtrue_tools.commission import folder, plot, report
    from fluxtrue_tools.commission.hidden import folder_of, make
    from fluxtrue_tools.commission.steps import announcement, chosen, run
    from fluxtrue_tools.errors import FluxtrueError
    from fluxtrue_tools.sim import motor as motors

    wanted = chosen(tuple(steps.split(",")))
    folder_of(machine)
    if out is None and not dry_run:
        raise FluxtrueError("--out: missing, wanted: a folder for the result, or --dry-run")
    motor = motors.load(str(nameplate), where="--motor")
    known = nameplate_of(nameplate, motor)
    if out is None or dry_run:
        for step in wanted:
            click.echo(f"{step.name}: {announcement(step, known)}")
        return
    with paths.outputs() as outputs:
        staging = outputs.scratch(out)
        connected = all(step.name != "phases" for step in wanted)
        drive, _ = make(machine, seed, motor, known.i_max_A, connected)
        found = run(drive, wanted, known, click.echo)
        known = found.known(known)
        grid, _ = folder.write(found, known, nameplate, staging, out)
        text = report.text(found, known, grid)
        (staging / "commission.txt").write_text(text, encoding="utf-8")
        if found.resistance is not None:
            plot.write(found, known, grid, staging / "commission.png")
    click.echo(text, nl=False)
    click.echo(f"written to {out}")
