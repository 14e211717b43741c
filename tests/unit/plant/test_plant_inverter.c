/* SPDX-License-Identifier: Apache-2.0 */
#include "plant_bench.h"

#include <math.h>

#include "unity.h"

static plant_params_t p;
static plant_t *plant;

/* At 400 V and 10 kHz a dead time of 2 us reduces a leg's voltage by 8 V. The inductance makes the current
 * sinusoidal. */
void setUp(void)
{
    p = bench_params();
    p.ideal_inverter = 0;
    p.ld_H = p.lq_H = 5e-3;
    p.psi_f_Vs = 0.0;
    p.r_ohm_20 = 1.0;
    plant = NULL;
}

void tearDown(void)
{
    plant_destroy(plant);
}

static const plant_truth_t *start(void)
{
    plant = plant_create(&p, NULL);
    TEST_ASSERT_NOT_NULL(plant);
    return plant_truth(plant);
}

/* Locked rotor at angle 0: i_d = i_a, and half of it returns through each of legs b and c. */
static const plant_truth_t *one_period(double id, double a, double b, double c)
{
    const double duty[3] = {a, b, c};
    const plant_truth_t *t = start();
    plant_set_state(plant, id, 0.0, 0.0, 0.0);
    plant_advance(plant, duty, 1);
    return t;
}

/* The loss is three square waves of 8 V; their fundamental is 4/pi x 8 V along the current. The 5th and 7th harmonic of
 * the loss, 2.0 and 1.5 V, make harmonics of 0.4 % and 0.2 % of the current. They shift its zero crossings, and with
 * them the phase of the loss, by up to 0.015 rad: 0.15 V perpendicular to the current. */
void test_the_fundamental_of_the_dead_time_loss_is_four_over_pi_of_the_leg_loss_along_the_current(void)
{
    p.dead_time_s = 2e-6;
    p.speed_rad_s = TWO_PI * 50.0 / 3.0;
    const plant_truth_t *t = start();
    double complex u = 0.0, i = 0.0;
    for (int k = 0; k < 4200; k++) { /* 20 electrical turns to settle, one to measure */
        bench_drive(plant, 100.0 * I);
        if (k >= 4000) {
            u += (t->u_d_V + I * t->u_q_V) / 200.0;
            i += (t->i_d_A + I * t->i_q_A) / 200.0;
        }
    }
    const double x = PI * 50.0 / p.pwm_hz;
    const double complex lost = (100.0 * I * sin(x) / x - u) * conj(i) / cabs(i);
    TEST_ASSERT_DOUBLE_WITHIN(0.03, 4.0 / PI * 8.0, creal(lost));
    TEST_ASSERT_DOUBLE_WITHIN(0.15, 0.0, cimag(lost));
}

void test_an_ideal_inverter_loses_nothing(void)
{
    p.dead_time_s = 2e-6;
    p.device_drop_V = 2.0;
    p.ideal_inverter = 1;
    const plant_truth_t *t = one_period(50.0, 0.6, 0.45, 0.45);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 2.0 / 3.0 * 400.0 * 0.15, t->u_d_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-8, 0.0, t->inverter_W);
}

/* i_a > 0: leg a loses 8 V, b and c gain 8 V: u_d changes by -2/3 (8 + 8) V. With i_a < 0 the sign is opposite. */
void test_the_voltage_error_of_every_leg_opposes_its_current(void)
{
    p.dead_time_s = 2e-6;
    const plant_truth_t *t = one_period(50.0, 0.5, 0.5, 0.5);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, -32.0 / 3.0, t->u_d_V);
    plant_destroy(plant);
    t = one_period(-50.0, 0.5, 0.5, 0.5);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 32.0 / 3.0, t->u_d_V);
}

/* A knee at 10 A: 50 A lose 1 - 10/100 of 8 V, 25 A lose 1 - 10/50 of it; 4 and 2 A lose 4/20 and 2/20. The inductance
 * keeps the currents. Dead time dissipates nothing with a knee either. */
void test_a_soft_knee_reduces_the_error_of_small_currents(void)
{
    p.dead_time_s = 2e-6;
    p.leg_knee_A = 10.0;
    p.ld_H = p.lq_H = 50.0;
    p.r_ohm_20 = 0.0;
    const plant_truth_t *t = one_period(50.0, 0.5, 0.5, 0.5);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, -2.0 / 3.0 * 8.0 * (0.9 + 0.8), t->u_d_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.0, t->inverter_W);
    plant_destroy(plant);
    t = one_period(-50.0, 0.5, 0.5, 0.5);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 2.0 / 3.0 * 8.0 * (0.9 + 0.8), t->u_d_V);
    plant_destroy(plant);
    t = one_period(4.0, 0.5, 0.5, 0.5);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, -2.0 / 3.0 * 8.0 * (0.2 + 0.1), t->u_d_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.0, t->inverter_W);
}

/* The diodes alone block the whole dc voltage. */
void test_a_soft_knee_belongs_to_switching_legs_alone(void)
{
    const double duty[3] = {0.5, 0.5, 0.5};
    double seen[2];
    p.dead_time_s = 2e-6;
    for (int n = 0; n < 2; n++) {
        p.leg_knee_A = n == 0 ? 0.0 : 10.0;
        start();
        plant_set_state(plant, 50.0, 0.0, 0.0, 0.0);
        plant_advance(plant, duty, 0);
        seen[n] = plant_truth(plant)->u_d_V;
        plant_destroy(plant);
    }
    plant = NULL;
    TEST_ASSERT_EQUAL_DOUBLE(seen[0], seen[1]);
}

/* Legs at 0 or 1 do not switch. If leg a alone switches, its error of 8 V changes u_d by 16/3 V. */
void test_a_leg_that_does_not_switch_has_no_dead_time(void)
{
    p.dead_time_s = 2e-6;
    const plant_truth_t *t = one_period(50.0, 1.0, 0.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 800.0 / 3.0, t->u_d_V);
    plant_destroy(plant);
    t = one_period(-50.0, 1.0, 0.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 800.0 / 3.0, t->u_d_V);
    plant_destroy(plant);
    t = one_period(-50.0, 0.5, 0.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 400.0 / 3.0 + 16.0 / 3.0, t->u_d_V);
}

/* A pulse of 0.5 us and a dead time of 2 us. With current out of the leg exactly the pulse is lost. With current into
 * the leg the lower switch is off for 2.5 us. The same holds, mirrored, for a duty near 1. */
void test_a_pulse_shorter_than_the_dead_time_vanishes(void)
{
    const double d = 0.005, per_leg = 800.0 / 3.0;
    p.dead_time_s = 2e-6;
    const plant_truth_t *t = one_period(50.0, d, 0.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 0.0, t->u_d_V);
    plant_destroy(plant);
    t = one_period(-50.0, d, 0.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, per_leg * (d + 0.02), t->u_d_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-8, 0.0, t->inverter_W); /* without a device drop there is no loss */
    plant_destroy(plant);
    t = one_period(-50.0, 1.0 - d, 0.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, per_leg, t->u_d_V);
    plant_destroy(plant);
    t = one_period(50.0, 1.0 - d, 0.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, per_leg * (1.0 - d - 0.02), t->u_d_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-8, 0.0, t->inverter_W);
}

/* 1.5 V against each current, also in legs that do not switch: -2/3 (1.5 + 1.5) V. The loss is 1.5 V x (60 + 30 + 30)
 * A, while the current falls by 0.07 % in the period. */
void test_the_device_drop_opposes_the_current_and_its_power_is_the_inverters_loss(void)
{
    p.device_drop_V = 1.5;
    p.r_ohm_20 = 0.0;
    const plant_truth_t *t = one_period(60.0, 0.0, 0.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, -2.0, t->u_d_V);
    TEST_ASSERT_DOUBLE_WITHIN(0.2, 180.0, t->inverter_W);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, t->idc_A);
}

/* Within +-0.05 A the loss is proportional to the current: with 0.025 A leg a loses 4 V, b and c gain 2 V each. 50 H
 * keep the current constant. */
void test_the_loss_is_proportional_to_a_small_current(void)
{
    p.dead_time_s = 2e-6;
    p.ld_H = p.lq_H = 50.0;
    const plant_truth_t *t = one_period(0.025, 0.5, 0.5, 0.5);
    TEST_ASSERT_DOUBLE_WITHIN(0.01, -4.0, t->u_d_V);
}

/* 3 V are applied and the dead time opposes up to 10.7 V: the current stays near zero without oscillating. */
void test_the_dead_time_holds_a_small_current_at_zero(void)
{
    p.dead_time_s = 2e-6;
    p.ld_H = p.lq_H = 0.2e-3;
    const plant_truth_t *t = start();
    double before = 0.0;
    for (int k = 0; k < 500; k++) {
        before = t->i_d_A;
        bench_drive(plant, 3.0);
        TEST_ASSERT_TRUE(fabs(t->i_d_A) < 0.05);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, before, t->i_d_A);
}

/* Without a device drop the dc power is the power at the terminals. */
void test_dead_time_changes_the_voltage_but_dissipates_nothing(void)
{
    p.dead_time_s = 3e-6;
    p.psi_f_Vs = 0.1;
    p.speed_rad_s = 200.0;
    const plant_truth_t *t = start();
    for (int k = 0; k < 2000; k++) {
        bench_drive(plant, -20.0 + 110.0 * I);
    }
    TEST_ASSERT_TRUE(t->e_copper_J > 10.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9 * fabs(t->e_electrical_J), t->e_electrical_J, t->e_dc_J);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, t->electrical_W, t->idc_A * 400.0);
}

void test_duties_beyond_their_range_are_limited_and_nan_counts_as_one_half(void)
{
    p.r_ohm_20 = 0.0;
    const plant_truth_t *t = one_period(0.0, 1.7, -3.0, -(double)INFINITY);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 800.0 / 3.0, t->u_d_V);
    plant_destroy(plant);
    t = one_period(0.0, (double)NAN, 0.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 400.0 / 3.0, t->u_d_V);
}

/* 20 V of ripple at 300 Hz. The value at the start of a period is sampled; the value in its middle acts. */
void test_dc_ripple_is_sampled_at_the_start_of_a_period_and_acts_with_its_value_in_the_middle(void)
{
    p.vdc_ripple_V = 20.0;
    p.vdc_ripple_hz = 300.0;
    p.r_ohm_20 = 0.0;
    const plant_truth_t *t = start();
    const double duty[3] = {1.0, 0.0, 0.0};
    for (int k = 0; k < 30; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 400.0 + 20.0 * sin(TWO_PI * 0.03 * k), t->vdc_V);
        plant_advance(plant, duty, 1);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2.0 / 3.0 * (400.0 + 20.0 * sin(TWO_PI * 0.03 * (k + 0.5))), t->u_d_V);
    }
}

/* 9 V along phase a: leg a is at its bound of 8 V, b and c are within theirs with an error e. By hand from
 * i_a = 2 x 0.05 A x e/8 V and 9 V - 1 ohm x i_a = 2/3 (8 V + e): e = 5.399 V, i_a = 0.06749 A. */
void test_one_leg_at_its_error_bound_and_two_within_theirs_match_the_closed_form(void)
{
    p.dead_time_s = 2e-6;
    p.ld_H = p.lq_H = 0.2e-3;
    const plant_truth_t *t = start();
    for (int k = 0; k < 100; k++) {
        bench_drive(plant, 9.0);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-5, 0.067485, t->i_d_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-5, 0.0, t->i_q_A);
}

/* Its voltage is constant in the stationary frame for a period: the mean in the turning frame is smaller by sinc. */
void test_a_source_in_series_adds_its_voltage_to_that_of_the_legs(void)
{
    const double x = PI * 400.0 / p.pwm_hz;
    p.ideal_inverter = 1;
    p.speed_rad_s = TWO_PI * 400.0 / 3.0;
    p.theta_m_rad = 0.4;
    p.series_d_V = 3.0;
    p.series_q_V = -4.0;
    const plant_truth_t *t = start();
    plant_advance(plant, (double[3]){0.5, 0.5, 0.5}, 1);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 3.0 * sin(x) / x, t->u_d_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, -4.0 * sin(x) / x, t->u_q_V);
    bench_drive(plant, 10.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 13.0 * sin(x) / x, t->u_d_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, -4.0 * sin(x) / x, t->u_q_V);
}
