# SPDX-License-Identifier: Apache-2.0
"""The current loop measured in simulation: a small voltage between inverter and machine, and what the firmware adds.

With the source's voltage d, the inverter's voltage u and the machine's voltage u + d the loop opened at the machine's
voltage is L = -u/(u + d). The firmware is unchanged; only the simulated machine has a source in series (PL-27).
d is a sum of sines of both directions of rotation, in the rotor's frame, with a whole number of turns in the time of
the measurement. So is the rotor's angle, so that the inverter's harmonics lie on frequencies of their own.
"""

import math

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.current_loop import Response, operating_point, turn_per_period
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.motor.motor import Motor
from fluxtrue_tools.motor.simulated import DataLoop, Simulated

Complex = NDArray[np.complex128]

PERIODS, SETTLE = 4096, 1024
LINES = 24  # of each direction
LOW, HIGH = 0.004, 0.45  # of the PWM frequency
VOLTAGE = 0.02  # amplitude of all lines together, rms, of vdc
START_S = 0.4
WATCHED = ("voltage_limited", "fault_word")


def at_point(
    simulated: Simulated, motor: Motor, speed_rpm: float, inductance: float, torque_sign: float = 1.0
) -> DataLoop:
    """The drive at the operating point of the plots, as current references, settled.

    At standstill phase a carries all of the current: none of the three is near zero, where the dead time acts. The
    monitors that compare voltages with currents would take the source in series for a fault.
    """
    i_d, i_q = operating_point(motor, abs(speed_rpm), inductance)
    i_q *= torque_sign
    angle = -math.atan2(i_q, i_d) / motor.config.machine.pole_pairs
    wrong = {"lq_scale": inductance, "ld_slope_scale": inductance, "theta_m_rad": angle % (2.0 * math.pi)}
    loop = simulated.loop({"imposed_speed": 1.0} | wrong)
    switches = {"enable": 1.0, "current_mode": 1.0, "identification": 0.0, "machine_monitors": 0.0}
    for name, value in switches.items():
        loop.set(name, value)
    if simulated.plant.get("ideal_inverter"):
        loop.set("dead_time_compensation", 0.0)
    turned = 2.0 * math.pi / 60.0 * speed_rpm
    loop.run(round(START_S / loop.period_s), {"plant.speed_rad_s": (0.0, turned), "id_ref_A": (0.0, i_d)})
    loop.run(round(START_S / loop.period_s), {"iq_ref_A": (0.0, i_q)})
    return loop


def lines(turns: int) -> NDArray[np.int64]:
    """Turns of each sine in the time of the measurement: odd ones with, even ones against the field.

    An axis that differs from the other answers a turning voltage also with one of the opposite direction; it then
    falls on no line. Multiples of six electrical turns are left to the dead time's harmonics.
    """
    wanted = np.geomspace(LOW * PERIODS, HIGH * PERIODS, LINES)
    found = []
    for sign, odd in ((1, 1), (-1, 0)):
        for line in wanted:
            k = 2 * round((line - odd) / 2) + odd
            while turns and k % (6 * abs(turns)) == 0:
                k += 2
            found.append(sign * k)
    return np.unique(np.array(found, dtype=np.int64))


def excitation(at: NDArray[np.int64], amplitude_V: float) -> Complex:
    """One turn of all sines: phases by Schroeder keep the largest value low."""
    n = np.arange(len(at))
    phase = np.exp(-1j * np.pi * n * (n - 1) / len(at))
    spectrum = np.zeros(PERIODS, dtype=np.complex128)
    spectrum[at % PERIODS] = phase * amplitude_V / math.sqrt(len(at)) * PERIODS
    return np.asarray(np.fft.ifft(spectrum))


def measure(
    simulated: Simulated, motor: Motor, speed_rpm: float, inductance: float = 1.0, torque_sign: float = 1.0
) -> Response:
    """The open loop with so many times the inductances of the data."""
    theta = turn_per_period(motor, speed_rpm)
    turns = round(theta * PERIODS / (2.0 * math.pi))
    per_rpm = PERIODS * turn_per_period(motor, 1.0) / (2.0 * math.pi)
    with at_point(simulated, motor, turns / per_rpm, inductance, torque_sign) as loop:
        at = lines(turns)
        source = excitation(at, VOLTAGE * motor.config.inverter.vdc_V)
        loop.record(("truth.u_d_V", "truth.u_q_V", *WATCHED))
        rows = np.concatenate([_period(loop, source[k % PERIODS]) for k in range(SETTLE + PERIODS)])[SETTLE:]
        frequency = at / (PERIODS * loop.period_s)
    _check(rows[:, 2:], speed_rpm)
    half = math.pi * turns / PERIODS
    machine = np.fft.fft((rows[:, 0] + 1j * rows[:, 1]) / np.sinc(half / math.pi))[at % PERIODS]
    injected = np.fft.fft(np.roll(source, -SETTLE))[at % PERIODS]
    return Response(frequency, -(machine - injected) / machine)


def _period(loop: DataLoop, volt: complex) -> Array:
    loop.set("plant.series_d_V", volt.real)
    loop.set("plant.series_q_V", volt.imag)
    return loop.run(1)


def _check(watched: Array, speed_rpm: float) -> None:
    for name, values in zip(WATCHED, watched.T, strict=True):
        if values.any():
            raise FluxtrueError(f"at {speed_rpm:.0f} rpm: {name} = {values.max():g}")
