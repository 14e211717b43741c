# SPDX-License-Identifier: Apache-2.0
"""fluxtrue commission."""

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fluxtrue_tools import kinds, paths
from fluxtrue_tools.bus.options import can_bus_or

if TYPE_CHECKING:
    from fluxtrue_tools.commission.drive import Capture
    from fluxtrue_tools.commission.nameplate import Nameplate
    from fluxtrue_tools.commission.steps import Step
    from fluxtrue_tools.commission.work import Work
    from fluxtrue_tools.sim.motor import Motor

WRITTEN = ("motor.toml", "flux_map.csv", "commission.txt", "commission.png")


def nameplate_of(folder: Path, motor: "Motor") -> "Nameplate":
    """What the folder says, with the values that follow from it."""
    from fluxtrue_tools.commission.nameplate import Nameplate
    from fluxtrue_tools.motor.config import load_config
    from fluxtrue_tools.motor.derived import knee_A

    config = load_config(folder)
    machine, inverter = config.machine, config.inverter
    level_V = inverter.dead_time_s * inverter.pwm_hz * inverter.vdc_V + inverter.device_drop_V
    return Nameplate(machine.i_max_A, machine.speed_max_rpm, motor.r_ohm, motor.psi_f_Vs, machine.pole_pairs,
                     machine.inertia_kgm2, level_V, knee_A(config), v_dc_full_scale_V=config.v_dc_full_scale_V,
                     v_dc_offset_V=inverter.v_dc_offset_V, v_dc_offset_max_V=config.v_dc_offset_max_V,
                     adc_bits=inverter.adc_bits)  # fmt: skip


@dataclass(frozen=True)
class Target:
    """What is measured: by software in the loop, on a virtual ECU of its own, or behind a CAN interface."""

    machine: str
    seed: int
    virtual_ecu: bool
    interface: str | None
    channel: str
    options: dict[str, Any]
    bench: tuple[str, int] | None
    elf: Path | None

    def check(self) -> None:
        """Refuse options that this target does not have."""
        if self.interface is None:
            paths.refuse_given("without --can-interface", "can_channel", "can_option", "bench", "elf", "yes")
        else:
            paths.refuse_given("with --can-interface", "machine", "seed", "virtual_ecu")
        if self.elf is not None:
            from fluxtrue_tools.a2l.elf import read

            read(self.elf)  # a file that is given is read before anything is built or started

    def work(self, folder: Path, nameplate: Path, connected: bool) -> "Work":
        """Where finished steps are kept; they belong to this target and this nameplate."""
        from hashlib import sha256

        from fluxtrue_tools.commission.work import Work
        from fluxtrue_tools.motor.names import source_files

        # A file that is missing is reported when the motor is loaded.
        content = b"".join(path.read_bytes() for path in source_files(nameplate) if path.is_file())
        if self.interface is not None:
            where = {"bus": f"{self.interface} {self.channel} {sorted(self.options.items())}"}
        else:
            where = {"--machine": self.machine, "--seed": str(self.seed), "connection": str(connected),
                     "bus": "virtual ECU" if self.virtual_ecu else "none"}  # fmt: skip
        return Work(folder, {"--motor": sha256(content).hexdigest(), **where})

    @contextlib.contextmanager
    def drive(self, motor: "Motor", known: "Nameplate", connected: bool) -> "Iterator[Capture]":
        """The drive to be measured."""
        if self.interface is None and not self.virtual_ecu:
            from fluxtrue_tools.commission.hidden import make

            yield make(self.machine, self.seed, motor, known.i_max_A, connected)[0]
            return
        from fluxtrue_tools.bus.address import BusAddress
        from fluxtrue_tools.commission import on_the_bus

        with contextlib.ExitStack() as stack:
            if self.interface is None:
                bench = stack.enter_context(
                    on_the_bus.hidden_machine(motor, self.machine, self.seed, known.i_max_A, connected)
                )
            else:
                address = BusAddress(self.interface, self.channel, self.options)
                bench = on_the_bus.Bench(address, self.elf or motor.folder.vecu, self.bench)
            yield stack.enter_context(on_the_bus.connected(bench, motor, known))


def consented(steps: "list[Step]", known: "Nameplate") -> None:
    """Ask for a consent to each movement of the shaft, also of the steps that a named one needs, before anything is
    enabled; without a terminal they are refused."""
    import sys

    from fluxtrue_tools.commission.steps import TURNING, announcement
    from fluxtrue_tools.errors import FluxtrueError

    moving = [step for step in steps if step.name in TURNING]
    if moving and not sys.stdin.isatty():
        names = ", ".join(step.name for step in moving)
        raise FluxtrueError(f"--step: {names}: the shaft turns, allowed: on a terminal, which asks for each movement, "
                            "or with --yes")  # fmt: skip
    for step in moving:
        click.echo(f"{step.name}: {announcement(step, known)}")
        if not click.confirm("The shaft is uncoupled and nothing can be caught by it: may it turn as described?"):
            raise FluxtrueError(f"commission: {step.name}: without consent; nothing was done")


@click.command("commission", cls=paths.Command)
@click.option("--motor", "nameplate", required=True, type=paths.InputFolder(), metavar="DIR",
              help="The folder that `fluxtrue motor start` has made.")  # fmt: skip
@click.option("--machine", default="hsm1", show_default=True, metavar="NAME",
              help="The simulated machine at the terminals: one of the project's, changed at random.")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Of these changes.")
@click.option("--virtual-ecu", is_flag=True,
              help="Over CAN on a virtual ECU with this machine, in place of software in the loop.")  # fmt: skip
@can_bus_or("software in the loop, or --virtual-ecu")
@click.option("--bench", type=kinds.Address(), metavar="HOST:PORT",
              help="Bench channel of the virtual ECU behind that interface, for its time with --fast.")  # fmt: skip
@click.option("--elf", type=paths.InputFile(), help="The ECU's firmware image; default: the virtual ECU's program.")
@click.option("--step", "steps", default="map", show_default=True, metavar="STEP,...",
              help="offsets, phases, spin, drag, resistance, map, or all; a step brings what it needs.")  # fmt: skip
@click.option("--out", type=paths.OutputFolder(*WRITTEN), metavar="DIR", help="The motor's folder.")
@click.option("--work", type=paths.BuildFolder(), metavar="DIR", help="Keep the finished steps here.")
@click.option("--resume", is_flag=True, help="Go on after the steps that --work has.")
@click.option("--yes", is_flag=True, help="On a bench: consent to every movement that is announced.")
@click.option("--dry-run", is_flag=True, help="Only say what will move and how much current will flow.")
def commission(nameplate: Path, machine: str, seed: int, virtual_ecu: bool, can_interface: str | None,
               can_channel: str, can_option: tuple[tuple[str, Any], ...], bench: tuple[str, int] | None,
               elf: Path | None, steps: str, out: Path | None, work: Path | None, resume: bool, yes: bool,
               dry_run: bool) -> None:  # fmt: skip
    """Measure an unknown motor with an uncoupled shaft, by software in the loop or over CAN.

    The steps phases, spin and drag turn the shaft; the simulated machine's sensor and leads are then connected at
    random. The others keep it at standstill and need the connection to be right. With --can-interface each movement
    needs a consent.
    """
    from fluxtrue_tools.commission import hidden, result
    from fluxtrue_tools.commission.steps import announcement, chosen, run
    from fluxtrue_tools.errors import FluxtrueError
    from fluxtrue_tools.sim import motor as motors

    wanted = chosen(tuple(steps.split(",")))
    target = Target(machine, seed, virtual_ecu, can_interface, can_channel, dict(can_option), bench, elf)
    target.check()
    hidden.folder_of(machine)
    if out is None and not dry_run:
        raise FluxtrueError("--out: missing, wanted: a folder for the result, or --dry-run")
    if resume and work is None:
        raise FluxtrueError("--resume: wanted: --work with the folder that has the finished steps")
    connected = all(step.name != "phases" for step in wanted)
    kept = None if work is None or dry_run else target.work(work, nameplate, connected)
    earlier = kept.load() if kept is not None and resume else None  # refused before anything is built or started
    motor = motors.load(str(nameplate), where="--motor")
    known = nameplate_of(nameplate, motor)
    if out is None or dry_run:
        for step in wanted:
            click.echo(f"{step.name}: {announcement(step, known)}")
        return
    if can_interface is not None and not yes:
        consented([step for step in wanted if earlier is None or step.name not in earlier[0]], known)
    with paths.outputs() as outputs:
        staging = outputs.scratch(out)
        with target.drive(motor, known, connected) as drive:
            found = run(drive, wanted, known, click.echo, kept, earlier)
        text, _ = result.write(found, known, nameplate, staging, out)
    click.echo(f"{text}written to {out}")
