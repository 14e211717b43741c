# SPDX-License-Identifier: Apache-2.0
"""Per-unit bases, docs/scaling.md (SC-1) to (SC-9)."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from fluxtrue_tools.motor.config import MotorConfig
from fluxtrue_tools.motor.flux_model import MODELS_KEPT, FluxModel, flux
from fluxtrue_tools.motor.quantise import Unfit

VOLTAGE_PER_VDC = 1.5
VOLTAGE_STEP_V = 10.0
OMEGA_PER_OMEGA_MAX = (1.25, 1.2, 1.15, 1.1, 1.05, 1.02)  # the first one that fits is taken
OMEGA_MIN_PER_PWM = 0.02  # rad/s per Hz: below it the current controller's integral gain leaves its format
OMEGA_STEP_MIN = 1.0 / 7.9  # rad per step of the task: below it 1/(omega_b T) leaves its format
FLUX_USE_MIN = 0.3  # smallest share of psi_b that the largest flux may have; below it torque and tables lose resolution
FLUX_USE_MAX = 0.97  # of psi_b, by the largest flux on the i_max circle
STEP_USE_WANTED = 0.99  # of I_b, by one period of V_b on the smallest incremental inductance
TURNS_PER_STEP_MAX = 7.99  # of the field, at omega_b: the identification counts them in a word
TASK_HZ = 1000.0  # a step is the whole number of PWM periods nearest to this


@dataclass(frozen=True)
class Bases:
    """SI value of 1 per unit; the fields of bases_t."""

    voltage_V: float
    current_A: float
    omega_rad_s: float
    flux_Vs: float
    resistance_ohm: float
    inductance_H: float
    torque_Nm: float
    period_s: float
    step_s: float
    periods_per_step: int


def periods_per_step(pwm_hz: float) -> int:
    """PWM periods of one step of the 1 kHz task (SC-10); of two that are equally near the larger number."""
    return math.floor(pwm_hz / TASK_HZ + 0.5)


@lru_cache(maxsize=MODELS_KEPT)
def flux_max(model: FluxModel, i_max_A: float) -> float:
    """Largest |psi| on the i_max half circle i_d <= 0, and of the magnet alone."""
    angle = np.linspace(0.5 * np.pi, np.pi, 181)
    rim = flux(model, i_max_A * np.cos(angle), i_max_A * np.sin(angle))
    return float(max(rim.max(), flux(model, 0.0, 0.0)))


@lru_cache(maxsize=MODELS_KEPT)
def inductance_min(model: FluxModel, i_max_A: float) -> float:
    """Smallest incremental inductance of both axes inside the i_max circle, i_d <= 0."""
    d, q = np.meshgrid(np.linspace(-i_max_A, 0, 101), np.linspace(0, i_max_A, 101), indexing="ij")
    inside = np.hypot(d, q) <= i_max_A * (1 + 1e-9)
    return float(min(model.psi_d(d, q, nd=1)[inside].min(), model.psi_q(d, q, nq=1)[inside].min()))


def inductance_at_rest(model: FluxModel) -> float:
    """The smaller incremental inductance of the two axes without current."""
    return min(float(model.psi_d(0.0, 0.0, nd=1)), float(model.psi_q(0.0, 0.0, nq=1)))


def _voltage(config: MotorConfig, psi_max_Vs: float, omega_rad_s: float) -> float:
    """1.5 vdc, or more where the machine's flux would not fit psi_b = V_b/omega_b."""
    normal = VOLTAGE_PER_VDC * config.inverter.vdc_V
    needed = psi_max_Vs * omega_rad_s / FLUX_USE_MAX
    return normal if needed <= normal else VOLTAGE_STEP_V * math.ceil(needed / VOLTAGE_STEP_V)


def _omega_and_voltage(config: MotorConfig, model: FluxModel) -> tuple[float, float]:
    """(SC-7), (SC-8): the largest speed reserve with which (SC-9) holds; the whole reserve where it cannot hold."""
    pwm_hz = config.inverter.pwm_hz
    psi_max = flux_max(model, config.machine.i_max_A)
    omega_min = max(
        OMEGA_MIN_PER_PWM * pwm_hz,
        OMEGA_STEP_MIN / (periods_per_step(pwm_hz) / pwm_hz),
        FLUX_USE_MIN * VOLTAGE_PER_VDC * config.inverter.vdc_V / psi_max,
    )
    omega_turns = TURNS_PER_STEP_MAX * 2.0 * math.pi * pwm_hz / periods_per_step(pwm_hz)
    omegas = [max(ratio * config.omega_max_rad_s, omega_min) for ratio in OMEGA_PER_OMEGA_MAX]
    omegas = [omega for omega in omegas if omega <= omega_turns]
    if not omegas:
        raise Unfit(
            f"the largest flux linkage, {1e3 * psi_max:.3g} mV·s, is so small for vdc_V that its speed base would be "
            f"{max(omega_min, config.omega_max_rad_s):.4g} rad/s electrical, allowed: up to {omega_turns:.4g} rad/s"
        )
    choices = [(omega, _voltage(config, psi_max, omega)) for omega in omegas]
    l_min = inductance_min(model, config.machine.i_max_A)
    wanted = STEP_USE_WANTED * l_min * config.inverter.current_full_scale_A * pwm_hz
    return next((choice for choice in choices if choice[1] <= wanted), choices[0])


def make_bases(config: MotorConfig, model: FluxModel) -> Bases:
    """The bases of one machine and its inverter."""
    current, period = config.inverter.current_full_scale_A, 1.0 / config.inverter.pwm_hz
    omega, voltage = _omega_and_voltage(config, model)
    impedance = voltage / current
    return Bases(
        voltage_V=voltage,
        current_A=current,
        omega_rad_s=omega,
        flux_Vs=voltage / omega,
        resistance_ohm=impedance,
        inductance_H=impedance / omega,
        torque_Nm=1.5 * config.machine.pole_pairs * voltage / omega * current,
        period_s=period,
        step_s=periods_per_step(config.inverter.pwm_hz) / config.inverter.pwm_hz,
        periods_per_step=periods_per_step(config.inverter.pwm_hz),
    )
