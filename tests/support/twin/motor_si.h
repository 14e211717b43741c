/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TWIN_MOTOR_SI_H
#define TWIN_MOTOR_SI_H
/** The machine data of drive/motor.h in SI doubles, before any quantisation, for the double-precision twin.
 *   Written beside the fixed-point tables by `tools/fluxtrue motor build`; shares no number format with the firmware.
 * Units    SI, electrical rad/s, per-second gains */

typedef struct {
    int pole_pairs, periods_per_step;
    double r_ohm_20, psi_f_Vs, period_s, step_s; /* PWM period; step of the 1 kHz task */
    double i_base_A, v_base_V, omega_base_rad_s; /* only to state per-unit results */
    double current_full_scale_A, v_dc_full_scale_V, v_dc_offset_V;
    int adc_bits;
    /* angle tracker */
    double tracker_bandwidth_rad_s;
    double tracker_jump_turns; /* electrical: a sample that deviates by more is ignored */
    /* flux tables: node (ix, iy) is i_d = id0_A + ix did_A, |i_q| = iy diq_A; row-major [ix * nq + iy] */
    int nd, nq;
    double id0_A, did_A, diq_A;
    const double *l_d_H, *l_q_H, *l_dd_H, *l_qq_H, *psi_f0_Vs;
    /* current control */
    double sigma_rad_s, setpoint_weight, integral_ratio, v_ratio;
    double turning_approach, turning_feedback, turning_integral; /* per period; 0: the field does not turn far */
    double turning_knee_A_per_rad;
    /* modulation */
    double dead_time_duty, knee_A, min_pulse_duty;
    /* identification */
    double observer_m, flux_bandwidth_rad_s, resistance_bandwidth_rad_s;
    double flux_proportional, resistance_proportional; /* k_P/k_I in periods */
    double psi_delta_min_Vs, psi_delta_max_Vs, r_delta_min_ohm, r_delta_max_ohm;
    double omega_min_rad_s, omega_r_max_rad_s, i_min_A;
    double quality_rate;
    /* robust identification: R, drop, flux, l_q, l_d, angle, iron; leak per update, rates per step */
    double r_temp_coeff_per_K, iron_hysteresis, iron_eddy, iron_sign_rad_s;
    double identify_sigma[7], identify_leak[7], identify_r_known;
    double identify_noise_V, identify_noise_Vs, identify_noise_rate;
    double identify_omega_min_rad_s, identify_i_min_A, identify_i_smooth_A;
    double identify_local_corner_rad_s, identify_local_rate, identify_torque_min_Nm;
    double identify_limited_noise, identify_mismatch_rate;
    double identify_confidence_full, identify_confidence_none, identify_confidence_rate;
    /* torque loop, per 1 kHz step */
    double torque_ki, torque_kp, torque_model_rate, torque_authority, torque_min_Nm;
    double torque_max_Nm, torque_slew_Nm; /* slew per 1 kHz step, <= 0: not limited */
    /* current references: torque node ix torque_step_Nm, flux node psi0_Vs + iy psi_step_Vs, row-major [ix * ref_npsi
     * + iy] */
    int ref_nt, ref_npsi;
    double torque_step_Nm, psi0_Vs, psi_step_Vs;
    const double *ref_id_A, *ref_iq_A;
    const double *ref_torque_max_Nm; /* [ref_npsi] */
    double ref_v_ratio, i_max_A;
    /* voltage reserve, gain per 1 kHz step */
    double trim_gain, trim_min_V, trim_max_ratio;
    /* torque limits, rates per 1 kHz step; derating lines: no torque at _end, full torque at _start */
    double torque_slew_weak_Nm, psi_weak_Vs, loss_rate, loss_drop_V;
    double moving_end_rad_s, moving_start_rad_s, speed_end_rad_s, speed_start_rad_s;
    double inverter_end_C, inverter_start_C, winding_end_C, winding_start_C;
    double dc_low_end_V, dc_low_start_V, dc_high_end_V, dc_high_start_V;
    double i_d_20_A, i_d_slope_A_per_K, psi_temp_coeff_per_K, magnet_assumed_C;
    /* monitors */
    double i_trip_A, v_max_V, v_min_V, sum_max_A;
} motor_si_t;

extern const motor_si_t motor_si;

#endif
