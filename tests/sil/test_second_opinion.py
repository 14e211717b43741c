# SPDX-License-Identifier: Apache-2.0
"""The robust identification on machine models of other projects: motulator's with saturation, gym-electric-motor's."""

import importlib.util
import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from fluxtrue_tools.sim.build import prepare
from gym_electric_motor.physical_systems.electric_motors import PermanentMagnetSynchronousMotor
from motulator.drive import model
from motulator.drive.utils import SynchronousMachinePars
from sil import OK, Drive, load_library

MOTORS = Path(__file__).resolve().parents[1] / "motors"
PERIOD_S, SUBSTEPS, VDC_V = 1e-4, 10, 350.0
MAGNET, LQ, RESISTANCE = 0.88, 1.08, 1.3
WINDING_C = 20.0 + (RESISTANCE - 1.0) / 0.00393 - 3.0  # the thermometer reads 3 K too low

Point = tuple[float, float, float]
# time, speed, torque: learning first, then the windows.
LEARN: list[Point] = [(0.0, 0, 0), (0.1, 800, 60), (0.4, 800, -90), (0.7, 2000, 120), (1.1, 3200, 50),
                      (1.5, 3200, -80), (1.9, 1500, 30)]  # fmt: skip
WINDOWS: list[Point] = [(2.2, 1000, 100), (2.6, 3000, 40), (3.0, 3000, -70), (3.4, 1500, 20)]
MOVE_S, SETTLE_S, MEASURE_S, WINDOW_S = 0.1, 0.25, 0.14, 0.4
LATE_S = WINDOWS[0][0] - 0.1
ALONE: list[Point] = [(0.0, 0, 0), *((t - LATE_S, n, torque) for t, n, torque in WINDOWS)]
TABLES = {"torque_loop": 0.0, "identification": 0.0, "enable": 1.0}
ROBUST = {"identification_mode": 1.0, "enable": 1.0}

Wave = Callable[[Any], Any]
Plant = Callable[[Drive, Wave, Wave, float], tuple[Any, Any]]


def profile(column: int, points: list[Point]) -> Wave:
    """From point to point in MOVE_S, constant in between."""
    times: list[float] = []
    values: list[float] = []
    for before, point in zip([points[0], *points], points, strict=False):
        times += [point[0], point[0] + MOVE_S]
        values += [before[column], point[column]]
    return lambda t: np.interp(t, times, values)


def step(drive: Drive, torque_Nm: float, currents: Any, angle: float) -> list[float]:
    """One period of the firmware: the duties of the next one."""
    assert drive.set("torque_command_Nm", float(torque_Nm)) == OK
    return list(drive.step((*map(float, currents), VDC_V, angle, WINDING_C))[:3])


def errors(plant: Plant, motor: str, settings: dict[str, float], points: list[Point]) -> list[float]:
    """Percent of the command (of 18 N·m at least) in every window."""
    drive = Drive(load_library(prepare(str(MOTORS / motor)).sil))
    for name, value in settings.items():
        assert drive.set(name, value) == OK
    now, true = plant(drive, profile(1, points), profile(2, points), points[-1][0] + WINDOW_S)
    assert drive.get("fault_word") == 0.0
    drive.close()
    found = []
    for start, _, command in points[-len(WINDOWS):]:
        some = (now > start + SETTLE_S) & (now <= start + SETTLE_S + MEASURE_S)
        mean = float(np.trapezoid(true[some], now[some]) / (now[some][-1] - now[some][0]))
        found.append(100.0 * (mean - command) / max(abs(command), 18.0))
    return found


def judge(plant: Plant, motor: str) -> None:
    """What was learnt corrects the torque, and harms nowhere."""
    tables = errors(plant, motor, TABLES, ALONE)
    robust = errors(plant, motor, ROBUST, LEARN + WINDOWS)
    print("tables", np.round(tables, 2), "robust", np.round(robust, 2))
    # A magnet 12 % weaker costs some of it everywhere, L_q gives a little of it back.
    assert max(abs(error) for error in tables) > 3.0
    # The campaign's bound on the 99th percentile, after 2 s of learning.
    assert max(abs(error) for error in robust) <= 2.5
    assert all(abs(a) <= max(abs(b) + 0.5, 2.0) for a, b in zip(robust, tables, strict=True))


def iron() -> Any:
    """tests/motors/make_maps.py: the machine's currents as closed formulas of its fluxes."""
    spec = importlib.util.spec_from_file_location("make_maps", MOTORS / "make_maps.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["make_maps"] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module.MACHINES["saturated"]


IRON = iron()


def saturation(psi: Any) -> Any:
    """What motulator asks for, current over flux, with a weaker magnet and a larger L_q."""
    psi_d = psi.real + (1.0 - MAGNET) * IRON.psi_f_Vs
    i_d, i_q = IRON.currents(psi_d, psi.imag / LQ)
    return i_d + 1j * i_q


class Firmware:
    """The library in the place of motulator's control system; motulator delays the duties by a period."""

    def __init__(self, drive: Drive, torque: Wave) -> None:
        self.drive, self.torque = drive, torque

    def __call__(self, mdl: Any) -> tuple[float, list[float]]:
        currents, angle = mdl.machine.meas_currents(), float(mdl.mechanics.meas_position())
        return PERIOD_S, step(self.drive, self.torque(mdl.t0), currents, angle)

    def post_process(self) -> None:
        """Nothing to tidy up."""


def motulator(drive: Drive, speed: Wave, torque: Wave, end_s: float) -> tuple[Any, Any]:
    """Time and torque of motulator's synchronous machine, its solver and transforms."""
    machine = SynchronousMachinePars(n_p=4, R_s=0.012 * RESISTANCE, L_d=1e-4, L_q=1e-4, psi_f=MAGNET * IRON.psi_f_Vs)
    plant = model.Drive(
        model.VoltageSourceConverter(u_dc=VDC_V),
        model.SynchronousMachine(machine, i_s=saturation, psi_s0=MAGNET * IRON.psi_f_Vs),
        model.ExternalRotorSpeed(w_M=lambda t: speed(t) * math.tau / 60.0),
    )
    model.Simulation(plant, Firmware(drive, torque)).simulate(end_s)
    return np.asarray(plant.machine.data.t), np.asarray(plant.machine.data.tau_M)


def gym(drive: Drive, speed: Wave, torque: Wave, end_s: float) -> tuple[Any, Any]:
    """Time and torque of gym-electric-motor's PMSM: its differential equation, torque and transforms; RK4 is ours."""
    given = {"p": 3, "r_s": 0.018 * RESISTANCE, "l_d": 0.37e-3, "l_q": 1.2e-3 * LQ, "psi_p": MAGNET * 0.066}
    motor = PermanentMagnetSynchronousMotor(motor_parameter=given)
    state, duty, h = np.zeros(3), [0.5] * 3, PERIOD_S / SUBSTEPS
    now, true = np.arange(round(end_s / PERIOD_S)) * PERIOD_S, []
    for t in now:
        omega = float(speed(t)) * math.tau / 60.0
        currents = motor.t_32(motor.q(state[:2], state[2]))
        coming = step(drive, torque(t), currents, (state[2] / 3.0) % math.tau)
        u_ab = motor.t_23((np.array(duty) - np.mean(duty)) * VDC_V)

        def slope(x: Any, u: Any = u_ab, w: float = omega) -> Any:
            return motor.electrical_ode(x, motor.q_inv(u, x[2]), w)

        for _ in range(SUBSTEPS):
            a = slope(state)
            b = slope(state + h / 2 * a)
            c = slope(state + h / 2 * b)
            state = state + h / 6 * (a + 2 * b + 2 * c + slope(state + h * c))
        true.append(motor.torque(state))
        duty = coming
    return now, np.array(true)


def test_what_was_learnt_on_motulators_saturating_machine_corrects_its_torque() -> None:
    judge(motulator, "lossless")


def test_what_was_learnt_on_gym_electric_motors_machine_corrects_its_torque() -> None:
    judge(gym, "gem")
