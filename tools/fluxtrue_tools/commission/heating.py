# SPDX-License-Identifier: Apache-2.0
"""How long the steps last and how much they heat the windings: python -m fluxtrue_tools.commission.heating.

The current is the simulated machine's own, in each PWM period, not that of the sensors. Its share is the root of the
mean square of the current vector's magnitude over the whole step, pauses included, divided by the largest current of
the nameplate: 1 heats the windings as that current does for as long. The time is that of the drive in software in the
loop; over CAN most of the time passes without current, while captures are read.
"""

import contextlib
from collections.abc import Iterator

import click
import numpy as np

from fluxtrue_tools.cli import run_module
from fluxtrue_tools.commission import hidden
from fluxtrue_tools.commission.campaign import FOLDER, KINDS, MOTORS, NAMEPLATES, draw
from fluxtrue_tools.commission.cli import nameplate_of
from fluxtrue_tools.commission.drive import Capture
from fluxtrue_tools.commission.metered import Metered
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.steps import ALL, Step, chosen, run
from fluxtrue_tools.sim import motor as motors
from fluxtrue_tools.sim.library import Loop
from fluxtrue_tools.sim.motor import Motor


def measure(name: str, seed: int, motor: Motor, known: Nameplate) -> dict[str, tuple[float, float]]:
    """Of each step of a machine with an unknown connection, and of all: seconds, share of the largest current."""
    _, flux_map, plant = hidden.draw(name, seed, motor, known.i_max_A, connected=False)
    drive = Metered(Loop(motor.library, plant, flux_map))
    of_steps: dict[str, tuple[float, float]] = {}

    def share(seconds: float, square_A2s: float) -> float:
        return float(np.sqrt(square_A2s / seconds)) / known.i_max_A

    @contextlib.contextmanager
    def metered(_: Capture, step: Step) -> Iterator[None]:
        seconds, square_A2s = drive.seconds, drive.square_A2s
        yield
        lasted = drive.seconds - seconds
        of_steps[step.name] = (lasted, share(lasted, drive.square_A2s - square_A2s))

    run(drive, chosen((ALL,)), known, lambda _: None, shown=metered)
    return of_steps | {ALL: (drive.seconds, share(drive.seconds, drive.square_A2s))}


@click.command()
@click.option("--machines", type=click.IntRange(min=1), default=len(KINDS), show_default=True)
@click.option("--nameplate", type=click.Choice(list(NAMEPLATES)), default=FOLDER.name, show_default=True)
def main(machines: int, nameplate: str) -> None:
    """Time and heating of hidden machines, and the worst of each step."""
    folder = MOTORS / nameplate
    motor = motors.load(str(folder))
    known = nameplate_of(folder, motor)
    found = []
    for name, seed in draw(machines, nameplate):
        found.append(measure(name, seed, motor, known))
        click.echo(f"{name:10} {seed}  " + "  ".join(f"{step} {s:.1f} s {share:.2f}"
                                                     for step, (s, share) in found[-1].items()))  # fmt: skip
    for step in found[0]:
        seconds, share = np.array([each[step] for each in found]).T
        click.echo(f"{step:10}  median {np.median(seconds):.1f} s, longest {seconds.max():.1f} s, at most "
                   f"{share.max():.2f} i_max rms")  # fmt: skip


if __name__ == "__main__":
    run_module(main)
