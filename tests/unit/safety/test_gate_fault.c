/* SPDX-License-Identifier: Apache-2.0 */
/* The safe state after a gate-driver fault, and the detection of a shorted switch, against hand calculations. */
#include "safety/gate_fault.h"

#include "unity.h"

#define V_DC 21845 /* 350 V of 525 V */

/* i_alive is 0.06; 1.5 sqrt(3) psi_b is 0.66 V_b T, about that of hsm1. */
static const gate_fault_config_t config = {.i_alive = 1966, .volt_steps = 21679};
static gate_fault_state_t state;
static gate_fault_in_t in;

void setUp(void)
{
    state = (gate_fault_state_t){0};
    in = (gate_fault_in_t){.v_dc = V_DC, .currents_valid = true};
}

void tearDown(void)
{
}

static bool steps(int count)
{
    bool short_circuit = false;
    for (int k = 0; k < count; k++) {
        short_circuit = gate_fault_step(&config, &state, &in);
    }
    return short_circuit;
}

static bool at(int line_emf)
{
    in.line_emf = (q15_t)line_emf;
    return steps(1);
}

void test_above_an_eighth_of_the_dc_voltage_a_gate_fault_needs_the_short_circuit(void)
{
    TEST_ASSERT_FALSE(at(V_DC / 8));
    TEST_ASSERT_TRUE(at(V_DC / 8 + 1));
    TEST_ASSERT_TRUE(at(V_DC / 16 + 1));
    TEST_ASSERT_FALSE(at(V_DC / 16));
    TEST_ASSERT_FALSE(at(V_DC / 8));
}

/* The dc voltage opposes 0.667 V_b T per step without back-EMF, and 0.167 with a back-EMF of 0.5 V_b: 4 steps. */
void test_a_current_that_outlasts_the_flux_of_the_windings_is_a_shorted_switch(void)
{
    in.i_magnitude = 8000;
    (void)steps(1);
    TEST_ASSERT_TRUE(state.switch_shorted);
    setUp();
    in.i_magnitude = 8000;
    in.line_emf = 16384;
    (void)steps(3);
    TEST_ASSERT_FALSE(state.switch_shorted);
    (void)steps(1);
    TEST_ASSERT_TRUE(state.switch_shorted);
}

/* Zeros of two sensors that are wrong against each other have no sum. What may be theirs, up to 4 i_alive, shows a
 * shorted switch only if the drivers have reported one. */
void test_zeros_that_are_wrong_against_each_other_are_no_shorted_switch(void)
{
    in.i_magnitude = 4 * 1966;
    (void)steps(30000);
    TEST_ASSERT_FALSE(state.switch_shorted);
    in.i_magnitude++;
    (void)steps(1);
    TEST_ASSERT_TRUE(state.switch_shorted);
    in.i_magnitude = 2000; /* not latched yet */
    (void)steps(1);
    TEST_ASSERT_TRUE(state.switch_shorted);
    in.i_magnitude = 1966;
    (void)steps(1);
    TEST_ASSERT_FALSE(state.switch_shorted);
    in.i_magnitude = 2000;
    (void)steps(30000);
    TEST_ASSERT_FALSE(state.switch_shorted);
    in.latched = true;
    (void)steps(1);
    TEST_ASSERT_TRUE(state.switch_shorted);
}

void test_other_causes_of_a_current_are_no_shorted_switch(void)
{
    const gate_fault_in_t not_found[] = {
        {.v_dc = V_DC, .currents_valid = true, .i_magnitude = 1966},                    /* no current */
        {.v_dc = V_DC, .currents_valid = true, .i_magnitude = 9000, .gates = true},     /* the bridge conducts */
        {.v_dc = V_DC, .currents_valid = false, .i_magnitude = 9000},                   /* the sensors are wrong */
        {.v_dc = V_DC, .currents_valid = true, .i_magnitude = 9000, .rectifies = true}, /* the diodes conduct */
        {.v_dc = 9000, .line_emf = 9000, .currents_valid = true, .i_magnitude = 12728}, /* the dc voltage is too low */
        {.v_dc = -50, .line_emf = 0, .currents_valid = true, .i_magnitude = 12728},
    };
    for (unsigned n = 0; n < sizeof not_found / sizeof not_found[0]; n++) {
        setUp();
        in = not_found[n];
        (void)steps(30000);
        TEST_ASSERT_FALSE(state.switch_shorted);
    }
}

/* An offset of one sensor makes a vector of twice the mean of the phases. 2000 on top of it are a current. */
void test_the_offset_of_a_current_sensor_is_no_shorted_switch(void)
{
    in.i_magnitude = 3000;
    in.zero = 1500;
    (void)steps(1000);
    TEST_ASSERT_FALSE(state.switch_shorted);
    in.i_magnitude = 5000;
    in.latched = true;
    (void)steps(1);
    TEST_ASSERT_TRUE(state.switch_shorted);
}

void test_a_gap_in_the_current_restarts_the_sum(void)
{
    in.line_emf = 10923; /* 0.333 V_b T per step: 2 steps suffice */
    for (int k = 0; k < 100; k++) {
        in.i_magnitude = k % 2 == 0 ? 9000 : 0;
        (void)steps(1);
        TEST_ASSERT_FALSE(state.switch_shorted);
    }
    in.i_magnitude = 9000;
    (void)steps(2);
    TEST_ASSERT_TRUE(state.switch_shorted);
    setUp();
    (void)steps(1);
    in.i_magnitude = 9000;
    in.line_emf = (q15_t)(V_DC - (config.volt_steps - 1) / 2); /* 2 steps are one count short of the sum */
    (void)steps(2);
    TEST_ASSERT_FALSE(state.switch_shorted);
    (void)steps(1);
    TEST_ASSERT_TRUE(state.switch_shorted);
}

/* A shorted switch that has been found needs the short circuit at any speed as long as the gate fault is latched, with
 * and without the current of the short circuit. */
void test_a_shorted_switch_needs_the_short_circuit_until_the_fault_is_reset(void)
{
    in.i_magnitude = 9000;
    TEST_ASSERT_TRUE(steps(2));
    in.latched = in.gates = true;
    TEST_ASSERT_TRUE(steps(1000));
    in.i_magnitude = 0;
    TEST_ASSERT_TRUE(steps(1000));
    in.latched = false;
    TEST_ASSERT_FALSE(steps(1));
}

void test_without_a_gate_fault_the_supply_is_not_held(void)
{
    in.line_emf = 20000;
    (void)steps(1);
    TEST_ASSERT_FALSE(state.holds_supply);
}

/* While the machine turns, the supply is held until 50 steps have passed without a current. It is released at once when
 * the back-EMF is at most 1/64 of the dc voltage. */
void test_with_a_gate_fault_the_supply_is_held_until_no_switch_is_shorted_or_the_machine_is_at_rest(void)
{
    in.latched = true;
    in.line_emf = V_DC / 64 + 1;
    (void)steps(49);
    TEST_ASSERT_TRUE(state.holds_supply);
    (void)steps(1);
    TEST_ASSERT_FALSE(state.holds_supply);
    in.i_magnitude = 9000;
    (void)steps(1);
    TEST_ASSERT_TRUE(state.holds_supply);
    in.i_magnitude = config.i_alive; /* no current, and all 50 steps again */
    (void)steps(49);
    TEST_ASSERT_TRUE(state.holds_supply);
    (void)steps(1);
    TEST_ASSERT_FALSE(state.holds_supply);
    in.i_magnitude = 9000;
    (void)steps(1);
    TEST_ASSERT_TRUE(state.holds_supply);
    in.line_emf = V_DC / 64;
    (void)steps(1);
    TEST_ASSERT_FALSE(state.holds_supply);
    setUp();
    in.latched = in.gates = true; /* during the short circuit a shorted switch cannot be excluded */
    in.line_emf = 1000;
    (void)steps(1000);
    TEST_ASSERT_TRUE(state.holds_supply);
    in.v_dc = 0;
    in.line_emf = 17;
    (void)steps(1);
    TEST_ASSERT_TRUE(state.holds_supply);
    in.line_emf = 16;
    (void)steps(1);
    TEST_ASSERT_FALSE(state.holds_supply);
}

void test_a_shorted_switch_holds_the_supply_however_long_no_current_flows(void)
{
    in.i_magnitude = 9000;
    (void)steps(2);
    in.latched = true;
    in.i_magnitude = 0;
    in.line_emf = 1000;
    (void)steps(1000);
    TEST_ASSERT_TRUE(state.holds_supply);
}

/* What may be the offset of a sensor is no shorted switch, but it may as well be a current. */
void test_an_offset_delays_the_release_of_the_supply(void)
{
    in.latched = true;
    in.line_emf = 1000;
    in.i_magnitude = 3000;
    in.zero = 1500;
    (void)steps(1000);
    TEST_ASSERT_FALSE(state.switch_shorted);
    TEST_ASSERT_TRUE(state.holds_supply);
}

/* A converter that measures nothing says nothing about the current. */
void test_the_supply_is_held_while_the_currents_are_not_valid(void)
{
    in.latched = true;
    in.line_emf = V_DC / 4;
    in.currents_valid = false;
    (void)steps(250);
    TEST_ASSERT_TRUE(state.holds_supply);
    in.currents_valid = true;
    (void)steps(250);
    TEST_ASSERT_FALSE(state.holds_supply);
}
