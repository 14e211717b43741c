# SPDX-License-Identifier: Apache-2.0
"""Errors of the results against a simulated machine: for tests and campaigns, which know the machine."""

import cmath
import math
from dataclasses import dataclass

import numpy as np

from fluxtrue_tools.commission.balance import Balance
from fluxtrue_tools.commission.dc_zero import DcZero
from fluxtrue_tools.commission.hidden import Truth
from fluxtrue_tools.commission.iron import Iron
from fluxtrue_tools.commission.plan import FIRST_CURRENT, First
from fluxtrue_tools.commission.spin import Spun
from fluxtrue_tools.commission.steps import Found
from fluxtrue_tools.motor.flux_model import FluxModel


@dataclass(frozen=True)
class Score:
    """Shares of the largest flux linkage and of the largest torque in the current circle, i_d <= 0."""

    map_rms: float
    map_worst: float
    torque_rms: float


def score(model: FluxModel, truth: Truth, i_max_A: float, psi_f_Vs: float) -> Score:
    """Over a grid in the half circle; psi_f_Vs: the magnet's flux in place of the map's own,
    which a standstill cannot show."""
    d, q = np.meshgrid(np.linspace(-i_max_A, 0.0, 41), np.linspace(0.0, i_max_A, 41), indexing="ij")
    inside = np.hypot(d, q) <= i_max_A
    d, q = d[inside], q[inside]
    true_d, true_q = truth.psi(d, q)
    shift = psi_f_Vs - float(model.psi_d(0.0, 0.0))
    error_d, error_q = model.psi_d(d, q) + shift - true_d, model.psi_q(d, q) - true_q
    largest = float(np.hypot(true_d, true_q).max())
    torque = true_d * q - true_q * d
    error = np.hypot(error_d, error_q)
    return Score(float(np.sqrt(np.mean(error**2))) / largest, float(error.max()) / largest,
                 float(np.sqrt(np.mean((error_d * q - error_q * d) ** 2))) / float(np.abs(torque).max()))  # fmt: skip


def resistance_error(r_ohm: float, truth: Truth) -> tuple[float, float]:
    """Shares: the whole error, and what is left beyond the gain of the dc voltage and the mean gain of the currents,
    which no measurement with these sensors can show."""
    plant = truth.plant
    gain = plant["vdc_gain"] / float(np.mean([plant[f"current_gain_{phase}"] for phase in "abc"]))
    share = r_ohm / plant["r_ohm_20"]
    return share - 1.0, share / gain - 1.0


def _order(truth: Truth) -> str:
    """The sensors are exchanged with the leads."""
    return "acb" if truth.plant.get("phases_swapped", 0.0) else "abc"


def balance_error(balance: Balance, truth: Truth) -> float:
    """The largest error of the difference between two sensors' gains."""
    return float(np.ptp(balance.gains - [truth.plant[f"current_gain_{phase}"] for phase in _order(truth)]))


def offset_error(offset_A: complex, truth: Truth) -> float:
    """Of the current sensors' offsets, a share of their full scale."""
    plant = truth.plant
    true_A = sum(2.0 / 3.0 * plant[f"current_offset_A_{phase}"] * cmath.rect(1.0, 2.0 * math.pi * k / 3.0)
                 for k, phase in enumerate(_order(truth)))  # fmt: skip
    return abs(offset_A - true_A) / plant["current_full_scale_A"]


def dc_zero_error(found: DcZero, truth: Truth) -> float:
    """As a share of the full scale of the dc voltage; of what the firmware subtracts if nothing was found."""
    return (found.value_V - truth.plant["vdc_offset_V"]) / truth.plant["vdc_full_scale_V"]


def leg_errors(total_V: float, truth: Truth, guess_V: float) -> tuple[float, float]:
    """Of the voltage that a leg loses, as the sensor of the dc voltage shows it: the error, V, and which share it is of
    the nameplate's error."""
    plant = truth.plant
    true_V = plant["vdc_gain"] * (plant["dead_time_s"] * plant["pwm_hz"] * plant["vdc_V"] + plant["device_drop_V"])
    return total_V - true_V, (total_V - true_V) / (guess_V - true_V)


def inductance_error(first: First, truth: Truth, i_max_A: float) -> float:
    """The larger of both axes, against the slope of the flux linkages over the currents of the first pulses."""
    i_A = FIRST_CURRENT * i_max_A
    true_H = [float(truth.psi_d(i_A, 0.0) - truth.psi_d(-i_A, 0.0)) / (2.0 * i_A),
              float(truth.psi_q(0.0, i_A) - truth.psi_q(0.0, -i_A)) / (2.0 * i_A)]  # fmt: skip
    return max(abs(found / true - 1.0) for found, true in zip(first.found_H, true_H, strict=True))


def iron_error(found: Iron | None, truth: Truth) -> float:
    """The error of the iron's current as a share of the true one at the speed of the measurement; a loss that is found
    where there is none, and none where there is one, are an error of 1."""
    true = truth.plant.get("iron_k_excess", 0.0)
    if found is None or true == 0.0:
        return float((found is None) != (true == 0.0))
    return found.per_flux / (true * math.sqrt(found.omega_rad_s)) - 1.0


def waves_rad(truth: Truth) -> list[complex]:
    """The harmonics once and twice per turn of the hidden machine's sensor, as harmonics.py has them: (PL-18) by the
    shown angle, against which the rotor turns where the sensor is reversed."""
    plant, found = truth.plant, []
    zero = plant.get("angle_offset_rad", 0.0) / plant["pole_pairs"]
    for order in (1, 2):
        amplitude, phase = (plant.get(f"angle_h{order}_{what}", 0.0) for what in ("rad", "phase"))
        if plant.get("angle_reversed", 0.0):
            found.append(cmath.rect(amplitude, 0.5 * math.pi - phase - order * zero))
        else:
            found.append(cmath.rect(amplitude, phase - 0.5 * math.pi - order * zero))
    return found


def harmonics_deg(found: Spun, truth: Truth) -> float:
    """The largest error of the complex amplitudes, electrical; without a measurement NaN."""
    if found.harmonics is None:
        return math.nan
    waves = (found.harmonics.first.value_rad, found.harmonics.second.value_rad)
    errors = [abs(wave - true) for wave, true in zip(waves, waves_rad(truth), strict=True)]
    return math.degrees(max(*errors, abs(found.harmonics.further.value_rad)))


DRAG_FROM = 0.3  # of the largest speed of the run


@dataclass(frozen=True)
class Turned:
    """Errors of the steps that turn the shaft."""

    is_connected: bool  # pole pairs and direction are right
    offset_deg: float  # electrical
    psi_f: float  # a share, beyond the gain of the dc voltage's sensor
    inertia: float
    drag: float  # rms of its relative error over the speeds
    harmonics_deg: float  # electrical, the largest of the complex amplitudes once to four times per turn


def turned(found: Found, truth: Truth) -> Turned:
    """All three steps have been run."""
    assert found.spun is not None and found.drag is not None
    at, drag, plant = found.spun.connection, found.drag, truth.plant
    right = at.pole_pairs == plant["pole_pairs"] and at.reversed == truth.reversed
    offset = math.degrees(math.remainder(at.offset_rad - truth.offset_rad, 2.0 * math.pi))
    speeds = np.linspace(DRAG_FROM, 1.0, 15) * drag.to_rad_s
    drags = drag.torque_Nm(speeds) / truth.drag_Nm(speeds) - 1.0
    return Turned(right, offset, found.spun.psi_f_Vs / (truth.psi_f_Vs * plant["vdc_gain"]) - 1.0,
                  drag.inertia_kgm2 / plant["inertia_kgm2"] - 1.0, float(np.sqrt(np.mean(drags**2))),
                  harmonics_deg(found.spun, truth))  # fmt: skip
