# SPDX-License-Identifier: Apache-2.0
"""The connection to an ECU for a commissioning: a bench, or a virtual ECU of its own with a hidden machine."""

import contextlib
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import can

from fluxtrue_tools.a2l.elf import read
from fluxtrue_tools.bus.address import BusAddress
from fluxtrue_tools.bus.interface import read_interface
from fluxtrue_tools.commission import hidden
from fluxtrue_tools.commission.bus import OverTheBus
from fluxtrue_tools.commission.bus_line import Beat, Clock, Line, SimulatedTime, WallTime
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.sim.motor import Motor
from fluxtrue_tools.vecu.channel import Channel
from fluxtrue_tools.vecu.process import HOST, VirtualEcu
from fluxtrue_tools.vecu.stepped import SteppedBus


@dataclass(frozen=True)
class Bench:
    """Where the ECU is; channel: of a virtual ECU whose time passes only when it is asked to."""

    address: BusAddress
    elf: Path
    channel: tuple[str, int] | None = None


def address_of(ecu: VirtualEcu) -> BusAddress:
    """The bus of a virtual ECU of its own."""
    return BusAddress("socketcand", "can0", {"host": HOST, "port": ecu.can_port, "tcp_tune": True})


@contextlib.contextmanager
def hidden_machine(
    motor: Motor, name: str, seed: int, i_max_A: float, connected: bool = True, other_errors: bool = False
) -> Iterator[Bench]:
    """A virtual ECU with this machine; connected: sensor and leads are as the firmware assumes."""
    _, flux_map, plant = hidden.draw(name, seed, motor, i_max_A, connected, other_errors)
    with contextlib.ExitStack() as stack:
        machine = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "machine.txt"
        machine.write_text(hidden.machine_text(plant, flux_map), encoding="utf-8")
        ecu = stack.enter_context(VirtualEcu(motor.folder.vecu, machine=machine))
        yield Bench(address_of(ecu), motor.folder.vecu, (HOST, ecu.bench_port))


def _clock(bus: can.BusABC, channel: Channel | None) -> Callable[[Beat], Clock]:
    if channel is not None and channel.is_fast():
        return lambda beat: SimulatedTime(SteppedBus(bus, channel), beat)
    return lambda beat: WallTime(bus, beat)


@contextlib.contextmanager
def connected(bench: Bench, motor: Motor, known: Nameplate) -> Iterator[OverTheBus]:
    """The drive; at the end it is switched off and the bus left."""
    with contextlib.ExitStack() as stack:
        description = read(bench.elf)
        bus = bench.address.connect()
        stack.callback(bus.shutdown)
        channel = None if bench.channel is None else Channel.greeted(*bench.channel)
        if channel is not None:
            stack.callback(channel.close)
        line = Line(_clock(bus, channel), read_interface(motor.folder.dbc))
        stack.callback(line.close)
        drive = OverTheBus(line, description, known, motor.plant["vdc_V"])
        stack.callback(drive.switch_off)
        yield drive
