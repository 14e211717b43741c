/* SPDX-License-Identifier: Apache-2.0 */
/* Open and shorted switches: conduction against closed forms, and the reaction of the gate drivers to a short
 * circuit. */
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

/* One period at standstill with i_a = id, which returns through b and c; the inductance keeps it constant. */
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

/* Duties 0.75, 0, 0; the drop is 2 V. Intact leg: v_a = 300 - 8 - 2 V for i_a > 0 and 300 + 8 + 2 V for i_a < 0; b and
 * c have 2 V against their currents. With the upper switch of a open, i_a > 0 flows through the lower diode for the
 * whole period: v_a = -2 V. */
void test_an_open_upper_switch_leaves_the_lower_diode_to_a_current_out_of_the_leg(void)
{
    p.device_drop_V = 2.0;
    const plant_truth_t *t = one_period(100.0, 0.75, 0.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 2.0 / 3.0 * (290.0 - 2.0), t->u_d_V);
    p.switch_open[UPPER_A] = 1;
    t = one_period(100.0, 0.75, 0.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 2.0 / 3.0 * (-2.0 - 2.0), t->u_d_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, t->idc_A); /* it circulates through the lower rail */
    t = one_period(-100.0, 0.75, 0.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 2.0 / 3.0 * (310.0 + 2.0), t->u_d_V);
}

/* Mirrored: with the lower switch of a open, i_a < 0 flows through the upper diode: v_a = 400 + 2 V. */
void test_an_open_lower_switch_leaves_the_upper_diode_to_a_current_into_the_leg(void)
{
    p.device_drop_V = 2.0;
    p.switch_open[LOWER_A] = 1;
    const plant_truth_t *t = one_period(-100.0, 0.25, 1.0, 1.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 2.0 / 3.0 * (402.0 - 398.0), t->u_d_V);
    t = one_period(100.0, 0.25, 1.0, 1.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 2.0 / 3.0 * (90.0 - 402.0), t->u_d_V);
}

void test_with_six_open_switches_the_bridge_behaves_as_with_switching_disabled(void)
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

/* With an open upper switch no current flows out of the leg: only the negative half waves remain. */
void test_one_open_switch_leaves_half_waves_in_its_phase(void)
{
    p.switch_open[UPPER_B] = 1;
    p.ideal_inverter = 1;
    p.speed_rad_s = 50.0;
    const plant_truth_t *t = start();
    double i_max = 0.0, i_min = 0.0;
    for (int k = 0; k < 2000; k++) {
        bench_drive(plant, 2.0 + 17.0 * I);
        i_max = fmax(i_max, t->i_abc_A[1]);
        i_min = fmin(i_min, t->i_abc_A[1]);
    }
    TEST_ASSERT_TRUE(i_max < 1.0);
    TEST_ASSERT_TRUE(i_min < -50.0);
    TEST_ASSERT_EQUAL(0, t->inversion_failures);
}

/* Switching is disabled at standstill; i_a = 100 A flows out of a leg whose upper switch is shorted. It returns through
 * the upper diodes of b and c, whose drop is the only voltage: u_d = 2/3 x (0 - 2) V, no current in the dc link. */
void test_a_current_out_of_a_shorted_upper_switch_circulates_through_the_upper_rail(void)
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
    /* a current into the leg flows through the lower diodes of b and c and charges the link: 2/3 x (400 - (-2)) V */
    plant_set_state(plant, -100.0, 0.0, 0.0, 0.0);
    plant_advance(plant, half, 0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 2.0 / 3.0 * 402.0, t->u_d_V);
    TEST_ASSERT_TRUE(t->idc_A < -50.0);
}

/* Mean torque with one shorted switch at a speed at which an intact bridge has no current (line voltage 66 V of 400 V).
 * The diodes let the current of the shorted leg flow in one direction only: out of it for an upper switch, into it for
 * a lower one; the other two phases have the opposite sign. */
static double braking(int shorted, double *i_max_A, double *i_min_A)
{
    double torque_Nm = 0.0;
    const int leg = shorted % 3;
    p.switch_shorted[shorted] = 1;
    p.speed_rad_s = 150.0;
    plant_destroy(plant);
    const plant_truth_t *t = start();
    *i_max_A = *i_min_A = 0.0;
    for (int k = 0; k < 4189; k++) { /* 30 electrical turns of 139.6 periods */
        plant_advance(plant, half, 0);
        torque_Nm += t->torque_mean_Nm / 4189.0;
        *i_max_A = fmax(*i_max_A, t->i_abc_A[leg]);
        *i_min_A = fmin(*i_min_A, t->i_abc_A[leg]);
        TEST_ASSERT_TRUE((shorted < 3 ? 1.0 : -1.0) * t->i_abc_A[(leg + 1) % 3] < 1e-3);
        TEST_ASSERT_DOUBLE_WITHIN(0.1, 0.0,
                                  t->idc_A); /* the current circulates through the rail of the shorted switch */
    }
    TEST_ASSERT_EQUAL(0, t->inversion_failures);
    p.switch_shorted[shorted] = 0;
    return torque_Nm;
}

void test_freewheel_with_a_shorted_switch_brakes_by_half_waves(void)
{
    double i_max, i_min, first_A = 0.0, first_Nm = 0.0;
    const double short_circuit_A = 0.084 / 0.2e-3; /* of the symmetrical short circuit at high speed */
    for (int k = 0; k < 6; k++) {
        const double torque_Nm = braking(k, &i_max, &i_min);
        first_A = k == 0 ? i_max : first_A;
        first_Nm = k == 0 ? torque_Nm : first_Nm;
        TEST_ASSERT_TRUE(torque_Nm < -5.0);
        TEST_ASSERT_DOUBLE_WITHIN(0.05 * fabs(first_Nm), first_Nm, torque_Nm);
        TEST_ASSERT_DOUBLE_WITHIN(0.02 * first_A, first_A, k < 3 ? i_max : -i_min);
        TEST_ASSERT_DOUBLE_WITHIN(1.0, 0.0, k < 3 ? i_min : i_max);
    }
    TEST_ASSERT_TRUE(first_A > short_circuit_A);
}

/* All switches on the side of the shorted one are on: a symmetrical short circuit, and no gate driver reports a
 * fault. */
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

/* 2000 A for 3 us are 6 mC, 12 V of a capacitor of 500 uF. In this period the gate drivers block all switches: i_a =
 * 100 A circulates through the shorted rail. The next attempt to switch is reported again. */
void test_a_short_circuit_of_the_link_is_blocked_and_reported_and_lowers_the_voltage(void)
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

/* There is no short circuit while the lower switch of the leg is not switched on: with its upper switch on, with a
 * pulse shorter than the dead time, with an open lower switch, without supply of the drivers. A pulse of 2 us after
 * dead time is too short for a desaturation time of 3 us and is reported with one of 1 us. */
void test_the_gate_drivers_report_only_a_short_circuit_longer_than_the_desaturation_time(void)
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

/* Without desaturation detection, or with both switches of a leg shorted, 2000 A discharge 500 uF within a period. */
void test_a_short_circuit_that_is_not_blocked_discharges_the_link(void)
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

void test_a_broken_lead_has_no_current_even_with_a_shorted_switch(void)
{
    p.phase_open[0] = p.switch_shorted[UPPER_A] = 1;
    p.speed_rad_s = 150.0;
    const plant_truth_t *t = start();
    for (int k = 0; k < 300; k++) {
        plant_advance(plant, half, 0);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.0, t->i_abc_A[0]);
    }
}

/* The current after some periods with these wishes of the controller, the supply of its gates lost. */
static double complex without_supply(int imposed, const double duty[3], int gates_on)
{
    plant_destroy(plant);
    const plant_truth_t *t = start();
    plant_switch(plant, &(plant_switches_t){.contactor = 1});
    plant_params(plant)->imposed_bridge = imposed;
    plant_set_state(plant, -80.0, 60.0, 0.4, 400.0);
    for (int k = 0; k < 50; k++) {
        plant_advance(plant, duty, gates_on);
    }
    return t->i_d_A + I * t->i_q_A;
}

void test_an_imposed_state_of_the_bridge_is_that_of_a_controller_that_wants_it(void)
{
    const double lower[3] = {0.0, 0.0, 0.0}, upper[3] = {1.0, 1.0, 1.0}, other[3] = {0.3, 0.6, 0.8};
    p.switch_open[UPPER_A] = 1; /* so that the two short circuits differ */
    p.speed_rad_s = 400.0;
    double complex wanted[4];
    for (int n = 1; n < 4; n++) {
        plant_destroy(plant);
        const plant_truth_t *t = start();
        plant_set_state(plant, -80.0, 60.0, 0.4, 400.0);
        for (int k = 0; k < 50; k++) {
            plant_advance(plant, n == PLANT_BRIDGE_UPPER_ON ? upper : lower, n != PLANT_BRIDGE_OFF);
        }
        wanted[n] = t->i_d_A + I * t->i_q_A;
    }
    TEST_ASSERT_TRUE(cabs(wanted[PLANT_BRIDGE_LOWER_ON] - wanted[PLANT_BRIDGE_UPPER_ON]) > 10.0);
    for (int n = 1; n < 4; n++) {
        for (int gates_on = 0; gates_on < 2; gates_on++) {
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, cabs(without_supply(n, other, gates_on) - wanted[n]));
        }
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, cabs(without_supply(PLANT_BRIDGE_OBEYS, other, 1) - wanted[PLANT_BRIDGE_OFF]));
}

/* A fault of the drivers themselves leaves only the first of the imposed states, and only that one to a controller. */
void test_gate_drivers_that_block_leave_only_switching_disabled(void)
{
    const double other[3] = {0.3, 0.6, 0.8};
    p.speed_rad_s = 400.0;
    const double complex off = without_supply(PLANT_BRIDGE_OFF, other, 1);
    TEST_ASSERT_FALSE(reported());
    TEST_ASSERT_TRUE(cabs(without_supply(PLANT_BRIDGE_LOWER_ON, other, 1) - off) > 10.0);
    p.drivers_block = 1;
    for (int n = PLANT_BRIDGE_OFF; n <= PLANT_BRIDGE_UPPER_ON; n++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, cabs(without_supply(n, other, 1) - off));
        TEST_ASSERT_TRUE(reported());
    }
    plant_destroy(plant);
    const plant_truth_t *t = start();
    plant_set_state(plant, -80.0, 60.0, 0.4, 400.0);
    for (int k = 0; k < 50; k++) {
        plant_advance(plant, other, 1);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, cabs(t->i_d_A + I * t->i_q_A - off));
}

/* The drivers' line is active at the next sample; what enables switching at the one after that acts in the third
 * period. Until then the imposed state is the one without switching; thereafter it makes another current. */
static double complex imposed_after_a_report(int imposed, int periods)
{
    const double upper[3] = {1.0, 1.0, 1.0};
    plant_destroy(plant);
    const plant_truth_t *t = start();
    plant_switch(plant, &(plant_switches_t){.contactor = 1, .gate_supply = 1});
    plant_set_state(plant, -80.0, 60.0, 0.4, 400.0);
    plant_advance(plant, upper, 1);
    TEST_ASSERT_TRUE(reported());
    plant_params(plant)->imposed_bridge = imposed;
    for (int k = 0; k < periods; k++) {
        plant_advance(plant, half, 1);
    }
    return t->i_d_A + I * t->i_q_A;
}

void test_an_imposed_state_begins_no_earlier_than_the_fault_line_lets_a_controller_begin(void)
{
    p.speed_rad_s = 400.0;
    p.switch_shorted[LOWER_A] = 1;
    for (int periods = 1; periods < 4; periods++) {
        const double complex off = imposed_after_a_report(PLANT_BRIDGE_OFF, periods);
        const double change_A = cabs(imposed_after_a_report(PLANT_BRIDGE_LOWER_ON, periods) - off);
        TEST_ASSERT_EQUAL(periods > 2, change_A > 1.0);
        TEST_ASSERT_TRUE(periods > 2 || change_A == 0.0);
    }
}

/* The board's switches stay as they were when the state was imposed. */
void test_with_an_imposed_state_of_the_bridge_the_contactor_does_not_move(void)
{
    p.dc_link_F = 500e-6;
    p.dc_load_ohm = 100.0;
    p.imposed_bridge = PLANT_BRIDGE_OFF;
    const plant_truth_t *t = start();
    plant_switch(plant, &(plant_switches_t){.contactor = 0});
    for (int k = 0; k < 1000; k++) {
        plant_advance(plant, half, 0);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, p.vdc_V, t->vdc_V);
    plant_params(plant)->imposed_bridge = PLANT_BRIDGE_OBEYS;
    plant_switch(plant, &(plant_switches_t){.contactor = 0});
    for (int k = 0; k < 1000; k++) { /* two time constants of 50 ms */
        plant_advance(plant, half, 0);
    }
    TEST_ASSERT_TRUE(t->vdc_V < 0.5 * p.vdc_V);
}
