# SPDX-License-Identifier: Apache-2.0
"""An ECU on CAN as the drive of a commissioning.

Protected commands keep it enabled with a request of zero; only between two bursts a small torque brakes the rotor. The
values of the voltage pulses are set, and the pulses started, by commands of XCP (firmware/calibration/pulse_access.h),
and their currents and voltages are captured by the scope. A movement of the shaft is commanded by a protected frame of
its own; its bounds are in the firmware (firmware/drive/movement.h). The same frame has the consent to voltage pulses.
"""

import contextlib
import math
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from fluxtrue_tools import faults
from fluxtrue_tools.a2l.elf import Description, Value
from fluxtrue_tools.commission.bus_line import RUNNING, Line, Movement
from fluxtrue_tools.commission.drive import (
    DONE,
    FAILED,
    LIGHTNESS,
    PERIODS_MAX,
    PULSE,
    SEEN_S,
    VOLTAGES,
    nothing,
    voltage_share,
)
from fluxtrue_tools.commission.nameplate import BRAKE_SHARE, Nameplate
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.scope.scope import SIGNALS_MAX, WORDS, Scope, make_setup
from fluxtrue_tools.scope.xcp import DOWNLOAD, SET_MTA, XcpMaster, XcpRefused, unlock, upload

USER: Final = 0xF1
PULSE_SET, PULSE_START, PULSE_STATE, MOVEMENT_STATE = 0x10, 0x11, 0x12, 0x13  # firmware/calibration/pulse_access.h
ANGLE_CORRECTION: Final = 0x14  # the same: the first of four coefficients, in turns times 2^32
FIELDS: Final = ("pulses_vd", "pulses_id_low_A", "pulses_id_high_A", "pulses_vq", "pulses_iq_low_A", "pulses_iq_high_A",
                 "pulses_first", "pulses_angle_rad", "pulses_delay", "pulses_reversals", "pulses_periods")  # fmt: skip
UNKNOWN: Final = 0x20
Q15: Final = 32768.0
CAPTURED: Final = {"id_A": "i_d_A", "iq_A": "i_q_A", "ud_V": "u_d_V", "uq_V": "u_q_V", "theta_e_rad": "theta_e_deg",
                   "i_zero_A": "i_zero_A", "sensor_turns": "theta_m_deg", "v_dc_V": "v_dc_V"}  # fmt: skip
CAPTURED_VOLTAGES: Final = tuple(CAPTURED[name] for name in VOLTAGES)
LINK_S, LINK_SAMPLES, LINK_FALLS_S = 6.0, 1000, 5.0  # until the dc link is off; of a capture; the firmware's limit
PULSE_SIGNALS: Final = ("id_A", "iq_A", "ud_V", "uq_V", "theta_e_rad", "i_zero_A")
FORMATS: Final = {"S16": "<h", "U32": "<I", "F32": "<f", "U8": "<B"}
MARGIN_S: Final = 0.015  # captured beside the pulses: the commands to start them take some milliseconds
POLL_S: Final = 0.005
LATE_S: Final = 0.02  # of the reported speed
FALL_S: Final = 0.008  # of a torque
STOPPED, NO_CONSENT = 2.0, 6.0  # of pulses_failure
TOLD_S: Final = 0.03  # in which the bus says that switching is disabled, and why
READY_S, RUN_S, OFF_S, RESET_S = 5.0, 0.5, 0.05, 0.05
LISTEN_S: Final = 0.15
DEGREES: Final = 360.0
ENDED: Final = "movement ended"  # why enable was refused
MOVED: Final = ("id_ref_A", "iq_ref_A", "imposed_hz", "current_mode", "angle_imposed", "angle_pole_pairs",
                "angle_reversed", "angle_offset_rad")  # fmt: skip
IN_FIRMWARE: Final = ("spin_periods", "spin_rpm", "machine_monitors")  # what the movement itself brings
STEADY, SMALL = 0.05, 0.5  # of the largest voltage
ANGLE_PERIODS: Final = 8
RELEASED_S: Final = 0.05  # in which a movement is no longer asked for, or has been agreed
AGREED: Final = 1.0  # of the movement's phase
MOVEMENT_ENDED: Final = {
    1: "the inverter has refused it: switching was enabled, or there was a torque request",
    2: "the commands stopped", 3: "the shaft turned faster than 30 % of the largest speed",
    4: "the shaft did not turn although a current makes torque: it is blocked or coupled, or the angle is wrong",
    5: "it took longer than a minute", 6: "a fault has disabled switching, or a torque was requested",
}  # fmt: skip
PERCENT: Final = 100.0
MOST_PERCENT: Final = 40.0


def _steady(magnitude: Array) -> tuple[int, int]:
    """First and last row of the longest stretch of one voltage, which current control never holds constant."""
    same = np.abs(np.diff(magnitude)) < STEADY * magnitude[1:]
    same &= magnitude[1:] > SMALL * magnitude.max(initial=0.0)
    ends = np.flatnonzero(np.diff(np.concatenate(([False], same, [False])).astype(int)))
    if not len(ends):
        return 0, 0
    begins, ends = ends[::2], ends[1::2]
    longest = int(np.argmax(ends - begins))
    return int(begins[longest]), int(ends[longest])


def pulsing(u_d: Array, u_q: Array, v_d: float, v_q: float) -> Array:
    """The rows in which the pulses act, including the return to zero current: each voltage has one magnitude."""
    axes = [np.abs(u) for u, v in ((u_d, v_d), (u_q, v_q)) if v > 0.0]
    first, last = _steady(axes[0])
    acts = np.zeros(len(u_d), bool)
    if last <= first:
        return acts
    levels = [np.median(axis[(first + last) // 2 : last + 1]) for axis in axes]
    while last + 1 < len(u_d) and any(abs(axis[last + 1] - level) < STEADY * level
                                      for axis, level in zip(axes, levels, strict=True)):  # fmt: skip
        last += 1
    last += 1  # the last voltage is a share of it
    while last + 1 < len(u_d) and u_d[last + 1] == 0.0 == u_q[last + 1]:  # until current control goes on
        last += 1
    acts[first : last + 1] = True
    return acts


class OverTheBus:
    """The drive with the names that a commissioning without a turning shaft needs."""

    switched_off: tuple[str, ...] = ()  # the trim acts while the shaft turns
    settings: tuple[str, ...] = ("dead_time_compensation",)
    slower: float = 12.0
    brake_s: float = 0.02  # whole periods of the command

    def __init__(self, line: Line, description: Description, known: Nameplate, vdc_V: float) -> None:
        self._line, self._known, self._description = line, known, description
        self.period_s = description.period_s
        self._level_share = known.level_V / vdc_V
        self._values = {value.name: value for value in description.values + description.measurements}
        self._factors = {base.name: base.factor for base in description.bases}
        self._enabled = False
        self._is_moving = self._is_imposed = False
        self._connection = Movement()
        self._failure = 0.0
        self.lightness, self.strikes, self.struck, self.dc_zero_V = LIGHTNESS, False, 0.0, 0.0
        self._prepared: dict[str, float] = {}
        line.pass_time(LISTEN_S)
        self._master = XcpMaster(line)
        unlock(self._master)
        self._scope = Scope(self._master, description)
        if not self._has_command(PULSE_STATE):
            raise FluxtrueError("commission: this firmware has no commands for voltage pulses")
        self.tells_angle_correction = self._has_command(ANGLE_CORRECTION)

    @property
    def line(self) -> Line:
        """Commands and state."""
        return self._line

    @property
    def passed(self) -> Callable[[float], None]:
        """Called with the seconds for which the drive has run."""
        return self._line.passed

    @passed.setter
    def passed(self, passed: Callable[[float], None]) -> None:
        self._line.passed = passed

    def _has_command(self, query: int) -> bool:
        """The firmware answers this query; an earlier version does not know it."""
        try:
            self._master.command(USER, query)
        except XcpRefused as error:
            if error.code != UNKNOWN:
                raise
            return False
        return True

    def _torque_Nm(self, i_q_A: float) -> float:
        """The torque of a current by the nameplate."""
        return 1.5 * self._known.pole_pairs * self._known.psi_f_Vs * i_q_A

    # Names.

    def set(self, name: str, value: float) -> None:
        """Set a value of the drive; without effect once the connection is lost: the drive then stops by itself."""
        if self._line.is_lost:
            return
        if name == "enable":
            self._enable() if value else self._disable()
        elif name == "torque_requested_Nm":
            self._line.ask(torque_Nm=value)
        elif name in MOVED:
            self._move(name, value)
        elif name not in IN_FIRMWARE:
            self._write(self._known_value(name), value)

    def get(self, name: str) -> float:
        """The present value."""
        if name == "run_state":
            return float(self._line.state in RUNNING)
        if name == "angle_reversed":
            return float(self._connection.is_reversed)
        if name == "pulses":
            return self._state()
        if name == "pulses_failure":
            self._state()
            return self._failure
        if name == "theta_e_rad":
            return float(np.angle(np.exp(1j * self.capture((name,), ANGLE_PERIODS)[:, 0]).mean()))
        if name == "compensation_V":
            return self.get("dead_time_compensation") * self._level_share * self.get("v_dc_V") * self._voltage_share()
        if name == "compensation_knee_A":
            return self._known.knee_A
        return self._read(self._known_value(name))

    def _voltage_share(self) -> float:
        """Without an offset, without reading the dc voltage over the bus."""
        return voltage_share(self.dc_zero_V, self.get("v_dc_V")) if self.dc_zero_V else 1.0

    def _known_value(self, name: str) -> Value:
        if name not in self._values:
            raise FluxtrueError(f"{name}: an ECU on the bus has no such value")
        return self._values[name]

    def _read(self, value: Value) -> float:
        content = upload(self._master, value.address, struct.calcsize(FORMATS[value.type]))
        return float(struct.unpack(FORMATS[value.type], content)[0]) * self._factors.get(value.base, 1.0)

    def _write(self, value: Value, to: float) -> None:
        self._master.command(SET_MTA, 0, 0, 0, *value.address.to_bytes(4, "little"))
        self._master.command(DOWNLOAD, 4, *struct.pack("<f", to))

    # The state of the inverter.

    def _enable(self) -> None:
        limit_Nm = self._torque_Nm(BRAKE_SHARE * self._known.i_max_A)  # of the torque that brakes the rotor
        self._line.ask(mode="torque", enable=False, torque_Nm=0.0, limit_Nm=limit_Nm)
        self._line.wait_for(("ready", *RUNNING), READY_S, "the dc link cannot be charged")
        if not self._enabled:
            self._agree()
        self._line.ask(enable=True)
        self._line.wait_for(RUNNING, RUN_S, "switching cannot be enabled")
        self._enabled = True

    def _disable(self) -> None:
        self._enabled = False
        self._line.ask(enable=False, torque_Nm=0.0)
        if self._line.movement is None:
            return
        self._line.move(d_percent=0.0, q_percent=0.0, direction="stand", is_damped=False, agrees_to_pulses=False)
        self._line.pass_time(OFF_S)
        self._line.move(kind="none")
        self._line.pass_time(RELEASED_S)

    # Movements of the shaft.

    def _move(self, name: str, value: float) -> None:
        """The names of software in the loop; what connects the angle acts when switching is enabled again."""
        if name in ("id_ref_A", "iq_ref_A"):
            percent = min(max(PERCENT * value / self._known.i_max_A, -MOST_PERCENT), MOST_PERCENT)
            self._line.move(**{f"{name[1]}_percent": percent})
        elif name == "imposed_hz":
            self._line.move(direction="stand" if value == 0.0 else "forward" if value > 0.0 else "backward")
        elif name == "current_mode":
            self._is_moving = value != 0.0
        elif name == "angle_imposed":
            self._is_imposed = value != 0.0
        elif name == "angle_pole_pairs":
            self._connection = replace(self._connection, kind="connected", pole_pairs=round(value))
        elif name == "angle_reversed":
            self._connection = replace(self._connection, is_reversed=value != 0.0)
        else:
            self._connection = replace(self._connection, offset_rad=value)

    def _kind(self) -> str:
        """The movement that is needed: without a known connection, and without currents, none."""
        if self._is_moving:
            return "imposed" if self._is_imposed else "spin"
        return self._connection.kind

    def _agree(self) -> None:
        """The consent to a movement or to pulses, before switching is enabled; none is left of an earlier one."""
        kind, pulses = self._kind(), not self._is_moving
        self._line.move(agrees_to_pulses=False)
        self._line.pass_time(RELEASED_S)
        self._line.movement = replace(self._connection, kind=kind, agrees_to_pulses=pulses)
        self._line.pass_time(RELEASED_S)
        phase, failure = self._movement_state()
        if kind != "none" and phase != AGREED:
            raise FluxtrueError(f"commission: the movement has not begun: {MOVEMENT_ENDED.get(failure, 'no answer')}")
        if pulses and not self._is_agreed_to_pulses():
            raise FluxtrueError(f"commission: no consent to voltage pulses (state {self._line.state}): no frame with "
                                "it has arrived, or a torque was requested")  # fmt: skip

    def _movement_state(self) -> tuple[float, int]:
        phase, failure, *_ = self._master.command(USER, MOVEMENT_STATE)
        return float(phase), failure

    def _is_agreed_to_pulses(self) -> bool:
        _phase, _failure, agreed, *_ = self._master.command(USER, PULSE_STATE)
        return agreed != 0

    def shaft_rad_s(self) -> float:
        """The mechanical speed, positive in the electrical direction: the drive reports it with its own pole pairs."""
        share = self._known.pole_pairs / self._connection.pole_pairs
        return self.get("speed_rpm") * share * math.pi / 30.0

    def angle_correction(self) -> list[complex]:
        """What the firmware adds to the sensor's angle, once and twice per turn: Re(value exp(j k theta)), mechanical,
        rad. Only of a firmware that tells it."""
        got = [self._master.command(USER, ANGLE_CORRECTION + n) for n in range(4)]
        cosine_1, sine_1, cosine_2, sine_2 = (struct.unpack("<i", bytes(each[:4]))[0] for each in got)
        return [2.0 * math.pi / 2**32 * complex(c, -s) for c, s in ((cosine_1, sine_1), (cosine_2, sine_2))]

    def damp(self, is_damped: bool) -> None:
        """Brake the swing of the rotor about the current, in the firmware."""
        self._line.move(is_damped=is_damped)

    def _check(self) -> None:
        """Check that the drive still runs if it should."""
        if not self._enabled or self._line.state in RUNNING:
            return
        self._enabled = False
        named = faults.named(int(self._read(self._values["fault_word"])))
        ended = MOVEMENT_ENDED.get(self._movement_state()[1]) if self._line.refused == ENDED else None
        why = ", ".join(named) or ended or self._line.refused
        raise FluxtrueError(f"commission: the inverter has stopped (state {self._line.state}): {why}")

    def rest(self, seconds: float) -> None:
        """Let the drive run."""
        if not self._line.is_lost:
            self._line.pass_time(seconds)
            self._check()

    def switch_off(self) -> None:
        """Disable switching and discharge the dc link."""
        self._enabled = False
        self._line.ask(mode="off", enable=False, torque_Nm=0.0, limit_Nm=0.0)
        if self._line.movement is not None:
            self._line.move(agrees_to_pulses=False)
        with contextlib.suppress(FluxtrueError):  # without commands the drive stops by itself
            self.rest(OFF_S)

    # The dc link.

    def discharge(self) -> str:
        """Mode off: in state standby contactor, precharge and discharge are off, and the dc link is below 60 V."""
        self._enabled = False
        self._line.ask(mode="off", enable=False, torque_Nm=0.0)
        try:
            self._line.wait_for(("standby",), LINK_S, "the dc link cannot be switched off")
        except FluxtrueError:
            if self._line.is_lost:
                raise
            return f"the dc link is not off: the inverter is in state {self._line.state or 'unknown'}"
        return ""

    def dc_link_V(self, seconds: float) -> Array:
        """As the scope captures it."""
        periods = round(seconds / self.period_s)
        return self.capture_during(("v_dc_V",), periods, max(periods // LINK_SAMPLES, 1), self.rest)[:, 0]

    def falling_link_V(self) -> Array:
        """Charged, then discharged by mode off; nothing if it cannot be charged."""
        self._line.ask(mode="torque", enable=False)
        try:
            self._line.wait_for(("ready",), READY_S, "the dc link cannot be charged")
        except FluxtrueError:
            if self._line.is_lost:
                raise
            return np.zeros(1)

        def switch_off(seconds: float) -> None:
            self._line.ask(mode="off")
            self.rest(seconds)

        periods = round(LINK_FALLS_S / self.period_s)
        return self.capture_during(("v_dc_V",), periods, math.ceil(periods / WORDS), switch_off)[:, 0]

    def end_discharge(self) -> None:
        """The mode stays off; the next step charges the dc link."""
        self._line.ask(mode="off")

    def reset_faults(self) -> None:
        """One edge of the reset, after switch_off(). The ECU grants it in state fault."""
        self._line.ask(fault_reset=True)
        self.rest(RESET_S)
        self._line.ask(fault_reset=False)

    # Movements and captures.

    def speed_rpm(self, seconds: float) -> float:
        """Let the drive run; return the speed at the end, which the drive reports some milliseconds later."""
        self.rest(seconds + LATE_S)
        return self.get("speed_rpm")

    def free_speed_rpm(self) -> float:
        """When the torque has fallen and the reported speed has followed. Not repeated: the offsets of the sensors,
        which cannot be held at zero, turn a light rotor meanwhile."""
        return self.speed_rpm(SEEN_S + FALL_S)

    def push(self, current_A: complex, offset_A: complex = 0j) -> None:
        """Request a torque instead of a current, which cannot be commanded on the bus."""
        self._line.ask(torque_Nm=self._torque_Nm(current_A.imag))

    def hold(self, offset_A: complex) -> None:
        """Request no torque. The rotor rests where the current of the sensors' offsets makes no torque. A constant
        torque against that of the offsets would move it away from there, and the drive would take it for a wrong
        angle."""
        self.let_go()

    def let_go(self) -> None:
        """Request no torque."""
        self._line.ask(torque_Nm=0.0)

    def capture(self, names: Sequence[str], periods: int) -> Array:
        """Capture as many rows as the scope holds; without a signal of the scope, let the drive run."""
        if not set(names) <= set(CAPTURED):
            self.rest(periods * self.period_s)
            return np.zeros((1, len(names)))
        return self.capture_during(names, periods, 1, nothing)

    def capture_during(
        self, names: Sequence[str], periods: int, divisor: int, action: Callable[[float], None]
    ) -> Array:
        """Capture every so many periods; the action is given the time that the capture takes, and may let time pass."""
        signals = [CAPTURED[name] for name in names]
        self._arm(signals, periods // divisor, divisor)
        self._trigger()
        with self._fault_first():
            action(periods * self.period_s)
            self._scope.until_complete(2.0 * periods * self.period_s + 1.0)
            self._check()
            columns = self._captured()
        return np.column_stack([self._column(columns, name) for name in names])

    def _captured(self, most: int | None = None) -> Mapping[str, Array]:
        """The capture's columns; what the machine is identified from must be complete."""
        capture = self._scope.read(most=most)
        if capture.warning:
            raise FluxtrueError(f"commission: {capture.warning}")
        share = self._voltage_share()
        return {
            name: share * column if name in CAPTURED_VOLTAGES else column for name, column in capture.columns.items()
        }

    @staticmethod
    def _column(columns: Mapping[str, Array], name: str) -> Array:
        column = columns[CAPTURED[name]]
        if name == "sensor_turns":
            return np.unwrap(column, period=DEGREES) / DEGREES
        return np.radians(column) if name == "theta_e_rad" else column

    def _arm(self, signals: Sequence[str], samples: int, divisor: int = 1) -> None:
        assert len(signals) <= SIGNALS_MAX
        self._prepared = {}  # another setup than that of the pulses
        setup = make_setup(
            self._scope.signals, signals, "manual", None, 0.0, 0.0, min(samples, WORDS // len(signals)), divisor
        )
        with self._fault_first():
            self._scope.stop()
            self._scope.take(setup)
            self._scope.arm()

    def _trigger(self) -> None:
        with self._fault_first():
            self._scope.trigger()

    @contextlib.contextmanager
    def _fault_first(self) -> Iterator[None]:
        """A fault takes the scope for its freeze frame: then the fault is the reason, not what the scope refuses."""
        try:
            yield
        except FluxtrueError:
            self.rest(TOLD_S)
            raise

    def _state(self) -> float:
        """Phase of the pulses."""
        phase, self._failure, *_ = map(float, self._master.command(USER, PULSE_STATE))
        return phase

    def _raw(self, name: str, value: float) -> int:
        if name.endswith("_A"):
            return round(value / self._factors["CURRENT"])
        if name == "pulses_angle_rad":
            return round(value / (2.0 * np.pi) * 65536.0)
        return round(Q15 * value) if name in ("pulses_vd", "pulses_vq", "pulses_first") else round(value)

    def _captured_periods(self, values: Mapping[str, float]) -> int:
        return round(values["pulses_periods"] + MARGIN_S / self.period_s)

    def prepare(self, values: Mapping[str, float]) -> None:
        """What takes time before a start: the values are set, and the scope waits."""
        for field, name in enumerate(FIELDS):
            self._master.command(
                USER, PULSE_SET, field, *(self._raw(name, values[name]) & 0xFFFF).to_bytes(2, "little")
            )
        self._arm([CAPTURED[name] for name in PULSE_SIGNALS], self._captured_periods(values))
        self._prepared = dict(values)

    def pulse(self, values: Mapping[str, float]) -> Array:
        """Captured from before their start to after their end, or as far as the scope's memory reaches."""
        if self._prepared != values:
            self.prepare(values)
        self._prepared = {}
        begun_s, periods = self._line.now_s, self._captured_periods(values)
        self._trigger()
        self._master.command(USER, PULSE_START)
        phase = self._until_ended()
        most = math.ceil((self._line.now_s - begun_s) / self.period_s)
        if self._failure in (STOPPED, NO_CONSENT):
            self.rest(TOLD_S)
        with self._fault_first():
            self._scope.until_complete(periods * self.period_s + 1.0)
            columns = self._captured(most)
        rows = np.column_stack([self._column(columns, name) for name in PULSE_SIGNALS])
        acts = pulsing(rows[:, 2], rows[:, 3], values["pulses_vd"], values["pulses_vq"])
        if acts[-1] and phase == DONE:
            raise FluxtrueError(f"commission: the voltage pulses last longer than the {len(rows)} periods of the scope")
        # The scope has the voltage that acts in a period, SIGNALS that of the next one.
        state = np.where(acts[1:], PULSE, phase)
        return np.column_stack((rows[:-1, :2], rows[1:, 2:4], rows[:-1, 4:], state))

    def _until_ended(self) -> float:
        waited_s = 0.0
        while (phase := self._state()) not in (DONE, FAILED):
            if waited_s > 2.0 * PERIODS_MAX * self.period_s:
                raise FluxtrueError("commission: the voltage pulses do not end")
            self.rest(POLL_S)
            waited_s += POLL_S
        return phase
