/* SPDX-License-Identifier: Apache-2.0 */
/* The 1 kHz task's part of the voltage pulses: which requests it accepts, and what ends them. */
#include "drive/mrai/mrai_seam.h"
#include "hal/mock_adc.h"
#include "hal/mock_angle.h"
#include "hal/mock_irq.h"
#include "hal/mock_pwm.h"
#include "hal/mock_temperature.h"
#include "seam.h"
#include "unity.h"

static snapshot_t snapshot;
static pulses_config_t *const wanted = &drive.request.pulses.config;

/* A drive that runs at standstill without a request, pulses in the middle of all ranges, and the consent to them. */
void setUp(void)
{
    const int32_t half = motor.commission.i_max / 2;
    seam_start();
    snapshot = (snapshot_t){.psi_d_error = 0};
    drive.task.run_state = RUN_STATE_RUN;
    drive.request.pulses_agreed = true;
    *wanted = (pulses_config_t){.d = {.v = 1000, .low = -half, .high = half},
                                .q = {.v = 1000, .low = -half, .high = half},
                                .first = 23170,
                                .angle_max = 0x10000000U,
                                .reversals = 4,
                                .periods_max = 100};
}

void tearDown(void)
{
}

static void ask(void)
{
    drive.request.pulses.starts++;
    drive_pulse(&drive, &snapshot);
}

static void accepted(void)
{
    ask();
    TEST_ASSERT_EQUAL_INT(PULSES_PULSE, drive.task.pulsing.phase);
    TEST_ASSERT_EQUAL_INT(PULSES_GOOD, drive.task.pulsing.failure);
    TEST_ASSERT_EQUAL_INT32(wanted->d.v, drive.pulses.d.v);
    setUp();
}

static void refused(void)
{
    const uint16_t number = drive.pulses.number;
    ask();
    TEST_ASSERT_EQUAL_INT(PULSES_FAILED, drive.task.pulsing.phase);
    TEST_ASSERT_EQUAL_INT(PULSES_REFUSED, drive.task.pulsing.failure);
    TEST_ASSERT_EQUAL_UINT16(number, drive.pulses.number);
    setUp();
}

/* 0.7 of the voltage, i_max, an eighth of a turn, 20000 periods. */
void test_the_ends_of_all_ranges_are_accepted_together(void)
{
    const int32_t i_max = motor.commission.i_max;
    wanted->d = (pulses_axis_config_t){.v = 22938, .low = -i_max, .high = i_max};
    wanted->q = (pulses_axis_config_t){.v = 0, .low = i_max - 1, .high = i_max};
    wanted->first = 0;
    wanted->angle_max = 0x20000000U;
    wanted->reversals = 1;
    wanted->periods_max = 20000;
    accepted();
}

void test_an_axis_beyond_its_range_is_refused(void)
{
    pulses_axis_config_t *const axes[] = {&wanted->d, &wanted->q};
    for (unsigned k = 0; k < 2; k++) {
        axes[k]->v = -1;
        refused();
        axes[k]->v = 22939;
        refused();
        axes[k]->low = axes[k]->high;
        refused();
        axes[k]->low = -motor.commission.i_max - 1;
        refused();
        axes[k]->high = motor.commission.i_max + 1;
        refused();
        accepted();
    }
}

void test_each_other_value_beyond_its_range_is_refused(void)
{
    wanted->d.v = wanted->q.v = 0; /* nothing would happen */
    refused();
    wanted->first = -1;
    refused();
    wanted->angle_max = 0x20000001U;
    refused();
    wanted->reversals = 0;
    refused();
    wanted->periods_max = 20001;
    refused();
}

void test_pulses_need_a_drive_that_runs_at_standstill_with_nothing_else_to_do(void)
{
    drive.task.run_state = RUN_STATE_OFF;
    refused();
    snapshot.mrai_is_chosen = true;
    refused();
    drive.task.commission.phase = COMMISSION_SETTLE;
    refused();
    drive.task.commission.phase = COMMISSION_MEASURE;
    refused();
    drive.request.torque_arbitrated = 1;
    refused();
    snapshot.sample.point.omega = motor.commission.omega_max + 1;
    refused();
    snapshot.sample.point.omega = -motor.commission.omega_max;
    accepted();
}

void test_in_current_mode_pulses_need_both_requested_currents_to_be_zero(void)
{
    drive.request.i_ref = (dq_q15_t){1, 1}; /* of no account in the other mode */
    accepted();
    drive.request.current_mode = true;
    accepted();
    drive.request.current_mode = true;
    drive.request.i_ref.d = 1;
    refused();
    drive.request.current_mode = true;
    drive.request.i_ref.q = -1;
    refused();
}

static void ended_with(pulses_failure_t failure)
{
    TEST_ASSERT_EQUAL_INT(PULSES_FAILED, drive.task.pulsing.phase);
    TEST_ASSERT_EQUAL_INT(failure, drive.task.pulsing.failure);
    TEST_ASSERT_EQUAL_INT(BRIDGE_CONTROL, drive_bridge_mode(&drive, true));
}

/* Whatever else speaks against the start, the missing consent is the reason. */
void test_without_a_consent_a_start_is_refused_for_a_reason_of_its_own(void)
{
    for (int beside = 0; beside < 2; beside++) {
        setUp();
        drive.request.pulses_agreed = false;
        drive.task.run_state = beside ? RUN_STATE_OFF : RUN_STATE_RUN;
        ask();
        ended_with(PULSES_NO_CONSENT);
        TEST_ASSERT_EQUAL_UINT16(0, drive.pulses.number);
    }
}

void test_a_refused_start_is_not_made_up_for_when_the_consent_comes(void)
{
    drive.request.pulses_agreed = false;
    ask();
    drive.request.pulses_agreed = true;
    drive_pulse(&drive, &snapshot);
    ended_with(PULSES_NO_CONSENT);
}

void test_the_end_of_the_consent_ends_pulses_in_the_same_step(void)
{
    ask();
    drive.request.pulses_agreed = false;
    drive_pulse(&drive, &snapshot);
    ended_with(PULSES_NO_CONSENT);
}

/* A start in every step, as from a tool that repeats its command. */
void test_further_starts_do_not_delay_the_end_of_pulses(void)
{
    for (int by_consent = 0; by_consent < 2; by_consent++) {
        setUp();
        ask();
        drive.request.pulses_agreed = by_consent == 0;
        drive.task.run_state = by_consent ? RUN_STATE_RUN : RUN_STATE_OFF;
        ask();
        ended_with(by_consent ? PULSES_NO_CONSENT : PULSES_STOPPED);
    }
}

/* A lost command ends the run and the consent at the same time. */
void test_with_the_run_the_consent_is_not_the_reason(void)
{
    ask();
    drive.request.pulses_agreed = false;
    drive.task.run_state = RUN_STATE_OFF;
    drive_pulse(&drive, &snapshot);
    ended_with(PULSES_STOPPED);
}

void test_pulses_that_run_go_on_when_others_are_asked_for(void)
{
    ask();
    const uint16_t number = drive.pulses.number;
    wanted->reversals = 9;
    ask();
    TEST_ASSERT_EQUAL_INT(PULSES_PULSE, drive.task.pulsing.phase);
    TEST_ASSERT_EQUAL_UINT16(number, drive.pulses.number);
    TEST_ASSERT_EQUAL_UINT16(4, drive.pulses.reversals);
}

void test_the_end_of_the_run_and_a_request_stop_pulses(void)
{
    for (int by_request = 0; by_request < 2; by_request++) {
        setUp();
        ask();
        drive.request.torque_arbitrated = (q15_t)by_request;
        drive.task.run_state = by_request ? RUN_STATE_RUN : RUN_STATE_OFF;
        drive_pulse(&drive, &snapshot);
        TEST_ASSERT_EQUAL_INT(PULSES_FAILED, drive.task.pulsing.phase);
        TEST_ASSERT_EQUAL_INT(PULSES_STOPPED, drive.task.pulsing.failure);
    }
}

/* The fast ISR's state belongs to the pulses before until it has begun these. */
void test_pulses_end_when_the_fast_isr_has_ended_these(void)
{
    ask();
    drive.pulses_state = (pulses_state_t){.phase = PULSES_DONE, .number = (uint16_t)(drive.pulses.number - 1U)};
    drive_pulse(&drive, &snapshot);
    TEST_ASSERT_EQUAL_INT(PULSES_PULSE, drive.task.pulsing.phase);
    drive.pulses_state.number = drive.pulses.number;
    for (pulses_phase_t phase = PULSES_PULSE; phase <= PULSES_BACK; phase++) {
        drive.pulses_state.phase = phase;
        drive_pulse(&drive, &snapshot);
        TEST_ASSERT_EQUAL_INT(PULSES_PULSE, drive.task.pulsing.phase);
    }
    drive.pulses_state.phase = PULSES_DONE;
    drive_pulse(&drive, &snapshot);
    TEST_ASSERT_EQUAL_INT(PULSES_DONE, drive.task.pulsing.phase);
    TEST_ASSERT_EQUAL_INT(PULSES_GOOD, drive.task.pulsing.failure);
}

void test_the_failure_of_the_fast_isr_is_passed_on(void)
{
    ask();
    drive.pulses_state =
        (pulses_state_t){.phase = PULSES_FAILED, .failure = PULSES_MOVED, .number = drive.pulses.number};
    drive_pulse(&drive, &snapshot);
    TEST_ASSERT_EQUAL_INT(PULSES_FAILED, drive.task.pulsing.phase);
    TEST_ASSERT_EQUAL_INT(PULSES_MOVED, drive.task.pulsing.failure);
}

void test_pulses_along_one_axis_alone_are_accepted(void)
{
    wanted->d.v = 0;
    accepted();
    wanted->q.v = 0;
    accepted();
}

/* With a margin of a sixteenth in the square. */
void test_the_monitored_current_is_the_largest_one_of_the_pulses_and_a_margin(void)
{
    const double i_max = motor.commission.i_max;
    ask();
    TEST_ASSERT_DOUBLE_WITHIN(1.0, i_max * i_max * 17.0 / 16.0, drive.pulses.square_max);
}

void test_each_accepted_start_has_the_next_number(void)
{
    for (uint16_t number = 1; number <= 3; number++) {
        ask();
        TEST_ASSERT_EQUAL_UINT16(number, drive.pulses.number);
        drive.pulses_state = (pulses_state_t){.phase = PULSES_DONE, .number = number};
        drive_pulse(&drive, &snapshot);
        TEST_ASSERT_EQUAL_INT(PULSES_DONE, drive.task.pulsing.phase);
    }
}

void test_without_pulses_the_end_of_the_run_is_no_failure(void)
{
    drive.task.run_state = RUN_STATE_OFF;
    drive_pulse(&drive, &snapshot);
    TEST_ASSERT_EQUAL_INT(PULSES_IDLE, drive.task.pulsing.phase);
    TEST_ASSERT_EQUAL_INT(PULSES_GOOD, drive.task.pulsing.failure);
}

void test_pulses_that_end_in_the_step_in_which_the_run_ends_count_as_stopped(void)
{
    ask();
    drive.pulses_state = (pulses_state_t){.phase = PULSES_DONE, .number = drive.pulses.number};
    drive.task.run_state = RUN_STATE_OFF;
    drive_pulse(&drive, &snapshot);
    TEST_ASSERT_EQUAL_INT(PULSES_FAILED, drive.task.pulsing.phase);
    TEST_ASSERT_EQUAL_INT(PULSES_STOPPED, drive.task.pulsing.failure);
}
