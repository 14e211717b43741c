/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <stdio.h>

#include "drive/motor.h"
#include "twin/twin_stages.h"
#include "unity.h"
#include "worst.h"

/* The generated constants of a shipped machine: the fixed-point ones against those in SI, by the units that the headers
 * state, and both against the requirements of the stages. */

static double v_b, i_b, w_b, psi_b, z_b, t_b;

void setUp(void)
{
    v_b = (double)motor.bases.voltage_V;
    i_b = (double)motor.bases.current_A;
    w_b = (double)motor.bases.omega_rad_s;
    psi_b = v_b / w_b;
    z_b = v_b / i_b;
    t_b = 1.5 * motor_si.pole_pairs * psi_b * i_b;
}

void tearDown(void)
{
}

static double q15(int32_t x)
{
    return x / 32768.0;
}

static double q31(int32_t x)
{
    return x / 2147483648.0;
}

/* The bases are floats, with a relative rounding of 6e-8. */
#define NEAR(expected, is) TEST_ASSERT_DOUBLE_WITHIN(fabs(expected) * 2e-7, (expected), (double)(is))

void test_the_derived_bases_follow_from_voltage_current_and_frequency(void)
{
    NEAR(psi_b, motor.bases.flux_Vs);
    NEAR(z_b, motor.bases.resistance_ohm);
    NEAR(z_b / w_b, motor.bases.inductance_H);
    NEAR(t_b, motor.bases.torque_Nm);
    NEAR(motor_si.period_s, motor.bases.period_s);
    NEAR(motor_si.v_base_V, v_b);
    NEAR(motor_si.i_base_A, i_b);
    NEAR(motor_si.omega_base_rad_s, w_b);
    NEAR(i_b, motor.current_full_scale_A);
}

/* A constant may differ by the rounding of its format. */
#define HELD(expected, is, lsb) TEST_ASSERT_DOUBLE_WITHIN(0.51 * (lsb) + 1e-6 * fabs(expected), (expected), (is))

void test_measurement_and_angle_are_the_si_values(void)
{
    const double turns_at_base = w_b * motor_si.period_s / (2.0 * 3.14159265358979323846);
    const double wn = motor_si.tracker_bandwidth_rad_s * motor_si.period_s;
    const double lsb = 65536.0 / (1 << motor_si.adc_bits); /* of the converter, in 16-bit counts */
    HELD(motor_si.v_dc_full_scale_V / v_b, motor.measure.v_dc.scale / lsb / 16384.0, 1.0 / lsb / 16384.0);
    HELD(-motor_si.v_dc_offset_V / v_b, (motor.measure.v_dc.bias - 16384) / 1073741824.0, 1.0 / 1073741824.0);
    for (int phase = 0; phase < 3; phase++) {
        const int sign = (phase == 0) ? 1 : -1; /* b and c are negated; the bias of a is half an LSB of alpha */
        HELD(sign * lsb * 8192.0 / 3.0, motor.measure.phase[phase].scale, 1.0);
        const int32_t at_middle = (int)(32768.0 / lsb) * motor.measure.phase[phase].scale;
        TEST_ASSERT_EQUAL_INT((phase == 0) ? 2048 : 0, at_middle + motor.measure.phase[phase].bias);
    }
    TEST_ASSERT_EQUAL_INT(motor_si.pole_pairs, motor.angle_tracker.pole_pairs);
    HELD(2.0 * wn, q31(motor.angle_tracker.kp), q31(1));
    HELD(wn * wn / turns_at_base, 4.0 * q31(motor.angle_tracker.ki_q29), 4.0 * q31(1));
    HELD(8.0 * turns_at_base, q31(motor.angle_tracker.pu_to_turn), q31(1));
    HELD(0.5 / turns_at_base, motor.angle_tracker.turn_to_pu / 65536.0, 1.0 / 65536.0);
    TEST_ASSERT_EQUAL_UINT32((uint32_t)motor_si.pole_pairs << 21, motor.angle_tracker.repeat_max);
    HELD(0.1875 / wn, motor.angle_tracker.lag_steps, 1.0);
    HELD(0.005 / motor_si.period_s, motor.angle_tracker.stop_periods, 1.0);
    HELD(0.02, motor.angle_tracker.stop_speed_q30 / 1073741824.0, 1e-6); /* in 5 ms, of 250 ms from the base */
}

void test_current_control_and_modulation_are_the_si_values(void)
{
    const double sigma = motor_si.sigma_rad_s / w_b;
    HELD(1.0 / (3.0 * motor_si.period_s), motor_si.sigma_rad_s, 1e-9);
    HELD(sigma, motor.parameters.current_control.sigma_q24 / 16777216.0, 1.0 / 16777216.0);
    HELD(motor_si.r_ohm_20 / z_b / sigma, motor.parameters.current_control.drop_gain / 65536.0, 1.0 / 65536.0);
    HELD(motor_si.setpoint_weight, q15(motor.parameters.current_control.setpoint_weight), q15(1));
    HELD(sigma * motor_si.integral_ratio, q15(motor.parameters.current_control.integral_gain), q15(1));
    HELD(motor_si.integral_ratio / motor_si.setpoint_weight * motor_si.v_ratio,
         q31(motor.parameters.current_control.tracking_gain_q34) / 8.0, q31(1) / 8.0);
    HELD(1.0 / motor_si.v_ratio, motor.parameters.current_control.per_ratio_q31 / 2147483648.0, q31(1));
    HELD(motor_si.v_ratio, q31(motor.parameters.modulate.alpha_q31), q31(1));
    HELD(motor_si.v_ratio * sqrt(0.75), q31(motor.parameters.modulate.side_q31), q31(1));
    HELD(motor_si.dead_time_duty, motor.parameters.modulate.dead_time_q16 / 65536.0, q15(1));
    HELD(i_b / motor_si.knee_A, motor.parameters.modulate.knee_q17 / 131072.0, 1.0 / 131072.0);
    HELD(0.5 * sqrt(3.0) * i_b / motor_si.knee_A, motor.parameters.modulate.knee_side_q17 / 131072.0, 1.0 / 131072.0);
    HELD(0.5 - motor_si.min_pulse_duty, q31(motor.parameters.modulate.longest_q31), q15(1));
    HELD(0.5 - 0.5 * motor_si.min_pulse_duty, q31(motor.parameters.modulate.nearer_rail_q31), q15(1));
    TEST_ASSERT_TRUE(motor_si.v_ratio <= 1.05 / sqrt(3.0)); /* the largest fundamental within the hexagon */
    /* (MO-11), and 31/32 of the voltage circle: below this voltage neither current control nor modulation limits. */
    const double clear = sqrt(motor.parameters.current_control.clear_q30 / 1073741824.0) * motor_si.v_ratio;
    const double pulse = motor_si.min_pulse_duty + motor_si.dead_time_duty;
    TEST_ASSERT_TRUE(clear < 31.0 / 32.0 * motor_si.v_ratio && sqrt(3.0) * clear + 2.0 * pulse < 1.0);
    TEST_ASSERT_TRUE(clear > 0.9 / sqrt(3.0)); /* most of the voltage range */
}

void test_the_identification_is_the_si_values(void)
{
    const mrai_config_t *c = motor.mrai;
    const double r0 = motor_si.r_ohm_20 / z_b;
    HELD(r0, q31(c->r0), q31(1));
    HELD(4.0 * motor_si.observer_m * r0, q31(c->pole_gain), q31(1));
    HELD(2.0 * motor_si.flux_bandwidth_rad_s / w_b, q31(c->flux_gain), q31(1));
    HELD(2.0 * motor_si.resistance_bandwidth_rad_s / w_b, q31(c->resistance_gain), q31(1));
    HELD(motor_si.flux_proportional, c->flux_proportional_q24 / 16777216.0, 1.0 / 16777216.0);
    HELD(motor_si.resistance_proportional, c->resistance_proportional_q24 / 16777216.0, 1.0 / 16777216.0);
    HELD(motor_si.psi_delta_min_Vs / psi_b, q31(c->psi_delta_min), q31(1));
    HELD(motor_si.psi_delta_max_Vs / psi_b, q31(c->psi_delta_max), q31(1));
    HELD(motor_si.r_delta_min_ohm / z_b, q31(c->r_delta_min), q31(1));
    HELD(motor_si.r_delta_max_ohm / z_b, q31(c->r_delta_max), q31(1));
    HELD(motor_si.omega_min_rad_s / w_b, q15(c->omega_min), q15(1));
    HELD(motor_si.omega_r_max_rad_s / w_b, q15(c->omega_r_max), q15(1));
    HELD(motor_si.i_min_A / i_b, q15(c->i_min), q15(1));
    HELD(w_b * motor_si.period_s, q31(c->period), q31(1));
    HELD(w_b * motor_si.period_s * w_b * motor_si.period_s / 24.0, q31(c->sinc_gain), q31(1));
    HELD(0.05 * motor_si.psi_f_Vs / psi_b * motor_si.flux_bandwidth_rad_s * 1e-3, q31(c->psi_drift_full), q31(1));
    HELD(0.2 * r0 * motor_si.resistance_bandwidth_rad_s * 1e-3, q31(c->r_drift_full), q31(1));
    HELD(motor_si.quality_rate, q15(c->quality_rate), q15(1));
}

void test_torque_loop_references_and_monitors_are_the_si_values(void)
{
    HELD(motor_si.torque_ki, q15(motor.parameters.torque_loop.ki), q15(1));
    HELD(motor_si.torque_kp, q15(motor.parameters.torque_loop.kp), q15(1));
    HELD(motor_si.torque_model_rate, q15(motor.parameters.torque_loop.model_rate), q15(1));
    HELD(motor_si.torque_authority, q15(motor.parameters.torque_loop.authority), q15(1));
    HELD(motor_si.torque_min_Nm / t_b, q15(motor.parameters.torque_loop.torque_min), q15(1));
    HELD(motor_si.torque_max_Nm / t_b, q15(motor.torque_max), q15(1));
    HELD(motor_si.i_max_A / i_b, q15(motor.current_reference.i_max), q15(1));
    HELD(motor_si.ref_v_ratio, q15(motor.voltage_reserve.v_ratio), q15(1));
    HELD(motor_si.trim_gain, q15(motor.voltage_reserve.gain), q15(1));
    HELD(motor_si.trim_min_V / v_b, q15(motor.voltage_reserve.trim_min), q15(1));
    HELD(motor_si.trim_max_ratio, q15(motor.voltage_reserve.trim_max), q15(1));
    HELD(motor_si.i_trip_A / i_b, q15(motor.monitor.i_trip), q15(1));
    HELD(motor_si.v_max_V / v_b, q15(motor.monitor.v_max), q15(1));
    HELD(motor_si.v_min_V / v_b, q15(motor.monitor.v_min), q15(1));
    HELD(motor_si.sum_max_A / i_b, q15(motor.monitor.sum_max), q15(1));
    TEST_ASSERT_EQUAL_INT(motor.monitor.sum_max / 3, motor.monitor.zero_sequence_max);
    TEST_ASSERT_TRUE(motor_si.i_trip_A < 0.8 * motor_si.current_full_scale_A);
    TEST_ASSERT_TRUE(motor_si.i_max_A < motor_si.i_trip_A);
}

/* Rounding of the nodes (1/2 LSB), of the look-up (1/2) and of its bilinear term (below 0.2) make 1.2 LSB for each
 * table. For psi: 1.2 of psi_f0, 1.2 * 2^l_shift |i| of l i, and 1/2. */
void test_the_flux_tables_agree_with_the_unquantised_ones(void)
{
    const double l = 32768.0 * w_b / z_b / (1 << motor.flux_table.l_shift);
    double value = 0.0;
    double flux = 0.0;
    for (int d = motor.flux_table.mesh.x0; d <= 0; d += 101) {
        for (int q = -20480; q <= 20480; q += 103) {
            const flux_point_t y = flux_table_step(&motor.flux_table, (dq_q15_t){(q15_t)d, (q15_t)q});
            const flux_inductances_t x = flux_table_inductances(&motor.flux_table, (dq_q15_t){(q15_t)d, (q15_t)q});
            const twin_flux_t t = twin_flux_table(&motor_si, (twin_dq_t){q15(d) * i_b, q15(q) * i_b});
            const double tolerance = 1.7 + 1.2 * (1 << motor.flux_table.l_shift) * fmax(fabs(q15(d)), fabs(q15(q)));
            value = worse_of(value, fabs(x.l_d - t.l_d * l));
            value = worse_of(value, fabs(x.l_qq - t.l_qq * l));
            value = worse_of(value, fabs(y.g - 0.5 * (t.g_d + t.g_q) * z_b * 32768.0));
            value = worse_of(value, fabs(y.psi_f0 - t.psi_f0 / psi_b * 32768.0));
            flux = worse_of(flux, fabs(y.psi_d - t.psi_d / psi_b * 32768.0) / tolerance);
            flux = worse_of(flux, fabs(y.psi_q - t.psi_q / psi_b * 32768.0) / tolerance);
        }
    }
    TEST_ASSERT_DOUBLE_WITHIN(1.3, 0.0, value);
    TEST_ASSERT_DOUBLE_WITHIN(1.0, 0.0, flux);
}

static current_reference_t reference(double torque_Nm, double psi_Vs)
{
    /* The speed at which the planned voltage allows exactly this flux without a torque. */
    const double v = motor_si.v_dc_full_scale_V * 0.7;
    const double w = motor_si.ref_v_ratio * v / psi_Vs;
    const current_reference_in_t in = {.torque_corrected = (q15_t)lround(torque_Nm / t_b * 32768.0),
                                       .v_plan = (int32_t)lround(motor_si.ref_v_ratio * v / v_b * 32768.0),
                                       .omega = (q15_t)lround(fmin(w / w_b, 0.9999) * 32768.0),
                                       .i_d_max = INT16_MAX};
    return current_reference_step(&motor.current_reference, &in);
}

static double torque_of(twin_dq_t i)
{
    const twin_flux_t flux = twin_flux_table(&motor_si, i);
    return twin_torque(&motor_si, i, &flux, 0.0);
}

static twin_dq_t amperes(dq_q15_t i)
{
    return (twin_dq_t){q15(i.d) * i_b, q15(i.q) * i_b};
}

/* Where the voltage is no limit, the reference makes the requested torque (to 0.3 % of the largest, the interpolation
 * of the table) within the current circle, and no other point with this torque needs 0.5 % less current: maximum torque
 * per ampere. */
void test_the_references_make_the_requested_torque_with_the_least_current(void)
{
    for (int n = -20; n <= 20; n++) {
        const double torque = 0.05 * n * motor_si.torque_max_Nm * 0.98;
        const twin_dq_t i = amperes(reference(torque, 2.0 * psi_b).i_ref);
        char where[60];
        (void)snprintf(where, sizeof where, "%.1f N m", torque);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(3e-3 * motor_si.torque_max_Nm, torque, torque_of(i), where);
        TEST_ASSERT_TRUE_MESSAGE(hypot(i.d, i.q) <= motor_si.i_max_A * 1.0005, where);
        for (int step = -10; step <= 10; step++) {
            const double d = fmin(i.d + 0.02 * step * motor_si.i_max_A, 0.0);
            double lo = 0.0;
            double hi = 2.0 * motor_si.i_max_A;
            for (int k = 0; k < 50; k++) { /* bisection: i_q for the same torque at another i_d */
                const double mid = 0.5 * (lo + hi);
                if (torque_of((twin_dq_t){d, mid}) < fabs(torque_of(i))) {
                    lo = mid;
                } else {
                    hi = mid;
                }
            }
            TEST_ASSERT_TRUE_MESSAGE(hypot(d, lo) > hypot(i.d, i.q) * 0.995 - 0.003 * motor_si.i_max_A, where);
        }
    }
}

/* Between the nodes of the table the flux at the reference may exceed the available flux by 1 % at most. */
void test_the_references_respect_the_available_flux(void)
{
    const double psi_low = motor_si.psi0_Vs * 1.02;
    const double psi_high = motor_si.psi0_Vs + motor_si.psi_step_Vs * (motor_si.ref_npsi - 1);
    for (int p = 0; p <= 40; p++) {
        const double psi = psi_low + (psi_high - psi_low) * p / 40.0;
        for (int n = 0; n <= 10; n++) {
            const current_reference_t y = reference(0.1 * n * motor_si.torque_max_Nm, psi);
            const twin_dq_t i = amperes(y.i_ref);
            const twin_flux_t flux = twin_flux_table(&motor_si, i);
            const double speed = motor_si.ref_v_ratio * motor_si.v_dc_full_scale_V * 0.7 / psi;
            if (speed > 0.999 * w_b) {
                continue; /* beyond the speed range */
            }
            TEST_ASSERT_TRUE(hypot(flux.psi_d, flux.psi_q) <= 1.01 * psi);
            TEST_ASSERT_TRUE(hypot(i.d, i.q) <= motor_si.i_max_A * 1.0005);
        }
    }
}
