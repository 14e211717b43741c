/* SPDX-License-Identifier: Apache-2.0 */
#include "plant_bench.h"

#include <math.h>
#include <stddef.h>

#include "unity.h"

static plant_params_t p;

void setUp(void)
{
    p = bench_params();
}

void tearDown(void)
{
}

static void refused(const char *field)
{
    const char *bad = plant_params_bad_field(&p, 0);
    TEST_ASSERT_NOT_NULL_MESSAGE(bad, field);
    TEST_ASSERT_EQUAL_STRING(field, bad);
    TEST_ASSERT_NULL(plant_create(&p, NULL));
    p = bench_params();
}

#define REFUSE(field, value)                                                                       \
    do {                                                                                           \
        p.field = (value);                                                                         \
        refused(#field);                                                                           \
    } while (0)

void test_complete_parameters_are_accepted(void)
{
    TEST_ASSERT_NULL(plant_params_bad_field(&p, 0));
    plant_t *plant = plant_create(&p, NULL);
    TEST_ASSERT_NOT_NULL(plant);
    plant_destroy(plant);
    plant_destroy(NULL);
}

void test_the_defaults_alone_are_refused(void)
{
    plant_params_default(&p);
    refused("pole_pairs");
}

void test_impossible_machines_are_refused_by_name(void)
{
    const double nan = (double)NAN, inf = (double)INFINITY;
    REFUSE(pole_pairs, 0.0);
    REFUSE(pole_pairs, 2.5);
    REFUSE(r_ohm_20, -0.01);
    REFUSE(r_temp_coeff_per_K, nan);
    REFUSE(winding_C, inf);
    p.r_temp_coeff_per_K = 0.004;
    REFUSE(winding_C, -230.0); /* R = 0 */
    REFUSE(magnet_scale, -0.1);
    REFUSE(ld_H, 0.0);
    REFUSE(lq_H, -1e-3);
    REFUSE(psi_f_Vs, nan);
    REFUSE(magnet_scale, inf);
    REFUSE(magnet_temp_coeff_per_K, nan);
    REFUSE(rotor_C, nan);
    REFUSE(lq_scale, 0.0);
    REFUSE(ld_slope_scale, 0.0);
    REFUSE(cross_saturation_scale, nan);
    REFUSE(iron_k_h, -1.0);
    REFUSE(iron_k_e, -1.0);
    REFUSE(iron_k_excess, -1.0);
    REFUSE(speed_rad_s, nan);
    REFUSE(theta_m_rad, inf);
    REFUSE(load_Nm, nan);
    REFUSE(viscous_Nms, -1e-3);
    REFUSE(coulomb_Nm, -1e-3);
    REFUSE(stiction_Nm, -1e-3);
    REFUSE(stribeck_rad_s, 0.0);
    p.imposed_speed = 0;
    p.inertia_kgm2 = 0.0;
    refused("inertia_kgm2");
}

void test_impossible_electronics_are_refused_by_name(void)
{
    const double nan = (double)NAN;
    REFUSE(vdc_V, 0.0);
    REFUSE(vdc_ripple_V, 400.0);
    REFUSE(vdc_ripple_hz, -1.0);
    REFUSE(pwm_hz, 0.0);
    REFUSE(dead_time_s, 50e-6);
    REFUSE(dead_time_s, -1e-6);
    REFUSE(device_drop_V, -0.1);
    REFUSE(leg_knee_A, -0.1);
    REFUSE(short_circuit_A, 0.0);
    REFUSE(desaturation_s, -1e-6);
    REFUSE(imposed_bridge, -1);
    REFUSE(imposed_bridge, 4);
    REFUSE(substeps, 9);
    REFUSE(substeps, 100001);
    REFUSE(current_full_scale_A, 0.0);
    REFUSE(adc_bits, 0);
    REFUSE(adc_bits, 25);
    REFUSE(current_noise_A_rms, -0.5);
    REFUSE(vdc_full_scale_V, 0.0);
    REFUSE(vdc_gain, nan);
    REFUSE(vdc_offset_V, nan);
    REFUSE(vdc_least_V, 0.0);
    REFUSE(converter_reference, 0.0);
    REFUSE(known_voltage_gain, -1.0);
    REFUSE(angle_offset_rad, nan);
    REFUSE(angle_spike_every, -1);
    REFUSE(angle_spike_samples, -1);
    REFUSE(angle_spike_rad, nan);
    REFUSE(angle_h1_rad, nan);
    REFUSE(angle_h2_rad, nan);
    REFUSE(resolver_pole_pairs, 0.0);
    REFUSE(angle_bits, -1);
    REFUSE(angle_bits, 25);
    REFUSE(angle_delay_s, nan);
    p.current_gain[2] = nan;
    refused("current_gain");
    p.current_offset_A[1] = nan;
    refused("current_offset_A");
}

void test_a_map_replaces_the_constants(void)
{
    plant_map_t *map = poly_map();
    p.ld_H = p.lq_H = p.psi_f_Vs = 0.0;
    plant_t *plant = plant_create(&p, map);
    TEST_ASSERT_NOT_NULL(plant);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, POLY_F, plant_truth(plant)->psi_f_Vs);
    plant_destroy(plant);
    plant_map_destroy(map);
}
