# SPDX-License-Identifier: Apache-2.0
"""Commissioning of the image that would be flashed, on the emulated processor, with a hidden machine.

python -m fluxtrue_tools.commission.emulated --machine saturated --seed 101 --step all

The image is that of a nameplate, as for any unknown motor, with an AS5047P. With the gains of another machine currents
may oscillate or not settle. A second of the bus takes about a second of a processor.
"""

import contextlib
import tempfile
from collections.abc import Iterator
from pathlib import Path

import click

from fluxtrue_tools.cli import run_module
from fluxtrue_tools.commission import hidden, on_the_bus
from fluxtrue_tools.commission.bus import OverTheBus
from fluxtrue_tools.commission.campaign import FOLDER
from fluxtrue_tools.commission.cli import nameplate_of
from fluxtrue_tools.commission.hidden import Truth
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.on_the_bus import Bench
from fluxtrue_tools.commission.over_can import measure
from fluxtrue_tools.commission.steps import chosen
from fluxtrue_tools.emulate import build
from fluxtrue_tools.emulate.build import Parts
from fluxtrue_tools.vecu.process import HOST, VirtualEcu

START_S, OFF_S = 0.2, 0.1


def parts() -> Parts:
    """The image and its emulation, built if needed."""
    return build.prepare(str(FOLDER), angle="as5047", flashed=True)


@contextlib.contextmanager
def connected(made: Parts, name: str, seed: int) -> Iterator[tuple[OverTheBus, Truth, Nameplate]]:
    """The image with this machine, whose sensor and leads are connected at random; its bus; the nameplate."""
    motor = made.motor
    known = nameplate_of(FOLDER, motor)
    truth, flux_map, plant = hidden.draw(name, seed, motor, known.i_max_A, connected=False)
    with contextlib.ExitStack() as stack:
        machine = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "machine.txt"
        machine.write_text(hidden.machine_text(plant, flux_map), encoding="utf-8")
        ecu = stack.enter_context(VirtualEcu(made.program, machine=machine, environment=made.environment))
        bench = Bench(on_the_bus.address_of(ecu), made.image, (HOST, ecu.bench_port))
        drive = stack.enter_context(on_the_bus.connected(bench, motor, known))
        drive.rest(START_S)
        # The model of the sensor is at zero until the first period: the rotor seems to jump.
        drive.switch_off()
        drive.reset_faults()
        drive.rest(OFF_S)
        yield drive, truth, known


@click.command()
@click.option("--machine", default="saturated", show_default=True, help="One of the project's, changed at random.")
@click.option("--seed", default=101, show_default=True, help="Of these changes.")
@click.option("--step", "steps", default="all", show_default=True, help="As of `tools/fluxtrue commission`.")
def main(machine: str, seed: int, steps: str) -> None:
    """Measure the machine and print the errors."""
    wanted = chosen(tuple(steps.split(",")))
    hidden.folder_of(machine)  # refuses an unknown one before anything is built
    with connected(parts(), machine, seed) as (drive, truth, known):
        measure(drive, truth, known, wanted)


if __name__ == "__main__":
    run_module(main)
