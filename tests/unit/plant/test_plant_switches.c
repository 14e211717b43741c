/* SPDX-License-Identifier: Apache-2.0 */
/* Open and shorted switches: conduction against closed forms, and what the gate drivers do about a short circuit. */
#include "plant_bench.h"

#include <math.h>

#include "unity.h"

enum { UPPER_A, UPPER_B, UPPER_C, LOWER_A, LOWER_B, LOWER_C };

static const double half[3] = {0.5, 0.5, 0.5};
static plant_params_t p;
static plant_t *plant;

void setUp(void)
{
    p = bench_params();
    p.ideal_inverter = 0;
    p.dead_time_s = 2e-6;
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

static int reported(void)
{
    plant_sensors_t sensors;
    plant_sample(plant, &sensors);
    return sensors.gate_fault;
}

/* One period at rest with i_a = id and the return in b and c, inductive enough to keep it. */
static const plant_truth_t *one_period(double id, double a, double b, double c)
{
    const double duty[3] = {a, b, c};
    p.ld_H = p.lq_H = 5e-3;
    p.r_ohm_20 = 0.0;
    plant_destroy(plant);
    const plant_truth_t *t = start();
    plant_set_state(plant, id, 0.0, 0.0, 0.0);
    plant_advance(plant, duty, 1);
    return t;
}

/* Duties 0.75, 0, 0; the drop is 2 V. Sound: v_a = 300 - 8 - 2 V for i_a > 0 and 300 + 8 + 2 V for i_a < 0, b and c
 * 2 V against their currents. With the upper switch of a open, i_a > 0 has the lower diode only: v_a = -2 V. */
void test_an_open_upper_switch_leaves_the_lower_diode_to_a_current_out_of_the_leg(void)
{
    p.device_drop_V = 2.0;
    const plant_truth_t *t = one_period(100.0, 0.75, 0.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 2.0 / 3.0 * (290.0 - 2.0), t->u_d_V);
    p.switch_open[UPPER_A] = 1;
    t = one_period(100.0, 0.75, 0.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 2.0 / 3.0 * (-2.0 - 2.0), t->u_d_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, t->idc_A); /* it circulates below */
    t = one_period(-100.0, 0.75, 0.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 2.0 / 3.0 * (310.0 + 2.0), t->u_d_V);
}

/* The mirror image: with the lower switch open, i_a < 0 has the upper diode only: v_a = 400 + 2 V. */
void test_an_open_lower_switch_leaves_the_upper_diode_to_a_current_into_the_leg(void)
{
    p.device_drop_V = 2.0;
    p.switch_open[LOWER_A] = 1;
    const plant_truth_t *t = one_period(-100.0, 0.25, 1.0, 1.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 2.0 / 3.0 * (402.0 - 398.0), t->u_d_V);
    t = one_period(100.0, 0.25, 1.0, 1.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 2.0 / 3.0 * (90.0 - 402.0), t->u_d_V);
}

/* With all six open the bridge does what one with switching disabled does, at any duty. */
void test_six_open_switches_are_a_bridge_with_switching_disabled(void)
{
    double i_A[2], idc_A[2];
    for (int n = 0; n < 2; n++) {
        for (int k = 0; k < 6; k++) {
            p.switch_open[k] = n;
        }
        plant_destroy(plant);
        const plant_truth_t *t = start();
        plant_set_state(plant, -80.0, 60.0, 0.4, 700.0);
        plant_advance(plant, (double[3]){0.3, 0.6, 0.8}, n);
        i_A[n] = t->i_d_A;
        idc_A[n] = t->idc_A;
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, i_A[0], i_A[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, idc_A[0], idc_A[1]);
}

/* A phase with an open upper switch drives no current out of its leg: half waves. */
void test_one_open_switch_leaves_half_waves_in_its_phase(void)
{
    p.switch_open[UPPER_B] = 1;
    p.ideal_inverter = 1;
    p.speed_rad_s = 50.0;
    const plant_truth_t *t = start();
    double most = 0.0, least = 0.0;
    for (int k = 0; k < 2000; k++) {
        bench_drive(plant, 2.0 + 17.0 * I);
        most = fmax(most, t->i_abc_A[1]);
        least = fmin(least, t->i_abc_A[1]);
    }
    TEST_ASSERT_TRUE(most < 1.0);
    TEST_ASSERT_TRUE(least < -50.0);
    TEST_ASSERT_EQUAL(0, t->inversion_failures);
}

/* Switching disabled, at rest, i_a = 100 A out of a leg whose upper switch is shorted: it returns through the upper
 * diodes of b and c, and the loop has their drop alone: u_d = 2/3 x (0 - 2) V, no current in the dc link. */
void test_a_current_out_of_a_shorted_upper_switch_circulates_above(void)
{
    p.device_drop_V = 2.0;
    p.switch_shorted[UPPER_A] = 1;
    p.ld_H = p.lq_H = 5e-3;
    const plant_truth_t *t = start();
    plant_set_state(plant, 100.0, 0.0, 0.0, 0.0);
    plant_advance(plant, half, 0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 2.0 / 3.0 * -2.0, t->u_d_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, t->idc_A);
    TEST_ASSERT_FALSE(reported());
    /* the other way it returns through the lower diodes, against the link: 2/3 x (400 - (-2)) V, and charges it */
    plant_set_state(plant, -100.0, 0.0, 0.0, 0.0);
    plant_advance(plant, half, 0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 2.0 / 3.0 * 402.0, t->u_d_V);
    TEST_ASSERT_TRUE(t->idc_A < -50.0);
}

/* Half waves at a speed at which a sound bridge is without current (line voltage 66 of 400 V): each phase current has
 * one sign, that of the shorted leg out of it for an upper switch, into it for a lower one; the machine is braked.
 * Mirrored machines give mirrored currents. */
static double braking(int shorted, double *most_A, double *least_A)
{
    double torque_Nm = 0.0;
    const int leg = shorted % 3;
    p.switch_shorted[shorted] = 1;
    p.speed_rad_s = 150.0;
    plant_destroy(plant);
    const plant_truth_t *t = start();
    *most_A = *least_A = 0.0;
    for (int k = 0; k < 4189; k++) { /* 30 electrical turns of 139.6 periods */
        plant_advance(plant, half, 0);
        torque_Nm += t->torque_mean_Nm / 4189.0;
        *most_A = fmax(*most_A, t->i_abc_A[leg]);
        *least_A = fmin(*least_A, t->i_abc_A[leg]);
        TEST_ASSERT_TRUE((shorted < 3 ? 1.0 : -1.0) * t->i_abc_A[(leg + 1) % 3] < 1e-3);
        TEST_ASSERT_DOUBLE_WITHIN(0.1, 0.0, t->idc_A); /* all of it circulates at the shorted switch's rail */
    }
    TEST_ASSERT_EQUAL(0, t->inversion_failures);
    p.switch_shorted[shorted] = 0;
    return torque_Nm;
}

void test_freewheel_with_a_shorted_switch_brakes_by_half_waves(void)
{
    double most, least, first_A = 0.0, first_Nm = 0.0;
    const double short_circuit_A = 0.084 / 0.2e-3; /* of the symmetrical short circuit at high speed */
    for (int k = 0; k < 6; k++) {
        const double torque_Nm = braking(k, &most, &least);
        first_A = k == 0 ? most : first_A;
        first_Nm = k == 0 ? torque_Nm : first_Nm;
        TEST_ASSERT_TRUE(torque_Nm < -5.0);
        TEST_ASSERT_DOUBLE_WITHIN(0.05 * fabs(first_Nm), first_Nm, torque_Nm);
        TEST_ASSERT_DOUBLE_WITHIN(0.02 * first_A, first_A, k < 3 ? most : -least);
        TEST_ASSERT_DOUBLE_WITHIN(1.0, 0.0, k < 3 ? least : most);
    }
    TEST_ASSERT_TRUE(first_A > short_circuit_A);
}

/* The short circuit on the side of the shorted switch is the symmetrical one, and no driver reports a fault. */
void test_the_short_circuit_on_the_side_of_a_shorted_switch_is_symmetrical(void)
{
    double i_A[4];
    for (int n = 0; n < 4; n++) {
        const double rail = n < 2 ? 1.0 : 0.0, duty[3] = {rail, rail, rail};
        p.switch_shorted[n == 1 ? UPPER_C : (n == 3 ? LOWER_C : UPPER_B)] = n % 2;
        p.speed_rad_s = 400.0;
        plant_destroy(plant);
        const plant_truth_t *t = start();
        for (int k = 0; k < 500; k++) {
            plant_advance(plant, duty, 1);
            TEST_ASSERT_FALSE(reported());
        }
        i_A[n] = hypot(t->i_d_A, t->i_q_A);
        p.switch_shorted[UPPER_C] = p.switch_shorted[LOWER_C] = 0;
    }
    for (int n = 1; n < 4; n++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, i_A[0], i_A[n]);
    }
    TEST_ASSERT_TRUE(i_A[0] > 300.0);
}

/* 2000 A for 3 us is 6 mC, 12 V of a capacitor of 500 uF; the gates are off in that period: i_a = 100 A falls against
 * the shorted rail only, and the report comes again with the next attempt. */
void test_a_short_circuit_of_the_link_is_blocked_reported_and_seen_in_the_voltage(void)
{
    p.dc_link_F = 500e-6;
    p.vdc_start_V = 400.0;
    p.switch_shorted[UPPER_A] = 1;
    const plant_truth_t *t = start();
    plant_switch(plant, &(plant_switches_t){.gate_supply = 1});
    plant_set_state(plant, 100.0, 0.0, 0.0, 0.0);
    plant_advance(plant, half, 1);
    TEST_ASSERT_TRUE(reported());
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 388.0, t->vdc_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 0.0, t->u_d_V);
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 6e-3 * 394.6, t->e_short_circuit_J);
    plant_advance(plant, half, 0);
    TEST_ASSERT_FALSE(reported());
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 388.0, t->vdc_V);
    plant_advance(plant, (double[3]){0.0, 0.0, 0.0}, 1);
    TEST_ASSERT_TRUE(reported());
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 376.0, t->vdc_V);
}

/* Nothing is switched on against it: all upper switches on, a pulse shorter than the dead time, an open counterpart, no
 * supply of the drivers. A pulse of 2 us after dead time is noticed by a driver of 1 us only. */
void test_what_the_gate_drivers_do_not_report(void)
{
    p.switch_shorted[UPPER_A] = 1;
    (void)one_period(0.0, 1.0, 0.0, 0.0);
    TEST_ASSERT_FALSE(reported());
    (void)one_period(0.0, 0.99, 0.0, 0.0);
    TEST_ASSERT_FALSE(reported());
    const plant_truth_t *t = one_period(0.0, 0.96, 0.0, 0.0);
    TEST_ASSERT_FALSE(reported());
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 400.0 * 2000.0 * 2e-6, t->e_short_circuit_J);
    p.desaturation_s = 1e-6;
    (void)one_period(0.0, 0.96, 0.0, 0.0);
    TEST_ASSERT_TRUE(reported());
    plant_switch(plant, &(plant_switches_t){.contactor = 1});
    plant_advance(plant, half, 1);
    TEST_ASSERT_FALSE(reported());
    p.switch_open[LOWER_A] = 1;
    (void)one_period(0.0, 0.5, 0.5, 0.5);
    TEST_ASSERT_FALSE(reported());
}

/* Without desaturation, or with both switches of a leg shorted, 2000 A empty 500 uF within a period. */
void test_a_short_circuit_that_is_not_blocked_empties_the_link(void)
{
    p.dc_link_F = 500e-6;
    p.vdc_start_V = 400.0;
    p.switch_shorted[LOWER_B] = p.desaturation_open = 1;
    const plant_truth_t *t = start();
    plant_switch(plant, &(plant_switches_t){.gate_supply = 1});
    plant_advance(plant, (double[3]){1.0, 1.0, 1.0}, 1);
    TEST_ASSERT_FALSE(reported());
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.0, t->vdc_V);
    p.switch_shorted[UPPER_B] = 1;
    p.desaturation_open = 0;
    plant_destroy(plant);
    t = start();
    plant_switch(plant, &(plant_switches_t){.gate_supply = 1});
    plant_advance(plant, half, 0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.0, t->vdc_V);
    plant_advance(plant, half, 1);
    TEST_ASSERT_TRUE(reported());
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.0, t->vdc_V);
}

/* A broken lead carries nothing, whatever the switches of its leg do. */
void test_a_broken_lead_outlasts_a_shorted_switch(void)
{
    p.phase_open[0] = p.switch_shorted[UPPER_A] = 1;
    p.speed_rad_s = 150.0;
    const plant_truth_t *t = start();
    for (int k = 0; k < 300; k++) {
        plant_advance(plant, half, 0);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.0, t->i_abc_A[0]);
    }
}
