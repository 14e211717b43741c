# SPDX-License-Identifier: Apache-2.0
"""An inverter on a bus in this process: the firmware with the simulated machine, which receives and sends frames."""

import ctypes
import os
from pathlib import Path

import cantools
from cantools.database.can import Database
from protection import protect

from fluxtrue_tools.bus import DBC
from fluxtrue_tools.motor.bases import periods_per_step
from fluxtrue_tools.sim import motor as sim_motor
from fluxtrue_tools.sim.build import MotorFolder

ROOT = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ.get("FLUXTRUE_BUILD_DIR", ROOT / "build" / "host"))
# Assumed: the capacitor, empty at the start, and semiconductors that withstand twice the battery's voltage.
DC_LINK_F, AVALANCHE_PER_BATTERY = 500e-6, 2.0
COMMAND = "VCU_TorqueRequest"
LIMITS = "VCU_BatteryLimits"


def load_dbc(path: Path = DBC) -> Database:
    """The DBC of a motor, or the standard one: the only description of the bus."""
    database = cantools.database.load_file(path)
    assert isinstance(database, Database)
    return database


class Frame(ctypes.Structure):
    """The C type can_frame_t."""

    _fields_ = (("id", ctypes.c_uint32), ("extended", ctypes.c_bool), ("length", ctypes.c_uint8),
                ("data", ctypes.c_uint8 * 8))  # fmt: skip


class Ecu:
    """One ECU and its machine at an imposed speed; time passes in steps of the task."""

    def __init__(self, motor: sim_motor.Motor | None = None) -> None:
        self.motor = motor or sim_motor.read(MotorFolder("hsm1", BUILD / "motors" / "hsm1"))
        self.dbc = load_dbc(self.motor.folder.dbc)
        self.lib = self.motor.library
        self.lib.fluxtrue_create.restype = ctypes.c_void_p
        self.lib.fluxtrue_get.restype = ctypes.c_double
        self.lib.sim_create_around.restype = ctypes.c_void_p
        self.lib.can_host_put.restype = ctypes.c_bool
        self.lib.can_host_take.restype = ctypes.c_bool
        self.handle = ctypes.c_void_p(self.lib.fluxtrue_create())
        self.lib.can_host_attach(self.handle)
        self.sim = ctypes.c_void_p(self.lib.sim_create_around(self.handle))
        if self.motor.flux_map is not None:
            self.motor.flux_map.hand_over(self.lib, self.sim)
        link = {"dc_link_F": DC_LINK_F, "avalanche_V": AVALANCHE_PER_BATTERY * self.motor.plant["vdc_V"]}
        for name, value in {**self.motor.plant, "imposed_speed": 1.0, **link}.items():
            self.set(name, value)
        bad = self.lib.sim_start(self.sim)
        assert bad is None, bad
        self.speed_rad_s = 0.0
        self.periods_per_step = periods_per_step(self.motor.plant["pwm_hz"])
        self.time_ms = 0
        self.counters = {COMMAND: 0, LIMITS: 0}
        self.torque_end_Nm = float(self.dbc.get_message_by_name(COMMAND).get_signal_by_name("TorqueRequested").maximum)
        self.command = {"Enable": 0, "FaultReset": 0, "Mode": "off", "TorqueRequested": 0.0,
                        "TorqueLimitDrive": self.torque_end_Nm, "TorqueLimitRegen": self.torque_end_Nm}  # fmt: skip
        self.talking = True
        self.sent: list[tuple[int, int, bytes]] = []
        self.last: dict[str, dict] = {}

    def close(self) -> None:
        """Release the memory."""
        self.lib.sim_destroy(self.sim)
        self.lib.fluxtrue_destroy(self.handle)

    def set(self, name: str, value: float) -> None:
        """A parameter of the plant."""
        assert self.lib.sim_set(self.sim, f"plant.{name}".encode(), float(value)) == 0, name

    def truth(self, name: str) -> float:
        """A true value of the plant."""
        return float(self.lib.sim_get(self.sim, f"truth.{name}".encode()))

    def get(self, name: str) -> float:
        """A value of fluxtrue_get()."""
        return float(self.lib.fluxtrue_get(self.handle, name.encode()))

    def put(self, identifier: int, data: bytes, extended: bool = False) -> bool:
        """A frame on the bus."""
        frame = Frame(identifier, extended, len(data), (ctypes.c_uint8 * 8)(*data))
        return bool(self.lib.can_host_put(self.handle, ctypes.byref(frame)))

    def encode(self, name: str, values: dict) -> bytes:
        """A protected message with its next counter."""
        message = self.dbc.get_message_by_name(name)
        absent = {"BatteryVoltage": 0.0} if name == LIMITS else {}
        raw = bytearray(message.encode({"Crc": 0, "Counter": self.counters[name], **absent, **values}))
        self.counters[name] = (self.counters[name] + 1) % 15
        return protect(int(message.dbc.attributes["E2EDataId"].value), raw)

    def send(self, name: str, values: dict) -> None:
        """Puts a protected message on the bus."""
        self.put(self.dbc.get_message_by_name(name).frame_id, self.encode(name, values))

    def step_ms(self) -> None:
        """One millisecond of simulated time; the command goes out in every tenth."""
        self.step_once(self.periods_per_step, self.time_ms % 10 == 0)

    def step_once(self, periods: int, command_is_due: bool) -> None:
        """One step of the task, of so many periods."""
        if self.talking and command_is_due:
            self.send(COMMAND, self.command)
        self.set("speed_rad_s", self.speed_rad_s)
        assert self.lib.sim_run(self.sim, periods, None, 0) == 0
        self.time_ms += 1
        frame = Frame()
        while self.lib.can_host_take(self.handle, ctypes.byref(frame)):
            data = bytes(frame.data[: frame.length])
            self.sent.append((self.time_ms, frame.id, data))
            message = self.dbc.get_message_by_frame_id(frame.id)
            self.last[message.name] = message.decode(data)

    def run(self, milliseconds: int, **command: object) -> None:
        """Change the command, then simulate this time."""
        self.command.update(command)
        for _ in range(milliseconds):
            self.step_ms()

    def run_until(self, name: str) -> dict:
        """Run to the end of the millisecond in which the message is sent; the result is its values."""
        self.last.pop(name, None)
        while name not in self.last:
            self.run(1)
        return self.last[name]

    @property
    def state(self) -> str:
        """The state that the bus reports."""
        return str(self.last["INV_Status"]["State"])

    def power_up(self, v_dc_V: float = 350.0) -> None:
        """Bring the inverter to the state run, without torque."""
        self.set("vdc_V", v_dc_V)
        self.run(100)
        self.run(20, Mode="torque")
        self.run(200)
        self.run(30, Enable=1)
