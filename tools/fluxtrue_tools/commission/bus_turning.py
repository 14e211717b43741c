# SPDX-License-Identifier: Apache-2.0
"""The movements of the shaft over CAN: what the scope of the firmware captures in place of a record of every period.

The scope's memory holds five signals of 1228 periods, 0.12 s at 10 kHz, and reading it takes longer than the shaft
coasts. Therefore each window is captured, the currents are brought to zero, and the shaft is accelerated again. A level
has every second period or fewer where a turn of the shaft takes longer. The evaluation is that of software in the loop
(connection.py, spin.py, drag.py).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from fluxtrue_tools.commission import connection, drag, spin, turning
from fluxtrue_tools.commission.bus import OverTheBus
from fluxtrue_tools.commission.harmonics import ORDERS, Coasting, Direction, fit
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.spin import Magnet, Window
from fluxtrue_tools.commission.turning import Connection
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.scope.scope import WORDS

ROTATED: Final = ("theta_e_rad", "sensor_turns")
DIVISOR_SLOW: Final = 100  # 10 ms: of the slow turn
MARGIN_S: Final = 0.1  # beside the movement
TAKEN: Final = ("id_A", "iq_A", "ud_V", "uq_V", "theta_e_rad")
SENSOR: Final = ("sensor_turns", "iq_A")
ROWS: Final = WORDS // len(TAKEN)
LEVEL_SETTLE_S: Final = 0.3
OFF_SHARE: Final = 0.01  # of i_max: a mean current so far from the wanted one has not settled
LEAST_RAD_S: Final = 0.1  # of a shaft that turns
DIVISOR_DRAG: Final = 10  # 1 ms: the electrical angle may turn by less than half a turn between two samples


def rotate(drive: OverTheBus, current_A: float, _: complex) -> tuple[Array, Array]:
    """Imposed angle and sensor's angle on the way there and back, both continuous, in turns."""
    steps = round(connection.RISE_S / turning.STEP_S)
    for k in range(steps):
        turning.currents(drive, current_A * (k + 1) / steps, 0.0)
        drive.rest(turning.STEP_S)
    drive.damp(True)
    drive.rest(connection.SWING_S)
    drive.damp(False)
    way_s = connection.TURNS / connection.HZ + connection.SPEED_UP_S

    def there_and_back(seconds: float) -> None:
        begun_s = drive.line.now_s
        for hz in (connection.HZ, -connection.HZ):
            drive.set("imposed_hz", hz)
            drive.rest(way_s - connection.SPEED_UP_S)
            drive.set("imposed_hz", 0.0)
            drive.rest(connection.SPEED_UP_S)
        drive.rest(max(seconds - (drive.line.now_s - begun_s), 0.0))

    periods = round((2.0 * way_s + MARGIN_S) / drive.period_s)
    taken = drive.capture_during(ROTATED, periods, DIVISOR_SLOW, there_and_back)
    imposed = np.unwrap(taken[:, 0]) / turning.TURN
    turn = int(np.argmax(imposed))
    half = min(turn, len(imposed) - turn)
    return imposed[turn - half : turn + half], taken[turn - half : turn + half, 1]


def _accelerate(
    drive: OverTheBus, known: Nameplate, wanted_rad_s: float, step: str, currents: Sequence[complex] = spin.ALONG_Q
) -> None:
    """From any speed, which the drive reports."""

    def advance() -> float:
        drive.rest(spin.TRY_S)
        return drive.shaft_rad_s()

    spin.reach(drive, known, wanted_rad_s, step, currents, drive.shaft_rad_s(), advance)


def _brake(drive: OverTheBus, known: Nameplate, wanted_rad_s: float) -> None:
    spin.stop(drive, known, wanted_rad_s, drive.shaft_rad_s, lambda: drive.rest(turning.STEP_S))


def _window(drive: OverTheBus, divisor: int, action: Callable[[float], None]) -> Array:
    """Rows as those of software in the loop: with each sample the voltage of the next one."""
    rows = drive.capture_during(TAKEN, ROWS * divisor, divisor, action)
    return np.column_stack((rows[:-1, :2], rows[1:, 2:4], rows[:-1, 4]))


def _divisor(drive: OverTheBus) -> int:
    """PWM periods from one row of a level to the next, so that a window has a whole turn of the shaft: over less the
    harmonics of the angle sensor have a mean."""
    turn_s = turning.TURN / max(abs(drive.shaft_rad_s()), LEAST_RAD_S)
    wanted_s = min(spin.SHAFT_TURNS * turn_s, spin.LEVEL_MOST_S)
    return max(math.ceil(wanted_s / (ROWS * drive.period_s)), 1)


def direction(drive: OverTheBus, known: Nameplate, wanted_rad_s: float, rough: Connection) -> Magnet:
    """One direction with all levels of the current along d, each after an acceleration of its own."""
    turning.connect(drive, rough, known, spin.NAME)
    compensation, q_A, taken = drive.get(spin.COMPENSATION), 0.0, []
    drive.set(spin.COMPENSATION, 0.0)
    try:
        for level in spin.LEVELS:
            i_d_A = level * spin.D_SHARE * known.i_max_A
            _accelerate(drive, known, wanted_rad_s, spin.NAME, spin.TURNED)
            turning.currents(drive, i_d_A, q_A)
            drive.rest(LEVEL_SETTLE_S)
            every = _divisor(drive)
            taken.append(Window(_window(drive, every, lambda seconds: _and_none(drive, seconds)), every))
            mean_A = spin.mean_current(taken[-1].rows, known.offset_A, known.pole_pairs)
            if abs(mean_A.real - i_d_A) > OFF_SHARE * known.i_max_A:
                raise FluxtrueError(f"commission: {spin.NAME}: {i_d_A:.3g} A along d did not settle: "
                                    f"{mean_A.real:.3g} A flow")  # fmt: skip
            q_A -= mean_A.imag
        sensor = _sensor(drive, known, wanted_rad_s, rough)
        _brake(drive, known, wanted_rad_s)
    finally:
        drive.set(spin.COMPENSATION, compensation)
    return replace(spin.magnet(taken, drive.period_s, known.offset_A, known.pole_pairs), sensor=sensor)


def _sensor(drive: OverTheBus, known: Nameplate, wanted_rad_s: float, wired: Connection) -> Direction | None:
    """A window without current. The scope captures the angle that the firmware has corrected: its correction, which
    it adapts while the shaft turns, is taken away again."""
    if not drive.tells_angle_correction:
        return None
    _accelerate(drive, known, wanted_rad_s, spin.NAME, spin.TURNED)
    turning.currents(drive, 0.0, 0.0)
    drive.rest(LEVEL_SETTLE_S)
    corrections = []

    def coast(seconds: float) -> None:
        corrections.append(drive.angle_correction())
        drive.rest(seconds)
        corrections.append(drive.angle_correction())

    rows = drive.capture_during(SENSOR, WORDS // len(SENSOR), 1, coast)
    theta_e = wired.offset_rad + (-wired.pole_pairs if wired.reversed else wired.pole_pairs) * turning.TURN * rows[:, 0]
    i_q_A = rows[:, 1] - spin.offset_seen(theta_e, known.offset_A).imag
    found = fit([Coasting(rows[:, 0], i_q_A, drive.period_s)])
    if found is None:
        return None
    correction = np.mean(corrections, axis=0)
    return replace(found, waves=found.waves - np.append(correction, np.zeros(len(ORDERS) - len(correction))))


def _and_none(drive: OverTheBus, seconds: float) -> None:
    """Let the window pass; without current while it is read."""
    drive.rest(seconds)
    turning.currents(drive, 0.0, 0.0)


def runs(drive: OverTheBus, known: Nameplate, wanted_rad_s: float) -> tuple[list[Array], int]:
    """Accelerated, without current, and braked; PWM periods from one row to the next."""

    def driven(seconds: float) -> None:
        begun_s = drive.line.now_s
        _accelerate(drive, known, wanted_rad_s, drag.NAME)
        turning.currents(drive, 0.0, 0.0)
        drive.rest(max(seconds - (drive.line.now_s - begun_s), 0.0))

    def braked(seconds: float) -> None:
        begun_s = drive.line.now_s
        _brake(drive, known, wanted_rad_s)
        drive.rest(max(seconds - (drive.line.now_s - begun_s), 0.0))

    parts = [_window(drive, DIVISOR_DRAG, driven)]
    _accelerate(drive, known, wanted_rad_s, drag.NAME)
    turning.currents(drive, 0.0, 0.0)
    for _ in range(drag.COASTS):
        parts.append(_window(drive, DIVISOR_DRAG, drive.rest))
        if drive.shaft_rad_s() < drag.COAST_END * wanted_rad_s:
            break
    _accelerate(drive, known, wanted_rad_s, drag.NAME)
    parts.append(_window(drive, DIVISOR_DRAG, braked))
    return parts, DIVISOR_DRAG
