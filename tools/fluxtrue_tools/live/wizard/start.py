# SPDX-License-Identifier: Apache-2.0
"""The wizard from a command line: what is measured, the process that measures, and the session of the pages."""

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from fluxtrue_tools.bus.address import BusAddress
from fluxtrue_tools.bus.interface import read_interface
from fluxtrue_tools.commission import on_the_bus
from fluxtrue_tools.commission.bus import OverTheBus
from fluxtrue_tools.commission.cli import nameplate_of
from fluxtrue_tools.commission.steps import chosen
from fluxtrue_tools.live.pace import InStep
from fluxtrue_tools.live.recorder import Recorder
from fluxtrue_tools.live.samples import Samples
from fluxtrue_tools.live.session import Session
from fluxtrue_tools.live.wizard.link import Measuring
from fluxtrue_tools.live.wizard.process import Job, Setup
from fluxtrue_tools.live.wizard.wizard import Wizard
from fluxtrue_tools.live.words import words
from fluxtrue_tools.sim.motor import Motor
from fluxtrue_tools.vecu.channel import Channel

STANDING, WITH_TURNING = ("map",), ("all",)  # with the steps that they need


@dataclass(frozen=True)
class Terminals:
    """Where the unknown motor is: behind a bus, or simulated on a virtual ECU that is started for it."""

    machine: str
    seed: int
    address: BusAddress | None = None
    bench: tuple[str, int] | None = None
    elf: Path | None = None
    turning: bool = False  # with the steps that turn the shaft: leads and angle sensor are not known


def _waits(bench: on_the_bus.Bench) -> bool:
    """Whether its time passes only when it is asked to."""
    if bench.channel is None:
        return False
    with contextlib.closing(Channel.greeted(*bench.channel)) as channel:
        return channel.is_fast()


@contextlib.contextmanager
def session(nameplate: Path, motor: Motor, at: Terminals, records: Path) -> Iterator[Session]:
    """Everything behind the pages; at the end switching is disabled."""
    known = nameplate_of(nameplate, motor)
    with contextlib.ExitStack() as stack:
        if at.address is not None:
            title, bench = f"{at.address.interface} {at.address.channel}, unknown motor", on_the_bus.Bench(
                at.address, at.elf or motor.folder.vecu, at.bench)  # fmt: skip
        else:
            title = "unknown motor, simulated"
            bench = stack.enter_context(
                on_the_bus.hidden_machine(motor, at.machine, at.seed, known.i_max_A, not at.turning)
            )
        interface = read_interface(motor.folder.dbc)
        samples, recorder = Samples(interface.database), Recorder(records, interface)
        wizard = Wizard(chosen(WITH_TURNING if at.turning else STANDING), nameplate, known,
                        motor.plant["current_full_scale_A"], OverTheBus.slower)  # fmt: skip
        stack.callback(wizard.close)
        in_step = InStep() if _waits(bench) else None
        setup = Setup(bench, motor.folder, known, in_step is not None)
        link = Measuring(setup, [samples], in_step, wizard)
        stack.callback(link.close)
        wizard.begin = lambda *job: link.do(Job(*job))
        yield Session(title, motor.torque_max_Nm, samples, recorder, words(), link=link, wizard=wizard,
                      in_step=in_step)  # fmt: skip
