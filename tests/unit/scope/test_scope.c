/* SPDX-License-Identifier: Apache-2.0 */
/* The commands of the scope, and the freeze frame that a fault of the drive leaves. */
#include "scope/scope.h"

#include <string.h>

#include "late_gather.h"
#include "unity.h"

#define COMMAND(...) command((const uint8_t[]){__VA_ARGS__}, sizeof((const uint8_t[]){__VA_ARGS__}))
#define LOW(value) ((uint8_t)((value) & 0xFF))
#define HIGH(value) ((uint8_t)((value) >> 8 & 0xFF))

static drive_t drive;
static scope_t scope;
static bool ecu_fault, was_fault;

static scope_result_t command(const uint8_t *data, size_t length)
{
    return scope_command(&scope, &drive, data, (uint8_t)length);
}

/* Each period's i_q is its number, and i_d the complement. */
static void run(uint32_t periods)
{
    for (uint32_t k = 0; k < periods; k++) {
        sample_t *slot = sample_box_begin(&drive.samples);
        slot->point.i.q = (int16_t)(drive.samples.generation + 1U);
        slot->point.i.d = -(int16_t)(drive.samples.generation + 1U);
        (void)sample_box_publish(&drive.samples);
    }
}

/* The scope is told when a fault comes and when all have gone. */
static void step(void)
{
    const bool is_fault = drive.fast.faults != 0U || ecu_fault;
    const bool changed = is_fault != was_fault;
    was_fault = is_fault;
    scope_step(&scope, &drive, changed, is_fault);
    late_gather_end(); /* the hardware has copied nothing before */
}

static void run_steps(uint32_t steps)
{
    for (uint32_t k = 0; k < steps; k++) {
        run(10);
        step();
    }
}

static void set_up(capture_trigger_t trigger, uint16_t samples, uint16_t before)
{
    TEST_ASSERT_EQUAL(SCOPE_OK, COMMAND(SCOPE_SELECT, 0, CAPTURE_i_q_A));
    TEST_ASSERT_EQUAL(SCOPE_OK, COMMAND(SCOPE_SELECT, 1, CAPTURE_i_q_ref_A));
    TEST_ASSERT_EQUAL(SCOPE_OK, COMMAND(SCOPE_SETUP, 2, 1, 0, (uint8_t)trigger, CAPTURE_i_q_A));
    TEST_ASSERT_EQUAL(
        SCOPE_OK, COMMAND(SCOPE_SAMPLES, LOW(samples), HIGH(samples), LOW(before), HIGH(before), LOW(500), HIGH(500)));
}

static void arm(capture_trigger_t trigger)
{
    set_up(trigger, 40, 10);
    TEST_ASSERT_EQUAL(SCOPE_OK, COMMAND(SCOPE_ARM));
}

/* The number of the period in which the k-th sample was taken. */
static int16_t period_of(uint32_t k, uint32_t column)
{
    const capture_config_t *config = &scope.capture.config;
    return scope.memory[(scope.capture.first + k) % config->samples * config->signals + column];
}

static void expect_trigger(uint32_t period, uint16_t before)
{
    TEST_ASSERT_EQUAL(CAPTURE_DONE, scope.capture.state);
    TEST_ASSERT_EQUAL_UINT32(period, scope.capture.trigger_period);
    TEST_ASSERT_EQUAL_UINT16(before, scope.capture.before);
    for (uint32_t k = 0; k < scope.capture.taken; k++) {
        TEST_ASSERT_EQUAL_INT16((int16_t)(period - before + k), period_of(k, scope.capture.frozen));
    }
}

void setUp(void)
{
    memset(&drive, 0, sizeof drive);
    memset(&scope, 0, sizeof scope);
    ecu_fault = was_fault = false;
    late_gather_reset(GATHER);
    run(7);
}

void tearDown(void)
{
}

void test_a_capture_is_set_up_armed_triggered_and_released_by_commands(void)
{
    arm(TRIGGER_MANUAL);
    TEST_ASSERT_EQUAL(CAPTURE_ARMED, scope.capture.state);
    run_steps(5);
    TEST_ASSERT_EQUAL(SCOPE_OK, COMMAND(SCOPE_TRIGGER));
    run_steps(4);
    TEST_ASSERT_EQUAL_UINT8(0, scope.capture.frozen);
    expect_trigger(58, 10);
    TEST_ASSERT_EQUAL(SCOPE_OK, COMMAND(SCOPE_STOP));
    TEST_ASSERT_EQUAL(CAPTURE_IDLE, scope.capture.state);
}

void test_the_level_of_a_signal_triggers(void)
{
    arm(TRIGGER_RISING);
    run_steps(60);
    expect_trigger(500, 10);
}

void test_only_an_idle_scope_can_be_armed(void)
{
    arm(TRIGGER_RISING);
    const capture_t armed = scope.capture;
    TEST_ASSERT_EQUAL(SCOPE_BUSY, COMMAND(SCOPE_ARM));
    TEST_ASSERT_EQUAL_MEMORY(&armed, &scope.capture, sizeof armed);
    run_steps(60);
    TEST_ASSERT_EQUAL(SCOPE_BUSY, COMMAND(SCOPE_ARM));
    TEST_ASSERT_EQUAL(SCOPE_OK, COMMAND(SCOPE_STOP));
    TEST_ASSERT_EQUAL(SCOPE_OK, COMMAND(SCOPE_ARM));
    TEST_ASSERT_EQUAL_UINT16(2, scope.capture.number);
}

void test_what_is_set_up_does_not_touch_a_capture_under_way(void)
{
    arm(TRIGGER_RISING);
    set_up(TRIGGER_MANUAL, 20, 0);
    run_steps(60);
    TEST_ASSERT_EQUAL_UINT16(40, scope.capture.taken);
    expect_trigger(500, 10);
}

void test_nothing_is_armed_before_it_is_set_up(void)
{
    TEST_ASSERT_EQUAL(SCOPE_OUT_OF_RANGE, COMMAND(SCOPE_ARM));
    TEST_ASSERT_EQUAL(CAPTURE_IDLE, scope.capture.state);
}

static void expect_refused(scope_result_t reason, const uint8_t *data, size_t length)
{
    const scope_t before = scope;
    TEST_ASSERT_EQUAL(reason, command(data, length));
    TEST_ASSERT_EQUAL_MEMORY(&before, &scope, sizeof before);
}

#define REFUSED(reason, ...) \
    expect_refused(reason, (const uint8_t[]){__VA_ARGS__}, sizeof((const uint8_t[]){__VA_ARGS__}))

void test_what_is_out_of_range_is_refused_and_changes_nothing(void)
{
    set_up(TRIGGER_MANUAL, 40, 10);
    REFUSED(SCOPE_OUT_OF_RANGE, SCOPE_SELECT, CAPTURE_SIGNALS_MAX, 0);
    REFUSED(SCOPE_OUT_OF_RANGE, SCOPE_SELECT, 0, CAPTURE_SIGNALS);
    REFUSED(SCOPE_OUT_OF_RANGE, SCOPE_SETUP, 0, 1, 0, TRIGGER_MANUAL, 0);
    REFUSED(SCOPE_OUT_OF_RANGE, SCOPE_SETUP, CAPTURE_SIGNALS_MAX + 1, 1, 0, TRIGGER_MANUAL, 0);
    REFUSED(SCOPE_OUT_OF_RANGE, SCOPE_SETUP, 2, 0, 0, TRIGGER_MANUAL, 0);
    REFUSED(SCOPE_OUT_OF_RANGE, SCOPE_SETUP, 2, 1, 0, TRIGGERS, 0);
    REFUSED(SCOPE_OUT_OF_RANGE, SCOPE_SETUP, 2, 1, 0, TRIGGER_MANUAL, CAPTURE_SIGNALS);
    REFUSED(SCOPE_OUT_OF_RANGE, SCOPE_SAMPLES, LOW(6145), HIGH(6145), 0, 0, 0, 0);
    REFUSED(SCOPE_OUT_OF_RANGE, SCOPE_SAMPLES, 40, 0, 40, 0, 0, 0);
    REFUSED(SCOPE_OUT_OF_RANGE, SCOPE_SAMPLES, 0, 0, 0, 0, 0, 0);
}

/* Each number is allowed, but two signals of 3073 samples are not. */
void test_more_samples_than_the_memory_holds_are_refused_when_armed(void)
{
    set_up(TRIGGER_MANUAL, CAPTURE_MEMORY / 2 + 1, 10);
    REFUSED(SCOPE_OUT_OF_RANGE, SCOPE_ARM);
    set_up(TRIGGER_MANUAL, CAPTURE_MEMORY / 2, 10);
    TEST_ASSERT_EQUAL(SCOPE_OK, COMMAND(SCOPE_ARM));
}

void test_an_unknown_command_and_one_that_is_too_short_are_refused(void)
{
    REFUSED(SCOPE_UNKNOWN, 0);
    REFUSED(SCOPE_UNKNOWN, SCOPE_STOP + 1);
    REFUSED(SCOPE_TOO_SHORT, SCOPE_SELECT, 0);
    REFUSED(SCOPE_TOO_SHORT, SCOPE_SETUP, 1, 1, 0, 0);
    REFUSED(SCOPE_TOO_SHORT, SCOPE_SAMPLES, 40, 0, 10, 0, 0);
    TEST_ASSERT_EQUAL(SCOPE_TOO_SHORT, scope_command(&scope, &drive, NULL, 0));
}

void test_a_fault_leaves_a_freeze_frame_of_32_periods_on_both_sides(void)
{
    run_steps(20);
    run(4);
    drive_raise_fault(&drive, FAULT_OVER_CURRENT); /* while the sample of period 212 is made */
    run(6);
    step();
    TEST_ASSERT_EQUAL(CAPTURE_TRIGGERED, scope.capture.state);
    run_steps(4);
    TEST_ASSERT_EQUAL_UINT8(1, scope.capture.frozen);
    TEST_ASSERT_EQUAL_UINT16(64, scope.capture.taken);
    TEST_ASSERT_EQUAL_UINT8(8, scope.capture.config.signals);
    expect_trigger(212, 32);
    for (uint32_t k = 0; k < 64U; k++) {
        TEST_ASSERT_EQUAL_INT16(-(int)(180U + k), period_of(k, 0));
    }
}

void test_the_first_fault_is_the_trigger_not_those_after_it(void)
{
    run_steps(20);
    drive_raise_fault(&drive, FAULT_OVER_CURRENT);
    run(2);
    drive_raise_fault(&drive, FAULT_OVER_VOLTAGE);
    run_steps(5);
    expect_trigger(208, 32);
}

void test_a_fault_outside_the_drive_is_dated_to_its_step(void)
{
    run_steps(20);
    ecu_fault = true;
    run_steps(6);
    expect_trigger(217, 32);
}

void test_a_fault_that_a_capture_waits_for_triggers_it(void)
{
    arm(TRIGGER_FAULT);
    run_steps(20);
    run(4);
    drive_raise_fault(&drive, FAULT_OVER_CURRENT);
    run_steps(5);
    TEST_ASSERT_EQUAL_UINT8(0, scope.capture.frozen);
    expect_trigger(212, 10);
}

void test_a_capture_that_waits_for_something_else_gives_way_to_a_fault(void)
{
    arm(TRIGGER_MANUAL);
    run_steps(20);
    drive_raise_fault(&drive, FAULT_OVER_CURRENT);
    run_steps(5);
    TEST_ASSERT_EQUAL_UINT8(1, scope.capture.frozen);
    TEST_ASSERT_EQUAL_UINT16(2, scope.capture.number);
    expect_trigger(208, 32);
}

void test_a_capture_that_has_been_triggered_is_kept_at_a_fault(void)
{
    arm(TRIGGER_RISING);
    run_steps(50);
    TEST_ASSERT_EQUAL(CAPTURE_TRIGGERED, scope.capture.state);
    drive_raise_fault(&drive, FAULT_OVER_CURRENT);
    run_steps(5);
    TEST_ASSERT_EQUAL_UINT16(1, scope.capture.number);
    expect_trigger(500, 10);
    drive.fast.faults = 0;
    run_steps(1);
    TEST_ASSERT_EQUAL(CAPTURE_DONE, scope.capture.state);
}

void test_the_freeze_frame_is_released_when_the_last_fault_has_been_reset(void)
{
    run_steps(20);
    drive_raise_fault(&drive, FAULT_OVER_CURRENT);
    ecu_fault = true;
    run_steps(5);
    drive.fast.faults = 0;
    run_steps(5);
    expect_trigger(208, 32);
    ecu_fault = false;
    run_steps(1);
    TEST_ASSERT_EQUAL(CAPTURE_IDLE, scope.capture.state);
}

void test_the_next_fault_leaves_the_next_freeze_frame(void)
{
    run_steps(20);
    for (uint16_t k = 1; k <= 3U; k++) {
        const uint32_t period = drive.samples.generation + 1U;
        drive_raise_fault(&drive, FAULT_OVER_CURRENT);
        run_steps(9);
        TEST_ASSERT_EQUAL_UINT16(k, scope.capture.number);
        expect_trigger(period, 32);
        drive.fast.faults = 0;
        run_steps(1);
    }
}

void test_a_freeze_frame_must_be_released_before_a_tool_can_arm(void)
{
    set_up(TRIGGER_MANUAL, 40, 10);
    drive_raise_fault(&drive, FAULT_OVER_CURRENT);
    run_steps(5);
    TEST_ASSERT_EQUAL(SCOPE_BUSY, COMMAND(SCOPE_ARM));
    TEST_ASSERT_EQUAL(SCOPE_OK, COMMAND(SCOPE_STOP));
    TEST_ASSERT_EQUAL(SCOPE_OK, COMMAND(SCOPE_ARM));
    run_steps(5);
    TEST_ASSERT_EQUAL(CAPTURE_ARMED, scope.capture.state);
}

/* The command of a step acts in the periods up to the next one. */
void test_a_reference_stands_beside_the_periods_in_which_it_acts(void)
{
    arm(TRIGGER_RISING);
    for (int16_t n = 1; n <= 60; n++) {
        run(10); /* 8 to 17 before the first step, and so on */
        drive.task.i_ref.q = n;
        step();
    }
    expect_trigger(500, 10);
    for (uint32_t k = 0; k < 40U; k++) {
        TEST_ASSERT_EQUAL_INT16((period_of(k, 0) - 8) / 10, period_of(k, 1));
    }
}
