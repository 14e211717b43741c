/* SPDX-License-Identifier: Apache-2.0 */
#include "ecu/shut_off.h"
#include "ecu/supervisor.h"
#include "unity.h"

static shut_off_t state;
static shut_off_in_t in;
static bool switch_stuck, switch_open, watchdog_stuck, watchdog_open;
static bool cut; /* by the watchdog */

void setUp(void)
{
    state = (shut_off_t){0};
    in = (shut_off_in_t){.fitted = true, .idle = true, .elapsed_us = 1000};
    switch_stuck = switch_open = watchdog_stuck = watchdog_open = cut = false;
}

void tearDown(void)
{
}

/* One step with a board that follows within it. */
static void step(void)
{
    shut_off_step(&state, &in);
    cut = watchdog_open || (state.wrong && !watchdog_stuck);
    const bool on = (state.supply_on || in.wanted || switch_stuck) && !switch_open;
    in.supply = on && !cut;
}

static void steps(int count)
{
    for (int n = 0; n < count; n++) {
        step();
    }
}

void test_a_board_whose_paths_work_passes_within_20_ms_and_ends_without_supply(void)
{
    bool with_supply = false, with_wrong = false;
    for (int n = 0; n < 20; n++) {
        step();
        TEST_ASSERT_EQUAL_HEX16(0, state.faults);
        with_supply = with_supply || in.supply;
        with_wrong = with_wrong || state.wrong;
    }
    TEST_ASSERT_TRUE(state.tested && with_supply && with_wrong);
    TEST_ASSERT_FALSE(state.supply_on || state.wrong || in.supply);
}

void test_without_a_watchdog_nothing_is_tested(void)
{
    in.fitted = false;
    step();
    TEST_ASSERT_TRUE(state.tested);
    in.wanted = true;
    switch_open = true;
    steps(100);
    TEST_ASSERT_EQUAL_HEX16(0, state.faults);
}

static void fails_with(uint16_t fault)
{
    steps(30);
    TEST_ASSERT_FALSE(state.tested || state.supply_on || state.wrong);
    TEST_ASSERT_EQUAL_HEX16(fault, state.faults);
    switch_stuck = switch_open = watchdog_stuck = watchdog_open = in.switching = false;
    steps(100);
    TEST_ASSERT_EQUAL_HEX16(fault, state.faults); /* until the next start */
    TEST_ASSERT_FALSE(state.tested);
}

void test_a_watchdog_that_falls_silent_does_not_end_the_test(void)
{
    while (state.stage == 0U) {
        step();
    }
    in.fitted = false;
    watchdog_stuck = true;
    steps(100);
    TEST_ASSERT_FALSE(state.tested);
    TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_WATCHDOG, state.faults);
}

void test_a_test_that_has_failed_stays_failed_without_a_watchdog(void)
{
    in.switching = true;
    steps(2);
    TEST_ASSERT_EQUAL_UINT8(0, state.stage);
    in.fitted = false;
    steps(10);
    TEST_ASSERT_FALSE(state.tested);
    TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_GATE_DISABLE, state.faults);
}

void test_a_supply_that_comes_later_than_the_drive_would_wait_is_a_fault(void)
{
    for (int n = 0; n < 15; n++) {
        shut_off_step(&state, &in);
    }
    TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_GATE_SUPPLY, state.faults);
}

void test_a_supply_that_does_not_come_is_a_fault_of_the_supply(void)
{
    switch_open = true;
    fails_with(ECU_FAULT_GATE_SUPPLY);
    setUp();
    watchdog_open = true;
    fails_with(ECU_FAULT_GATE_SUPPLY);
}

void test_a_supply_that_does_not_stop_is_a_fault_of_the_supply(void)
{
    switch_stuck = true;
    fails_with(ECU_FAULT_GATE_SUPPLY);
}

void test_a_watchdog_that_does_not_switch_off_is_a_fault_of_the_watchdog(void)
{
    watchdog_stuck = true;
    fails_with(ECU_FAULT_WATCHDOG);
}

void test_switching_that_reads_back_as_enabled_is_a_fault_of_its_own(void)
{
    in.switching = true;
    fails_with(ECU_FAULT_GATE_DISABLE);
}

void test_the_test_waits_while_the_contactor_is_closed_or_the_link_is_charged(void)
{
    in.idle = false;
    steps(100);
    TEST_ASSERT_FALSE(state.tested || state.supply_on);
    in.idle = true;
    steps(20);
    TEST_ASSERT_TRUE(state.tested);
}

/* Steps are 1 ms; up to 10 ms the supply may be absent, for example while it comes. */
void test_a_supply_that_is_wanted_and_absent_for_more_than_10_ms_is_a_fault(void)
{
    steps(20);
    in.wanted = true;
    steps(100);
    TEST_ASSERT_EQUAL_HEX16(0, state.faults);
    switch_open = true;
    in.supply = false;
    steps(10);
    TEST_ASSERT_EQUAL_HEX16(0, state.faults);
    step();
    TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_GATE_SUPPLY, state.faults);
    steps(100);
    TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_GATE_SUPPLY, state.faults);
    switch_open = false;
    steps(2);
    TEST_ASSERT_EQUAL_HEX16(0, state.faults); /* the state machine has latched it */
}
