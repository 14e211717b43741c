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

static void until_stage(uint8_t stage)
{
    while (state.stage < stage) {
        step();
    }
}

/* On, off, on, off by the watchdog, on: what has worked once must work again. */
void test_the_supply_is_switched_off_by_its_switch_then_by_the_watchdog_and_returns_each_time(void)
{
    static const struct {
        bool supply_on, wrong;
    } wanted[] = {{true, false}, {false, false}, {true, false}, {true, true}, {true, false}};
    step();
    for (uint8_t stage = 0; stage < 5U; stage++) {
        TEST_ASSERT_EQUAL_UINT8(stage, state.stage);
        TEST_ASSERT_EQUAL(wanted[stage].supply_on, state.supply_on);
        TEST_ASSERT_EQUAL(wanted[stage].wrong, state.wrong);
        while (state.stage == stage) {
            step();
        }
    }
    TEST_ASSERT_TRUE(state.tested);
    TEST_ASSERT_FALSE(state.supply_on || state.wrong);
}

/* The third stage switches it on by its switch, the fifth after the watchdog's cut. */
void test_a_supply_that_does_not_return_is_a_fault_of_what_has_switched_it_off(void)
{
    static const struct {
        uint8_t stage;
        uint16_t fault;
    } cases[] = {{2, ECU_FAULT_GATE_SUPPLY}, {4, ECU_FAULT_WATCHDOG}};
    for (unsigned n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        setUp();
        until_stage(cases[n].stage);
        switch_open = true;
        in.supply = false;
        steps(30);
        TEST_ASSERT_FALSE(state.tested);
        TEST_ASSERT_EQUAL_HEX16(cases[n].fault, state.faults);
    }
}

/* A supply from before the test is no answer to the switch: that can be seen in the next step at the earliest. */
void test_no_stage_ends_in_the_step_in_which_it_begins(void)
{
    in.supply = true;
    shut_off_step(&state, &in);
    TEST_ASSERT_EQUAL_UINT8(0, state.stage);
    shut_off_step(&state, &in);
    TEST_ASSERT_EQUAL_UINT8(1, state.stage);
    in.supply = false;
    shut_off_step(&state, &in);
    TEST_ASSERT_EQUAL_UINT8(1, state.stage);
}

/* Each stage has its own time: 10 ms until the supply is there, 20 ms until it is gone. */
static uint16_t fault_of_stage_that_takes(uint8_t stage, uint32_t us)
{
    setUp();
    until_stage(stage);
    in.supply = !state.supply_on;
    in.elapsed_us = us / 2U;
    shut_off_step(&state, &in);
    in.elapsed_us = us - us / 2U;
    shut_off_step(&state, &in);
    return state.faults;
}

void test_each_stage_may_take_its_whole_time_and_no_more(void)
{
    TEST_ASSERT_EQUAL_HEX16(0, fault_of_stage_that_takes(1, 20000));
    TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_GATE_SUPPLY, fault_of_stage_that_takes(1, 20001));
    TEST_ASSERT_EQUAL_HEX16(0, fault_of_stage_that_takes(2, 10000));
    TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_GATE_SUPPLY, fault_of_stage_that_takes(2, 10001));
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

void test_a_supply_that_is_not_wanted_may_be_absent_and_one_that_is_wanted_for_10_ms(void)
{
    steps(20);
    steps(100);
    TEST_ASSERT_EQUAL_HEX16(0, state.faults);
    in.wanted = true;
    in.supply = false;
    in.elapsed_us = 10000;
    shut_off_step(&state, &in);
    TEST_ASSERT_EQUAL_HEX16(0, state.faults);
    in.elapsed_us = 1;
    shut_off_step(&state, &in);
    TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_GATE_SUPPLY, state.faults);
    in.elapsed_us = UINT32_MAX - 5000U; /* more than an hour: the sum of both times would have wrapped */
    for (int n = 0; n < 3; n++) {
        shut_off_step(&state, &in);
        TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_GATE_SUPPLY, state.faults);
    }
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
