# SPDX-License-Identifier: Apache-2.0
"""A virtual ECU with a hidden machine, and its drive over CAN."""

import math
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import can

from fluxtrue_tools.a2l.elf import read
from fluxtrue_tools.bus.interface import COMMAND, COMMISSION, read_interface
from fluxtrue_tools.commission import hidden
from fluxtrue_tools.commission.bus import OverTheBus
from fluxtrue_tools.commission.bus_line import Line, SimulatedTime
from fluxtrue_tools.commission.hidden import Truth
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.turning import Connection
from fluxtrue_tools.sim.motor import Motor
from fluxtrue_tools.vecu.channel import Channel
from fluxtrue_tools.vecu.process import VirtualEcu
from fluxtrue_tools.vecu.stepped import SteppedBus, connect

COMMAND_ID, COMMISSION_ID = (read_interface().message(name).frame_id for name in (COMMAND, COMMISSION))


class Choosing(SimulatedTime):
    """Frames that can be kept from the bus, as those of a tool that has stalled."""

    kept_back: frozenset[int] = frozenset()

    def send(self, frame: can.Message) -> None:
        if frame.arbitration_id not in self.kept_back:
            super().send(frame)


@dataclass
class Stand:
    """The parts that a test needs."""

    ecu: VirtualEcu
    channel: Channel
    stepped: SteppedBus
    line: Line
    drive: OverTheBus
    truth: Truth
    clock: Choosing

    @property
    def wired(self) -> Connection:
        """The connection as it is."""
        return Connection(int(self.truth.plant["pole_pairs"]), self.truth.reversed, self.truth.offset_rad)

    def speed_rad_s(self) -> float:
        return abs(self.channel.get("truth.speed_rad_s")[0])

    def current_A(self) -> float:
        """A current of the plant."""
        return math.hypot(*self.channel.get("truth.i_d_A", "truth.i_q_A"))


@contextmanager
def bus_stand(motor: Motor, known: Nameplate, folder: Path, machine: tuple[str, int], connected: bool,
              **changed: float) -> Iterator[Stand]:  # fmt: skip
    """machine: name and seed; connected: sensor and leads are as the firmware assumes; changed: of the plant."""
    truth, flux_map, plant = hidden.draw(*machine, motor, known.i_max_A, connected)
    plant.update(changed)
    text = folder / "machine.txt"
    text.write_text(hidden.machine_text(plant, flux_map), encoding="utf-8")
    with ExitStack() as stack:
        ecu = stack.enter_context(VirtualEcu(motor.folder.vecu, machine=text))
        bus = connect(ecu.can_port)
        stack.callback(bus.shutdown)
        channel = Channel("127.0.0.1", ecu.bench_port)
        stack.callback(channel.close)
        stepped = SteppedBus(bus, channel)
        clocks: list[Choosing] = []
        line = Line(lambda beat: clocks.append(Choosing(stepped, beat)) or clocks[0], read_interface(motor.folder.dbc))
        drive = OverTheBus(line, read(motor.folder.vecu), known, motor.plant["vdc_V"])
        yield Stand(ecu, channel, stepped, line, drive, truth, clocks[0])
