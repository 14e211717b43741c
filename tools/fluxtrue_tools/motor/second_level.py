# SPDX-License-Identifier: Apache-2.0
"""The second level's own constants: its coarse torque table and tolerances, under their own checksum."""

import struct
import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools.motor.derived import steps
from fluxtrue_tools.motor.flux_model import FluxModel, torque
from fluxtrue_tools.motor.motor import Motor
from fluxtrue_tools.motor.quantise import Q15_ONE, Q16_ONE, q15_table

ROWS, COLUMNS, PARTS = 18, 17, 16  # as firmware/second_level/constants.h
TABLE = "torque"
SLOWEST_S = 0.04  # zero to full torque, by the arbitration of the first level
HOLD_S, HOLDS = 0.02, 4  # jerk 10 ms, a cycle of the task, the answer of the currents, the mean
CONFIRM_S, MEAN_SHIFT = 0.025, 2
TOLERANCE_SHARE_OF_MONITOR, TOLERANCE_SHARE = 0.6, 1 / 64
STANDSTILL_SHARE = 0.025  # of maximum speed


@dataclass(frozen=True)
class SecondLevel:
    """Names and order as in second_level_constants_t."""

    words: dict[str, int]
    torque: NDArray[np.int64]

    @property
    def checksum(self) -> int:
        body = struct.pack(f"<{len(self.words)}I", *(w & 0xFFFFFFFF for w in self.words.values()))
        return zlib.crc32(body + struct.pack(f"<{self.torque.size}h", *self.torque.ravel()))


def coarse_torque_Nm(model: FluxModel, pole_pairs: int, current_A: float) -> NDArray[np.float64]:
    """Torque at the grid's currents: i_d from -I_b to I_b/16, |i_q| from 0 to I_b."""
    i_d = (np.arange(ROWS) - PARTS) / PARTS * current_A
    i_q = np.arange(COLUMNS) / PARTS * current_A
    d, q = np.meshgrid(i_d, i_q, indexing="ij")
    return torque(model, pole_pairs, d, q)


def make_second_level(motor: Motor) -> SecondLevel:
    """All constants of the second level."""
    config, bases, derived = motor.config, motor.bases, motor.derived
    machine = config.machine
    table = coarse_torque_Nm(motor.model, machine.pole_pairs, bases.current_A) / bases.torque_Nm
    rated = machine.torque_max_Nm / bases.torque_Nm * Q15_ONE
    slew = min(machine.torque_max_Nm / SLOWEST_S * bases.step_s, derived.torque_slew_Nm or np.inf)
    turns = config.omega_max_rad_s / machine.pole_pairs / (2.0 * np.pi) * bases.step_s
    per_count = 2.0 ** (16 - config.inverter.adc_bits)  # q15 of the full scale, which is I_b
    psi_f_Vs = float(motor.model.psi_d(0.0, 0.0))
    l_d_H = (psi_f_Vs - float(motor.model.psi_d(-bases.current_A / 2.0, 0.0))) / (bases.current_A / 2.0)
    l_q_H = float(motor.model.psi_q(0.0, bases.current_A / PARTS)) / (bases.current_A / PARTS)
    words = {
        "torque_per_count": round(float(motor.bus.factors["torque_Nm"]) / bases.torque_Nm * Q15_ONE * Q16_ONE),
        "torque_max": round(rated),
        "fall": max(int(slew / bases.torque_Nm * Q15_ONE), 1),
        "tolerance": round(TOLERANCE_SHARE_OF_MONITOR * derived.monitor_torque_Nm / bases.torque_Nm * Q15_ONE),
        "tolerance_share": round(TOLERANCE_SHARE * Q16_ONE),
        "alpha_per_count": round(per_count / 3.0 * Q16_ONE),
        "beta_per_count": round(per_count / np.sqrt(3.0) * Q16_ONE),
        "psi_f": round(psi_f_Vs / bases.flux_Vs * Q15_ONE),
        "l_d": round(l_d_H / bases.inductance_H * Q16_ONE),
        "mean_flux": round(psi_f_Vs / bases.flux_Vs * l_q_H / l_d_H * Q16_ONE),
        "mean_share": round((2.0 * np.pi * machine.pole_pairs / bases.periods_per_step) ** 2 / 24.0 * Q16_ONE),
        "pole_pairs": machine.pole_pairs,
        "angle_offset": 0,
        "turn_standstill": min(round(STANDSTILL_SHARE * turns * 2.0**32), 2**31 - 1),
        "mean_shift": MEAN_SHIFT,
        "hold_steps": steps(HOLD_S / HOLDS, bases.step_s),
        "confirm_steps": steps(CONFIRM_S, bases.step_s),
    }
    return SecondLevel(words, q15_table(np.clip(table, -1.0, 1.0 - 1.0 / Q15_ONE), TABLE))
