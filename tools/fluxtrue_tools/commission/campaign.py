# SPDX-License-Identifier: Apache-2.0
"""Many hidden machines: python -m fluxtrue_tools.commission.campaign [--machines 40] [--turning|--drive]. Refusals are
counted.

Without an option the sensor and the leads are connected as the firmware assumes, and resistance and map are measured;
with --turning pole pairs, leads, direction and offset of the sensor are random, and phases, spin and drag are. With
--drive all steps are run with an unknown connection, and each machine is driven with the folder that was written. With
--other-errors the machines have errors of other kinds, among them harmonics of the angle sensor. With --nameplate
unknown_48V the machines are small ones, of the kinds that SMALL names.
"""

import sys
from pathlib import Path

import click
import numpy as np

from fluxtrue_tools.cli import run_module
from fluxtrue_tools.commission import hidden, proof
from fluxtrue_tools.commission.cli import nameplate_of
from fluxtrue_tools.commission.score import balance_error, resistance_error, score, turned
from fluxtrue_tools.commission.steps import chosen, run
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim import motor as motors
from fluxtrue_tools.sim.build import ROOT

KINDS = ("hsm1", "saturated", "pmasynrm", "linear", "leaf")
SMALL = ("hub", "anaheim", "ebike")  # surface magnets for 48 V: psi_f of 4.0, 0.7 and 2.8 times L i_max
MOTORS = ROOT / "tests" / "motors"
FOLDER, SMALL_FOLDER = MOTORS / "unknown", MOTORS / "unknown_48V"
NAMEPLATES = {FOLDER.name: KINDS, SMALL_FOLDER.name: SMALL}
FIRST_SEED = 100
MOVEMENT = "movement, deg"  # of the rotor in a burst of the map's pulses, electrical, from where it stood
BOUNDS = {MOVEMENT: 1.0}  # of what the steps at standstill must keep beside proof.STEPS
MAP = ("map rms, % of psi_max", "R, %", "R beyond the sensors' gains, %", "gain balance, %",
       "largest current, % of i_max", MOVEMENT)  # fmt: skip
TURNING = ("wrong connections", "offset, deg", "psi_f, %", "inertia, %", "drag, %",
           "harmonics of the angle sensor, deg")  # fmt: skip


def draw(machines: int, nameplate: str = FOLDER.name) -> list[tuple[str, int]]:
    """Name and seed of so many hidden machines, of all kinds of a nameplate in turn."""
    kinds = NAMEPLATES[nameplate]
    return [(kinds[k % len(kinds)], FIRST_SEED + k) for k in range(machines)]


def _one(name: str, seed: int, folder: Path) -> tuple[float, ...] | None:
    """Errors in the order of MAP, share of i_max, movement in degrees; None after a refusal."""
    motor = motors.load(str(folder))
    known = nameplate_of(folder, motor)
    drive, truth = hidden.make(name, seed, motor, known.i_max_A)
    try:
        found = run(drive, chosen(("map",)), known, lambda _: None)
    except FluxtrueError as error:
        click.echo(f"{name:10} {seed}  refused: {error}")
        return None
    assert found.surface is not None and found.resistance is not None and found.balance is not None
    reached = score(found.surface.model, truth, known.i_max_A, truth.psi_f_Vs)
    r_error, r_left = resistance_error(found.resistance.r_ohm, truth)
    balance = balance_error(found.balance, truth)
    share, moved = found.largest_A / known.i_max_A, float(np.degrees(found.moved_rad))
    click.echo(f"{name:10} {seed}  map {100 * reached.map_rms:5.2f} % (worst {100 * reached.map_worst:5.2f} %)  "
               f"R {100 * r_error:+6.2f} % ({100 * r_left:+.2f} %)  balance {100 * balance:.3f} %  {share:.3f} i_max  "
               f"{moved:4.1f} deg")  # fmt: skip
    return reached.map_rms, abs(r_error), abs(r_left), balance, share, moved


def _turning(name: str, seed: int, folder: Path, other_errors: bool) -> tuple[float, ...] | None:
    """In the order of TURNING: 1 for a wrong connection; angles in degrees; errors; None after a refusal."""
    motor = motors.load(str(folder))
    known = nameplate_of(folder, motor)
    drive, truth = hidden.make(name, seed, motor, known.i_max_A, connected=False, other_errors=other_errors)
    try:
        found = run(drive, chosen(("drag",)), known, lambda _: None)
    except FluxtrueError as error:
        click.echo(f"{name:10} {seed}  refused: {error}")
        return None
    errors = turned(found, truth)
    word = "right" if errors.is_connected else "WRONG"
    click.echo(f"{name:10} {seed}  {word}  offset {errors.offset_deg:+6.3f} deg  psi_f {100 * errors.psi_f:+6.2f} %  "
               f"J {100 * errors.inertia:+6.2f} %  drag {100 * errors.drag:5.1f} %  "
               f"harmonics {errors.harmonics_deg:.4f} deg")  # fmt: skip
    return (float(not errors.is_connected), abs(errors.offset_deg), abs(errors.psi_f), abs(errors.inertia),
            errors.drag, errors.harmonics_deg)  # fmt: skip


@click.command()
@click.option("--machines", type=click.IntRange(min=1), default=40, show_default=True)
@click.option("--nameplate", type=click.Choice(list(NAMEPLATES)), default=FOLDER.name, show_default=True)
@click.option("--turning", is_flag=True, help="The steps that turn the shaft, with an unknown connection.")
@click.option("--drive", is_flag=True, help="All steps; then the folder is built and driven.")
@click.option("--other-errors", is_flag=True, help="With --turning or --drive: also errors of other kinds.")
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), help="With --drive: folder of the results.")
@click.option("--fresh", is_flag=True, help="With --drive: throw away the results that are there.")
def main(machines: int, nameplate: str, turning: bool, drive: bool, other_errors: bool, out: Path | None,
         fresh: bool) -> None:  # fmt: skip
    """Score hidden machines one after the other."""
    if (turning and drive) or (not drive and (out is not None or fresh)) or (other_errors and not (turning or drive)):
        raise click.UsageError("--out and --fresh belong to --drive, which --turning excludes; --other-errors belongs "
                               "to either")  # fmt: skip
    drawn, folder = draw(machines, nameplate), MOTORS / nameplate
    if drive:
        sys.exit(0 if _driven(folder, drawn, other_errors, out, fresh) else 1)
    _scored(folder, drawn, turning, other_errors)


def _driven(folder: Path, drawn: list[tuple[str, int]], other_errors: bool, out: Path | None, fresh: bool) -> bool:
    """Whether every bound is met."""
    job = proof.Job(folder, other_errors)
    results = ("other-errors" if other_errors else "driven") + ("" if folder == FOLDER else f"-{folder.name}")
    place = out or ROOT / "build" / "commission" / results
    table = proof.campaign(job, drawn, place, fresh, click.echo)
    text, met = proof.report(job, table, place)
    click.echo(text, nl=False)
    return met


def _scored(folder: Path, drawn: list[tuple[str, int]], turning: bool, other_errors: bool) -> None:
    machines = len(drawn)
    results = [_turning(name, seed, folder, other_errors) if turning else _one(name, seed, folder)
               for name, seed in drawn]  # fmt: skip
    done = np.array([result for result in results if result is not None])
    click.echo(f"{len(done)} of {machines} machines; {machines - len(done)} refused")
    names, scales = (TURNING, (1.0, 1.0, *(100.0,) * 3, 1.0)) if turning else (MAP, (*(100.0,) * 5, 1.0))
    if len(done):
        for name, values in zip(names, (done * scales).T, strict=True):
            kept = f"; bound {BOUNDS[name]:g}, kept by {(values <= BOUNDS[name]).sum()}" if name in BOUNDS else ""
            click.echo(f"{name}: median {np.median(values):.2f}, 95 % within {np.percentile(values, 95):.2f}, "
                       f"worst {values.max():.2f}{kept}")  # fmt: skip


if __name__ == "__main__":
    run_module(main)
