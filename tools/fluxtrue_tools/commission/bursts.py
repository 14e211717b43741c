# SPDX-License-Identifier: Apache-2.0
"""Bursts of voltage pulses: commanded, recorded, integrated to flux linkages (CM-9) ... (CM-11)."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fluxtrue_tools import faults
from fluxtrue_tools.commission.drive import FAILED, MEASURED, PERIODS_MAX, PULSE, SEEN_S, STANDING_RPM, Capture
from fluxtrue_tools.commission.nameplate import SWING_DEG, Nameplate
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import Array

FAILURES = {1: "refused", 2: "switching was disabled", 3: "the rotor moved", 4: "the current did not reach its bound",
            5: "the current exceeded the machine's largest",
            6: "without a consent: VCU_Commission has not agreed to them, or agrees no longer"}  # fmt: skip
REFUSED, MOVED, TOO_LARGE, NO_CONSENT = FAILURES[1], FAILURES[3], FAILURES[5], FAILURES[6]
STARTS = 6  # of one burst
PUSHES = 20  # short currents against a light rotor, at most
FOLLOW_S, FOLLOWED = 0.02, 14  # a heavy rotor: time between two changes of the current, and their number at most
STRIKE, STRIKE_FIRST, STRIKE_VOLTAGE = (0.01, 0.3), 0.06, 0.15  # bounds of i_max, the first of them; of the voltage
STRIKES, STRUCK = 10, 3.0  # at most; by how much one may change what is known of their effect
STRIKE_PAIRS = 4  # from so many pole pairs on a rotor stands at the same electrical speed
CERTAIN_RPM = 2.0  # change of the speed that is expected: from it on other torques hardly count
LIGHT, HEAVY = (0.1, 100.0), 0.5  # range of the lightness; up to HEAVY a rotor counts as heavy
ADAPTED, ADAPTED_LITTLE = 16.0, 2.0  # times at most that a current may show; the lightness changes by the root of it
REST_S = 0.005  # before a burst: the drive sees that the rotor stands
TURN = 2.0 * math.pi
CLOSER = 0.998  # times a bound: safely closer to zero, also in the firmware's steps of the current
STEADY = 1e-6  # of a knee: a current that does not change in a period


def shown_bounds(low_A: float, high_A: float, by_A: float) -> tuple[float, float]:
    """Bounds for currents that the sensors show larger by by_A. The firmware begins towards the bound that is further
    from zero, the upper one if both are as far: so that it begins in the same direction, the other one gives way."""
    low, high = low_A + by_A, high_A + by_A
    return (max(low, -high), high) if high_A >= -low_A else (low, min(high, -CLOSER * low))


@dataclass(frozen=True)
class Burst:
    """What the firmware is asked for; voltages as a share of the largest one, currents in A."""

    v_d: float
    v_q: float
    d: tuple[float, float]
    q: tuple[float, float]
    reversals: int
    delay: int = 0
    first: float = 0.7071  # without saturation: half of the impulse
    angle_deg: float = SWING_DEG
    periods: int = PERIODS_MAX

    @property
    def axes(self) -> tuple[float, float]:
        """An axis without voltage and current has a phase whose current is zero, and with it its voltage unknown."""
        return float(self.v_d > 0.0), float(self.v_q > 0.0)

    def shifted(self, by_A: complex) -> "Burst":
        """The same pulses with bounds for the currents that the sensors will show."""
        return replace(self, d=shown_bounds(*self.d, by_A.real), q=shown_bounds(*self.q, by_A.imag))

    def values(self) -> dict[str, float]:
        """The values by their names in the firmware."""
        return {"pulses_vd": self.v_d, "pulses_vq": self.v_q, "pulses_first": self.first,
                "pulses_id_low_A": self.d[0], "pulses_id_high_A": self.d[1],
                "pulses_iq_low_A": self.q[0], "pulses_iq_high_A": self.q[1],
                "pulses_angle_rad": math.radians(self.angle_deg), "pulses_delay": float(self.delay),
                "pulses_reversals": float(self.reversals), "pulses_periods": float(self.periods)}  # fmt: skip

    def command(self, drive: Capture) -> None:
        """Set all values and start."""
        for name, value in self.values().items():
            drive.set(name, value)
        drive.set("pulses", PULSE)


@dataclass(frozen=True)
class Raw:
    """A recorded burst: currents of each sample, and the voltage that acts until the next one."""

    i: Array  # complex, rotor frame
    u: Array  # complex, in the frame of the middle of its period
    theta: Array  # electrical, continuous
    zero: Array  # mean of the three phase currents: not zero only by errors of the sensors
    period_s: float
    axes: tuple[float, float] = (1.0, 1.0)  # weights of psi_d and psi_q
    failure: str = ""

    @property
    def is_valid(self) -> bool:
        """Up to its end by a movement of the rotor a burst is valid."""
        return self.failure in ("", MOVED)

    @property
    def moved_rad(self) -> float:
        """Electrical."""
        return float(np.abs(self.theta - self.theta[0]).max())

    def within(self, low_A: float, high_A: float) -> "Raw":
        """From the first to the last sample whose current along d is between the two: on the way back to zero the
        inductance is another one, and near zero the voltages of the legs are unknown."""
        inside = np.flatnonzero((self.i.real > low_A) & (self.i.real < high_A))
        kept = slice(int(inside[0]), int(inside[-1]) + 1) if len(inside) else slice(0)
        return self.part(kept)

    def part(self, kept: slice) -> "Raw":
        """Some of the samples."""
        return replace(self, i=self.i[kept], u=self.u[kept], theta=self.theta[kept], zero=self.zero[kept])

    def without(self, offset: complex) -> "Raw":
        """Without the offsets of the current sensors, which are constant in the stationary frame."""
        return replace(self, i=self.i - offset * np.exp(-1j * self.theta))

    def compensated(self, offset: complex, level_V: float, knee_A: float) -> "Raw":
        """With the voltage that the drive's compensation of the dead time has added, from the second sample on: it goes
        by the currents that the sensors have shown, with their offset, one sample before the voltage acts."""
        shown = self.i * np.exp(1j * self.theta) + offset
        added = level_V * legs_vector(shown[:-1], knee_A) * np.exp(-1j * self.theta[1:])
        return replace(self, i=self.i[1:], u=self.u[1:] + added, theta=self.theta[1:], zero=self.zero[1:])


def _aligned(rows: Array, period_s: float, burst: Burst, failure: str) -> Raw:
    """The voltage of a row acts in the period after its sample."""
    i = rows[1:, 0] + 1j * rows[1:, 1]
    u = rows[:-1, 2] + 1j * rows[:-1, 3]
    return Raw(i, u, np.unwrap(rows[1:, 4]), rows[1:, 5], period_s, burst.axes, failure)


def _phase_word(drive: Capture) -> str:
    return FAILURES.get(int(drive.get("pulses_failure")), "") if drive.get("pulses") == FAILED else ""


def shift(drive: Capture, known: Nameplate) -> complex:
    """In A, what the current sensors show without current, in the rotor frame now."""
    return complex(known.offset_A * np.exp(-1j * drive.get("theta_e_rad")))


def _adapted(lightness: float, change_rpm: float, guessed_rpm: float) -> float:
    """From the change of the speed by a current, and that of a rotor as heavy as is guessed. A small change also shows
    what else turns the rotor, and counts less."""
    if change_rpm * guessed_rpm <= 0.0:
        return lightness
    most = ADAPTED if lightness * abs(guessed_rpm) > CERTAIN_RPM else ADAPTED_LITTLE
    shown = min(max(change_rpm / guessed_rpm, lightness / most), lightness * most)
    return min(max(math.sqrt(lightness * shown), LIGHT[0]), LIGHT[1])


def _push_once(drive: Capture, known: Nameplate, speed_rpm: float) -> float:
    """A short current against the speed of a light rotor; how light it is follows from what the current has changed."""
    i_A = known.brake_A(speed_rpm, drive.brake_s, drive.lightness)
    drive.push(1j * i_A, known.offset_A)
    drive.rest(drive.brake_s)
    drive.hold(known.offset_A)
    after = drive.free_speed_rpm()
    drive.lightness = _adapted(drive.lightness, after - speed_rpm, known.gained_rpm(i_A, drive.brake_s))
    return after


def _follow(drive: Capture, known: Nameplate, speed_rpm: float) -> None:
    """A current that follows the speed of a heavy rotor to zero: what a short one lacks, because it rises slowly and
    the legs' errors take a part of it, is not known. Where it reverses the rotor, half of it follows.

    The lightness is not changed any more: a rotor that counts as heavy does so until the end of the measurement."""
    strength = 1.0
    for _ in range(FOLLOWED):
        if abs(speed_rpm) < STANDING_RPM:
            break
        drive.push(1j * strength * known.brake_A(speed_rpm, FOLLOW_S), known.offset_A)
        before, speed_rpm = speed_rpm, drive.speed_rpm(FOLLOW_S)
        strength *= 0.5 if speed_rpm * before < 0.0 else 1.0
    drive.hold(known.offset_A)
    drive.rest(FOLLOW_S)


def _bound_A(drive: Capture, known: Nameplate, speed_rpm: float) -> float:
    """Of a half wave that takes the speed away: its impulse grows with the square of its bound."""
    least, most = (share * known.i_max_A for share in STRIKE)
    if drive.struck <= 0.0:
        return STRIKE_FIRST * known.i_max_A
    return min(max(math.sqrt(abs(speed_rpm) / drive.struck), least), most)


def _strike_once(drive: Capture, known: Nameplate, speed_rpm: float) -> float:
    """One half wave of pulses along q against the speed, and the speed after it, which says for the next one by how
    much a bound changes it: (CM-44)."""
    top_A = _bound_A(drive, known, speed_rpm)
    q = (0.0, top_A) if speed_rpm < 0.0 else (-top_A, 0.0)
    burst = Burst(0.0, STRIKE_VOLTAGE, (-top_A, top_A), q, reversals=1, first=1.0, angle_deg=known.swing_deg)
    drive.pulse(burst.shifted(shift(drive, known)).values())
    drive.hold(known.offset_A)
    after = drive.speed_rpm(FOLLOW_S)
    changed = (speed_rpm - after) * math.copysign(1.0, speed_rpm)
    if _phase_word(drive) != REFUSED and (drive.struck <= 0.0 or abs(changed) > 2.0 * STANDING_RPM):
        shown = max(changed, STANDING_RPM / 10.0) / top_A**2
        low, high = (drive.struck / STRUCK, drive.struck * STRUCK) if drive.struck > 0.0 else (0.0, math.inf)
        drive.struck = min(max(shown, low), high)
    return after


def _strike(drive: Capture, known: Nameplate, speed_rpm: float) -> None:
    """Half waves against the speed of a heavy rotor, one after the other: unlike a small reference of the current
    control their current does not depend on what the legs lose. The firmware refuses them while the rotor turns fast:
    then a current follows the speed first. With many pole pairs the same electrical angle is a slower shaft."""
    standing_rpm = STANDING_RPM * min(STRIKE_PAIRS / known.pole_pairs, 1.0)
    for _ in range(STRIKES):
        if abs(speed_rpm) < standing_rpm:
            break
        speed_rpm = _strike_once(drive, known, speed_rpm)
        if _phase_word(drive) == REFUSED:
            _follow(drive, known, speed_rpm)
            speed_rpm = drive.speed_rpm(FOLLOW_S)


def _brake(drive: Capture, known: Nameplate) -> None:
    """The alternating torque leaves some speed, which small currents along q take away.

    With a light rotor only a speed without current counts: the current of a rotor that has just stopped would turn it
    back while it falls to zero. A heavy one is braked by half waves, over CAN by a current that follows its speed.
    Without current is without the offsets of the sensors, whose torque turns a light rotor."""
    drive.hold(known.offset_A)
    speed = drive.speed_rpm(SEEN_S)
    for _ in range(PUSHES):
        if abs(speed) < STANDING_RPM:
            break
        if drive.lightness <= HEAVY:
            (_strike if drive.strikes else _follow)(drive, known, speed)
            break
        speed = _push_once(drive, known, speed)
    drive.rest(REST_S)


def _started(drive: Capture, burst: Burst, known: Nameplate) -> Array:
    """The rows of a burst. A step of the angle sensor is a jump of the measured speed, with which the firmware refuses
    a start even at a standstill: it is tried again."""
    for _ in range(STARTS):
        values = replace(burst, angle_deg=known.swing_deg).shifted(shift(drive, known)).values()
        # Before the rotor is brought to a standstill, which does not last. A turn of it meanwhile changes the bounds by
        # twice the offsets of the sensors at most.
        drive.prepare(values)
        _brake(drive, known)
        rows = drive.pulse(values)
        if _phase_word(drive) != REFUSED or drive.get("fault_word"):
            break
    return rows


def record(drive: Capture, burst: Burst, known: Nameplate) -> Raw:
    """One burst, from zero current to zero current."""
    rows = _started(drive, burst, known)
    fault = int(drive.get("fault_word"))
    if fault:
        raise FluxtrueError(f"commission: a fault ended the voltage pulses: {', '.join(faults.named(fault))}")
    active = np.nonzero(np.abs(rows[:, 2] + 1j * rows[:, 3]) > 0.0)[0]
    failure = _phase_word(drive)
    if failure in (REFUSED, NO_CONSENT) or not len(active):
        raise FluxtrueError(f"commission: voltage pulses {failure or 'had no voltage'}")
    running = np.nonzero(rows[:, -1] == PULSE)[0]
    rows = rows[max(running[0] - 1, 0) : running[-1] + 1]
    return _aligned(rows, drive.period_s, burst, failure).without(known.offset_A)


def offset(drive: Capture, seconds: float = 0.1) -> tuple[complex, float]:
    """Mean current with switching disabled, in the stationary frame, and the standard deviation of its components."""
    rows = drive.capture(MEASURED, round(seconds / drive.period_s))
    i_s = (rows[:, 0] + 1j * rows[:, 1]) * np.exp(1j * rows[:, 4])
    spread = math.sqrt(0.5 * float(np.var(i_s)))  # np.var() of complex values adds both components
    return complex(i_s.mean()), spread / math.sqrt(len(i_s))


@dataclass(frozen=True)
class Linkage:
    """A burst as flux linkages: the change since its start, and what an error of each kind would have added."""

    i: Array
    psi: Array  # complex, rotor frame
    turned: Array  # e^(-j delta): what the magnet's flux of the start is multiplied by
    of_r: Array  # change of psi per ohm of error
    of_level: Array  # per volt that a leg loses
    axes: tuple[float, float]


def _three_legs(i_s: Array, of_leg: Callable[[Array], Array]) -> Array:
    """The vector of what each leg has at its current."""
    axes = [np.exp(2j * np.pi * k / 3.0) for k in range(3)]
    return np.asarray(sum(2.0 / 3.0 * axis * of_leg((i_s * np.conj(axis)).real) for axis in axes))


def legs_vector(i_s: Array, knee_A: float) -> Array:
    """The vector of three legs whose voltages are sat(i/knee)."""
    return _three_legs(i_s, lambda i: np.clip(i / knee_A, -1.0, 1.0))


def legs_of(i_s: Array, knee_A: float) -> Array:
    """The vector of three legs that lose 1 V at large currents; a knee of 0 is that of a constant voltage."""
    return _three_legs(i_s, lambda i: leg_share(i, knee_A) if knee_A > 0.0 else np.sign(i))


def mean_sign(begins: Array, ends: Array) -> Array:
    """Of currents that change along straight lines from begins to ends: (CM-25)."""
    change = ends - begins
    return np.where(
        change == 0.0, np.sign(ends), (np.abs(ends) - np.abs(begins)) / np.where(change == 0.0, 1.0, change)
    )


def leg_share(i: Array, knee_A: float) -> Array:
    """Of its voltage, with its sign, that a leg loses at a current: (CM-33)."""
    over = np.abs(i) / knee_A
    return np.sign(i) * np.where(over < 1.0, 0.5 * over, 1.0 - 0.5 / np.maximum(over, 1.0))


def _area(i: Array, knee_A: float) -> Array:
    """The integral of leg_share() from zero on."""
    over = np.abs(i) / knee_A
    beyond = np.maximum(over, 1.0)
    return knee_A * np.where(over < 1.0, 0.25 * over * over, beyond - 0.5 * np.log(beyond) - 0.75)


def mean_share(begins: Array, ends: Array, knee_A: float) -> Array:
    """What (CM-33) has in place of the mean sign; a knee of 0 is that of a constant voltage."""
    if knee_A <= 0.0:
        return mean_sign(begins, ends)
    change = ends - begins
    steady = np.abs(change) < STEADY * knee_A
    means = (_area(ends, knee_A) - _area(begins, knee_A)) / np.where(steady, 1.0, change)
    return np.where(steady, leg_share(0.5 * (begins + ends), knee_A), means)


def of_legs(i_s: Array, knee_A: float) -> Array:
    """The vector of three legs that lose 1 V at large currents: means over each period."""
    return _three_legs(i_s, lambda i: mean_share(i[:-1], i[1:], knee_A))


def _sum(means: Array, period_s: float) -> Array:
    """The integral from the first sample on, of what is constant in each period."""
    return period_s * np.concatenate(([0.0], np.cumsum(means)))


def level_linkage(raw: Raw, knee_A: float) -> Array:
    """What the legs' voltage adds to the flux linkage for each volt that is not compensated, in the rotor frame."""
    i_s = raw.i * np.exp(1j * raw.theta)
    return np.asarray(-_sum(of_legs(i_s, knee_A), raw.period_s) * np.exp(-1j * raw.theta))


def integrate(raw: Raw, r_ohm: float, knee_A: float = 0.0) -> Linkage:
    """(CM-11): in the stationary frame, so that a movement of the rotor is part of the model."""
    turn = np.exp(1j * raw.theta)
    middle = np.exp(0.5j * (raw.theta[1:] + raw.theta[:-1]))
    i_s = raw.i * turn
    volts = _sum(raw.u[:-1] * middle, raw.period_s)
    r_part = _sum(0.5 * (i_s[1:] + i_s[:-1]), raw.period_s)
    back = np.exp(-1j * raw.theta)
    of_level = level_linkage(raw, knee_A)
    return Linkage(raw.i, (volts - r_ohm * r_part) * back, back * turn[0], -r_part * back, of_level, raw.axes)
