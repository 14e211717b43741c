/* SPDX-License-Identifier: Apache-2.0 */
#include "plant_bench.h"

#include <math.h>

#include "unity.h"

static plant_params_t p;
static plant_map_t *map;
static plant_t *plant;

void setUp(void)
{
    p = bench_params();
    map = poly_map();
    plant = NULL;
}

void tearDown(void)
{
    plant_destroy(plant);
    plant_map_destroy(map);
}

static const plant_truth_t *start(const plant_map_t *with)
{
    plant = plant_create(&p, with);
    TEST_ASSERT_NOT_NULL(plant);
    return plant_truth(plant);
}

/* Applies changed parameters and updates the truth without advancing time. */
static void sample(void)
{
    plant_sensors_t unused;
    plant_sample(plant, &unused);
}

/* All scales at once; each term of the polynomial belongs to one of them:
 * psi_d = F | -X i_q^2 (cross) | A i_d - C i_d^2 (slope); psi_q = B i_q - 2 X i_d i_q (q). */
void test_each_perturbation_scales_its_own_part_of_the_flux(void)
{
    p.magnet_scale = 0.85;
    p.lq_scale = 1.1;
    p.ld_slope_scale = 0.9;
    p.cross_saturation_scale = 1.2;
    const plant_truth_t *t = start(map);
    for (double id = -240.0; id <= 40.0; id += 35.0) {
        for (double iq = -240.0; iq <= 240.0; iq += 48.0) {
            plant_set_state(plant, id, iq, 0.0, 0.0);
            const double d = 0.85 * POLY_F - 1.2 * POLY_X * iq * iq + 0.9 * (POLY_A * id - POLY_C * id * id);
            TEST_ASSERT_DOUBLE_WITHIN(1e-14, d, t->psi_d_Vs);
            TEST_ASSERT_DOUBLE_WITHIN(1e-14, 1.1 * (POLY_B * iq - 2.0 * POLY_X * id * iq), t->psi_q_Vs);
        }
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.85 * POLY_F, t->psi_f_Vs);
}

/* The incremental inductances must be scaled as well, or the currents would not be found: twenty periods of +-100 V
 * from 60 A; the expected flux is computed here from the resulting currents. */
void test_perturbed_currents_are_those_of_the_perturbed_flux(void)
{
    p.magnet_scale = 0.9;
    p.cross_saturation_scale = 0.5;
    p.ld_slope_scale = 1.3;
    p.lq_scale = 0.8;
    const plant_truth_t *t = start(map);
    plant_set_state(plant, -60.0, 60.0, 0.0, 0.0);
    for (int k = 0; k < 20; k++) {
        bench_drive(plant, -10.0 + 100.0 * I * (k < 10 ? 1.0 : -1.0));
        const double id = t->i_d_A, iq = t->i_q_A;
        const double d = 0.9 * POLY_F - 0.5 * POLY_X * iq * iq + 1.3 * (POLY_A * id - POLY_C * id * id);
        TEST_ASSERT_DOUBLE_WITHIN(2e-10, d, t->psi_d_Vs);
        TEST_ASSERT_DOUBLE_WITHIN(2e-10, 0.8 * (POLY_B * iq - 2.0 * POLY_X * id * iq), t->psi_q_Vs);
    }
    TEST_ASSERT_EQUAL(0, t->inversion_failures);
}

/* At constant flux linkage any change of the flux functions must change the currents immediately. */
void test_each_scale_acts_when_it_alone_changes_at_run_time(void)
{
    double *scale[4];
    const plant_truth_t *t = start(map);
    plant_params_t *live = plant_params(plant);
    scale[0] = &live->magnet_scale, scale[1] = &live->lq_scale;
    scale[2] = &live->ld_slope_scale, scale[3] = &live->cross_saturation_scale;
    for (int n = 0; n < 4; n++) {
        plant_set_state(plant, -80.0, 90.0, 0.0, 0.0);
        *scale[n] = 0.9;
        sample();
        TEST_ASSERT_TRUE(fabs(t->i_d_A + 80.0) + fabs(t->i_q_A - 90.0) > 0.5);
        *scale[n] = 1.0;
        sample();
        TEST_ASSERT_DOUBLE_WITHIN(1e-5, -80.0, t->i_d_A);
        TEST_ASSERT_DOUBLE_WITHIN(1e-5, 90.0, t->i_q_A);
    }
}

void test_constants_obey_the_same_scales(void)
{
    p.magnet_scale = 0.9;
    p.ld_slope_scale = 1.3;
    p.lq_scale = 0.8;
    p.cross_saturation_scale = 5.0; /* constants have no cross saturation */
    const plant_truth_t *t = start(NULL);
    plant_set_state(plant, -50.0, 70.0, 0.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.9 * 0.084 - 1.3 * 0.2e-3 * 50.0, t->psi_d_Vs);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.8 * 0.5e-3 * 70.0, t->psi_q_Vs);
}

/* At constant flux: i_d = -0.2 mH x 50 A/L_d', and a magnet 10 % stronger reduces i_d by 42 A. */
void test_each_constant_acts_when_it_alone_changes_at_run_time(void)
{
    const plant_truth_t *t = start(NULL);
    plant_params_t *live = plant_params(plant);
    plant_set_state(plant, -50.0, 70.0, 0.0, 0.0);
    live->ld_H = 0.25e-3;
    sample();
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, -40.0, t->i_d_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 70.0, t->i_q_A);
    live->lq_H = 0.7e-3;
    sample();
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 50.0, t->i_q_A);
    live->ld_H = 0.2e-3;
    live->psi_f_Vs = 1.1 * 0.084;
    sample();
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, -92.0, t->i_d_A);
}

/* -0.1 %/K over 100 K: 10 % */
void test_a_warm_rotor_weakens_the_magnet(void)
{
    p.magnet_temp_coeff_per_K = -0.001;
    p.rotor_C = 120.0;
    const plant_truth_t *t = start(map);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.9 * POLY_F, t->psi_f_Vs);
}

/* A magnet weaker by 0.84 mVs increases i_d by 4.2 A at constant flux linkage and 0.2 mH. */
void test_a_magnet_step_keeps_the_flux_linkage_and_changes_the_current(void)
{
    const plant_truth_t *t = start(NULL);
    plant_set_state(plant, -30.0, 60.0, 0.5, 100.0);
    const double psi_d = t->psi_d_Vs, psi_q = t->psi_q_Vs;
    plant_params(plant)->magnet_scale = 0.99;
    sample();
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, psi_d, t->psi_d_Vs);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, psi_q, t->psi_q_Vs);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, -30.0 + 4.2, t->i_d_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 60.0, t->i_q_A);
}

void test_a_magnet_step_keeps_the_current_if_so_configured(void)
{
    p.magnet_step_keeps_current = 1;
    const plant_truth_t *t = start(map);
    plant_set_state(plant, -30.0, 60.0, 0.5, 0.0);
    const double psi_d = t->psi_d_Vs;
    plant_params(plant)->magnet_scale = 0.8;
    sample();
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, -30.0, t->i_d_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 60.0, t->i_q_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, psi_d - 0.2 * POLY_F, t->psi_d_Vs);
    /* the flux in the stationary frame has changed too: a period with the steady voltage changes nothing */
    bench_drive(plant, p.r_ohm_20 * (-30.0 + 60.0 * I));
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, -30.0, t->i_d_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 60.0, t->i_q_A);
}

/* The magnet is weakened by 15 % in 1000 periods. In the shorted winding each small step has the effect of a slow
 * change: L di/dt + R i = -dpsi_f/dt. At standstill i_d = (rate/R) (1 - e^(-R t/L)), rate = 0.15 x 0.084 Vs / 0.1 s
 * = 0.126 V. The steps differ from the ramp by half a period: 0.126 V x 50 us / 0.2 mH = 0.03 A. */
void test_a_magnet_ramp_induces_its_voltage_in_a_shorted_winding(void)
{
    const plant_truth_t *t = start(NULL);
    const double off[3] = {0.0, 0.0, 0.0}, rate = 0.126;
    for (int k = 1; k <= 1000; k++) {
        plant_params(plant)->magnet_scale = 1.0 - 0.15 * k / 1000.0;
        plant_advance(plant, off, 1);
    }
    const double expected = rate / p.r_ohm_20 * -expm1(-0.1 * p.r_ohm_20 / p.ld_H);
    TEST_ASSERT_DOUBLE_WITHIN(0.035, expected, t->i_d_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, t->i_q_A);
}
