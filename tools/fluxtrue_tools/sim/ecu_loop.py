# SPDX-License-Identifier: Apache-2.0
"""The application on its bus in closed loop with the plant: frames in, state machine, duties to the plant."""

import ctypes
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools.bench.can_command import Command, Frame
from fluxtrue_tools.bus.interface import LIMITS, Interface, read_interface
from fluxtrue_tools.bus.protect import Protector
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim.library import Loop
from fluxtrue_tools.sim.members import members
from fluxtrue_tools.sim.motor import Motor

LIMITS_SIGNALS: Final = ("PowerLimitDrive", "PowerLimitRegen", "BatteryVoltage")
COMMAND_MS, LIMITS_MS = 10, 100
# Assumed, as in the virtual ECU: the dc link, and semiconductors that withstand twice the battery's voltage.
DC_LINK_F: Final = 500e-6
AVALANCHE_PER_BATTERY: Final = 2.0
RUN: Final = 4
# What Sender.wrong may hold: not 0 is wrong; `skipped` counters are left out before every command.
WRONG: Final = ("lost", "crc", "byte", "repeated", "other_id", "extended", "short", "skipped", "limits_lost")


class Sender:
    """The vehicle: what it sends every 10 and 100 ms, and what is wrong with its frames."""

    def __init__(self, interface: Interface) -> None:
        self.command = Command(interface)
        self.limits: dict[str, float] = {}  # empty: not sent; without BatteryVoltage: not known
        self.wrong: dict[str, float] = {}
        self._limits_message = interface.message(LIMITS)
        self._limits = Protector(interface.data_id(LIMITS))
        self._last: Frame | None = None

    def _damaged(self, frame: Frame) -> Frame | None:
        """A frame as it arrives; None: it does not."""
        wrong = self.wrong
        if wrong.get("repeated") and self._last is not None:
            return self._last
        self._last = frame
        if wrong.get("crc"):
            frame.data[0] ^= 1
        if wrong.get("byte"):
            frame.data[3] ^= 0x40
        if wrong.get("other_id"):
            frame.id = int(self._limits_message.frame_id)
        if wrong.get("extended"):
            frame.extended = True
        if wrong.get("short"):
            frame.length = 7
        return None if wrong.get("lost") else frame

    def frames(self, time_ms: int) -> list[Frame]:
        """What is due in this millisecond."""
        due = []
        if time_ms % COMMAND_MS == 0:
            for _ in range(int(self.wrong.get("skipped", 0.0))):
                self.command.frame()
            due.append(self._damaged(self.command.frame()))
        if time_ms % LIMITS_MS == 0 and self.limits and not self.wrong.get("limits_lost"):
            signals = {"Crc": 0, "Counter": 0, **dict.fromkeys(LIMITS_SIGNALS, 0.0), **self.limits}
            raw = self._limits.protect(self._limits_message.encode(signals))
            due.append(Frame(self._limits_message.frame_id, False, len(raw), (ctypes.c_uint8 * 8)(*raw)))
        return [frame for frame in due if frame is not None]


@dataclass(frozen=True)
class Change:
    """A name that gets a value after so many periods of a millisecond."""

    after: int
    name: str
    value: float


class EcuLoop(Loop):
    """The firmware with state machine and bus, around the plant with battery, contactor and dc link."""

    def __init__(self, motor: Motor, plant: Mapping[str, float]) -> None:
        self._handle: int = 0
        link = {"dc_link_F": DC_LINK_F, "avalanche_V": AVALANCHE_PER_BATTERY * motor.plant["vdc_V"]}
        self._library_path = str(motor.folder.library)
        self.sender = Sender(read_interface(motor.folder.dbc))
        self.time_ms = 0
        super().__init__(motor.library, {**motor.plant, **link, "imposed_speed": 1.0, **plant}, motor.flux_map)
        self.periods_per_ms = round(1e-3 / self.period_s)

    def _create(self, controller: str) -> int | None:
        self._handle = self._library.fluxtrue_create()
        self._library.can_host_attach(self._handle)
        created: int | None = self._library.sim_create_around(self._handle)
        return created

    def close(self) -> None:
        """Close the loop and the firmware, which belongs to it."""
        super().close()
        if self._handle:
            self._library.fluxtrue_destroy(self._handle)
            self._handle = 0

    def read(self, member: str) -> float:
        """A member of the firmware's state by its name in the source, for example ecu.supervisor.state."""
        return members(self._library_path).read(self._handle, member)

    def write(self, member: str, value: float) -> None:
        """Changes it from outside, as a fault of the memory or of the board would."""
        members(self._library_path).write(self._handle, member, value)

    @property
    def state(self) -> int:
        """The state of the state machine."""
        return int(self.read("ecu.supervisor.state"))

    def _changed(self, ramps: Mapping[str, tuple[float, float]], change: Change) -> NDArray[np.float64]:
        """A millisecond in two parts; straight lines go on in the second one."""
        share = change.after / self.periods_per_ms
        middle = {name: start + share * (stop - start) for name, (start, stop) in ramps.items()}
        first = self.run(change.after, {name: (ends[0], middle[name]) for name, ends in ramps.items()})
        self.set(change.name, change.value)
        rest = {name: (middle[name], ends[1]) for name, ends in ramps.items()}
        return np.concatenate([first, self.run(self.periods_per_ms - change.after, rest)])

    def step_ms(self, ramps: Mapping[str, tuple[float, float]] | None = None,
                change: Change | None = None) -> NDArray[np.float64]:  # fmt: skip
        """One millisecond with the frames that are due in it."""
        for frame in self.sender.frames(self.time_ms):
            self._put(frame)
        rows = self.run(self.periods_per_ms, ramps) if change is None else self._changed(ramps or {}, change)
        self._take_all()
        self.time_ms += 1
        return rows

    def _put(self, frame: Frame) -> None:
        """A frame arrives at the firmware."""
        self._library.can_host_put(self._handle, ctypes.byref(frame))

    def _take_all(self) -> None:
        """What the firmware has sent is thrown away."""
        while self._library.can_host_take(self._handle, ctypes.byref(Frame())):
            pass

    def steps(self, milliseconds: int, **command: Any) -> None:
        """Some time, after a change of the command; what is recorded meanwhile is not kept."""
        self.sender.command.values.update(command)
        for _ in range(milliseconds):
            self.step_ms()

    def power_up(self) -> None:
        """Bring the ECU to state run without torque."""
        self.steps(60, Enable=0, Mode="off", TorqueRequested=0.0)
        self.steps(20, Mode="torque")
        for _ in range(500):
            if self.state == 3:
                break
            self.steps(1)
        self.steps(12, Enable=1)
        if self.state != RUN:
            words = int(self.get("fault_word")), int(self.read("ecu.supervisor.faults"))
            raise FluxtrueError(
                f"the drive does not start: state {self.state}, fault words {words[0]:#x}, {words[1]:#x}"
            )
