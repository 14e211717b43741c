# SPDX-License-Identifier: Apache-2.0
"""The two generated C files: motor_tables.c for the firmware, motor_si.c for its double-precision twin."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fluxtrue_tools.motor import identification
from fluxtrue_tools.motor.bases import Bases
from fluxtrue_tools.motor.derived import (
    ANGLE_HARMONIC_MAX_TURNS,
    ANGLE_JUMPS_S,
    ANGLE_S,
    COMMISSION_MEASURE_S,
    COMMISSION_SETTLE_S,
    DEVIATION_S,
    EQUAL_S,
    FAST_S,
    GATE_EXCEEDED_S,
    HOT_S,
    LAG_SHARE,
    LAUNCH_ANGLE,
    LAUNCH_FLUX_SHARE,
    LAUNCH_SPARE,
    LOST_S,
    MOVEMENT_BLOCKED_S,
    MOVEMENT_BLOCKED_SHARE,
    MOVEMENT_CURRENT_SHARE,
    MOVEMENT_HZ,
    MOVEMENT_RISE_S,
    MOVEMENT_S,
    MOVEMENT_SPEED_SHARE,
    MOVEMENT_SPEED_UP_S,
    MOVEMENT_STILL_SHARE,
    PAPER_TURN_MAX,
    REPEAT_TURNS,
    RIPPLE_S,
    SETTLE_S,
    STANDSTILL_SHARE,
    STOP_S,
    TORQUE_S,
    TRIM_S,
    TURNING_APPROACH,
    TURNING_FEEDBACK,
    TURNING_INTEGRAL,
    WINDING_MIN_C,
    frozen_settle_s,
    sinc_gain,
    steps,
    turning_knee_A_per_rad,
)
from fluxtrue_tools.motor.motor import Motor
from fluxtrue_tools.motor.quantise import Q15_ONE, Q16_ONE, Unfit, q15, q16, q31, u16
from fluxtrue_tools.motor.second_level import make_second_level

Row = tuple[str, object, str]  # member, literal, comment

COLUMNS = 100
INT32_MAX = 2**31 - 1
GATE_FAULT_FLUX = 1.5  # psi_b: more than any current of the machine links
INDENT = "    "
ZERO_ERROR_SHARE = 0.015  # of full scale: the largest zero error of a phase current (MN-38)


def _float(value: float) -> str:
    """A float literal that the compiler reads as the nearest float."""
    text = str(np.float32(value))
    return (text if "." in text or "e" in text else text + ".0") + "f"


def _double(value: float) -> str:
    return repr(float(value))


def _wrap(values: Sequence[str]) -> list[str]:
    lines, line = [], INDENT
    for value in values:
        item = value + ", "
        if len(line) + len(item) - 1 > COLUMNS:
            lines.append(line.rstrip())
            line = INDENT
        line += item
    lines.append(line.rstrip())
    return lines


def _table(kind: str, name: str, values: NDArray[np.generic], comment: str) -> str:
    """One static table, a blank-free block per row of the grid."""
    rows = np.atleast_2d(values)
    lines = [f"/* {comment} */", f"static const {kind} {name}[{values.size}] = {{"]
    for row in rows:
        lines += _wrap([str(int(v)) if kind == "int16_t" else _double(float(v)) for v in row])
    return "\n".join([*lines, "};", ""])


def _struct(rows: Sequence[Row], indent: str) -> list[str]:
    out = []
    for member, literal, comment in rows:
        if isinstance(literal, list):
            out += [f"{indent}.{member} = {{", *_struct(literal, indent + INDENT), f"{indent}}},"]
        else:
            line = f"{indent}.{member} = {literal},"
            out.append(f"{line} /* {comment} */" if comment else line)
    return out


def _head(motor: Motor, include: str) -> str:
    return (
        f"/* SPDX-License-Identifier: Apache-2.0 */\n"
        f"/* Motor '{motor.config.machine.name}'. Generated from motor.toml by `tools/fluxtrue motor build`; "
        f'do not edit. */\n#include "{include}"\n'
    )


def _bases(bases: Bases) -> list[Row]:
    values = {name: getattr(bases, name) for name in Bases.__dataclass_fields__}
    return [(name, f"{v}u" if isinstance(v, int) else _float(v), "") for name, v in values.items()]


def _dc_bias(motor: Motor, gain: int) -> int:
    """The offset of the dc voltage's sensor in Q30, and half an LSB of q15: (CC-3)."""
    offset_V = motor.config.inverter.v_dc_offset_V
    bias = 16384 - round(math.ldexp(offset_V / motor.bases.voltage_V, 30))
    if gain * (2**motor.config.inverter.adc_bits - 1) + bias > INT32_MAX:
        raise Unfit("v_dc_full_scale_V - v_dc_offset_V, allowed: below twice V_b")
    return bias


def _dc_comment(motor: Motor, shift: int) -> str:
    full_scale = f"{motor.config.v_dc_full_scale_V:g} V full scale in Q14, times 2^{shift}"
    offset_V = motor.config.inverter.v_dc_offset_V
    return f"{full_scale}; {offset_V:g} V of offset" if offset_V else full_scale


def _measure(motor: Motor) -> list[Row]:
    shift = 16 - motor.config.inverter.adc_bits
    ratio = motor.config.v_dc_full_scale_V / motor.bases.voltage_V
    u16(ratio, Q15_ONE, "v_dc_full_scale_V/V_b")  # below 2
    gain = round(math.ldexp(ratio, 14 + shift))
    scale = round(2 ** (13 + shift) / 3)
    # Mid scale is exactly no current; the offset rounds alpha, which contains twice phase a, by half an LSB.
    bias = -scale << 15 - shift
    phases = [(scale, bias + 2048), (-scale, -bias), (-scale, -bias)]
    return [
        (
            "phase",
            "{" + ", ".join(f"{{{s}, {b}}}" for s, b in phases) + "}",
            f"a third of gain 1.0 in Q13, times 2^{shift}; -32768 counts of it",
        ),
        ("v_dc", f"{{{gain}, {_dc_bias(motor, gain)}}}", _dc_comment(motor, shift)),
    ]


def _tracker(motor: Motor) -> list[Row]:
    d, b = motor.derived, motor.bases
    w_ts = d.tracker_bandwidth_rad_s * b.period_s
    to_pu = math.pi / (b.omega_rad_s * b.period_s)
    shift = 1 if b.omega_rad_s * b.period_s > PAPER_TURN_MAX else 0
    return [
        ("pole_pairs", f"{motor.config.machine.pole_pairs}u", ""),
        ("offset", "0u", ""),
        ("kp", q31(2 * w_ts, "tracker kp"), f"2 w_n T_s, w_n = {d.tracker_bandwidth_rad_s:g} rad/s"),
        ("ki_q29", q31(w_ts**2 * 2 * to_pu / 4, "tracker ki"), "(w_n T_s)^2 2 pi/(omega_b T_s)"),
        ("pu_to_turn", q31(4 / to_pu / 2**shift, "pu_to_turn"), f"2^{34 - shift} omega_b T_s/(2 pi)"),
        ("turn_to_pu", q16(to_pu, "turn_to_pu"), f"{to_pu:.6g}"),
        ("max_step", f"{int(d.tracker_jump_turns * 2**32)}u", f"{d.tracker_jump_turns:g} turn"),
        (
            "repeat_max",
            f"{int(REPEAT_TURNS * motor.config.machine.pole_pairs * 2**32)}u",
            f"{REPEAT_TURNS:g} turn mechanical",
        ),
        ("lag_steps", f"{round(LAG_SHARE / w_ts)}u", f"{LAG_SHARE:g}/(w_n T_s)"),
        (
            "stop_speed_q30",
            q31(d.stop_speed_rad_s / b.omega_rad_s / 2.0, "stop_speed"),
            f"{d.stop_speed_rad_s:.4g} rad/s",
        ),
        ("stop_periods", f"{round(STOP_S / b.period_s)}u", f"{1e3 * STOP_S:g} ms of periods"),
        ("turn_shift", f"{shift}u", ""),
    ]


def _harmonics(motor: Motor) -> list[Row]:
    turns = ANGLE_HARMONIC_MAX_TURNS / motor.config.machine.pole_pairs
    return [("max", int(turns * 2**32), f"{360 * ANGLE_HARMONIC_MAX_TURNS:g} degrees electrical")]


def _grid(x0: int, y0: int, shift: int, shape: tuple[int, ...]) -> list[Row]:
    return [
        ("x0", x0, ""),
        ("y0", y0, ""),
        ("x_shift", f"{shift}u", ""),
        ("y_shift", f"{shift}u", ""),
        ("nx", f"{shape[0]}u", ""),
        ("ny", f"{shape[1]}u", ""),
    ]


def _flux_table(motor: Motor) -> list[Row]:
    tables = motor.tables
    names = ("l_d", "l_q", "l_qq", "g", "psi_f0")
    nx, ny = tables.l_d_H.shape
    return [
        ("mesh", f"FX_MESH({tables.x0}, {tables.shift}u, {nx}u, {ny}u)", ""),
        ("l_shift", f"{tables.l_shift}u", ""),
        ("i_scale", 8 << tables.l_shift, ""),
        *((name, f"table_{name}", "") for name in names),
    ]


def _current_gains(motor: Motor) -> tuple[Row, Row, Row]:
    """sigma, integral part and anti-windup; of the other law's voltage limit where the field turns far (CC-20)."""
    d, b = motor.derived, motor.bases
    if motor.config.is_turning:
        flux = b.omega_rad_s * b.period_s * d.v_ratio
        tracking = "tracking_gain_q34", q31(flux / 2, "tracking_gain"), "omega_b T_s v_ratio/16: turning_control"
        return ("sigma_q24", "0", ""), ("integral_gain", "0", ""), tracking
    sigma = d.sigma_rad_s / b.omega_rad_s
    return (
        ("sigma_q24", q31(sigma / 128, "sigma"), f"sigma = {d.sigma_rad_s:.6g} rad/s, over omega_b"),
        ("integral_gain", q15(sigma * d.integral_ratio, "integral_gain"), f"sigma_gain {d.integral_ratio:.6g}"),
        (
            "tracking_gain_q34",
            q31(8 * d.integral_ratio / d.setpoint_weight * d.v_ratio, "tracking_gain"),
            "integral ratio over weight, times v_ratio",
        ),
    )


def _current_control(motor: Motor) -> list[Row]:
    d, b = motor.derived, motor.bases
    sigma, integral, tracking = _current_gains(motor)
    r_pu = motor.config.machine.r_ohm / b.resistance_ohm
    drop = r_pu * b.omega_rad_s / d.sigma_rad_s
    return [
        sigma,
        ("drop_gain", q16(drop, "drop_gain"), "R at 20 C over sigma_gain"),
        ("setpoint_weight", q15(d.setpoint_weight, "setpoint_weight"), f"{d.setpoint_weight:g}"),
        integral,
        tracking,
        ("per_ratio_q31", f"{round(2**31 / d.v_ratio)}u", f"1/{d.v_ratio:.6g}"),
        ("clear_q30", f"{round(2**30 * (d.v_clear / d.v_ratio) ** 2)}u", f"({d.v_clear:.6g} over v_ratio) squared"),
    ]


def knee_turns_q27(motor: Motor) -> int:
    """Inverse of the knee times the angle of a period in turns, Q17 times Q10; a smaller number is a wider knee."""
    per_count_A = turning_knee_A_per_rad(motor.config, motor.model) * 2.0 * math.pi / 1024.0
    wanted = 2.0**17 * motor.bases.current_A
    return INT32_MAX if wanted >= INT32_MAX * per_count_A else max(1, round(wanted / per_count_A))


def _turning_control(motor: Motor) -> list[Row]:
    b = motor.bases
    turn = b.omega_rad_s * b.period_s
    if not motor.config.is_turning:
        return [("per_period_q29", "0", "not needed")]
    return [
        ("per_period_q29", q31(1 / turn / 4, "1/(omega_b T_s)"), f"1/(omega_b T_s) = {1 / turn:.6g}"),
        ("approach_q32", q31(2 * TURNING_APPROACH, "approach"), f"{TURNING_APPROACH:.6g} per period"),
        ("feedback_q32", q31(2 * TURNING_FEEDBACK, "feedback"), f"{TURNING_FEEDBACK:g} per period"),
        ("integral_q32", q31(2 * TURNING_INTEGRAL, "integral"), f"{TURNING_INTEGRAL:g} per period"),
        ("drop_q29", q31(turn * motor.config.machine.r_ohm / b.resistance_ohm / 4, "drop"), "omega_b T_s R at 20 C"),
        (
            "knee_turns_q27",
            str(knee_turns_q27(motor)),
            f"{turning_knee_A_per_rad(motor.config, motor.model):.6g} A per rad",
        ),
    ]


def _modulate(motor: Motor) -> list[Row]:
    d, b = motor.derived, motor.bases
    min_pulse = q15(d.min_pulse_duty, "min_pulse")
    # Twice the q15 number that commissioning moves.
    dead_time = 2 * q15(d.dead_time_duty, "dead_time")
    return [
        ("alpha_q31", q31(d.v_ratio, "v_ratio"), f"{d.v_ratio:.6g}"),
        ("side_q31", q31(math.sqrt(0.75) * d.v_ratio, "v_ratio"), "times sqrt(3)/2"),
        ("knee_q17", q16(2 * b.current_A / d.knee_A, "knee_q17"), f"1/({d.knee_A:g} A)"),
        ("knee_side_q17", q16(math.sqrt(3) * b.current_A / d.knee_A, "knee_side_q17"), "times sqrt(3)/2"),
        ("dead_time_q16", dead_time, f"{d.dead_time_duty:.6g} duty"),
        ("longest_q31", (1 << 30) - 65536 * min_pulse, f"half a duty less {d.min_pulse_duty:.6g}"),
        ("nearer_rail_q31", (1 << 30) - 32768 * min_pulse, "less half of that"),
    ]


def _mrai_gains(motor: Motor) -> list[Row]:
    d, b, control = motor.derived, motor.bases, motor.config.control
    r0 = motor.config.machine.r_ohm / b.resistance_ohm
    pole = 4.0 * r0 * 2.0**motor.tables.g_shift
    return [
        ("r0", q31(r0, "r0"), "R at 20 C"),
        ("pole_gain", q31(control.observer_m * pole, "pole_gain"), f"4 m R_0 2^g_shift, m = {control.observer_m:g}"),
        ("period", q31(min(b.omega_rad_s * b.period_s, PAPER_TURN_MAX), "omega_b T_s"), "omega_b T_s"),
        (
            "flux_gain",
            q31(2 * control.flux_bandwidth_rad_s / b.omega_rad_s, "flux_gain"),
            f"2 k_psi/omega_b, k_psi = {control.flux_bandwidth_rad_s:g} rad/s",
        ),
        (
            "resistance_gain",
            q31(2 * control.resistance_bandwidth_rad_s / b.omega_rad_s, "resistance_gain"),
            f"2 k_r/omega_b, k_r = {control.resistance_bandwidth_rad_s:g} rad/s",
        ),
        (
            "flux_proportional_q24",
            q31(d.flux_proportional / 128, "flux_proportional"),
            f"{d.flux_proportional:.6g} periods",
        ),
        (
            "resistance_proportional_q24",
            q31(d.resistance_proportional / 128, "resistance_proportional"),
            f"{d.resistance_proportional:.6g} periods",
        ),
    ]


def _mrai_limits(motor: Motor) -> list[Row]:
    d, b = motor.derived, motor.bases
    omega_min = q15(d.omega_min_rad_s / b.omega_rad_s, "omega_min"), f"{d.omega_min_rad_s:.6g} rad/s"
    if b.omega_rad_s * b.period_s > PAPER_TURN_MAX:
        omega_min = Q15_ONE - 1, "never adapts: the field turns too far in a period"
    return [
        ("psi_delta_min", q31(d.psi_delta_min_Vs / b.flux_Vs, "psi_delta_min"), f"{d.psi_delta_min_Vs:.6g} Vs"),
        ("psi_delta_max", q31(d.psi_delta_max_Vs / b.flux_Vs, "psi_delta_max"), f"{d.psi_delta_max_Vs:.6g} Vs"),
        ("r_delta_min", q31(d.r_delta_min_ohm / b.resistance_ohm, "r_delta_min"), f"{d.r_delta_min_ohm:.6g} ohm"),
        ("r_delta_max", q31(d.r_delta_max_ohm / b.resistance_ohm, "r_delta_max"), f"{d.r_delta_max_ohm:.6g} ohm"),
        ("omega_min", *omega_min),
        ("omega_r_max", q15(d.omega_r_max_rad_s / b.omega_rad_s, "omega_r_max"), f"{d.omega_r_max_rad_s:.6g} rad/s"),
        ("i_min", q15(d.i_min_A / b.current_A, "i_min"), f"{d.i_min_A:.6g} A"),
        ("sinc_gain", q31(sinc_gain(motor.config, b), "sinc_gain"), "(omega_b T_s)^2/24"),
        ("psi_drift_full", q31(d.psi_drift_full_Vs / b.flux_Vs, "psi_drift_full"), f"{d.psi_drift_full_Vs:.6g} Vs"),
        ("r_drift_full", q31(d.r_drift_full_ohm / b.resistance_ohm, "r_drift_full"), f"{d.r_drift_full_ohm:.6g} ohm"),
        ("quality_rate", q15(d.quality_rate, "quality_rate"), f"{d.quality_rate:.6g}"),
        ("g_shift", str(motor.tables.g_shift), ""),
    ]


def _torque_loop(motor: Motor) -> list[Row]:
    d, control = motor.derived, motor.config.control
    return [
        ("ki", q15(d.torque_ki, "torque ki"), f"{control.torque_loop_bandwidth_rad_s:g} rad/s"),
        ("kp", q15(d.torque_kp, "torque kp"), ""),
        ("model_rate", q15(d.torque_model_rate, "model_rate"), f"{d.torque_model_rate:g}"),
        ("authority", q15(control.torque_authority, "authority"), f"{control.torque_authority:g}"),
        ("torque_min", q15(d.torque_min_Nm / motor.bases.torque_Nm, "torque_min"), f"{d.torque_min_Nm:.6g} N·m"),
    ]


def _current_reference(motor: Motor) -> list[Row]:
    refs, b = motor.references, motor.bases
    return [
        ("grid", _grid(0, refs.y0, refs.shift, refs.id_A.shape), ""),
        ("i_d", "table_ref_i_d", ""),
        ("i_q", "table_ref_i_q", ""),
        ("torque_max", "table_ref_torque_max", ""),
        ("r_q16", f"{u16(motor.config.machine.r_ohm / b.resistance_ohm, Q16_ONE, 'r_pu')}u", "R at 20 C"),
        ("i_max", q15(motor.config.machine.i_max_A / b.current_A, "i_max"), f"{motor.config.machine.i_max_A:g} A"),
    ]


def _voltage_reserve(motor: Motor) -> list[Row]:
    d, b = motor.derived, motor.bases
    return [
        ("v_ratio", q15(d.ref_v_ratio, "ref v_ratio"), f"{d.ref_v_ratio:.6g}"),
        ("gain", q15(d.trim_gain, "trim gain"), f"{d.trim_gain:g} per task"),
        ("trim_min", q15(d.trim_min_V / b.voltage_V, "trim_min"), f"{d.trim_min_V:.6g} V"),
        ("trim_max", q15(d.trim_max_ratio, "trim_max"), f"{d.trim_max_ratio:.6g} of v_dc"),
    ]


def _line(end: float, start: float, per_count: float, name: str) -> list[Row]:
    """derating_line_t: 2^31 over the counts from no torque to all of it."""
    zero, one = round(end / per_count), round(start / per_count)
    if abs(one - zero) < 2:
        raise Unfit(
            f"between {end:.3g} and {start:.3g} (SI units, {name}) the firmware has no two steps of {per_count:.3g}"
        )
    return [
        ("end", q15(zero / Q15_ONE, name), f"{end:.6g}, all from {start:.6g} on"),
        ("gain", q16(Q15_ONE / (one - zero), name), ""),
    ]


def _torque_limit(motor: Motor) -> list[Row]:
    d, b = motor.derived, motor.bases
    volt, speed, tenth = b.voltage_V / Q15_ONE, b.omega_rad_s / Q15_ONE, 0.1
    return [
        ("torque_max", q15(motor.config.machine.torque_max_Nm / b.torque_Nm, "torque_max"), ""),
        ("drop", q15(d.loss_drop_V / b.voltage_V, "drop"), f"{d.loss_drop_V:g} V"),
        ("loss_rate", q15(d.loss_rate, "loss_rate"), f"{d.loss_rate:.6g}"),
        ("moving", _line(d.moving_end_rad_s, d.moving_start_rad_s, speed, "moving"), ""),
        ("inverter", _line(d.inverter_end_C, d.inverter_start_C, tenth, "inverter_trip_C"), ""),
        ("winding", _line(d.winding_end_C, d.winding_start_C, tenth, "winding_trip_C"), ""),
        ("dc_low", _line(d.dc_low_end_V, d.dc_low_start_V, volt, "dc_low"), ""),
        ("dc_high", _line(d.dc_high_end_V, d.dc_high_start_V, volt, "dc_high"), ""),
        ("speed", _line(d.speed_end_rad_s, d.speed_start_rad_s, speed, "speed"), ""),
    ]


def _i_d_limit(motor: Motor) -> list[Row]:
    d, b = motor.derived, motor.bases
    slope = d.i_d_slope_A_per_K / 10.0 / b.current_A * Q15_ONE
    per_psi = 10.0 / (d.psi_f_Vs * d.psi_temp_coeff_per_K) * b.flux_Vs / Q15_ONE
    return [
        ("i_20", str(round(d.i_d_20_A / b.current_A * Q15_ONE)), f"{d.i_d_20_A:g} A"),
        ("slope", q16(slope, "i_d_demag_A_per_K"), f"{d.i_d_slope_A_per_K:g} A/K"),
        ("i_max", q15(motor.config.machine.i_max_A / b.current_A, "i_max"), ""),
        ("dC_per_psi", q16(per_psi, "psi_temp_coeff_per_K"), f"{d.psi_temp_coeff_per_K:g} of psi_f per K"),
        ("assumed_dC", str(round(10 * d.magnet_assumed_C)), "without a winding temperature"),
    ]


def _monitor(motor: Motor) -> list[Row]:
    d, b = motor.derived, motor.bases
    quiet = max(d.i_trip_A - d.sum_max_A / 3, 0.0) / b.current_A * 0.999  # less the roundings on the way
    sum_max = q15(d.sum_max_A / b.current_A, "sum_max")
    return [
        ("i_normal_squared_q30", q31(quiet**2 / 2, "i_normal_squared"), f"({quiet * b.current_A:.6g} A)^2"),
        ("zero_sequence_max", sum_max // 3, "a third of sum_max"),
        ("v_min", q15(d.v_min_V / b.voltage_V, "v_min"), f"{d.v_min_V:g} V"),
        ("v_max", q15(d.v_max_V / b.voltage_V, "v_max"), f"{d.v_max_V:g} V"),
        ("i_trip", q15(d.i_trip_A / b.current_A, "i_trip"), f"{d.i_trip_A:g} A"),
        ("sum_max", sum_max, f"{d.sum_max_A:g} A"),
        ("angle_count_max", f"{round(ANGLE_JUMPS_S / b.period_s)}", f"{1e3 * ANGLE_JUMPS_S:g} ms of periods"),
    ]


def _counts(bases: Bases, **seconds: float) -> list[Row]:
    """Times as counts of steps."""
    return [(f"{name}_steps", f"{steps(s, bases.step_s)}", f"{1e3 * s:g} ms") for name, s in seconds.items()]


def _commission(motor: Motor) -> list[Row]:
    b = motor.bases
    periods = steps(COMMISSION_MEASURE_S, b.step_s) * b.periods_per_step
    return [
        ("i_max", q15(motor.config.machine.i_max_A / b.current_A, "i_max"), f"{motor.config.machine.i_max_A:g} A"),
        ("omega_max", q31(STANDSTILL_SHARE, "standstill"), "of omega_b"),
        *_counts(b, settle=COMMISSION_SETTLE_S, measure=COMMISSION_MEASURE_S),
        ("periods_per_step", f"{b.periods_per_step}", ""),
        ("mean_gain_q31", str(round(2**31 / periods)), f"1/{periods}: a sum to its mean"),
    ]


def _movement(motor: Motor) -> list[Row]:
    b, machine = motor.bases, motor.config.machine
    top = motor.config.omega_max_rad_s / b.omega_rad_s
    largest_A = MOVEMENT_CURRENT_SHARE * machine.i_max_A
    blocked_A = MOVEMENT_BLOCKED_SHARE * machine.i_max_A
    rise_steps, up_steps = steps(MOVEMENT_RISE_S, b.step_s), steps(MOVEMENT_SPEED_UP_S, b.step_s)
    rate = round(MOVEMENT_HZ * b.period_s * 2**32)
    return [
        ("i_max", q15(largest_A / b.current_A, "movement.i_max"), f"{largest_A:g} A"),
        (
            "i_slew",
            q15(largest_A / b.current_A / rise_steps, "movement.i_slew"),
            f"i_max in {1e3 * MOVEMENT_RISE_S:g} ms",
        ),
        ("i_blocked", q15(blocked_A / b.current_A, "movement.i_blocked"), f"{blocked_A:g} A"),
        ("omega_max", q31(MOVEMENT_SPEED_SHARE * top, "movement.omega_max"), "30 % of the largest speed"),
        ("omega_still", q31(MOVEMENT_STILL_SHARE * top, "movement.omega_still"), "1 % of it"),
        ("rate_max", str(rate), f"{MOVEMENT_HZ:g} electrical turns in a second"),
        ("rate_slew", str(round(rate / up_steps)), f"rate_max in {MOVEMENT_SPEED_UP_S:g} s"),
        ("blocked_steps", f"{steps(MOVEMENT_BLOCKED_S, b.step_s)}", f"{MOVEMENT_BLOCKED_S:g} s"),
        ("steps_max", f"{steps(MOVEMENT_S, b.step_s)}", f"{MOVEMENT_S:g} s"),
    ]


def _plausibility(motor: Motor) -> list[Row]:
    d, b, thermal = motor.derived, motor.bases, motor.config.thermal
    return [
        ("e_0", q15(d.deviation_A / b.current_A, "deviation"), f"{d.deviation_A:g} A"),
        ("i_dead", q15(d.phase_dead_A / b.current_A, "i_dead"), f"{d.phase_dead_A:g} A"),
        ("i_alive", q15(d.phase_alive_A / b.current_A, "i_alive"), f"{d.phase_alive_A:g} A"),
        ("ripple_max", q15(d.ripple_A / b.current_A, "ripple_max"), f"{d.ripple_A:.4g} A"),
        ("zero_error_max", q15(ZERO_ERROR_SHARE, "zero_error_max"), "of the converter's full scale"),
        ("answer_rate", q15(min(d.answer_rate, 1 - 1 / Q15_ONE), "answer_rate"), f"{d.answer_rate:.4g} per step"),
        (
            "behind_gain",
            q16(d.behind_A_per_V * b.voltage_V / b.current_A, "behind_gain"),
            f"{d.behind_A_per_V:.4g} A/V",
        ),
        ("omega_trip", q15(d.speed_trip_rad_s / b.omega_rad_s, "omega_trip"), f"{d.speed_trip_rad_s:.6g} rad/s"),
        ("inverter_trip_dC", str(round(10 * thermal.inverter_trip_C)), ""),
        ("winding_trip_dC", str(round(10 * thermal.winding_trip_C)), ""),
        *_counts(
            b,
            deviation=DEVIATION_S,
            ripple=RIPPLE_S,
            lost=LOST_S,
            equal=EQUAL_S,
            fast=FAST_S,
            hot=HOT_S,
            gate_exceeded=GATE_EXCEEDED_S,
        ),
    ]


def _launch_V(motor: Motor) -> float:
    """(MN-29) with (MN-34)."""
    d = motor.derived
    resolution_V = LAUNCH_ANGLE * motor.config.machine.pole_pairs / motor.bases.step_s * d.psi_f_Vs
    return d.launch_V + max(0.0, resolution_V - LAUNCH_SPARE * d.monitor_V)


def _torque_monitor(motor: Motor) -> list[Row]:
    d, b = motor.derived, motor.bases
    rate = 1.0 / (b.omega_rad_s * b.step_s)
    lag_s = 2.0 / d.tracker_bandwidth_rad_s - b.period_s / 2.0  # (AT-7)
    count_rad = 2.0 * math.pi * motor.config.machine.pole_pairs / 4096
    lag_noise = lag_s * d.tracker_bandwidth_rad_s**2 * count_rad  # (MN-41)
    launch_V = _launch_V(motor)
    r = motor.config.machine.r_ohm / b.resistance_ohm
    return [
        ("r", q31(r, "r"), "R at 20 C"),
        ("r_per_dC", q31(r * motor.config.machine.r_temp_coeff_per_K / 10.0, "r_per_dC"), "per 0.1 K"),
        ("winding_min_dC", str(round(10 * WINDING_MIN_C)), ""),
        ("winding_max_dC", str(round(10 * motor.config.thermal.winding_trip_C)), ""),
        ("psi_f", q15(d.psi_f_Vs / b.flux_Vs, "psi_f"), f"{d.psi_f_Vs:.6g} Vs"),
        ("t_0", q15(d.monitor_torque_Nm / b.torque_Nm, "t_0"), f"{d.monitor_torque_Nm:g} N·m"),
        ("v_0", q15(d.monitor_V / b.voltage_V, "v_0"), f"{d.monitor_V:g} V"),
        ("v_noise", q15(d.period_noise_V / b.voltage_V, "v_noise"), f"{d.period_noise_V:.4g} V"),
        ("i_0", q15(d.monitor_A / b.current_A, "i_0"), f"{d.monitor_A:g} A"),
        ("rate_gain", q16(rate, "rate_gain"), "1/(omega_b T)"),
        ("lag_gain", q16(lag_s / b.step_s, "lag_gain"), f"{lag_s / b.step_s:.4g} steps"),
        ("lag_noise", q15(lag_noise / b.omega_rad_s, "lag_noise"), f"{lag_noise:.4g} rad/s"),
        ("v_lag", q15(launch_V / b.voltage_V, "v_lag"), f"{launch_V:.4g} V"),
        ("mean_rate", q15(d.monitor_mean_rate, "mean_rate"), f"{d.monitor_mean_rate:.6g}"),
        *_counts(b, torque=TORQUE_S, angle=ANGLE_S, settle=SETTLE_S),
    ]


def _frozen_angle(motor: Motor) -> list[Row]:
    d, b = motor.derived, motor.bases
    v_0 = q15(d.frozen_V / b.voltage_V, "frozen_V") * b.periods_per_step
    rate = b.periods_per_step / (b.omega_rad_s * b.step_s)
    return [
        ("v_0", str(v_0), f"{d.frozen_V:g} V in each of {b.periods_per_step} periods"),
        ("rate_gain", q16(rate, "rate_gain"), f"{b.periods_per_step}/(omega_b T)"),
        ("answer_rate", q15(min(d.answer_rate, 1 - 1 / Q15_ONE), "answer_rate"), f"{d.answer_rate:.4g} per step"),
        ("i_0", q15(d.monitor_A / b.current_A, "i_0"), f"{d.monitor_A:g} A"),
        *_counts(b, settle=frozen_settle_s(motor.config), fault=ANGLE_S),
    ]


def _launch_power(motor: Motor) -> list[Row]:
    d, b = motor.derived, motor.bases
    launch_V = _launch_V(motor)
    v_1 = q15(launch_V / b.voltage_V, "launch_V") * b.periods_per_step
    turn_gain = round(2 * math.pi * b.periods_per_step * Q15_ONE / (b.omega_rad_s * b.step_s))
    return [
        ("turn_gain", f"{turn_gain}", "2 pi times the periods of a step/(omega_b T), Q15"),
        ("v_1", str(v_1), f"{launch_V:.4g} V in each of {b.periods_per_step} periods"),
        ("psi_share", q15(LAUNCH_FLUX_SHARE * d.psi_f_Vs / b.flux_Vs, "psi_share"), f"{LAUNCH_FLUX_SHARE:g} psi_f"),
        ("i_0", q15(d.launch_A / b.current_A, "i_0"), f"{d.launch_A:g} A"),
        ("i_min", q15(d.monitor_A / b.current_A, "i_min"), f"{d.monitor_A:g} A"),
        ("periods", str(b.periods_per_step), "of a step"),
        *_counts(b, settle=frozen_settle_s(motor.config), fault=ANGLE_S),
    ]


def _safe_state(motor: Motor) -> list[Row]:
    d, b = motor.derived, motor.bases
    return [
        ("psi_f", q15(d.psi_f_Vs / b.flux_Vs, "psi_f"), f"{d.psi_f_Vs:.6g} Vs"),
        ("share_short", q16(d.share_short, "share_short"), f"{d.share_short:g}"),
        ("share_open", q16(d.share_open, "share_open"), f"{d.share_open:g}"),
        ("v_release", q15(d.v_release_V / b.voltage_V, "v_release"), f"{d.v_release_V:g} V"),
    ]


def _gate_fault(motor: Motor) -> list[Row]:
    d, b = motor.derived, motor.bases
    steps_of_flux = GATE_FAULT_FLUX * math.sqrt(3.0) / (b.omega_rad_s * b.step_s)
    return [
        ("i_alive", q15(d.phase_alive_A / b.current_A, "i_alive"), f"{d.phase_alive_A:g} A"),
        ("volt_steps", str(round(steps_of_flux * Q15_ONE)), f"{steps_of_flux:.4g} V_b T"),
    ]


def _torque_slew(motor: Motor) -> tuple[str, str]:
    slew = motor.derived.torque_slew_Nm / motor.bases.torque_Nm
    if slew <= 0 or slew >= 1:
        return "Q15_MAX", "open"
    return str(max(q15(slew, "torque_slew"), 1)), f"{motor.config.torque_slew_Nm_per_s:g} N·m/s"


def _parameters(motor: Motor) -> list[Row]:
    """motor_parameters_t: what a drive starts with and changes."""
    return [
        ("torque_slew", *_torque_slew(motor)),
        ("current_control", _current_control(motor), ""),
        ("modulate", _modulate(motor), ""),
        ("torque_loop", _torque_loop(motor), ""),
    ]


def _identify(motor: Motor) -> list[Row]:
    gain = sinc_gain(motor.config, motor.bases)
    return identification.rows(motor.config, motor.bases, motor.derived.identify, motor.tables.l_shift, gain)


def _motor(motor: Motor) -> list[Row]:
    machine, inverter, b = motor.config.machine, motor.config.inverter, motor.bases
    return [
        ("name", f'"{machine.name}"', ""),
        ("bases", _bases(b), ""),
        ("bus_scales", [(name, _float(float(factor)), "") for name, factor in motor.bus.factors.items()], ""),
        ("interface_hash", f"{motor.bus.interface_hash}u", ""),
        ("adc_bits", f"{inverter.adc_bits}u", ""),
        ("trim_steps", f"{steps(TRIM_S, b.step_s)}u", f"{TRIM_S:g} s"),
        ("current_full_scale_A", _float(inverter.current_full_scale_A), ""),
        ("v_dc_full_scale_V", _float(motor.config.v_dc_full_scale_V), ""),
        ("torque_max_Nm", _float(machine.torque_max_Nm), ""),
        ("psi_f_Vs", _float(motor.derived.psi_f_Vs), ""),
        ("r_ohm_20", _float(machine.r_ohm), ""),
        ("dead_time_s", _float(inverter.dead_time_s), ""),
        ("bridge_duty", _float(motor.derived.bridge_duty), ""),
        ("torque_max", q15(machine.torque_max_Nm / b.torque_Nm, "torque_max"), f"{machine.torque_max_Nm:g} N·m"),
        ("torque_slew_weak", q15(motor.derived.torque_slew_weak_Nm / b.torque_Nm, "torque_slew_weak"), ""),
        ("psi_weak", q15(min(motor.derived.psi_weak_Vs / b.flux_Vs, 1.0 - 1.0 / Q15_ONE), "psi_weak"), ""),
        ("measure", _measure(motor), ""),
        ("angle_tracker", _tracker(motor), ""),
        ("angle_harmonics", _harmonics(motor), ""),
        ("flux_table", _flux_table(motor), ""),
        ("identify", _identify(motor), ""),
        ("current_reference", _current_reference(motor), ""),
        ("voltage_reserve", _voltage_reserve(motor), ""),
        ("torque_limit", _torque_limit(motor), ""),
        ("i_d_limit", _i_d_limit(motor), ""),
        ("monitor", _monitor(motor), ""),
        ("safe_state", _safe_state(motor), ""),
        ("gate_fault", _gate_fault(motor), ""),
        ("plausibility", _plausibility(motor), ""),
        ("torque_monitor", _torque_monitor(motor), ""),
        ("frozen_angle", _frozen_angle(motor), ""),
        ("launch_power", _launch_power(motor), ""),
        ("commission", _commission(motor), ""),
        ("movement", _movement(motor), ""),
        ("turning_control", _turning_control(motor), ""),
        ("parameters", _parameters(motor), ""),
        ("second_level", "&second_level", ""),
    ]


def _second_level(motor: Motor) -> str:
    """The second level's constants, which the motor data only point at."""
    own = make_second_level(motor)
    lines = [f"{INDENT}.{name} = {value}," for name, value in own.words.items()]
    table = "\n".join(line for row in own.torque for line in _wrap([str(int(v)) for v in row]))
    return "\n".join(
        [
            "/* Of the second level alone. */",
            "static const second_level_constants_t second_level = {",
            f"{INDENT}.checksum = {own.checksum}u,",
            *lines,
            f"{INDENT}.torque = {{",
            table,
            f"{INDENT}}},",
            "};",
            "",
        ]
    )


def _mrai(motor: Motor) -> str:
    """What the paper's law starts with, which the motor data only point at; not in a build without it."""
    rows = "\n".join(_struct(_mrai_gains(motor) + _mrai_limits(motor), INDENT))
    return _optional(f"/* Of the paper's law alone. */\nstatic const mrai_config_t mrai = {{\n{rows}\n}};") + "\n"


def _optional(text: str) -> str:
    return f"#if FLUXTRUE_MRAI\n{text}\n#endif"


def _q15_tables(motor: Motor) -> list[str]:
    b, tables, refs = motor.bases, motor.tables, motor.references
    l_unit = f"{b.inductance_H * 2**tables.l_shift / Q15_ONE:.6g} H per count"
    psi_unit = f"{b.flux_Vs / Q15_ONE:.6g} Vs per count"
    i_unit = f"{b.current_A / Q15_ONE:.6g} A per count"
    grid = (
        f"rows i_d = {tables.id_A[0]:g} ... {tables.id_A[-1]:g} A, columns |i_q| = 0 ... {tables.iq_A[-1]:g} A, "
        f"every {tables.iq_A[1]:g} A"
    )
    comments = {
        "l_d": f"apparent L_d, {l_unit}",
        "l_q": f"apparent L_q, {l_unit}",
        "l_qq": f"incremental L_q, {l_unit}",
        "g": f"omega_b T_s/2 (1/l_dd + 1/l_qq), 2^{tables.g_shift - 15} per count",
        "psi_f0": f"psi_d at i_d = 0, {psi_unit}",
    }
    out = [f"/* Flux tables: {grid}. */\n"]
    # psi_f0 depends on i_q alone: one row of it is enough.
    rows = {name: values[:1] if name == "psi_f0" else values for name, values in tables.stored.items()}
    out += [_table("int16_t", f"table_{name}", rows[name], text) for name, text in comments.items()]
    out.append(
        f"/* Current references: rows |T| = 0 ... {refs.torque_Nm[-1]:.6g} N·m "
        f"every {refs.torque_Nm[1]:.6g} N·m, columns\n"
        f" * available flux {refs.psi_Vs[0]:.6g} ... {refs.psi_Vs[-1]:.6g} Vs every "
        f"{refs.psi_Vs[1] - refs.psi_Vs[0]:.6g} Vs. */\n"
    )
    out.append(_table("int16_t", "table_ref_i_d", refs.stored["i_d"], i_unit))
    out.append(_table("int16_t", "table_ref_i_q", refs.stored["i_q"], i_unit))
    out.append(
        _table(
            "int16_t", "table_ref_torque_max", refs.stored["torque_max"], f"{b.torque_Nm / Q15_ONE:.6g} N·m per count"
        )
    )
    return out


def check_numbers(motor: Motor) -> None:
    """Refuse numbers that do not fit the firmware's formats, without generating the files."""
    _motor(motor)
    _mrai(motor)


def motor_tables_c(motor: Motor) -> str:
    """motor_tables.c."""
    body = "\n".join([*_struct(_motor(motor), INDENT), _optional(f"{INDENT}.mrai = &mrai,")])
    return "\n".join(
        [
            _head(motor, "drive/motor.h"),
            *_q15_tables(motor),
            _second_level(motor),
            _mrai(motor),
            f"const motor_t motor = {{\n{body}\n}};\n",
        ]
    )


_SI_DERIVED = (
    "tracker_bandwidth_rad_s",
    "tracker_jump_turns",
    "sigma_rad_s",
    "setpoint_weight",
    "integral_ratio",
    "v_ratio",
    "dead_time_duty",
    "knee_A",
    "min_pulse_duty",
    "flux_proportional",
    "resistance_proportional",
    "psi_delta_min_Vs",
    "psi_delta_max_Vs",
    "r_delta_min_ohm",
    "r_delta_max_ohm",
    "omega_min_rad_s",
    "omega_r_max_rad_s",
    "i_min_A",
    "quality_rate",
    "torque_ki",
    "torque_kp",
    "torque_model_rate",
    "torque_min_Nm",
    "torque_slew_Nm",
    "ref_v_ratio",
    "trim_gain",
    "trim_min_V",
    "trim_max_ratio",
    "i_trip_A",
    "v_max_V",
    "v_min_V",
    "sum_max_A",
    "psi_f_Vs",
    "torque_slew_weak_Nm",
    "psi_weak_Vs",
    "loss_rate",
    "loss_drop_V",
    "moving_end_rad_s",
    "moving_start_rad_s",
    "inverter_end_C",
    "inverter_start_C",
    "winding_end_C",
    "winding_start_C",
    "dc_low_end_V",
    "dc_low_start_V",
    "dc_high_end_V",
    "dc_high_start_V",
    "speed_end_rad_s",
    "speed_start_rad_s",
    "i_d_20_A",
    "i_d_slope_A_per_K",
    "psi_temp_coeff_per_K",
    "magnet_assumed_C",
)


def _si_rows(motor: Motor) -> list[Row]:
    machine, inverter, control, b = (motor.config.machine, motor.config.inverter, motor.config.control, motor.bases)
    tables, refs = motor.tables, motor.references
    numbers: dict[str, float] = {
        "r_ohm_20": machine.r_ohm,
        "period_s": b.period_s,
        "step_s": b.step_s,
        "i_base_A": b.current_A,
        "v_base_V": b.voltage_V,
        "omega_base_rad_s": b.omega_rad_s,
        "current_full_scale_A": inverter.current_full_scale_A,
        "v_dc_full_scale_V": motor.config.v_dc_full_scale_V,
        "v_dc_offset_V": inverter.v_dc_offset_V,
        "id0_A": tables.id_A[0],
        "did_A": tables.id_A[1] - tables.id_A[0],
        "diq_A": tables.iq_A[1],
        "observer_m": control.observer_m,
        "flux_bandwidth_rad_s": control.flux_bandwidth_rad_s,
        "resistance_bandwidth_rad_s": control.resistance_bandwidth_rad_s,
        "torque_authority": control.torque_authority,
        "torque_max_Nm": machine.torque_max_Nm,
        "torque_step_Nm": refs.torque_Nm[1],
        "psi0_Vs": refs.psi_Vs[0],
        "psi_step_Vs": refs.psi_Vs[1] - refs.psi_Vs[0],
        "i_max_A": machine.i_max_A,
    }
    numbers |= {name: getattr(motor.derived, name) for name in _SI_DERIVED}
    if motor.config.is_turning:
        numbers |= {
            "turning_approach": TURNING_APPROACH,
            "turning_feedback": TURNING_FEEDBACK,
            "turning_integral": TURNING_INTEGRAL,
            "turning_knee_A_per_rad": turning_knee_A_per_rad(motor.config, motor.model),
        }
    counts = {
        "pole_pairs": machine.pole_pairs,
        "periods_per_step": b.periods_per_step,
        "adc_bits": inverter.adc_bits,
        "nd": len(tables.id_A),
        "nq": len(tables.iq_A),
        "ref_nt": len(refs.torque_Nm),
        "ref_npsi": len(refs.psi_Vs),
    }
    pointers = ("l_d_H", "l_q_H", "l_dd_H", "l_qq_H", "psi_f0_Vs", "ref_id_A", "ref_iq_A", "ref_torque_max_Nm")
    return [
        *((k, v, "") for k, v in counts.items()),
        *((k, _double(v), "") for k, v in numbers.items()),
        *identification.si_rows(motor.config, motor.derived.identify),
        *((name, f"table_{name}", "") for name in pointers),
    ]


def motor_si_c(motor: Motor) -> str:
    """motor_si.c."""
    tables, refs = motor.tables, motor.references
    arrays = {
        "l_d_H": tables.l_d_H,
        "l_q_H": tables.l_q_H,
        "l_dd_H": tables.l_dd_H,
        "l_qq_H": tables.l_qq_H,
        "psi_f0_Vs": tables.psi_f0_Vs,
        "ref_id_A": refs.id_A,
        "ref_iq_A": refs.iq_A,
        "ref_torque_max_Nm": refs.torque_max_Nm,
    }
    blocks = [
        _table("double", f"table_{name}", values, name.rsplit("_", 1)[1] + ", unquantised")
        for name, values in arrays.items()
    ]
    body = "\n".join(_struct(_si_rows(motor), INDENT))
    return "\n".join([_head(motor, "twin/motor_si.h"), *blocks, f"const motor_si_t motor_si = {{\n{body}\n}};\n"])
