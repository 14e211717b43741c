# SPDX-License-Identifier: Apache-2.0
"""Many hidden machines: python -m fluxtrue_tools.commission.campaign [--machines 40] [--turning|--drive]. Refusals are
counted.

Without an option the sensor and the leads are connected as the firmware assumes, and resistance and map are measured;
with --turning pole pairs, leads, direction and offset of the sensor are random, and all steps are run. With --drive
each machine is then also driven with the folder that was written. With --other-errors the machines have errors of
other kinds, among them harmonics of the angle sensor. With --nameplate unknown_48V the machines are small ones, of the
kinds that SMALL names.
"""

import math
import sys
from pathlib import Path

import click
import numpy as np

from fluxtrue_tools.cli import run_module
from fluxtrue_tools.commission import hidden, proof, turning
from fluxtrue_tools.commission.cli import nameplate_of
from fluxtrue_tools.commission.metered import Metered
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.score import resistance_error, score, turned
from fluxtrue_tools.commission.steps import ALL, Found, chosen, run
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.sim import motor as motors
from fluxtrue_tools.sim.build import ROOT
from fluxtrue_tools.sim.library import Loop

KINDS = ("hsm1", "saturated", "pmasynrm", "linear", "leaf")
SMALL = ("hub", "anaheim", "ebike")  # surface magnets for 48 V: psi_f of 4.0, 0.7 and 2.8 times L i_max
MOTORS = ROOT / "tests" / "motors"
FOLDER, SMALL_FOLDER = MOTORS / "unknown", MOTORS / "unknown_48V"
NAMEPLATES = {FOLDER.name: KINDS, SMALL_FOLDER.name: SMALL}
FIRST_SEED = 100
MOVEMENT = "movement, deg"  # of the machine's rotor in a burst of the map's pulses, electrical, from where it stood
SHOWN_MOVEMENT = "movement that the sensor shows, deg"  # in steps of up to 0.2 degrees
LARGEST, FASTEST = "largest current, % of i_max", "largest speed, % of the nameplate's"
OFFSETS, DC_ZERO, LEG, FIRST_L = ("offsets of the current sensors, % of the full scale",
                         "offset of the dc voltage's sensor, % of the full scale",
                         "leg voltage, % of the nameplate's error", "L of the first pulses, %")  # fmt: skip
BOUNDS = {MOVEMENT: 1.0, LARGEST: 100.0, FASTEST: 100.0 * turning.LIMIT_SHARE, "wrong connections": 0.0,
          "map rms, % of psi_max": 100.0 * proof.STEPS["map_rms"], "R, %": 100.0 * proof.STEPS["r_error"],
          "gain balance, %": 100.0 * proof.STEPS["balance"], OFFSETS: 100.0 * proof.STEPS["sensor_offset"],
          DC_ZERO: 100.0 * proof.STEPS["dc_zero"], LEG: 100.0 * proof.STEPS["leg_left"],
          FIRST_L: 100.0 * proof.STEPS["l_error"],
          "offset, deg": proof.STEPS["offset_deg"], "psi_f, %": 100.0 * proof.STEPS["psi_f_error"],
          "inertia, %": 100.0 * proof.STEPS["inertia_error"], "drag, %": 100.0 * proof.STEPS["drag_error"],
          "harmonics of the angle sensor, deg": proof.STEPS["harmonics_deg"]}  # fmt: skip
"""Twice as large for the machines with other errors, but for MOVEMENT, LARGEST and FASTEST."""
SAME = (MOVEMENT, LARGEST, FASTEST)


def draw(machines: int, nameplate: str = FOLDER.name) -> list[tuple[str, int]]:
    """Name and seed of so many hidden machines, of all kinds of a nameplate in turn."""
    kinds = NAMEPLATES[nameplate]
    return [(kinds[k % len(kinds)], FIRST_SEED + k) for k in range(machines)]


def _standing(found: Found, truth: hidden.Truth, known: Nameplate) -> dict[str, float]:
    """Errors of the steps at standstill."""
    assert found.surface is not None and found.resistance is not None
    reached = score(found.surface.model, truth, known.i_max_A, truth.psi_f_Vs)
    errors = proof.standing(found, truth, known)
    return {"map rms, % of psi_max": 100.0 * reached.map_rms, "R, %": 100.0 * errors["r_error"],
            "R beyond the sensors' gains, %": 100.0 * resistance_error(found.resistance.r_ohm, truth)[1],
            "gain balance, %": 100.0 * errors["balance"], OFFSETS: 100.0 * errors["sensor_offset"],
            DC_ZERO: 100.0 * errors["dc_zero"], LEG: 100.0 * errors["leg_left"], FIRST_L: 100.0 * errors["l_error"],
            LARGEST: 100.0 * found.largest_A / known.i_max_A,
            SHOWN_MOVEMENT: float(np.degrees(found.moved_rad))}  # fmt: skip


def _turning(found: Found, truth: hidden.Truth) -> dict[str, float]:
    """Errors of the steps that turn the shaft."""
    at = turned(found, truth)
    return {"wrong connections": float(not at.is_connected), "offset, deg": at.offset_deg, "psi_f, %": 100.0 * at.psi_f,
            "inertia, %": 100.0 * at.inertia, "drag, %": 100.0 * at.drag,
            "harmonics of the angle sensor, deg": at.harmonics_deg}  # fmt: skip


def one(name: str, seed: int, folder: Path, connected: bool, other_errors: bool) -> dict[str, float] | None:
    """Errors and what was kept of a machine by their names; None after a refusal."""
    motor = motors.load(str(folder))
    known = nameplate_of(folder, motor)
    truth, flux_map, plant = hidden.draw(name, seed, motor, known.i_max_A, connected, other_errors)
    drive = Metered(Loop(motor.library, plant, flux_map))
    try:
        steps = chosen(("map",) if connected else (ALL,))
        found = run(drive, steps, known, lambda _: None, shown=drive.in_step)
    except FluxtrueError as error:
        click.echo(f"{name:10} {seed}  refused: {error}")
        return None
    moves_rad = plant["pole_pairs"] * np.array(drive.of_steps["map"])
    values = {MOVEMENT: float(np.degrees(moves_rad.max()))} | _standing(found, truth, known)
    if not connected:
        values |= _turning(found, truth)
        values[FASTEST] = 100.0 * drive.fastest_rad_s / (known.speed_max_rpm * math.pi / 30.0)
    click.echo(f"{name:10} {seed}  {int(plant['pole_pairs'])} pairs  "
               + "  ".join(f"{what.split(',')[0]} {value:.4g}" for what, value in values.items()))  # fmt: skip
    return values


@click.command()
@click.option("--machines", type=click.IntRange(min=1), default=40, show_default=True)
@click.option("--nameplate", type=click.Choice(list(NAMEPLATES)), default=FOLDER.name, show_default=True)
@click.option("--turning", "turns", is_flag=True, help="All steps, with an unknown connection.")
@click.option("--drive", is_flag=True, help="The same; then the folder is built and driven.")
@click.option("--other-errors", is_flag=True, help="With --turning or --drive: also errors of other kinds.")
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), help="With --drive: folder of the results.")
@click.option("--fresh", is_flag=True, help="With --drive: throw away the results that are there.")
def main(machines: int, nameplate: str, turns: bool, drive: bool, other_errors: bool, out: Path | None,
         fresh: bool) -> None:  # fmt: skip
    """Score hidden machines one after the other."""
    if (turns and drive) or (not drive and (out is not None or fresh)) or (other_errors and not (turns or drive)):
        raise click.UsageError("--out and --fresh belong to --drive, which --turning excludes; --other-errors belongs "
                               "to either")  # fmt: skip
    drawn, folder = draw(machines, nameplate), MOTORS / nameplate
    if drive:
        sys.exit(0 if _driven(folder, drawn, other_errors, out, fresh) else 1)
    _scored(folder, drawn, turns, other_errors)


def _driven(folder: Path, drawn: list[tuple[str, int]], other_errors: bool, out: Path | None, fresh: bool) -> bool:
    """Whether every bound is met."""
    job = proof.Job(folder, other_errors)
    results = ("other-errors" if other_errors else "driven") + ("" if folder == FOLDER else f"-{folder.name}")
    place = out or ROOT / "build" / "commission" / results
    table = proof.campaign(job, drawn, place, fresh, click.echo)
    text, met = proof.report(job, table, place)
    click.echo(text, nl=False)
    return met


def summary(what: str, values: Array, factor: float) -> str:
    """A line of the end; how many machines keep their bound."""
    sizes = np.abs(values)
    said = f"{what}: median {np.median(sizes):.3g}, 95 % within {np.percentile(sizes, 95):.3g}, worst {sizes.max():.4g}"
    if what not in BOUNDS:
        return said
    bound = BOUNDS[what] * (1.0 if what in SAME else factor)
    return f"{said}; bound {bound:g}, kept by {(sizes <= bound).sum()}"


def _scored(folder: Path, drawn: list[tuple[str, int]], turns: bool, other_errors: bool) -> None:
    results = [one(name, seed, folder, not turns, other_errors) for name, seed in drawn]
    done = [result for result in results if result is not None]
    click.echo(f"{len(done)} of {len(drawn)} machines; {len(drawn) - len(done)} refused")
    factor = proof.OTHER_FACTOR if other_errors else 1.0
    for what in done[0] if done else ():
        click.echo(summary(what, np.array([result[what] for result in done]), factor))


if __name__ == "__main__":
    run_module(main)
