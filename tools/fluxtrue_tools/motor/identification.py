# SPDX-License-Identifier: Apache-2.0
"""Robust identification: its numbers in SI, chosen here, and the rows of both generated files."""

import math
from dataclasses import dataclass

from fluxtrue_tools.motor.bases import Bases
from fluxtrue_tools.motor.config import MotorConfig
from fluxtrue_tools.motor.quantise import q15, q16, q31

Row = tuple[str, object, str]

UPDATE_STEPS = 10  # windows per update of the filter
LIMITED_NOISE = 5.0  # times the noise, in addition, if every period of a window has limited pulses
MISMATCH_TIME_S = -0.01 / math.log(0.9)  # a tenth in 10 ms
IRON_SIGN_RAD_S = 8.0  # electrical; the hysteresis term is whole from 25 rpm on three pole pairs
OMEGA_MIN_SHARE = 0.02  # of maximum speed
I_MIN_SHARE = 0.03  # of i_max
LOCAL_TIME_S = 0.02
CORNER_MAX = 0.999  # of the speed base: a machine with little magnet; its voltage never tells the flux' shape
CHANGE_UNCERTAINTY = 0.1  # of d psi/dt: what the window's ends and the tables' slope leave
CONFIDENCE_FULL, CONFIDENCE_NONE, CONFIDENCE_TIME_S = 0.03, 0.06, 0.5
TORQUE_MIN_SHARE = 0.1
Q30 = 1 << 30

STATES = ("R", "drop", "flux", "lq", "ld", "angle", "iron")
# Return to the prior: winding and inverter within a minute, magnet within two, geometry within minutes.
LEAK_PER_S = (0.02, 0.02, 0.01, 0.003, 0.003, 0.003, 0.003)


@dataclass(frozen=True)
class Identify:
    """SI; names as in motor_si_t without their prefix."""

    sigma: tuple[float, ...]
    leak: tuple[float, ...]
    r_known: float
    noise_V: float
    noise_Vs: float
    noise_rate: float
    omega_min_rad_s: float
    i_min_A: float
    i_smooth_A: float
    local_corner_rad_s: float
    local_rate: float
    limited_noise: float
    mismatch_rate: float
    torque_min_Nm: float
    confidence_rate: float


def derive(config: MotorConfig, bases: Bases, psi_f_Vs: float) -> Identify:
    """Compute the numbers from the uncertainties in motor.toml."""
    machine, inverter, prior = config.machine, config.inverter, config.identification
    update_s = UPDATE_STEPS * bases.step_s
    dead_V = prior.dead_time_uncertainty * inverter.vdc_V * inverter.dead_time_s * inverter.pwm_hz
    drop_V = 4.0 / math.pi * (dead_V + prior.device_drop_uncertainty_V)
    voltage_V, flux_Vs = prior.voltage_uncertainty * inverter.vdc_V, prior.flux_uncertainty * psi_f_Vs
    # Errors that stay for the correlation time are one measurement, not many.
    correlated = math.sqrt(max(prior.correlation_time_s / update_s, 1.0))
    sensor = machine.r_temp_coeff_per_K * prior.winding_uncertainty_K
    return Identify(
        sigma=(prior.resistance_uncertainty * machine.r_ohm, drop_V, prior.magnet_uncertainty * psi_f_Vs,
               prior.lq_uncertainty, prior.ld_uncertainty, math.radians(prior.angle_uncertainty_deg),
               prior.iron_loss_uncertainty),
        leak=tuple(rate * update_s for rate in LEAK_PER_S),
        r_known=min(1.0, max(sensor, 0.01) / prior.resistance_uncertainty) ** 2,
        noise_V=correlated * voltage_V, noise_Vs=correlated * flux_Vs, noise_rate=correlated * CHANGE_UNCERTAINTY,
        omega_min_rad_s=OMEGA_MIN_SHARE * config.omega_max_rad_s,
        i_min_A=I_MIN_SHARE * machine.i_max_A, i_smooth_A=0.5 * I_MIN_SHARE * machine.i_max_A,
        local_corner_rad_s=min(voltage_V / flux_Vs, CORNER_MAX * bases.omega_rad_s),
        local_rate=1.0 - math.exp(-bases.step_s / LOCAL_TIME_S),
        limited_noise=LIMITED_NOISE / bases.periods_per_step,
        mismatch_rate=1.0 - math.exp(-update_s / MISMATCH_TIME_S),
        torque_min_Nm=TORQUE_MIN_SHARE * machine.torque_max_Nm,
        confidence_rate=update_s / CONFIDENCE_TIME_S,
    )  # fmt: skip


def _array(values: list[str]) -> str:
    return "{" + ", ".join(values) + "}"


def _q30(value: float, name: str) -> str:
    return str(int(q31(value / 2.0, name)))


def _machine_rows(config: MotorConfig, bases: Bases, l_shift: int, sinc: float) -> list[Row]:
    b, machine = bases, config.machine
    turns = b.omega_rad_s * b.step_s / (2.0 * math.pi)
    admittance = b.flux_Vs / (1.5 * b.current_A)
    r0 = machine.r_ohm / b.resistance_ohm
    return [
        ("l_shift", f"{l_shift}u", ""), ("r0", q31(r0, "r0"), "R at 20 C"),
        ("r_per_dC", q31(r0 * machine.r_temp_coeff_per_K / 10.0, "r_per_dC"), "per 0.1 K"),
        ("sinc_gain", q31(sinc, "sinc_gain"), "(omega_b T_s)^2/24"),
        ("mean_gain_q32", str(round(2**32 / (2 * b.periods_per_step))), f"1/(2 N), N = {b.periods_per_step}"),
        ("rate_gain_q28", str(round(2**28 / (b.omega_rad_s * b.step_s))), "1/(omega_b T)"),
        ("window_turns_q29", f"{round(2**29 * turns)}u", f"{turns:.6g} turns"),
        ("turn_to_pu", q16(0.5 / turns, "turn_to_pu"), f"{0.5 / turns:.6g}"),
        ("iron_hysteresis", q31(machine.iron_loss_hysteresis * admittance, "iron_hysteresis"), "k_h/1.5"),
        ("iron_eddy", q31(machine.iron_loss_eddy * b.omega_rad_s * admittance, "iron_eddy"), "k_e omega_b/1.5"),
        ("iron_sign_gain", q16(b.omega_rad_s / IRON_SIGN_RAD_S, "iron_sign_gain"), f"over {IRON_SIGN_RAD_S:g} rad/s"),
    ]  # fmt: skip


def rows(config: MotorConfig, bases: Bases, identify: Identify, l_shift: int, sinc: float) -> list[Row]:
    """identify_config_t."""
    b, d = bases, identify
    unit = (b.resistance_ohm, b.voltage_V, b.flux_Vs, 1.0, 1.0, 1.0, 1.0)
    sigma = [str(q31(s / u, f"sigma of {n}")) for n, s, u in zip(STATES, d.sigma, unit, strict=True)]
    leak = [str(q31(value, f"leak of {n}")) for n, value in zip(STATES, d.leak, strict=True)]
    return [
        *_machine_rows(config, bases, l_shift, sinc),
        ("sigma", _array(sigma), ", ".join(f"{n} {s:.4g}" for n, s in zip(STATES, d.sigma, strict=True))),
        ("leak", _array(leak), "per update"),
        ("r_known_q30", _q30(d.r_known, "r_known"), f"{d.r_known:.4g}"),
        ("noise_voltage_q30", _q30(d.noise_V / b.voltage_V, "noise_voltage"), f"{d.noise_V:.4g} V"),
        ("noise_flux_q30", _q30(d.noise_Vs / b.flux_Vs, "noise_flux"), f"{d.noise_Vs:.4g} Vs"),
        ("noise_rate_q30", _q30(d.noise_rate, "noise_rate"), f"{d.noise_rate:.4g}"),
        ("omega_min", q15(d.omega_min_rad_s / b.omega_rad_s, "omega_min"), f"{d.omega_min_rad_s:.4g} rad/s"),
        ("i_min", q15(d.i_min_A / b.current_A, "i_min"), f"{d.i_min_A:.4g} A"),
        ("i_smooth", q15(d.i_smooth_A / b.current_A, "i_smooth"), f"{d.i_smooth_A:.4g} A"),
        ("local_corner", q15(d.local_corner_rad_s / b.omega_rad_s, "local_corner"),
         f"{d.local_corner_rad_s:.4g} rad/s"),
        ("local_rate", q31(d.local_rate, "local_rate"), f"{LOCAL_TIME_S:g} s"),
        ("limited_noise", q16(d.limited_noise, "limited_noise"), f"{d.limited_noise:g}"),
        ("mismatch_rate", q15(d.mismatch_rate, "mismatch_rate"), f"{MISMATCH_TIME_S:.3g} s"),
        ("torque_min", q15(d.torque_min_Nm / b.torque_Nm, "torque_min"), f"{d.torque_min_Nm:.4g} N·m"),
        ("confidence_full", q15(CONFIDENCE_FULL, "confidence_full"), f"{CONFIDENCE_FULL:g}"),
        ("confidence_none", q15(CONFIDENCE_NONE, "confidence_none"), f"{CONFIDENCE_NONE:g}"),
        ("confidence_rate", q15(d.confidence_rate, "confidence_rate"), f"{CONFIDENCE_TIME_S:g} s"),
    ]  # fmt: skip


def si_rows(config: MotorConfig, identify: Identify) -> list[Row]:
    """The same for motor_si_t, unrounded."""
    machine, d = config.machine, identify
    numbers = {
        "r_temp_coeff_per_K": machine.r_temp_coeff_per_K, "iron_hysteresis": machine.iron_loss_hysteresis,
        "iron_eddy": machine.iron_loss_eddy, "iron_sign_rad_s": IRON_SIGN_RAD_S, "identify_r_known": d.r_known,
        "identify_noise_V": d.noise_V, "identify_noise_Vs": d.noise_Vs, "identify_noise_rate": d.noise_rate,
        "identify_omega_min_rad_s": d.omega_min_rad_s, "identify_i_min_A": d.i_min_A,
        "identify_i_smooth_A": d.i_smooth_A, "identify_local_corner_rad_s": d.local_corner_rad_s,
        "identify_local_rate": d.local_rate, "identify_limited_noise": d.limited_noise,
        "identify_mismatch_rate": d.mismatch_rate, "identify_torque_min_Nm": d.torque_min_Nm,
        "identify_confidence_full": CONFIDENCE_FULL, "identify_confidence_none": CONFIDENCE_NONE,
        "identify_confidence_rate": d.confidence_rate,
    }  # fmt: skip
    lists = {"identify_sigma": d.sigma, "identify_leak": d.leak}
    return [
        *((k, repr(float(v)), "") for k, v in numbers.items()),
        *((k, _array([repr(float(v)) for v in values]), "") for k, values in lists.items()),
    ]
