/* SPDX-License-Identifier: Apache-2.0 */
/* The capacitor between battery and bridge against closed forms, and the gates without their supply. */
#include "plant_bench.h"

#include <math.h>

#include "unity.h"

#define V_BAT 350.0
#define FARAD 500e-6

static const double half[3] = {0.5, 0.5, 0.5};
static plant_params_t p;
static plant_t *plant;
static double avalanche_J;

void setUp(void)
{
    p = bench_params();
    p.vdc_V = V_BAT;
    p.dc_link_F = FARAD;
    plant = NULL;
    avalanche_J = 0.0;
}

void tearDown(void)
{
    plant_destroy(plant);
}

static const plant_truth_t *start(plant_switches_t on)
{
    plant = plant_create(&p, NULL);
    TEST_ASSERT_NOT_NULL(plant);
    plant_switch(plant, &on);
    return plant_truth(plant);
}

static void run(double seconds, int gates_on)
{
    for (long k = lround(seconds * p.pwm_hz); k > 0; k--) {
        plant_advance(plant, half, gates_on);
    }
}

void test_precharge_is_an_exponential(void)
{
    p.vdc_start_V = 10.0;
    const plant_truth_t *t = start((plant_switches_t){.precharge = 1});
    run(p.precharge_s, 0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, V_BAT + (10.0 - V_BAT) * exp(-1.0), t->vdc_V);
    run(10.0 * p.precharge_s, 0);
    TEST_ASSERT_DOUBLE_WITHIN(0.02, V_BAT, t->vdc_V);
}

void test_discharge_is_an_exponential_down_to_the_lowest_voltage(void)
{
    p.vdc_start_V = V_BAT;
    const plant_truth_t *t = start((plant_switches_t){.discharge = 1});
    run(p.discharge_s, 0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, V_BAT * exp(-1.0), t->vdc_V);
    run(2.0, 0);
    TEST_ASSERT_EQUAL_DOUBLE(1.0, t->vdc_V);
}

/* Both resistors at the same time: v -> V tau_dis/(tau_pre + tau_dis), with 1/tau = 1/tau_pre + 1/tau_dis. */
void test_precharge_and_discharge_together_are_a_divider(void)
{
    const plant_truth_t *t = start((plant_switches_t){.precharge = 1, .discharge = 1});
    run(1.0, 0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, V_BAT * 0.1 / 0.12, t->vdc_V);
}

/* The resistors of precharge and load: v -> V R_load/(R_pre + R_load), with tau = (R_pre || R_load) C. */
void test_a_load_across_the_capacitor_leaves_the_precharge_below_the_battery(void)
{
    const double pre_ohm = p.precharge_s / FARAD;
    p.vdc_start_V = 10.0;
    p.dc_load_ohm = 4.0 * pre_ohm;
    const plant_truth_t *t = start((plant_switches_t){.precharge = 1});
    run(0.8 * p.precharge_s, 0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.8 * V_BAT + (10.0 - 0.8 * V_BAT) * exp(-1.0), t->vdc_V);
    run(1.0, 0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.8 * V_BAT, t->vdc_V);
    plant_params(plant)->dc_load_ohm = 1e-3;
    run(0.1, 0);
    TEST_ASSERT_EQUAL_DOUBLE(1.0, t->vdc_V); /* the lowest that there is */
}

void test_the_contactor_connects_the_link_to_the_battery_unless_it_fails_to_close(void)
{
    const plant_truth_t *t = start((plant_switches_t){.contactor = 1});
    run(1e-4, 0);
    TEST_ASSERT_EQUAL_DOUBLE(V_BAT, t->vdc_V);
    plant_switch(plant, &(plant_switches_t){0});
    plant_params(plant)->vdc_V = 100.0;
    run(0.1, 0);
    TEST_ASSERT_EQUAL_DOUBLE(V_BAT, t->vdc_V); /* the capacitor keeps its voltage */
    plant_params(plant)->contactor_open = 1;
    plant_switch(plant, &(plant_switches_t){.contactor = 1});
    run(0.1, 0);
    TEST_ASSERT_EQUAL_DOUBLE(V_BAT, t->vdc_V);
    plant_params(plant)->contactor_open = 0;
    run(1e-4, 0);
    TEST_ASSERT_EQUAL_DOUBLE(100.0, t->vdc_V);
}

void test_resistors_whose_switch_does_not_close_do_nothing(void)
{
    p.vdc_start_V = 123.0;
    p.precharge_open = p.discharge_open = 1;
    const plant_truth_t *t = start((plant_switches_t){.precharge = 1, .discharge = 1});
    run(1.0, 0);
    TEST_ASSERT_EQUAL_DOUBLE(123.0, t->vdc_V);
}

void test_without_a_capacitor_the_bridge_is_always_connected_to_the_battery(void)
{
    p.dc_link_F = 0.0;
    const plant_truth_t *t = start((plant_switches_t){0});
    run(1e-3, 0);
    TEST_ASSERT_EQUAL_DOUBLE(V_BAT, t->vdc_V);
}

/* 1 A for 10 ms changes the voltage of 500 uF by 20 V. */
void test_the_bridge_current_charges_and_discharges_the_capacitor(void)
{
    const plant_switches_t none = {0};
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 280.0, dc_link_step(&p, &none, 300.0, V_BAT, 1.0, 0.01, &avalanche_J));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 320.0, dc_link_step(&p, &none, 300.0, V_BAT, -1.0, 0.01, &avalanche_J));
    TEST_ASSERT_EQUAL_DOUBLE(1.0, dc_link_step(&p, &none, 300.0, V_BAT, 1.0, 1.0, &avalanche_J));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, avalanche_J);
}

/* At standstill with i_d = 200 A the energy of 3/4 L I^2 = 6 J flows through the diodes into the capacitor, minus the
 * copper loss. The legs use the voltage at the start of a substep, on average half a step of 0.2 V too low: 0.03 % of
 * the energy, 0.01 V. */
void test_the_energy_of_the_windings_charges_the_capacitor(void)
{
    p.vdc_start_V = V_BAT;
    p.substeps = 200;
    const plant_truth_t *t = start((plant_switches_t){0});
    plant_set_state(plant, 200.0, 0.0, 0.0, 0.0);
    run(2e-3, 0);
    const double joule = 6.0 - t->e_copper_J;
    TEST_ASSERT_DOUBLE_WITHIN(0.02, sqrt(V_BAT * V_BAT + 2.0 * joule / FARAD), t->vdc_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.0, t->i_d_A);
}

void test_above_the_avalanche_voltage_the_semiconductors_dissipate_the_energy(void)
{
    p.vdc_start_V = V_BAT;
    p.avalanche_V = 360.0;
    p.substeps = 200;
    const plant_truth_t *t = start((plant_switches_t){0});
    plant_set_state(plant, 200.0, 0.0, 0.0, 0.0);
    run(2e-3, 0);
    const double stored_J = 0.5 * FARAD * (360.0 * 360.0 - V_BAT * V_BAT);
    TEST_ASSERT_EQUAL_DOUBLE(360.0, t->vdc_V);
    TEST_ASSERT_DOUBLE_WITHIN(0.003, 6.0 - t->e_copper_J - stored_J, t->e_avalanche_J);
}

/* The diodes charge the capacitor up to the peak of the line voltage, sqrt(3) w psi_f. It is so large that the
 * inductance of the windings does not charge it above the peak; it approaches the peak slowly from below. */
void test_a_turning_machine_charges_the_link_to_its_line_voltage(void)
{
    p.dc_link_F = 5e-3;
    p.vdc_start_V = 300.0;
    p.speed_rad_s = 1000.0;
    const double peak_V = sqrt(3.0) * 3.0 * 1000.0 * 0.084;
    const plant_truth_t *t = start((plant_switches_t){.gate_supply = 1});
    run(2.0, 0);
    TEST_ASSERT_DOUBLE_WITHIN(0.01 * peak_V, peak_V, t->vdc_V);
    TEST_ASSERT_TRUE(t->e_dc_J < 0.0);
}

/* The duties short-circuit the windings: with gate supply no current reaches the link; without it the diodes rectify as
 * with switching disabled. */
void test_gates_without_supply_do_not_switch(void)
{
    static const double short_circuit[3] = {0.0, 0.0, 0.0};
    p.vdc_start_V = 300.0;
    p.speed_rad_s = 1000.0;
    const plant_truth_t *t = start((plant_switches_t){.gate_supply = 1});
    for (int k = 0; k < 500; k++) {
        plant_advance(plant, short_circuit, 1);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 300.0, t->vdc_V);
    plant_switch(plant, &(plant_switches_t){0});
    for (int k = 0; k < 500; k++) {
        plant_advance(plant, short_circuit, 1);
    }
    TEST_ASSERT_TRUE(t->vdc_V > 436.0);
}

/* The board's own path needs no gate supply of the processor's; it holds until its request ends. */
void test_the_hardware_s_safe_state_stops_the_rise_and_holds_while_it_is_requested(void)
{
    p.vdc_start_V = 300.0;
    p.speed_rad_s = 1000.0;
    p.hardware_safe_V = 350.0;
    const plant_truth_t *t = start((plant_switches_t){.hardware_safe = 1});
    run(0.1, 0);
    const double held_V = t->vdc_V;
    TEST_ASSERT_TRUE(held_V > 350.0 && held_V < 400.0);
    run(0.1, 0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, held_V, t->vdc_V);
    plant_switch(plant, &(plant_switches_t){0});
    run(0.1, 0);
    TEST_ASSERT_TRUE(t->vdc_V > 430.0);
}

void test_without_a_request_the_hardware_does_nothing(void)
{
    p.vdc_start_V = 300.0;
    p.speed_rad_s = 1000.0;
    p.hardware_safe_V = 350.0;
    const plant_truth_t *t = start((plant_switches_t){0});
    run(0.1, 0);
    TEST_ASSERT_TRUE(t->vdc_V > 400.0);
}
