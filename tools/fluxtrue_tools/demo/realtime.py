# SPDX-License-Identifier: Apache-2.0
"""How fast the simulation is: against real time, and next to motulator's PMSM drive."""

import math
import time
from typing import Final

import motulator.drive.control.sm as control
from motulator.drive import model
from motulator.drive.utils import SynchronousMachinePars

from fluxtrue_tools.demo.experiment import Bench, run

SIMULATED_S: Final = 1.0
RUNS: Final = 5
REALTIME_FACTOR: Final = 20.0
SPEED_RPM: Final = 3000.0
TORQUE_NM: Final = 80.0

EVERYTHING_WRONG: Final = {
    "r_ohm_20": 0.025,
    "lq_scale": 1.02,
    "cross_saturation_scale": 1.05,
    "iron_k_h": 10.0,
    "iron_k_e": 0.01,
    "dead_time_s": 2e-6,
    "device_drop_V": 1.0,
    "vdc_ripple_V": 5.0,
    "vdc_ripple_hz": 300.0,
    "current_noise_A_rms": 0.5,
    "current_gain": [1.005, 0.995, 1.0],
    "current_offset_A": [0.3, -0.3, 0.1],
    "vdc_gain": 1.003,
    "angle_offset_rad": 0.01,
    "angle_h1_rad": 0.01,
    "angle_h2_rad": 0.005,
    "angle_bits": 12,
    "angle_delay_s": 2e-6,
}


def ours(bench: Bench) -> float:
    """Simulated over processor time: measured machine, firmware, every imperfection, one core.

    The best of a few runs: other load of the computer is not part of the simulation's speed.
    """
    scenario = {
        "duration_s": SIMULATED_S,
        "profile": {"torque_Nm": TORQUE_NM, "speed_rpm": SPEED_RPM, "magnet_scale": 0.85},
        "plant": EVERYTHING_WRONG,
    }
    return SIMULATED_S / min(run(bench.hsm1, scenario).processor_s for _ in range(RUNS))


def motulator(period_s: float = 1e-4) -> float:
    """The same figure for motulator: constant inductances near the same machine, ideal sensors."""
    machine = SynchronousMachinePars(n_p=3, R_s=0.018, L_d=0.25e-3, L_q=0.8e-3, psi_f=0.0717)
    omega = SPEED_RPM * math.tau / 60.0
    drive = model.Drive(
        model.VoltageSourceConverter(u_dc=350.0),
        model.SynchronousMachine(machine),
        model.ExternalRotorSpeed(w_M=lambda _: omega),
    )
    reference = control.CurrentReferenceCfg(machine, max_i_s=250.0, nom_w_m=4.0 * omega)
    controller = control.CurrentVectorControl(machine, reference, T_s=period_s, sensorless=False)
    controller.ref.tau_M = lambda _: TORQUE_NM
    simulation = model.Simulation(drive, controller)
    begin = time.thread_time()
    simulation.simulate(t_stop=SIMULATED_S)
    return SIMULATED_S / (time.thread_time() - begin)
