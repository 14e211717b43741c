/* SPDX-License-Identifier: Apache-2.0 */
#include "plant_bench.h"

#include <math.h>

#include "unity.h"

static const double half[3] = {0.5, 0.5, 0.5};
static plant_params_t p;
static plant_map_t *map;
static plant_t *plant;

void setUp(void)
{
    p = bench_params();
    p.ideal_inverter = 0;
    p.dead_time_s = 2e-6;
    map = NULL;
    plant = NULL;
}

void tearDown(void)
{
    plant_destroy(plant);
    plant_map_destroy(map);
}

static const plant_truth_t *start(void)
{
    plant = plant_create(&p, map);
    TEST_ASSERT_NOT_NULL(plant);
    return plant_truth(plant);
}

static double largest(const plant_truth_t *t)
{
    return fmax(fabs(t->i_abc_A[0]), fmax(fabs(t->i_abc_A[1]), fabs(t->i_abc_A[2])));
}

/* i_a > 0 > i_b = i_c: leg a is at the lower rail, b and c at the upper: u_d = -2/3 x (400 + 2 x 2) V, and
 * i_d = (I + U/R) e^(-t/tau) - U/R in the first period. After five more the energy has returned to the dc link. */
void test_the_diodes_reduce_the_current_against_the_dc_link_voltage(void)
{
    p.device_drop_V = 2.0;
    const plant_truth_t *t = start();
    plant_set_state(plant, 200.0, 0.0, 0.0, 0.0);
    plant_advance(plant, half, 0);
    const double u = 2.0 / 3.0 * 404.0, r = p.r_ohm_20;
    const double expected = (200.0 + u / r) * exp(-1e-4 * r / p.ld_H) - u / r;
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, -u, t->u_d_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, expected, t->i_d_A);
    /* b and c return the mean of i_d over the period to the dc link */
    const double x = 1e-4 * r / p.ld_H, mean = (200.0 + u / r) * -expm1(-x) / x - u / r;
    TEST_ASSERT_DOUBLE_WITHIN(5e-3, -mean, t->idc_A);
    for (int k = 0; k < 5; k++) {
        plant_advance(plant, half, 0);
    }
    /* 3/4 L I^2 = 6 J are divided between copper, dc link (400 V x q) and diodes (2 x 2 V x q) */
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 6.0 - t->e_copper_J, -1.01 * t->e_dc_J);
}

/* Below the speed at which the diodes rectify, any current decays to zero within 2 ms. Afterwards there is neither
 * current nor torque at any angle. */
void test_currents_decay_to_zero_and_stay_zero(void)
{
    map = poly_map();
    p.speed_rad_s = 800.0; /* sqrt(3) x 2400 x 0.07 = 291 V of line voltage */
    const plant_truth_t *t = start();
    for (int n = 0; n < 12; n++) {
        plant_set_state(plant, -20.0 * n, 60.0 * sin(n), 0.5 * n, 800.0);
        for (int k = 0; k < 20; k++) {
            plant_advance(plant, half, 0);
        }
        for (int k = 0; k < 100; k++) {
            plant_advance(plant, half, 0);
            TEST_ASSERT_TRUE(largest(t) < 1e-4);
            TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.0, t->torque_mean_Nm);
        }
    }
    TEST_ASSERT_EQUAL(0, t->inversion_failures);
}

/* Without current the terminal voltage is the back-EMF of the magnet, 126 V. It is constant within a substep, so that
 * its mean in the rotor frame is smaller by the square of sinc(w h/2), 2e-5. */
void test_without_current_the_terminals_have_the_back_emf(void)
{
    p.speed_rad_s = 500.0;
    const plant_truth_t *t = start();
    for (int k = 0; k < 10; k++) {
        plant_advance(plant, half, 0);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.0, t->u_d_V);
        TEST_ASSERT_DOUBLE_WITHIN(1e-4, 126.0 * pow(sin(0.0075) / 0.0075, 2.0), t->u_q_V);
    }
}

/* The diodes conduct when the line voltage sqrt(3) w psi_f exceeds 400 V + 2 drops. 1 % below no current flows in
 * several mechanical turns; 1 % above current flows into the dc link and the rotor is braked. */
static void rectify(double of_threshold, double *charge_A, double *torque_Nm, double *i_max_A)
{
    const plant_truth_t *t;
    p.device_drop_V = 2.0;
    p.speed_rad_s = of_threshold * 404.0 / (sqrt(3.0) * 3.0 * 0.084);
    t = start();
    *charge_A = *torque_Nm = *i_max_A = 0.0;
    for (int k = 0; k < 400; k++) {
        plant_advance(plant, half, 0);
        *charge_A -= t->idc_A / 400.0;
        *torque_Nm += t->torque_mean_Nm / 400.0;
        *i_max_A = fmax(*i_max_A, largest(t));
    }
    plant_destroy(plant);
    plant = NULL;
}

void test_rectification_starts_where_the_line_voltage_exceeds_the_dc_voltage(void)
{
    double charge, torque, i_max;
    rectify(0.99, &charge, &torque, &i_max);
    TEST_ASSERT_TRUE(i_max < 1e-4);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.0, charge);
    rectify(1.01, &charge, &torque, &i_max);
    TEST_ASSERT_TRUE(i_max > 0.1);
    TEST_ASSERT_TRUE(charge > 0.01);
    TEST_ASSERT_TRUE(torque < -0.01);
}

/* The positive and negative peaks of the three phase currents are equal. With 87 samples per electrical turn each peak
 * is found to a few per cent. */
void test_all_six_diodes_conduct_the_same_peak_current(void)
{
    double top[3] = {0.0, 0.0, 0.0}, bottom[3] = {0.0, 0.0, 0.0};
    p.pwm_hz = 4e4;
    p.speed_rad_s = 1.05 * 400.0 / (sqrt(3.0) * 3.0 * 0.084);
    const plant_truth_t *t = start();
    for (int k = 0; k < 4000; k++) {
        plant_advance(plant, half, 0);
        for (int x = 0; x < 3 && k > 2000; x++) {
            top[x] = fmax(top[x], t->i_abc_A[x]);
            bottom[x] = fmin(bottom[x], t->i_abc_A[x]);
        }
    }
    TEST_ASSERT_TRUE(top[0] > 1.0);
    for (int x = 0; x < 3; x++) {
        TEST_ASSERT_DOUBLE_WITHIN(0.05 * top[0], top[0], top[x]);
        TEST_ASSERT_DOUBLE_WITHIN(0.05 * top[0], -top[0], bottom[x]);
    }
}

/* 30 % above the threshold: the shaft power is divided between dc link, diodes and copper. */
void test_a_rectifying_machine_converts_shaft_power_into_dc_power(void)
{
    p.speed_rad_s = 1.3 * 400.0 / (sqrt(3.0) * 3.0 * 0.084);
    p.device_drop_V = 1.0;
    const plant_truth_t *t = start();
    for (int k = 0; k < 3000; k++) {
        plant_advance(plant, half, 0);
    }
    TEST_ASSERT_TRUE(t->e_mechanical_J < -100.0);
    TEST_ASSERT_TRUE(t->e_dc_J < -0.5 * fabs(t->e_mechanical_J));
    const double lost = t->e_copper_J + t->e_field_J;
    TEST_ASSERT_DOUBLE_WITHIN(1e-3 * fabs(t->e_mechanical_J), t->e_electrical_J, t->e_mechanical_J + lost);
    TEST_ASSERT_TRUE(t->e_dc_J > t->e_electrical_J); /* the difference is the loss of the diodes */
}

/* Phase b has no current, whatever the inverter does. */
void test_a_broken_lead_carries_no_current(void)
{
    p.phase_open[1] = 1;
    p.speed_rad_s = 100.0;
    const plant_truth_t *t = start();
    double i_max = 0.0;
    for (int k = 0; k < 300; k++) {
        bench_drive(plant, 30.0 + 60.0 * I);
        TEST_ASSERT_DOUBLE_WITHIN(5e-3, 0.0, t->i_abc_A[1]);
        i_max = fmax(i_max, fabs(t->i_abc_A[0]));
    }
    TEST_ASSERT_TRUE(i_max > 10.0);
}

void test_a_lead_that_breaks_under_current_has_no_current_after_one_period(void)
{
    const plant_truth_t *t = start();
    plant_set_state(plant, -50.0, 80.0, 0.3, 0.0);
    TEST_ASSERT_TRUE(fabs(t->i_abc_A[2]) > 10.0);
    plant_params(plant)->phase_open[2] = 1;
    plant_advance(plant, half, 1);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.0, t->i_abc_A[2]);
}
