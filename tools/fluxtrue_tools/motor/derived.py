# SPDX-License-Identifier: Apache-2.0
"""Every derived number of one motor in SI: gains, limits, thresholds. The only place where they are chosen."""

import math
from dataclasses import dataclass

from fluxtrue_tools.motor import identification
from fluxtrue_tools.motor.bases import Bases, inductance_at_rest
from fluxtrue_tools.motor.config import Inverter, MotorConfig
from fluxtrue_tools.motor.flux_model import FluxModel
from fluxtrue_tools.motor.rectifier import PULSE_SHARE, sustained_share

DELAY_PERIODS = 1.5  # one of computation, a half of the PWM's hold
CLOSED_LOOP_SHARE = 0.8
MEASURED_SHARE = 11 / 32  # of the rotational voltage, by the measured flux (CC-24); in current_control.h
TURNING_FEEDBACK, TURNING_INTEGRAL = 0.28, 0.045  # per period (CC-18), (CC-19)
TURNING_APPROACH = 0.08  # per period: L 20 % too small overshoots by less than 5 % with an ideal inverter (CC-21)
SINC_SERIES_MAX = 0.6  # rad: up to here 1 + theta^2/24 is 1/sinc(theta/2), (MR-5); beyond it is fitted at maximum speed
PAPER_TURN_MAX = 0.78  # rad at omega_b: the end of the formats of the paper's law
V_RATIO_CONTROL = 1.04 / math.sqrt(3.0)
V_CLEAR_MARGIN = 0.999  # of the roundings on the way from command to duty
V_RATIO_REFERENCE = 0.92 / math.sqrt(3.0)
TRIM_RATE_RAD_S = 50.0
TRIM_MIN_SHARE = -0.25  # of the planned voltage at vdc_V
TRIM_MAX = 1.0 / math.sqrt(3.0) - V_RATIO_REFERENCE  # of v_dc: up to the linear limit (CR-14)

TRACKER_BANDWIDTH_RAD_S = 300.0  # or as much as the rotor's own acceleration needs, up to ...: (AT-19)
TRACKER_BANDWIDTH_PER_PWM = 1 / 16
TRACKER_JUMP_TURNS, TRACKER_JUMP_MAX_TURNS = 1 / 20, 1 / 8
TRACKER_LAG_SHARE = 0.6  # of a jump, by the rotor alone with all torque
ANGLE_JUMPS_S = 0.03  # of implausible samples: (MN-21)
REPEAT_TURNS = 2 / 4096  # mechanical: two counts of the coarsest sensor, (AT-16)
LAG_SHARE = 0.1875  # of the lag that a rotor which stops leaves behind the prediction: (AT-17)
STOP_S = 0.005  # in which a slow rotor can stop: (AT-18)
BASE_STOPS_S = 0.25  # from the speed base to standstill: (SS-5)
ANGLE_HARMONIC_MAX_TURNS = 2 / 360  # electrical, of each harmonic's cosine and sine: a good sensor stays below half

KNEE_LSB = 4

PSI_DELTA_MIN, PSI_DELTA_MAX = -0.35, 0.15  # of psi_f
R_DELTA_MIN, R_DELTA_MAX = -0.5, 1.0  # of R at 20 C
DEAD_TIME_RESIDUAL = 0.1  # share of the dead-time voltage that may stay uncompensated ...
DEAD_TIME_CURRENT = 0.1  # ... at this share of i_max, where it looks like a resistance
OMEGA_MIN_RAD_S, OMEGA_MIN_SHARE = 200.0, 0.05
OMEGA_R_MAX_SHARE = 0.6
I_MIN_SHARE = 0.04
PROPORTIONAL_MAX_PERIODS = 127.0
PSI_DRIFT_SHARE, R_DRIFT_SHARE = 0.05, 0.2
QUALITY_TIME_S = 0.05

LOOP_MISSING_PERIODS = 3.75  # area between a small step of current and its answer (TL-11)
STEP_MISSING_S = 2e-3 / 3 - LOOP_MISSING_PERIODS * 1e-4  # what the voltage circle adds in a large one
TORQUE_MIN_SHARE = 0.1

V_MAX_PER_VDC, V_MIN_PER_VDC = 1.25, 0.4
SUM_MAX_PER_FULL_SCALE = 0.05
DEVIATION_SHARE, PHASE_DEAD_SHARE, PHASE_ALIVE_SHARE = 0.1, 0.02, 0.05  # of i_max
RIPPLE_SHARE = 0.015  # of i_max: noise, sensor harmonics and dead time in the controlled current
SPEED_TRIP = 0.8  # of the reserve of the speed base
TORQUE_MONITOR_NM, TORQUE_MONITOR_SHARE = 10.0, 0.05
INVERTER_ERROR_PER_VDC = 0.02
LEG_ERROR_SHARE = 0.25  # of dead time and device drop: 20 % of spread, at a dc voltage up to a quarter above nominal
FROZEN_SHARE, FROZEN_SETTLE_S = 0.25, 0.01  # of the inverter's voltage error; for the mean to settle
MONITOR_MEAN_S = -1e-3 / math.log(0.75)  # a quarter in 1 ms
DEVIATION_S, RIPPLE_S, LOST_S, EQUAL_S, FAST_S, HOT_S = 0.1, 0.02, 0.008, 0.02, 0.005, 0.11
LAUNCH_SHARE = 0.1  # of the inverter's voltage error: what a rotor's turning may change of its part along the current
LAUNCH_SPARE = LAUNCH_SHARE - math.pi / 6.0 * (1.0 - math.cos(math.pi / 6.0))  # what (MN-33) leaves of it
LAUNCH_ANGLE = 0.3 * 2.0 * math.pi / 4096  # of a turn of the rotor in a step: the resolution of a sensor of 12 bits
LAUNCH_FLUX_SHARE = 0.2  # of psi_f: deviation of the magnet
TORQUE_S, ANGLE_S, SETTLE_S, GATE_EXCEEDED_S = 0.02, 0.005, 0.005, 0.07
TRIM_S = 1.0  # of identification between two moves of the dead-time compensation
COMMISSION_SETTLE_S, COMMISSION_MEASURE_S = 0.04, 0.064
# Of a movement of the shaft for commissioning: shares of i_max and of the largest speed.
MOVEMENT_CURRENT_SHARE, MOVEMENT_BLOCKED_SHARE = 0.4, 0.15
MOVEMENT_SPEED_SHARE, MOVEMENT_STILL_SHARE = 0.3, 0.01
MOVEMENT_HZ, MOVEMENT_SPEED_UP_S, MOVEMENT_RISE_S = 1.0, 0.5, 0.01
MOVEMENT_BLOCKED_S, MOVEMENT_S = 1.0, 60.0
STANDSTILL_SHARE = 0.002  # of the speed base
NOISE_SHARE = 0.002  # of a current converter's full scale, rms
NOISE_CREST = 4.0 * 0.27  # 4 times the rms of a mean of four steps: (MN-35)
PERIOD_NOISE_CREST = 4.0 / 3.0  # times the rms; hsm1 needs no more than its V_0
MONITOR_NOISE_SHARE = 0.04  # of i_max: the bridge's zero crossing and noise look like a voltage on no current
SHARE_HYSTERESIS = 0.1
V_RELEASE_PER_VDC = 1.15

COLD_C = 20.0  # temperature of machine.r_ohm
WINDING_MIN_C = -40.0  # the coldest winding that the torque monitor allows for
SLEW_WEAK_PER_TORQUE_MAX = 100.0  # 1/s: a full reversal at top speed keeps its currents below the trip
PSI_WEAK_PER_PSI_F = 1.0 / 0.6  # the magnet alone takes 60 % of the planned voltage
LOSS_TIME_S = 0.02
MOVING_SHARES = (0.01, 0.02)  # of maximum speed: from here to there the direction of power becomes certain
DC_LOW_PER_VDC, DC_HIGH_PER_VDC = (0.4, 0.6), (1.24, 1.21)  # no torque, all torque
SPEED_RESERVE_MAX = 0.125
SPEED_START, SPEED_END = 0.1, 0.6  # of the reserve of the speed base: all torque, no driving torque


@dataclass(frozen=True)
class Derived:
    """Names as in motor_si_t."""

    psi_f_Vs: float
    tracker_bandwidth_rad_s: float
    tracker_jump_turns: float
    stop_speed_rad_s: float
    sigma_rad_s: float
    setpoint_weight: float
    integral_ratio: float
    v_ratio: float
    v_clear: float
    bridge_duty: float
    dead_time_duty: float
    knee_A: float
    min_pulse_duty: float
    observer_s_rad_s: float
    flux_proportional: float
    resistance_proportional: float
    psi_delta_min_Vs: float
    psi_delta_max_Vs: float
    r_delta_min_ohm: float
    r_delta_max_ohm: float
    omega_min_rad_s: float
    omega_r_max_rad_s: float
    i_min_A: float
    psi_drift_full_Vs: float
    r_drift_full_ohm: float
    quality_rate: float
    torque_ki: float
    torque_kp: float
    torque_model_rate: float
    torque_min_Nm: float
    torque_slew_Nm: float
    ref_v_ratio: float
    trim_gain: float
    trim_min_V: float
    trim_max_ratio: float
    torque_slew_weak_Nm: float
    psi_weak_Vs: float
    loss_rate: float
    loss_drop_V: float
    moving_end_rad_s: float
    moving_start_rad_s: float
    inverter_end_C: float
    inverter_start_C: float
    winding_end_C: float
    winding_start_C: float
    dc_low_end_V: float
    dc_low_start_V: float
    dc_high_end_V: float
    dc_high_start_V: float
    speed_end_rad_s: float
    speed_start_rad_s: float
    i_d_20_A: float
    i_d_slope_A_per_K: float
    psi_temp_coeff_per_K: float
    magnet_assumed_C: float
    i_trip_A: float
    v_max_V: float
    v_min_V: float
    sum_max_A: float
    deviation_A: float
    phase_dead_A: float
    phase_alive_A: float
    ripple_A: float
    answer_rate: float
    behind_A_per_V: float
    speed_trip_rad_s: float
    monitor_torque_Nm: float
    monitor_V: float
    monitor_noise_V: float
    period_noise_V: float
    frozen_V: float
    launch_V: float
    launch_A: float
    monitor_A: float
    monitor_mean_rate: float
    share_short: float
    share_open: float
    v_release_V: float
    identify: identification.Identify


def _current_control(period_s: float) -> dict[str, float]:
    sigma = 1.0 / (2.0 * DELAY_PERIODS * period_s)
    w_c, a = CLOSED_LOOP_SHARE * sigma, (1.0 - CLOSED_LOOP_SHARE) * sigma
    return {
        "sigma_rad_s": sigma,
        "setpoint_weight": w_c / (w_c + a),
        "integral_ratio": w_c * a * period_s / sigma,
        "v_ratio": V_RATIO_CONTROL,
    }


def turning_knee_A_per_rad(config: MotorConfig, model: FluxModel) -> float:
    """Per angle of the field in a period: the knee with which the part of the compensation's answer to a deviation that
    the dead time does not cancel stays below the answer of the law for a field that turns far (MO-12)."""
    inverter = config.inverter
    duty = inverter.dead_time_s * inverter.pwm_hz + inverter.device_drop_V / inverter.vdc_V
    l_min = inductance_at_rest(model)
    flux_Vs = duty * config.control.dead_time_compensation * inverter.vdc_V / inverter.pwm_hz
    return DELAY_PERIODS * flux_Vs / (TURNING_FEEDBACK * l_min)


def knee_A(config: MotorConfig) -> float:
    """The current from which the dead-time compensation is whole."""
    inverter = config.inverter
    return KNEE_LSB * 2.0 * inverter.current_full_scale_A / (1 << inverter.adc_bits)


def _modulation(config: MotorConfig) -> dict[str, float]:
    inverter = config.inverter
    # A device drop acts like dead time: a leg voltage against its current.
    duty = inverter.dead_time_s * inverter.pwm_hz + inverter.device_drop_V / inverter.vdc_V
    min_pulse = config.min_pulse_s * inverter.pwm_hz
    # Inside this circle no pulse can be too short, with the whole dead time on top: (MO-11).
    clear = (1.0 - 2.0 * (min_pulse + duty * max(1.0, config.control.dead_time_compensation))) / math.sqrt(3.0)
    return {
        "bridge_duty": duty,
        "dead_time_duty": duty * config.control.dead_time_compensation,
        "knee_A": knee_A(config),
        "min_pulse_duty": min_pulse,
        "v_clear": V_CLEAR_MARGIN * max(min(31 / 32 * V_RATIO_CONTROL, clear), 0.0),
    }


def _identification(config: MotorConfig, model: FluxModel, bases: Bases, psi_f_Vs: float) -> dict[str, float]:
    machine, control, inverter = config.machine, config.control, config.inverter
    period_s, step_s = bases.period_s, bases.step_s
    l_d, l_q = float(model.psi_d(0.0, 0.0, nd=1)), float(model.psi_q(0.0, 0.0, nq=1))
    s = control.observer_m * machine.r_ohm * (1.0 / l_d + 1.0 / l_q)
    # The zero of each law lies on the observer's poles, so that the proportional part damps them.
    periods = min(2.0 / (s * period_s), PROPORTIONAL_MAX_PERIODS)
    v_dead = 4.0 / math.pi * inverter.vdc_V * inverter.dead_time_s * inverter.pwm_hz
    looks_like = DEAD_TIME_RESIDUAL * v_dead / (DEAD_TIME_CURRENT * machine.i_max_A)
    return {
        "observer_s_rad_s": s,
        "flux_proportional": periods,
        "resistance_proportional": periods,
        "psi_delta_min_Vs": PSI_DELTA_MIN * psi_f_Vs,
        "psi_delta_max_Vs": PSI_DELTA_MAX * psi_f_Vs,
        "r_delta_min_ohm": R_DELTA_MIN * machine.r_ohm,
        "r_delta_max_ohm": R_DELTA_MAX * machine.r_ohm + looks_like,
        "omega_min_rad_s": min(OMEGA_MIN_RAD_S, OMEGA_MIN_SHARE * config.omega_max_rad_s),
        "omega_r_max_rad_s": OMEGA_R_MAX_SHARE * config.omega_max_rad_s,
        "i_min_A": I_MIN_SHARE * machine.i_max_A,
        "psi_drift_full_Vs": PSI_DRIFT_SHARE * psi_f_Vs * control.flux_bandwidth_rad_s * step_s,
        "r_drift_full_ohm": R_DRIFT_SHARE * machine.r_ohm * control.resistance_bandwidth_rad_s * step_s,
        "quality_rate": 1.0 - math.exp(-step_s / QUALITY_TIME_S),
    }


def missing_periods(config: MotorConfig) -> float:
    """Area between a small step of current and its answer (TL-11), (CC-21)."""
    return 1.0 + 1.0 / TURNING_APPROACH if config.is_turning else LOOP_MISSING_PERIODS


def _answer_rate(config: MotorConfig, bases: Bases) -> float:
    """Share of a change of the reference that the current follows in a step (CC-21); all with the usual law."""
    return 1.0 - (1.0 - TURNING_APPROACH) ** bases.periods_per_step if config.is_turning else 1.0


def _behind_A_per_V(config: MotorConfig, model: FluxModel, bases: Bases) -> float:
    """How far the current is off its reference if the rotational voltage is wrong by 1 V (MN-43)."""
    l_min = inductance_at_rest(model)
    sigma = _current_control(bases.period_s)["sigma_rad_s"]
    return 1.0 / (l_min * (TURNING_FEEDBACK / bases.period_s if config.is_turning else sigma))


def frozen_settle_s(config: MotorConfig) -> float:
    """Until the voltage that moves the currents is no part of the mean any more: a share of e^-5 is left (MN-22).

    Current control that answers slowly leaves a deviation while the tracked speed is behind that of a rotor which has
    just stopped: the voltage that removes it follows both.
    """
    answer_s = 5.0 / (TURNING_APPROACH * config.inverter.pwm_hz)
    if not config.is_turning or answer_s <= FROZEN_SETTLE_S:
        return FROZEN_SETTLE_S
    return answer_s + 5.0 / _tracker(config)["tracker_bandwidth_rad_s"]


def steps(seconds: float, step_s: float) -> int:
    """Steps of the task that cover a time."""
    return math.ceil(seconds / step_s - 1e-6)


def _torque_loop(config: MotorConfig, step_s: float) -> dict[str, float]:
    control = config.control
    missing_s = missing_periods(config) / config.inverter.pwm_hz + STEP_MISSING_S
    return {
        "torque_ki": control.torque_loop_bandwidth_rad_s * step_s,
        "torque_kp": 0.0,
        "torque_model_rate": step_s / (step_s + missing_s),
        "torque_min_Nm": TORQUE_MIN_SHARE * config.machine.torque_max_Nm,
        "torque_slew_Nm": config.torque_slew_Nm_per_s * step_s,
    }


def _voltage_reserve(config: MotorConfig, step_s: float) -> dict[str, float]:
    planned = V_RATIO_REFERENCE * config.inverter.vdc_V
    return {
        "ref_v_ratio": V_RATIO_REFERENCE,
        "trim_gain": TRIM_RATE_RAD_S * step_s,
        "trim_min_V": TRIM_MIN_SHARE * planned,
        "trim_max_ratio": TRIM_MAX,
    }


def _torque_limit(config: MotorConfig, bases: Bases, psi_f_Vs: float) -> dict[str, float]:
    vdc, omega, thermal, magnet = config.inverter.vdc_V, config.omega_max_rad_s, config.thermal, config.magnet
    reserve = min(bases.omega_rad_s / omega - 1.0, SPEED_RESERVE_MAX)
    return {
        "torque_slew_weak_Nm": SLEW_WEAK_PER_TORQUE_MAX * config.machine.torque_max_Nm * bases.step_s,
        "psi_weak_Vs": PSI_WEAK_PER_PSI_F * psi_f_Vs,
        "loss_rate": 1.0 - math.exp(-bases.step_s / LOSS_TIME_S),
        "loss_drop_V": 4.0 / math.pi * config.inverter.device_drop_V,
        "moving_end_rad_s": MOVING_SHARES[0] * omega,
        "moving_start_rad_s": MOVING_SHARES[1] * omega,
        "inverter_end_C": thermal.inverter_trip_C,
        "inverter_start_C": thermal.inverter_derate_C,
        "winding_end_C": thermal.winding_trip_C,
        "winding_start_C": thermal.winding_derate_C,
        "dc_low_end_V": DC_LOW_PER_VDC[0] * vdc,
        "dc_low_start_V": DC_LOW_PER_VDC[1] * vdc,
        "dc_high_end_V": DC_HIGH_PER_VDC[0] * vdc,
        "dc_high_start_V": DC_HIGH_PER_VDC[1] * vdc,
        "speed_end_rad_s": (1.0 + SPEED_END * reserve) * omega,
        "speed_start_rad_s": (1.0 + SPEED_START * reserve) * omega,
        "i_d_20_A": magnet.i_d_demag_A or config.machine.i_max_A,
        "i_d_slope_A_per_K": magnet.i_d_demag_A_per_K if magnet.i_d_demag_A else 0.0,
        "psi_temp_coeff_per_K": magnet.psi_temp_coeff_per_K,
        "magnet_assumed_C": magnet.assumed_C,
    }


def inverter_error_V(inverter: Inverter) -> float:
    """V_0: half of it covers the fundamental of what compensating dead time and device drop may leave (MN-25)."""
    legs_V = inverter.vdc_V * inverter.dead_time_s * inverter.pwm_hz + inverter.device_drop_V
    return max(INVERTER_ERROR_PER_VDC * inverter.vdc_V, 2.0 * LEG_ERROR_SHARE * 4.0 / math.pi * legs_V)


def _flux_noise(config: MotorConfig, model: FluxModel) -> float:
    """The current sensors' noise, rms, as flux."""
    l_max = max(float(model.psi_d(0.0, 0.0, nd=1)), float(model.psi_q(0.0, 0.0, nq=1)))
    return l_max * NOISE_SHARE * config.inverter.current_full_scale_A


def _voltage_noise(config: MotorConfig, model: FluxModel, bases: Bases) -> float:
    """The mean voltage with which the current follows the sensors' noise, beyond a quarter of V_0 (MN-35)."""
    noise_V = NOISE_CREST * _flux_noise(config, model) / bases.step_s
    return max(0.0, noise_V - inverter_error_V(config.inverter) / 4.0)


def _period_noise(config: MotorConfig, model: FluxModel, bases: Bases) -> float:
    """The voltage with which current control answers that noise in a period, beyond V_0 (MN-36)."""
    noise_V = PERIOD_NOISE_CREST * _current_control(bases.period_s)["sigma_rad_s"] * _flux_noise(config, model)
    return max(0.0, noise_V - inverter_error_V(config.inverter))


def _creeping_drop(config: MotorConfig) -> float:
    """How the resistive drop changes while both axes of the reference creep by I_0, beyond V_0/8 (MN-40)."""
    machine = config.machine
    hottest = 1.0 + machine.r_temp_coeff_per_K * (config.thermal.winding_trip_C - COLD_C)
    drop_V = math.sqrt(2.0) * machine.r_ohm * hottest * MONITOR_NOISE_SHARE * machine.i_max_A
    return max(0.0, drop_V - inverter_error_V(config.inverter) / 8.0)


def _slow_monitors(config: MotorConfig, model: FluxModel, bases: Bases) -> dict[str, float]:
    machine, omega = config.machine, config.omega_max_rad_s
    error_V, noise_V = inverter_error_V(config.inverter), _voltage_noise(config, model, bases)
    drop_V = _creeping_drop(config)
    reserve = min(bases.omega_rad_s / omega - 1.0, SPEED_RESERVE_MAX)
    return {
        "deviation_A": DEVIATION_SHARE * machine.i_max_A,
        "phase_dead_A": PHASE_DEAD_SHARE * machine.i_max_A,
        # The fastest change of torque moves the current by this much per second; current control lags behind (TL-11).
        "answer_rate": _answer_rate(config, bases),
        "behind_A_per_V": _behind_A_per_V(config, model, bases),
        "ripple_A": (RIPPLE_SHARE + SLEW_WEAK_PER_TORQUE_MAX * LOOP_MISSING_PERIODS * bases.period_s) * machine.i_max_A,
        "phase_alive_A": PHASE_ALIVE_SHARE * machine.i_max_A,
        "speed_trip_rad_s": (1.0 + SPEED_TRIP * reserve) * omega,
        "monitor_torque_Nm": max(
            min(TORQUE_MONITOR_NM, 0.1 * machine.torque_max_Nm), TORQUE_MONITOR_SHARE * machine.torque_max_Nm
        ),
        "monitor_V": error_V,
        "monitor_noise_V": noise_V,
        "period_noise_V": _period_noise(config, model, bases),
        "frozen_V": FROZEN_SHARE * error_V + noise_V + drop_V,
        "launch_V": LAUNCH_SHARE * error_V + noise_V + drop_V / 2.0,
        "launch_A": MONITOR_NOISE_SHARE / 4.0 * machine.i_max_A,
        "monitor_A": MONITOR_NOISE_SHARE * machine.i_max_A,
        "monitor_mean_rate": 1.0 - math.exp(-bases.step_s / MONITOR_MEAN_S),
    }


def _short_circuit_share(model: FluxModel) -> float:
    """Of the dc voltage, above which a fault shorts the phases (SS-25), to a hundredth."""
    return round(min(sustained_share(model), PULSE_SHARE), 2)


def _monitors(config: MotorConfig, model: FluxModel) -> dict[str, float]:
    inverter = config.inverter
    share_short = _short_circuit_share(model)
    return {
        "i_trip_A": config.i_trip_A,
        "v_max_V": V_MAX_PER_VDC * inverter.vdc_V,
        "v_min_V": V_MIN_PER_VDC * inverter.vdc_V,
        "share_short": share_short,
        "share_open": share_short - SHARE_HYSTERESIS,
        "v_release_V": V_RELEASE_PER_VDC * inverter.vdc_V,
        "sum_max_A": SUM_MAX_PER_FULL_SCALE * inverter.current_full_scale_A,
    }


def _tracker(config: MotorConfig) -> dict[str, float]:
    """Bandwidth and jump with which the lag of a rotor that accelerates by itself is no jump (AT-19)."""
    machine = config.machine
    acceleration = machine.pole_pairs * machine.torque_max_Nm / machine.inertia_kgm2
    wanted = math.sqrt(acceleration / (TRACKER_LAG_SHARE * TRACKER_JUMP_TURNS * 2.0 * math.pi))
    bandwidth = max(TRACKER_BANDWIDTH_RAD_S, min(wanted, TRACKER_BANDWIDTH_PER_PWM * config.inverter.pwm_hz))
    lag_turns = acceleration / bandwidth**2 / (2.0 * math.pi)
    return {
        "tracker_bandwidth_rad_s": bandwidth,
        "tracker_jump_turns": min(max(TRACKER_JUMP_TURNS, lag_turns / TRACKER_LAG_SHARE), TRACKER_JUMP_MAX_TURNS),
    }


def _stop_speed_rad_s(config: MotorConfig, bases: Bases, bandwidth_rad_s: float) -> float:
    """Tracked speed up to which a rotor may be at rest after STOP_S with the same angle (AT-18), (AT-21)."""
    deceleration = bases.omega_rad_s / BASE_STOPS_S
    tracked_rad_s = 2.0 * deceleration / bandwidth_rad_s  # when the rotor has stopped
    count_rad = 2.0 * math.pi * config.machine.pole_pairs / 4096
    seen_rad = deceleration / bandwidth_rad_s**2 - count_rad  # of the lag, in the worst case
    hidden = seen_rad < LAG_SHARE * tracked_rad_s / bandwidth_rad_s
    return 2.0 * tracked_rad_s if hidden else deceleration * STOP_S


def derive(config: MotorConfig, model: FluxModel, bases: Bases) -> Derived:
    """All derived numbers of one motor."""
    psi_f = float(model.psi_d(0.0, 0.0))
    tracker = _tracker(config)
    return Derived(
        psi_f_Vs=psi_f,
        **tracker,
        stop_speed_rad_s=_stop_speed_rad_s(config, bases, tracker["tracker_bandwidth_rad_s"]),
        **_current_control(bases.period_s),
        **_modulation(config),
        **_identification(config, model, bases, psi_f),
        **_torque_loop(config, bases.step_s),
        **_voltage_reserve(config, bases.step_s),
        **_torque_limit(config, bases, psi_f),
        **_monitors(config, model),
        **_slow_monitors(config, model, bases),
        identify=identification.derive(config, bases, psi_f),
    )


def sinc_gain(config: MotorConfig, bases: Bases) -> float:
    """c in 1/sinc(theta/2) = 1 + c theta^2, times (omega_b T_s)^2."""
    theta = config.omega_max_rad_s * bases.period_s
    gain = 1.0 / 24.0
    if theta > SINC_SERIES_MAX:
        gain = (0.5 * theta / math.sin(0.5 * theta) - 1.0) / theta**2
    return gain * (bases.omega_rad_s * bases.period_s) ** 2


def reference_flux_low(config: MotorConfig) -> float:
    """psi_avail at top speed on a dc link of 60 %: the lower end of the reference tables."""
    return 0.6 * config.inverter.vdc_V * V_RATIO_REFERENCE / config.omega_max_rad_s
