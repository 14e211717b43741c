# SPDX-License-Identifier: Apache-2.0
"""The test stand for a test: an ECU on CAN and, on some stands, a plant that can be commanded.

With a bench channel time is simulated: advance() sends the cyclic commands, lets the virtual ECU run and reads what it
has sent; no result depends on how fast the computer is. Without a bench channel time is the wall clock's.
"""

import math
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import can
import cantools.database
import e2e
import numpy as np
import pytest
from numpy.typing import NDArray
from progress import BenchTime

from fluxtrue_tools.vecu.channel import Channel
from fluxtrue_tools.vecu.stepped import SteppedBus

COMMAND = "VCU_TorqueRequest"
LIMITS = "VCU_BatteryLimits"
STATUS = "INV_Status"
MS = 1e-3
RPM = 2.0 * np.pi / 60.0  # rad/s
# In the first and third quadrant as often as in the others, at each speed with two torques.
WARM_UP_RPM = (1500.0, 4000.0, 800.0, 2500.0, 6000.0, 3000.0, -1500.0, -4000.0, 2000.0, 7000.0, -700.0)
WARM_UP_NM = (60.0, 20.0, -40.0, 100.0, -80.0, -20.0, 90.0, 40.0, -60.0)
EXACT = 1e-9  # s: a step's end and a frame's due time are the same instant


@dataclass(frozen=True)
class Command:
    """The vehicle's requests, in the DBC's units."""

    enable: bool = False
    reset: bool = False
    mode: str = "off"
    torque_Nm: float = 0.0
    limit_drive_Nm: float = math.inf  # as large as the message can carry
    limit_regen_Nm: float = math.inf

    def signals(self) -> dict[str, Any]:
        """Signal values for cantools; CRC and counter are set later."""
        return {
            "Crc": 0, "Counter": 0, "Enable": int(self.enable), "FaultReset": int(self.reset), "Mode": self.mode,
            "TorqueRequested": self.torque_Nm, "TorqueLimitDrive": self.limit_drive_Nm,
            "TorqueLimitRegen": self.limit_regen_Nm,
        }  # fmt: skip


@dataclass
class Trace:
    """Rows of a recording of the plant."""

    names: list[str]
    rows: list[list[float]] = field(default_factory=list)

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        return np.asarray(self.rows)[:, self.names.index(name)]


@dataclass
class Expected:
    """Faults and errors that a test provokes, and that the check after it therefore accepts."""

    faults: bool = False
    load: bool = False  # of the bus
    frames: bool = False  # cyclic frames that come late or not at all
    counters: set[str] = field(default_factory=set)


@dataclass
class Frame:
    """One frame as received."""

    time_s: float
    data: bytes


class Rig:
    """Bus, DBC, the cyclic commands, and what has been received.

    A `clock` is a bench channel that only advances simulated time, for a plant that cannot be commanded.
    """

    def __init__(
        self, bus: can.BusABC, database: cantools.database.Database, stand: Channel | None,
        clock: Channel | None = None,
    ) -> None:  # fmt: skip
        self.bus, self.database, self._stand = bus, database, stand
        channel = stand if stand is not None else clock
        self._stepped = SteppedBus(bus, channel) if channel is not None else None
        self._bench_time = BenchTime()
        self.may_switch_on = True
        self.by_name = {message.name: message for message in database.messages}
        self._command_id, self._limits_id = self.by_name[COMMAND].frame_id, self.by_name[LIMITS].frame_id
        self._encoded: dict[Command, bytes] = {}
        self._inverters = {m.frame_id: m.name for m in database.messages if "INV" in m.senders}
        self.listeners: list[Callable[[can.Message], None]] = []
        self.clear_history()

    def clear_history(self) -> None:
        """Return to the state after connecting: nothing sent, nothing received."""
        self.command = Command()
        self.is_sending = True
        self.power_limits_kW: tuple[float, float] | None = None
        self.battery_V = 0.0  # 0: not known
        self._due: dict[str, float] = {COMMAND: self.now_s, LIMITS: self.now_s}
        self._senders = {name: e2e.Sender(self.data_id(name)) for name in (COMMAND, LIMITS)}
        self.status_protection = e2e.Receiver(self.data_id(STATUS))
        self.frames: dict[str, list[Frame]] = defaultdict(list)
        self.last: dict[str, Frame] = {}
        self.others: dict[int, list[Frame]] = defaultdict(list)  # frames that the DBC does not describe, by identifier
        self.keep_frames = True
        self._commanded_s: float | None = None  # when the last cyclic command went out
        self.longest_gap_s = 0.0  # longest time between two of them; with the wall clock this computer may be late
        self.counted: dict[str, int] = defaultdict(int)
        self.trace = Trace([])
        self.expected = Expected()

    # What the DBC says.

    def data_id(self, name: str) -> int:
        """The data id of the end-to-end protection."""
        return int(self.by_name[name].dbc.attributes["E2EDataId"].value)

    def cycle_s(self, name: str) -> float:
        """The time from one frame of this message to the next."""
        return (self.by_name[name].cycle_time or 0) * MS

    # Time.

    @property
    def stand(self) -> Channel:
        """The bench channel; tests that need it carry the marker `plant`."""
        assert self._stand is not None, "this test needs the marker 'plant'"
        return self._stand

    @property
    def has_stand(self) -> bool:
        """Whether the plant can be commanded and time is simulated."""
        return self._stand is not None

    @property
    def now_s(self) -> float:
        """The present time on the clock of the frames' time stamps, as far as it is known here."""
        return (self._stepped or self._bench_time).now_s

    def advance(self, seconds: float) -> None:
        """Let time pass; the commands are sent in their cycle."""
        end_s = self.now_s + seconds
        while end_s - self.now_s > EXACT:
            self._send_due()
            step_to_s = min([end_s, *self._due.values()]) if self.is_sending else end_s
            self._pass(step_to_s)

    def _pass(self, until_s: float) -> None:
        if self._stepped is None:
            self._bench_time.receive(self.bus, until_s, self._take)
            return
        messages, rows = self._stepped.run(round(1e3 * (until_s - self.now_s), 6))
        self.trace.rows += rows
        for message in messages:
            self._take(message)

    # Sending.

    def send(self, frame_id: int, data: bytes, extended: bool = False) -> None:
        """Send one frame unchanged."""
        message = can.Message(arbitration_id=frame_id, data=data, is_extended_id=extended, timestamp=self.now_s)
        (self._stepped or self.bus).send(message)
        for listener in self.listeners:
            listener(message)

    def encode(self, command: Command) -> bytes:
        """A command's frame without protection."""
        if command not in self._encoded:
            message, values = self.by_name[COMMAND], command.signals()
            for name in ("TorqueLimitDrive", "TorqueLimitRegen"):
                values[name] = min(values[name], message.get_signal_by_name(name).maximum)
            self._encoded[command] = bytes(message.encode(values))
        return self._encoded[command]

    def next_command(self) -> bytes:
        """The next protected command frame."""
        return self._senders[COMMAND].protect(self.encode(self.command))

    def skip_counters(self, count: int) -> None:
        """Let the sender skip counter values."""
        sender = self._senders[COMMAND]
        sender.counter = (sender.counter + count) % e2e.COUNTERS

    def _is_due(self, name: str) -> bool:
        """Whether a cyclic message must be sent now; if so, its next time is set."""
        if self._due[name] > self.now_s + EXACT:
            return False
        self._due[name] = max(self._due[name], self.now_s - EXACT) + self.cycle_s(name)
        return True

    def _send_due(self) -> None:
        if not self.is_sending:
            self._commanded_s = None
            return
        if self._is_due(COMMAND):
            self.send(self._command_id, self.next_command())
            if self._commanded_s is not None:
                self.longest_gap_s = max(self.longest_gap_s, self.now_s - self._commanded_s)
            self._commanded_s = self.now_s
        if self._is_due(LIMITS) and self.power_limits_kW is not None:
            drive, regen = self.power_limits_kW
            signals = {"Crc": 0, "Counter": 0, "PowerLimitDrive": drive, "PowerLimitRegen": regen,
                       "BatteryVoltage": self.battery_V}  # fmt: skip
            data = self._senders[LIMITS].protect(bytes(self.by_name[LIMITS].encode(signals)))
            self.send(self._limits_id, data)

    # Receiving.

    def _take(self, message: can.Message | None) -> None:
        if message is None or message.is_error_frame:
            return
        for listener in self.listeners:
            listener(message)
        name = self._inverters.get(message.arbitration_id)
        if name is None or message.is_extended_id:
            self.others[message.arbitration_id].append(Frame(message.timestamp, bytes(message.data)))
            return
        frame = Frame(message.timestamp, bytes(message.data))
        self.counted[name] += 1
        self.last[name] = frame
        if name == STATUS:
            self.status_protection.take(frame.data)
        if self.keep_frames:
            self.frames[name].append(frame)

    def decode(self, name: str, data: bytes) -> dict[str, Any]:
        """Values of the signals; named values stay numbers."""
        return dict(self.by_name[name].decode(data, decode_choices=False))

    def newest(self, name: str) -> dict[str, Any] | None:
        """The values of the newest frame; None before the first."""
        return self.decode(name, self.last[name].data) if name in self.last else None

    def signal(self, name: str, signal: str) -> float:
        """The newest value."""
        assert name in self.last, f"no {name} has been received yet"
        return float(self.decode(name, self.last[name].data)[signal])

    def series(self, name: str, signal: str, since_s: float = 0.0) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Time stamps and values."""
        frames = [frame for frame in self.frames[name] if frame.time_s >= since_s]
        values = [self.decode(name, frame.data)[signal] for frame in frames]
        return np.asarray([frame.time_s for frame in frames]), np.asarray(values, dtype=np.float64)

    @property
    def state(self) -> str:
        """The state of the inverter, by its name in the DBC."""
        signal = self.by_name[STATUS].get_signal_by_name("State")
        assert signal.choices is not None
        return str(signal.choices[int(self.signal(STATUS, "State"))])

    # What every test does.

    def ask(self, **changes: Any) -> None:
        """Change the command that is sent from now on."""
        wanted = replace(self.command, **changes)
        if not self.may_switch_on and (wanted.enable or wanted.mode != "off"):
            pytest.skip("charges the dc link or enables switching: on a bench only with --allow-power")
        self.command = wanted

    def wait_for(self, state: str, seconds: float = 2.0) -> float:
        """Run until the status reports this state; the result is the time that it took."""
        start_s = self.now_s
        while STATUS not in self.last or self.state != state:
            assert self.now_s - start_s < seconds, f"state {state} wanted, after {seconds:g} s still {self.state}"
            self.advance(10 * MS)
        return self.now_s - start_s

    def start(self, torque_Nm: float = 0.0) -> None:
        """From standby to run, with a torque request that comes after switching has been enabled."""
        self.ask(mode="torque", enable=False, torque_Nm=0.0)
        self.wait_for("ready")
        self.ask(enable=True)
        self.wait_for("run")
        self.ask(torque_Nm=torque_Nm)

    def turn(self, speed_rpm: float, seconds: float = 0.3) -> None:
        """The dynamometer brings the shaft to this speed; a jump would be an angle fault."""
        self.stand.ramp("plant.speed_rad_s", speed_rpm * RPM, seconds)
        self.advance(seconds + 0.1)

    def warm_up(self, seconds: float) -> None:
        """Drive in all quadrants for the identification, and end with 20 N·m at 1000 rpm."""
        assert self.state == "run"
        end_s, k = self.now_s + seconds - 3.0, 0
        while self.now_s < end_s:
            self.stand.ramp("plant.speed_rad_s", WARM_UP_RPM[k % len(WARM_UP_RPM)] * RPM, 1.0)
            for _ in range(2):
                self.ask(torque_Nm=WARM_UP_NM[k % len(WARM_UP_NM)])
                self.advance(1.0)
                k += 1
        self.ask(torque_Nm=20.0)
        self.turn(1000.0, 1.0)
        self.advance(end_s + 3.0 - self.now_s)

    def record(self, names: Sequence[str], periods: int = 10) -> Trace:
        """Record true values of the plant from now on, one row every `periods` PWM periods."""
        self.stand.record(names, periods)
        self.trace = Trace(list(names))
        return self.trace

    def power_cycle(self, seed: int = 1) -> None:
        """Restart ECU and plant; the commands have their initial values again."""
        self.stand.reset(seed)
        self.clear_history()
