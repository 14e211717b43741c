# SPDX-License-Identifier: Apache-2.0
"""Angle offset and magnet's flux linkage of a turning machine: (CM-18), (CM-19).

The machine is accelerated to a part of its speed in both directions and coasts there with small currents along d, in
both polarities. The voltage that does not change its sign with the current is that of the magnet. The angle of the same
windows shows the harmonics of its sensor (harmonics.py).
"""

import cmath
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from fluxtrue_tools.commission import turning
from fluxtrue_tools.commission.drive import Capture
from fluxtrue_tools.commission.harmonics import Coasting, Direction, Harmonics, fit, together
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.turning import Connection
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import Array

NAME = "spin"
D_SHARE = 0.06  # of i_max: the larger of the two currents along d
LEVELS = (1.0, -1.0, 0.5, -0.5, -0.5, 0.5, -1.0, 1.0)  # of it: what drifts evenly is no odd part
LEVEL_S, WINDOW_S = 0.2, 0.05
LEVEL_MOST_S = 0.5  # of a level, on a shaft that has not made a turn before
SHAFT_TURNS = 1.2  # that a level should contain, of a shaft that becomes slower
SETTLED_SHARE = 1e-3  # of i_max: the mean current of a window is the wanted one
WINDOWS = 20  # to settle a level
LONGER, LEAST_TURNED = 1.2, 0.2  # electrical turns: of the window after one without a whole turn
SLOW_HZ, SLOW_SHARE = 20.0, 0.22  # electrical, and of the reached speed: below, the shaft is accelerated again
NEAR_SHARE = 0.9  # of the reached speed: more than this is no slow shaft
COMPENSATION = "dead_time_compensation"
Q_SHARES = (0.02, 0.04, 0.08, 0.16, 0.25, 0.4)  # of i_max: more while the machine does not accelerate
ALONG_Q = tuple(1j * share for share in Q_SHARES)
TURNED = (*ALONG_Q, Q_SHARES[-1] * cmath.exp(1j * math.atan2(1.0, -0.5)))  # with reluctance for a weak magnet
TRY_S, REACH_S, LONGEST_S = 0.05, 0.8, 10.0
PARTS, OVER = 20, 1.1  # of a try, and of the wanted speed: a light rotor gains more than it may in one try
ENOUGH_SHARE = 0.5  # of the wanted speed: a machine whose drag takes all of its torque before is measured there
BRAKE_STEPS = 15  # with each of the currents
ROUGH_RAD = math.radians(4.0)  # beyond, the currents along d make torque
STANDING_SHARE = 0.01  # of the wanted speed
ROUNDS = 2
D = TypeVar("D", bound=Capture)


@dataclass(frozen=True)
class Magnet:
    """One direction: flux linkage in the frame of the assumed angle."""

    psi_Vs: complex
    omega_rad_s: float  # electrical
    sensor: Direction | None = None  # its harmonics, if they can be seen

    @property
    def error_rad(self) -> float:
        """By which the rotor is ahead of the assumed angle."""
        return float(np.angle(self.psi_Vs))


@dataclass(frozen=True)
class Spun:
    """Both directions."""

    connection: Connection
    psi_f_Vs: float
    psi_f_sigma_Vs: float
    offset_sigma_rad: float
    lag_s: float  # by which the angle is late; iron losses seem to be a negative one
    omega_rad_s: float  # electrical, at which that was seen
    harmonics: Harmonics | None = None  # of the angle sensor


def reach(drive: Capture, known: Nameplate, wanted_rad_s: float, step: str, currents: Sequence[complex], speed: float,
          advance: Callable[[], float]) -> None:  # fmt: skip
    """Accelerate with as little current as reaches the speed in about REACH_S.

    After LONGEST_S a part of the speed is enough: a weak magnet makes little torque of the largest current.

    currents   one after the other, as shares of i_max, d and q in the direction of the rotation: ALONG_Q or TURNED
    speed      mechanical, positive in the electrical direction
    advance    lets TRY_S pass, and returns the speed then
    """
    seconds, tries, level, i_A = 0.0, 0, 0, 0j
    sign = math.copysign(1.0, wanted_rad_s)
    while sign * speed < abs(wanted_rad_s):
        if seconds > LONGEST_S:
            if sign * speed >= ENOUGH_SHARE * abs(wanted_rad_s):
                return
            raise FluxtrueError(f"commission: {step}: the shaft reached {abs(speed) * 30 / math.pi:.0f} rpm of "
                                f"{abs(wanted_rad_s) * 30 / math.pi:.0f} rpm with {abs(i_A):.3g} A: it is coupled or "
                                "blocked, or the angle is wrong")  # fmt: skip
        i_A = currents[level] * known.i_max_A
        turning.currents(drive, i_A.real, sign * i_A.imag)
        before, speed = speed, advance()
        seconds, tries = seconds + TRY_S, tries + 1
        late = sign * (speed - before) * REACH_S < 0.5 * TRY_S * abs(wanted_rad_s)
        level = min(level + 1, len(currents) - 1) if late and tries % 2 == 0 else level


def accelerate(drive: Capture, known: Nameplate, wanted_rad_s: float, step: str,
               currents: Sequence[complex] = ALONG_Q, speed: float = 0.0) -> Array:  # fmt: skip
    """From a standstill, or the given speed; all rows are kept."""
    rows: list[Array] = []

    def advance() -> float:
        begun = len(rows)
        for _ in range(PARTS):
            rows.append(turning.advance(drive, TRY_S / PARTS, step))
            if abs(turning.speed_rad_s(rows[-1], drive.period_s)) > OVER * abs(wanted_rad_s):
                break
        taken = np.vstack(rows[begun:])
        return turning.speed_rad_s(taken[len(taken) // 2 :], drive.period_s) * _electrical_sign(drive)

    reach(drive, known, wanted_rad_s, step, currents, speed, advance)
    return np.vstack(rows)


def _last_speed(drive: Capture, rows: Array) -> float:
    """At the end of the rows, mechanical, positive in the electrical direction."""
    last = rows[-round(0.5 * WINDOW_S / drive.period_s) :]
    return turning.speed_rad_s(last, drive.period_s) * _electrical_sign(drive)


def _electrical_sign(drive: Capture) -> float:
    return -1.0 if drive.get("angle_reversed") else 1.0


def stop(drive: Capture, known: Nameplate, wanted_rad_s: float, speed: Callable[[], float],
         advance: Callable[[], None]) -> None:  # fmt: skip
    """Brake to a standstill, with more current while that takes long.

    speed     mechanical, positive in the electrical direction
    advance   lets a step of the tool pass
    """
    sign = math.copysign(1.0, wanted_rad_s)
    for n in range(round(LONGEST_S / turning.STEP_S)):
        if sign * speed() < STANDING_SHARE * abs(wanted_rad_s):
            break
        share = Q_SHARES[min(n // BRAKE_STEPS, len(Q_SHARES) - 2)]
        turning.currents(drive, 0.0, -sign * share * known.i_max_A)
        advance()
    turning.currents(drive, 0.0, 0.0)


def brake(drive: Capture, known: Nameplate, wanted_rad_s: float, step: str) -> Array:
    """Back to a standstill; all rows are kept."""
    rows = [turning.advance(drive, turning.STEP_S, step)]

    def speed() -> float:
        return turning.speed_rad_s(rows[-1], drive.period_s) * _electrical_sign(drive)

    stop(drive, known, wanted_rad_s, speed, lambda: rows.append(turning.advance(drive, turning.STEP_S, step)))
    return np.vstack(rows)


def _is_slow(speed_rad_s: float, top_rad_s: float, known: Nameplate) -> bool:
    """The shaft is to be accelerated again: a small rotor loses its speed before all levels have been measured."""
    shaft_hz, share = abs(speed_rad_s) / turning.TURN, speed_rad_s / top_rad_s
    is_short = LEVEL_S * shaft_hz < SHAFT_TURNS  # a level is no whole turn
    return share < SLOW_SHARE or ((known.pole_pairs * shaft_hz < SLOW_HZ or is_short) and share < NEAR_SHARE)


def _recorded(drive: Capture, known: Nameplate) -> Array:
    """A level: longer than LEVEL_S on a shaft that has not made a whole turn then."""
    rows = [turning.advance(drive, LEVEL_S, NAME)]
    for _ in range(round((LEVEL_MOST_S - LEVEL_S) / WINDOW_S)):
        if abs(float(np.ptp(np.unwrap(np.vstack(rows)[:, 4])))) > known.pole_pairs * turning.TURN:
            break
        rows.append(turning.advance(drive, WINDOW_S, NAME))
    return np.vstack(rows)


def _coast(drive: Capture, known: Nameplate, wanted_rad_s: float, top_rad_s: float) -> list[Array]:
    """The levels of the current along d, each when it has settled.

    Without the drive's own compensation of the dead time: it acts by the sign of a measured current, turned with the
    rotor by a period and a half, so that what it leaves is not along the current.

    top_rad_s   the speed that the shaft has reached, mechanical, positive in the electrical direction
    """
    taken, q_A, speed = [], 0.0, top_rad_s
    again_rad_s = math.copysign(min(abs(top_rad_s), abs(wanted_rad_s)), top_rad_s)
    compensation = drive.get(COMPENSATION)
    drive.set(COMPENSATION, 0.0)
    try:
        for level in LEVELS:
            if _is_slow(speed, top_rad_s, known):
                speed = _last_speed(drive, accelerate(drive, known, again_rad_s, NAME, TURNED, speed))
            q_A = _settle_current(drive, known, level * D_SHARE * known.i_max_A, q_A, speed)
            taken.append(_recorded(drive, known))
            q_A -= mean_current(taken[-1], known.offset_A, known.pole_pairs).imag
            speed = _last_speed(drive, taken[-1])
    finally:
        drive.set(COMPENSATION, compensation)
    turning.currents(drive, 0.0, 0.0)
    return taken


def _settle_current(drive: Capture, known: Nameplate, i_d_A: float, q_A: float, speed_rad_s: float) -> float:
    """Until the mean current is the wanted one, along d, over whole electrical turns, in which the errors of sensors
    and inverter have no mean.

    While the machine becomes slower, its voltage falls, and current control follows it by a constant current along q,
    for which the reference makes up with q_A. A machine that slows down fast needs more of it: it is returned.
    """
    turning.currents(drive, i_d_A, q_A)
    turn_s = turning.TURN / (known.pole_pairs * abs(speed_rad_s))
    settled_A, before_A = SETTLED_SHARE * known.i_max_A, complex(math.inf, 0.0)
    for _ in range(WINDOWS):
        rows = turning.advance(drive, max(WINDOW_S, turn_s), NAME)
        left_A = i_d_A - mean_current(rows, known.offset_A)
        if abs(left_A) < settled_A:
            return q_A
        if abs(left_A - before_A) < settled_A:  # it does not change any more
            q_A += left_A.imag
            turning.currents(drive, i_d_A, q_A)
        before_A = left_A
        turned = abs(float(np.ptp(np.unwrap(rows[:, 4])))) / turning.TURN
        if turned < 1.0:
            turn_s = LONGER * max(WINDOW_S, turn_s) / max(turned, LEAST_TURNED)
    raise FluxtrueError(f"commission: {NAME}: {i_d_A:.3g} A along d did not settle: {abs(left_A):.2g} A are left")


def whole_turns(rows: Array, pole_pairs: int = 1) -> Array:
    """The rows of whole electrical turns, and the first of the next: over them the errors of sensors and inverter that
    turn have no mean.

    pole_pairs   of whole turns of the shaft, if it makes one: over them the harmonics of the angle sensor have none
    """
    theta = np.unwrap(rows[:, 4])
    turned = abs(theta[-1] - theta[0]) / turning.TURN
    unit = pole_pairs if turned >= pole_pairs else 1
    turns = unit * math.floor(turned / unit)
    return rows[: int(np.searchsorted(np.abs(theta - theta[0]), turns * turning.TURN)) + 1] if turns else rows


def offset_seen(theta_e_rad: Array, offset_A: complex) -> Array:
    """Of the current sensors, in the rotor frame."""
    return np.asarray(offset_A * np.exp(-1j * theta_e_rad))


def mean_current(rows: Array, offset_A: complex, pole_pairs: int = 1) -> complex:
    """Over whole_turns(), in the rotor frame."""
    used = whole_turns(rows, pole_pairs)
    return complex(np.mean(used[:, 0] + 1j * used[:, 1] - offset_seen(used[:, 4], offset_A)))


def machine_currents(rows: Array, offset_A: complex) -> Array:
    """The rows with the currents of the machine: the drive controls what the sensors show."""
    offset = offset_seen(rows[:, 4], offset_A)
    return np.column_stack((rows[:, 0] - offset.real, rows[:, 1] - offset.imag, rows[:, 2:]))


def voltages(rows: Array, period_s: float, periods: int = 1) -> tuple[Array, Array, float]:
    """Current, voltage over j times the effective speed, in each row; the mean speed: (CM-18).

    periods   from one row to the next
    """
    theta = np.unwrap(rows[1:, 4])
    times = periods * period_s * np.arange(len(theta))
    omega = np.polyval(np.polyder(np.polyfit(times, theta, 2)), times + 0.5 * period_s)
    i = rows[1:, 0] + 1j * rows[1:, 1]
    u = rows[:-1, 2] + 1j * rows[:-1, 3]
    return i, u / (1j * omega * np.sinc(0.5 * omega * period_s / np.pi)), float(omega.mean())


@dataclass(frozen=True)
class Window:
    """A level's rows, and the PWM periods from one to the next."""

    rows: Array
    periods: int = 1


@dataclass(frozen=True)
class _Level:
    """Means of a window over the angle, which a rotor that becomes slower does not pass evenly."""

    i_A: complex
    along: complex  # the direction of the current
    psi_Vs: complex  # (CM-18)
    omega_rad_s: float


def _level(window: Window, period_s: float, offset_A: complex, pole_pairs: int) -> _Level:
    rows = whole_turns(window.rows, pole_pairs)
    i, psi, omega = voltages(rows, period_s, window.periods)
    i = i - offset_seen(rows[1:, 4], offset_A)
    periods = np.arange(len(i))
    speed = np.polyval(np.polyder(np.polyfit(periods, np.unwrap(rows[1:, 4]), 2)), periods)
    means = (complex(np.average(each, weights=speed)) for each in (i, i / np.abs(i), psi))
    return _Level(*means, omega)


def _refuse_oscillation(taken: list[Window], largest_A: float) -> None:
    """The voltage of the dead time lies along the mean current only while the current keeps its direction.

    Gains for larger inductances than the machine's make it swing by more, about a mean that looks settled.
    """
    swing_A = max(float(np.std(each.rows[:, 0] + 1j * each.rows[:, 1])) for each in taken)
    if swing_A > largest_A:
        raise FluxtrueError(f"commission: {NAME}: the current oscillates by {swing_A:.2g} A rms about {largest_A:.2g} "
                            "A: the firmware's gains are for larger inductances; build the firmware for the nameplate "
                            "(tools/fluxtrue motor start)")  # fmt: skip


def magnet(taken: list[Window], period_s: float, offset_A: complex, pole_pairs: int) -> Magnet:
    """(CM-19): what neither changes its sign with the current, nor grows with its square, nor lies along it."""
    levels = np.array(LEVELS)
    means = [_level(window, period_s, offset_A, pole_pairs) for window in taken]
    psi, omega = np.array([each.psi_Vs for each in means]), np.array([each.omega_rad_s for each in means])
    i_A, along = np.array([each.i_A for each in means]), np.array([each.along for each in means])
    _refuse_oscillation(taken, float(np.abs(i_A).max()))
    matrix = np.column_stack((np.ones(len(levels)), i_A, levels**2, i_A / omega, along / omega))
    scale = np.linalg.norm(matrix, axis=0)
    inverse = np.linalg.pinv(matrix / scale)
    return Magnet(complex((inverse @ psi)[0] / scale[0]), float(omega.mean()))


def direction(drive: Capture, known: Nameplate, wanted_rad_s: float, _: Connection) -> Magnet:
    """One direction: accelerated, coasting with all levels of the current, and braked."""
    top_rad_s = _last_speed(drive, accelerate(drive, known, wanted_rad_s, NAME, TURNED))
    taken = _coast(drive, known, wanted_rad_s, top_rad_s)
    found = magnet([Window(rows) for rows in taken], drive.period_s, known.offset_A, known.pole_pairs)
    brake(drive, known, wanted_rad_s, NAME)
    true = [machine_currents(rows, known.offset_A) for rows in taken]
    return replace(found, sensor=fit([Coasting(rows[:, 5], rows[:, 1], drive.period_s) for rows in true]))


def measure(drive: D, known: Nameplate, rough: Connection,
            way: Callable[[D, Nameplate, float, Connection], Magnet]) -> Spun:  # fmt: skip
    """Both directions, with the angle that the alignment has found, then with the corrected one.

    way   direction(), or that of a drive over CAN
    """
    wanted = turning.SPEED_SHARE * known.speed_max_rpm * math.pi / 30.0
    rounds: list[tuple[Connection, list[Magnet]]] = []
    connection = rough
    try:
        for _ in range(ROUNDS):
            turning.connect(drive, connection, known, NAME)
            ways = [way(drive, known, sign * wanted, connection) for sign in (1.0, -1.0)]
            rounds.append((connection, ways))
            connection = connection.turned(_error_rad(ways))
    finally:
        turning.release(drive)
    if abs(_error_rad(ways)) > ROUGH_RAD:
        raise FluxtrueError(
            f"commission: {NAME}: the offset of the angle still changes by "
            f"{math.degrees(_error_rad(ways)):.2g} electrical degrees: the angle sensor is not reliable"
        )
    found = _together(rounds)
    return replace(found, harmonics=_harmonics([way for _, both in rounds for way in both], found, known))


def _error_rad(ways: list[Magnet]) -> float:
    """The mean of both directions: a lag of the sensor turns with the speed."""
    return 0.5 * (ways[0].error_rad + ways[1].error_rad)


def _harmonics(ways: list[Magnet], found: Spun, known: Nameplate) -> Harmonics | None:
    """Of all directions: an offset of the angle, which the first round still had, is no harmonic."""
    sensors = [way.sensor for way in ways if way.sensor is not None]
    if len(sensors) < len(ways):
        return None
    wired = found.connection
    torque_Nm_per_A = (-1.5 if wired.reversed else 1.5) * wired.pole_pairs * found.psi_f_Vs
    return together(sensors, wired.pole_pairs, torque_Nm_per_A, known.inertia_kgm2)


def _together(rounds: list[tuple[Connection, list[Magnet]]]) -> Spun:
    """The last round, with those before whose angle was right enough."""
    used = [(connection, ways) for connection, ways in rounds if abs(_error_rad(ways)) < ROUGH_RAD]
    last, _ = used[-1]
    errors = [math.remainder(connection.offset_rad - last.offset_rad, turning.TURN) + _error_rad(ways)
              for connection, ways in used]  # fmt: skip
    magnets = [way for _, ways in used for way in ways]
    psi_f = float(np.mean([abs(way.psi_Vs) for way in magnets]))
    sigma = float(np.std([abs(way.psi_Vs) for way in magnets], ddof=1) / math.sqrt(len(magnets)))
    apart = [0.5 * (ways[0].error_rad - ways[1].error_rad) for _, ways in used]
    lag = float(np.mean([half / ways[0].omega_rad_s for half, (_, ways) in zip(apart, used, strict=True)]))
    # Mean and half of the difference of two directions have the same noise, and only the latter repeats itself.
    offset_sigma = float(np.std(apart, ddof=1) / math.sqrt(len(apart))) if len(apart) > 1 else sigma / psi_f
    omega = float(np.mean([abs(way.omega_rad_s) for way in magnets]))
    return Spun(last.turned(float(np.mean(errors))), psi_f, sigma, offset_sigma, lag, omega)
