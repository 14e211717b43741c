# SPDX-License-Identifier: Apache-2.0
"""The largest torque that a plant can give at a speed, and that the firmware allows: decided before anything is run.

Source   the steady-state voltage equations over the nominal map with the plant's own scales (docs/howto/campaign.md)
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools.campaign.machine import Machine
from fluxtrue_tools.motor.derived import V_RATIO_REFERENCE
from fluxtrue_tools.motor.flux_model import FluxModel

Array = NDArray[np.float64]
NODES: Final = 121
SPEEDS: Final = 41
MARGIN: Final = 0.97  # share of the plant's largest torque; the rest is the margin with which a controller can correct
NOTHING_WRONG: Final = {"magnet_scale": 1.0, "lq_scale": 1.0, "ld_slope_scale": 1.0, "cross_saturation_scale": 1.0,
                        "resistance_scale": 1.0}  # fmt: skip


@dataclass(frozen=True)
class Envelope:
    """Reachable torque over speed."""

    speed_rpm: Array
    torque_Nm: Array

    def at(self, speed_rpm: float) -> float:
        """Largest torque at a speed of either direction."""
        return float(np.interp(abs(speed_rpm), self.speed_rpm, self.torque_Nm))


@dataclass(frozen=True)
class Capability:
    """What decides the torque of a machine at a speed."""

    model: FluxModel
    pole_pairs: int
    r_ohm: float
    i_max_A: float
    vdc_V: float


def largest(machine: Capability, factors: dict[str, float], omega: Array) -> Array:
    """Largest torque of one plant at every speed, within the current circle and the voltage circle."""
    i = np.linspace(0.0, machine.i_max_A, NODES)
    i_d, i_q = (x[np.hypot(*np.meshgrid(i, i)) <= machine.i_max_A] for x in np.meshgrid(-i, i, indexing="ij"))
    psi_f, axis = machine.model.psi_d(0.0, 0.0), machine.model.psi_d(0.0, i_q)
    psi_d = (factors["magnet_scale"] * psi_f + factors["cross_saturation_scale"] * (axis - psi_f)
             + factors["ld_slope_scale"] * (machine.model.psi_d(i_d, i_q) - axis))  # fmt: skip
    psi_q = factors["lq_scale"] * machine.model.psi_q(i_d, i_q)
    torque = 1.5 * machine.pole_pairs * (psi_d * i_q - psi_q * i_d)
    r_ohm, limit = machine.r_ohm * factors["resistance_scale"], V_RATIO_REFERENCE * machine.vdc_V
    w = omega[:, None]
    volts = np.hypot(r_ohm * i_d - w * psi_q, r_ohm * i_q + w * psi_d)
    return np.asarray(np.max(np.where(volts <= limit, torque, 0.0), axis=1))


def make_envelope(machine: Machine, factors: dict[str, float]) -> Envelope:
    """Torque that plant and firmware both allow; computed for motoring, where less is possible than in braking."""
    speed = np.linspace(0.0, machine.speed_max_rpm, SPEEDS)
    omega = machine.pole_pairs * speed * 2.0 * np.pi / 60.0
    able = Capability(machine.model, machine.pole_pairs, machine.motor.r_ohm, machine.i_max_A, machine.vdc_V)
    torque = np.minimum(largest(able, NOTHING_WRONG, omega), largest(able, factors, omega))
    return Envelope(speed, np.minimum(MARGIN * torque, machine.rated_Nm))
