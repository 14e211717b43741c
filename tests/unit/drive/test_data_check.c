/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/data_check.h"

#include <stddef.h>

#include "calibration/calibration.h"
#include "seam.h"
#include "unity.h"

/* Damage by the memory, one bit at a time, and changes on purpose. */

#define LIVE_FIRST offsetof(drive_t, period)
#define LIVE_END (offsetof(drive_t, mrai_parameters) + sizeof(mrai_config_t))

void setUp(void)
{
    seam_start();
    seam_run();
    seam_periods(30);
}

void tearDown(void)
{
}

static void flip(size_t byte, unsigned bit)
{
    ((uint8_t *)&drive)[byte] ^= (uint8_t)(1U << bit);
}

/* Steps of the task until the fault; the fast ISR latches it in the period after. */
static unsigned steps_to_fault(unsigned most)
{
    for (unsigned n = 1; n <= most; n++) {
        seam_periods(10);
        if (drive_motor_check(&drive) == MOTOR_CHECK_LIVE_DATA) {
            seam_period();
            TEST_ASSERT_EQUAL_HEX32(FAULT_CONFIG, drive.fast.faults & FAULT_CONFIG);
            TEST_ASSERT_FALSE(seam.gates);
            return n;
        }
    }
    return UINT32_MAX;
}

static void expect_fault_within(unsigned steps)
{
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(steps, steps_to_fault(steps + 1U));
}

static void expect_no_damage(void)
{
    seam_periods(10 * (int)DATA_CHECK_ROUND_MAX);
    TEST_ASSERT_EQUAL_HEX32(0, drive.fast.faults);
    TEST_ASSERT_EQUAL_INT(MOTOR_CHECK_OK, drive_motor_check(&drive));
}

/* The comparison alone: with damaged data the control may fail first. */
void test_every_bit_of_the_live_data_and_of_their_complements_is_found_within_a_round(void)
{
    const size_t complements = offsetof(drive_t, data_check), end = offsetof(drive_t, data_check.options);
    for (size_t byte = LIVE_FIRST; byte < end; byte++) {
        byte = (byte == LIVE_END) ? complements : byte;
        for (unsigned bit = 0; bit < 8U; bit++) {
            flip(byte, bit);
            uint32_t faults = 0;
            for (unsigned n = 0; n < DATA_CHECK_ROUND_MAX; n++) {
                faults |= data_check_step(&drive);
            }
            TEST_ASSERT_EQUAL_HEX32(FAULT_CONFIG, faults);
            flip(byte, bit);
            drive.data_check.damaged = false;
        }
    }
    TEST_ASSERT_EQUAL_HEX32(0, data_check_step(&drive));
}

void test_a_damaged_gain_is_a_fault_that_no_reset_clears(void)
{
    drive.parameters.torque_loop.ki ^= 1;
    expect_fault_within(DATA_CHECK_ROUND_MAX);
    drive.parameters.torque_loop.ki ^= 1;
    drive.request.enable = false;
    drive.request.fault_resets++;
    seam_periods(50);
    TEST_ASSERT_EQUAL_HEX32(FAULT_CONFIG, drive.fast.faults);
    TEST_ASSERT_EQUAL_INT(MOTOR_CHECK_LIVE_DATA, drive_motor_check(&drive));
}

void test_the_first_refusal_of_the_data_is_the_one_that_is_told(void)
{
    drive_refuse(&drive, MOTOR_CHECK_PWM_TIMER);
    drive.data_check.damaged = true;
    TEST_ASSERT_EQUAL_INT(MOTOR_CHECK_PWM_TIMER, drive_motor_check(&drive));
}

void test_a_change_on_purpose_is_no_damage_and_hides_none(void)
{
    for (unsigned id = 0; id < CALIBRATION_COUNT; id++) {
        calibration_set(&drive, (calibration_id_t)id, calibration_info[id].hi);
    }
    drive_restore_trim(&drive, 20);
    TEST_ASSERT_TRUE(drive_compensate(&drive, &(compensation_t){300, motor.parameters.modulate.knee_q17 / 2, 1}));
    expect_no_damage();
    drive.parameters.torque_slew ^= 64;
    calibration_set(&drive, CALIBRATION_torque_loop_bandwidth_rad_s, 20.0F);
    expect_fault_within(DATA_CHECK_ROUND_MAX);
}

/* So that its time is bounded. The words before and behind those of the first step are damaged. */
void test_a_step_compares_four_words(void)
{
    drive.data_check.at = 4;
    flip(LIVE_FIRST + 3U * sizeof(uint32_t), 0);
    flip(LIVE_FIRST + 8U * sizeof(uint32_t), 0);
    TEST_ASSERT_EQUAL_HEX32(0, data_check_step(&drive));
    TEST_ASSERT_EQUAL_HEX32(FAULT_CONFIG, data_check_step(&drive));
}

/* Of a damaged position the comparison would read what lies behind the data. */
void test_a_position_behind_the_data_compares_the_last_words_and_begins_a_new_round(void)
{
    const size_t words = (offsetof(drive_t, data_check.options) - offsetof(drive_t, data_check)) / sizeof(uint32_t);
    drive.data_check.at = (uint32_t)words;
    TEST_ASSERT_EQUAL_HEX32(0, data_check_step(&drive));
    TEST_ASSERT_EQUAL_UINT32(0, drive.data_check.at);
    flip(LIVE_END - sizeof(uint32_t), 0);
    drive.data_check.at = (uint32_t)words;
    TEST_ASSERT_EQUAL_HEX32(FAULT_CONFIG, data_check_step(&drive));
}

void test_a_change_of_the_trim_hides_no_damage_of_other_parameters_or_of_the_word_behind_them(void)
{
    const size_t damaged[] = {offsetof(drive_t, parameters.torque_slew), offsetof(drive_t, mrai_parameters)};
    for (unsigned k = 0; k < sizeof damaged / sizeof damaged[0]; k++) {
        setUp();
        flip(damaged[k], 0);
        drive_restore_trim(&drive, 20);
        expect_fault_within(DATA_CHECK_ROUND_MAX);
    }
}

void test_the_pointer_to_the_motor_data_is_restored_by_the_majority(void)
{
    const motor_t *const before = drive.motor;
    for (unsigned bit = 0; bit < 8U * sizeof drive.motor; bit++) {
        flip(offsetof(drive_t, motor) + bit / 8U, bit % 8U);
        task_1khz(&drive);
        TEST_ASSERT_EQUAL_PTR(before, drive.motor);
    }
    flip(offsetof(drive_t, data_check.motor), 3);
    task_1khz(&drive);
    TEST_ASSERT_EQUAL_PTR(before, drive.motor);
    expect_no_damage();
}

void test_a_window_that_never_ends_is_found(void)
{
    drive.fast.step_end += 1U << 20;
    expect_fault_within(5);
}

/* Four steps of ten periods. */
void test_a_window_may_be_late_by_four_steps_and_not_by_a_period_more(void)
{
    data_check_t *const data_check = &drive.data_check;
    TEST_ASSERT_EQUAL_HEX32(0, data_check_step(&drive));
    TEST_ASSERT_EQUAL_UINT32(drive.fast.command_seen, data_check->windows);
    data_check->periods = drive.samples.generation - 40U;
    TEST_ASSERT_EQUAL_HEX32(0, data_check_step(&drive));
    data_check->periods = drive.samples.generation - 41U;
    TEST_ASSERT_EQUAL_HEX32(FAULT_CONFIG, data_check_step(&drive));
}

void test_without_periods_no_window_is_expected(void)
{
    for (unsigned n = 0; n < 100U; n++) {
        TEST_ASSERT_EQUAL_HEX32(0, data_check_step(&drive));
    }
}

void test_damaged_parameters_of_the_identification_are_found_before_they_are_updated(void)
{
    for (unsigned word = 0; word < sizeof(kalman_t) / 4U; word++) {
        setUp();
        flip(offsetof(drive_t, task.identify.kalman) + 4U * word + word % 4U, word % 8U);
        expect_fault_within(2U * IDENTIFY_STEPS);
    }
}

void test_what_the_task_keeps_from_step_to_step_is_found_in_the_next(void)
{
    static const size_t words[] = {
        offsetof(drive_t, task.identify.kept.local.d),
        offsetof(drive_t, task.identify.kept.local.q),
        offsetof(drive_t, task.identify.kept.r_prior),
        offsetof(drive_t, task.identify.kept.mismatch_share),
        offsetof(drive_t, task.identify.kept.confidence),
        offsetof(drive_t, task.identify.kept.torque_certain),
        offsetof(drive_t, task.identify.seal),
        offsetof(drive_t, task.identify.damaged),
        offsetof(drive_t, task.angle_harmonics.c[0]),
        offsetof(drive_t, task.angle_harmonics.c[3]),
        offsetof(drive_t, task.angle_harmonics.seal_complement),
        offsetof(drive_t, task.angle_harmonics.damaged),
    };
    for (unsigned k = 0; k < sizeof words / sizeof words[0]; k++) {
        setUp();
        flip(words[k], 0);
        expect_fault_within(2);
    }
}

/* Without a bus others write the options. */
void test_the_options_of_the_request_are_checked_for_their_owner(void)
{
    drive.request.trim = false;
    data_check_accept_options(&drive);
    data_check_check_options(&drive);
    expect_no_damage();
    for (size_t byte = offsetof(drive_t, request.current_mode); byte <= offsetof(drive_t, request.trim); byte++) {
        flip(byte, 0);
        TEST_ASSERT_EQUAL_HEX32(0, data_check_step(&drive));
        data_check_check_options(&drive);
        TEST_ASSERT_EQUAL_HEX32(FAULT_CONFIG, data_check_step(&drive));
        flip(byte, 0);
        drive.data_check.damaged = false;
    }
}
