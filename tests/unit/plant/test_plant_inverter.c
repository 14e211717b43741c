/* SPDX-License-Identifier: Apache-2.0 */
#include "plant_bench.h"

#include <math.h>

#include "unity.h"

static plant_params_t p;
static plant_t *plant;

/* 400 V, 10 kHz, 2 us: a leg loses 8 V. Inductive, so that the current is a clean sine. */
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

/* Locked rotor at angle 0: i_d = i_a, and legs b and c share the return. */
static const plant_truth_t *one_period(double id, double a, double b, double c)
{
    const double duty[3] = {a, b, c};
    const plant_truth_t *t = start();
    plant_set_state(plant, id, 0.0, 0.0, 0.0);
    plant_advance(plant, duty, 1);
    return t;
}

/* Three square waves of 8 V, no zero sequence: fundamental 4/pi x 8 V along the current. The
 * current is no perfect sine: the 5th and 7th harmonic of the loss, 2.0 and 1.5 V, are 0.4 % and
 * 0.2 % of it and move its zero crossings, hence the loss's phase, by up to 0.015 rad: 0.15 V
 * across the current. */
void test_dead_time_costs_four_over_pi_of_the_leg_loss_along_the_current(void)
{
    p.dead_time_s = 2e-6;
    p.speed_rad_s = TWO_PI * 50.0 / 3.0;
    const plant_truth_t *t = start();
    double complex u = 0.0, i = 0.0;
    for (int k = 0; k < 4200; k++) { /* 20 turns to settle, one to measure */
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

/* i_a > 0: leg a 8 V down, b and c 8 V up: u_d changes by -2/3 (8 + 8) V; and the other way round.
 */
void test_every_leg_errs_against_its_current(void)
{
    p.dead_time_s = 2e-6;
    const plant_truth_t *t = one_period(50.0, 0.5, 0.5, 0.5);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, -32.0 / 3.0, t->u_d_V);
    plant_destroy(plant);
    t = one_period(-50.0, 0.5, 0.5, 0.5);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 32.0 / 3.0, t->u_d_V);
}

/* Legs at 0 or 1 do not switch: leg a alone errs, +-8 V, u_d +-16/3 V. */
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

/* 0.5 us of pulse, 2 us of dead time. Current out of the leg: the pulse is gone, no more than that.
 * Current into the leg: the lower switch is off for 2.5 us. Mirrored at the upper end. */
void test_a_pulse_shorter_than_the_dead_time_vanishes(void)
{
    const double d = 0.005, per_leg = 800.0 / 3.0;
    p.dead_time_s = 2e-6;
    const plant_truth_t *t = one_period(50.0, d, 0.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 0.0, t->u_d_V);
    plant_destroy(plant);
    t = one_period(-50.0, d, 0.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, per_leg * (d + 0.02), t->u_d_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-8, 0.0, t->inverter_W); /* no drop, nothing burnt */
    plant_destroy(plant);
    t = one_period(-50.0, 1.0 - d, 0.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, per_leg, t->u_d_V);
    plant_destroy(plant);
    t = one_period(50.0, 1.0 - d, 0.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, per_leg * (1.0 - d - 0.02), t->u_d_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-8, 0.0, t->inverter_W);
}

/* 1.5 V against each current, also in legs that do not switch: -2/3 (1.5 + 1.5) V; the heat is
 * 1.5 V x (60 + 30 + 30) A, less the 0.06 % that the current falls in the period. */
void test_the_devices_drop_their_voltage_and_burn_it(void)
{
    p.device_drop_V = 1.5;
    p.r_ohm_20 = 0.0;
    const plant_truth_t *t = one_period(60.0, 0.0, 0.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, -2.0, t->u_d_V);
    TEST_ASSERT_DOUBLE_WITHIN(0.2, 180.0, t->inverter_W);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, t->idc_A);
}

/* Inside +-0.05 A the loss is proportional: 0.025 A gives -4 V in leg a, +2 V in b and c each. The
 * 50 H keep the current where it is. */
void test_the_loss_passes_through_zero_in_proportion_to_a_tiny_current(void)
{
    p.dead_time_s = 2e-6;
    p.ld_H = p.lq_H = 50.0;
    const plant_truth_t *t = one_period(0.025, 0.5, 0.5, 0.5);
    TEST_ASSERT_DOUBLE_WITHIN(0.01, -4.0, t->u_d_V);
}

/* 3 V asked for, up to 10.7 V in the way: the current hangs at zero, without chattering. */
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

/* What leaves the dc link arrives at the terminals when there is no drop: dead time is lossless. */
void test_dead_time_moves_voltage_but_burns_nothing(void)
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

void test_duties_beyond_their_range_are_held_and_a_nan_is_a_half(void)
{
    p.r_ohm_20 = 0.0;
    const plant_truth_t *t = one_period(0.0, 1.7, -3.0, -(double)INFINITY);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 800.0 / 3.0, t->u_d_V);
    plant_destroy(plant);
    t = one_period(0.0, (double)NAN, 0.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 400.0 / 3.0, t->u_d_V);
}

/* 20 V of ripple at 300 Hz: the quarter wave is at 1/1200 s = 25/3 periods of 10 kHz. What acts in
 * a period is the middle's voltage, what is sampled the start's. */
void test_dc_ripple_is_seen_at_the_start_and_acts_in_the_middle_of_a_period(void)
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

/* 9 V in phase a: leg a can lose 8 V, so b and c must each lose e with i_a = 2 x 0.05 A x e/8 V and
 * 9 V - 1 ohm x i_a = 2/3 (8 V + e): e = 5.399 V, i_a = 0.06749 A. */
void test_a_leg_at_its_bound_and_two_within_theirs_share_the_voltage(void)
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
