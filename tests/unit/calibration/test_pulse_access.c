/* SPDX-License-Identifier: Apache-2.0 */
/* The commands for the voltage pulses: each field is set alone, and only with the key. */
#include "calibration/pulse_access.h"

#include "unity.h"

static drive_t drive;

void setUp(void)
{
    drive_init(&drive, &motor);
    drive.request.pulses = (pulses_request_t){0};
}

void tearDown(void)
{
}

static xcp_result_t set(uint8_t field, uint16_t raw, uint8_t length)
{
    const uint8_t command[4] = {PULSE_SET, field, (uint8_t)raw, (uint8_t)(raw >> 8)};
    return pulse_access_command(&drive, true, command, length);
}

/* All fields get different values; -2 as a signed one is 0xFFFE. */
void test_every_field_is_set_alone(void)
{
    static const uint16_t raw[PULSE_PERIODS + 1] = {101, 0xFFFE, 103, 104, 105, 106, 107, 0x1234, 0xFF00, 110, 111};
    for (uint8_t field = PULSE_V_D; field <= PULSE_PERIODS; field++) {
        TEST_ASSERT_EQUAL_INT(XCP_OK, set(field, raw[field], 4));
    }
    const pulses_config_t *config = &drive.request.pulses.config;
    TEST_ASSERT_EQUAL_INT32(101, config->d.v);
    TEST_ASSERT_EQUAL_INT32(-2, config->d.low);
    TEST_ASSERT_EQUAL_INT32(103, config->d.high);
    TEST_ASSERT_EQUAL_INT32(104, config->q.v);
    TEST_ASSERT_EQUAL_INT32(105, config->q.low);
    TEST_ASSERT_EQUAL_INT32(106, config->q.high);
    TEST_ASSERT_EQUAL_INT32(107, config->first);
    TEST_ASSERT_EQUAL_HEX32(0x12340000U, config->angle_max);
    TEST_ASSERT_EQUAL_HEX16(0xFF00, config->delay);
    TEST_ASSERT_EQUAL_UINT16(110, config->reversals);
    TEST_ASSERT_EQUAL_UINT16(111, config->periods_max);
    TEST_ASSERT_EQUAL_UINT32(0, drive.request.pulses.starts);
}

void test_an_unknown_field_and_a_short_command_are_refused(void)
{
    TEST_ASSERT_EQUAL_INT(XCP_ERR_OUT_OF_RANGE, set(PULSE_PERIODS + 1, 1, 4));
    TEST_ASSERT_EQUAL_INT(XCP_ERR_CMD_SYNTAX, set(PULSE_V_D, 1, 3));
    TEST_ASSERT_EQUAL_INT32(0, drive.request.pulses.config.d.v);
}

void test_a_start_counts_once_and_changes_no_value(void)
{
    const uint8_t command[4] = {PULSE_START, PULSE_V_D, 1, 0};
    TEST_ASSERT_EQUAL_INT(XCP_OK, pulse_access_command(&drive, true, command, 1));
    TEST_ASSERT_EQUAL_INT(XCP_OK, pulse_access_command(&drive, true, command, 4));
    TEST_ASSERT_EQUAL_UINT32(2, drive.request.pulses.starts);
    TEST_ASSERT_EQUAL_INT32(0, drive.request.pulses.config.d.v);
}

void test_without_the_key_nothing_is_set_or_started(void)
{
    const uint8_t command[4] = {PULSE_SET, PULSE_V_D, 1, 0}, start[1] = {PULSE_START}, state[1] = {PULSE_STATE};
    TEST_ASSERT_EQUAL_INT(XCP_ERR_ACCESS_LOCKED, pulse_access_command(&drive, false, command, 4));
    TEST_ASSERT_EQUAL_INT(XCP_ERR_ACCESS_LOCKED, pulse_access_command(&drive, false, start, 1));
    TEST_ASSERT_EQUAL_INT(XCP_OK, pulse_access_command(&drive, false, state, 1));
    TEST_ASSERT_EQUAL_INT32(0, drive.request.pulses.config.d.v);
    TEST_ASSERT_EQUAL_UINT32(0, drive.request.pulses.starts);
}

void test_the_state_of_the_movement_needs_no_key(void)
{
    const uint8_t command[1] = {MOVEMENT_STATE}, start[1] = {PULSE_START};
    can_frame_t answer = {.length = 1};
    drive.task.movement.phase = MOVEMENT_PHASE_ENDED;
    drive.task.movement.failure = MOVEMENT_FAILURE_FAST;
    TEST_ASSERT_EQUAL_INT(XCP_OK, pulse_access_command(&drive, false, command, 1));
    pulse_access_state(&drive, start[0], &answer);
    TEST_ASSERT_EQUAL_UINT8(1, answer.length);
    pulse_access_state(&drive, command[0], &answer);
    TEST_ASSERT_EQUAL_UINT8(3, answer.length);
    TEST_ASSERT_EQUAL_UINT8(MOVEMENT_PHASE_ENDED, answer.data[1]);
    TEST_ASSERT_EQUAL_UINT8(MOVEMENT_FAILURE_FAST, answer.data[2]);
}

void test_the_correction_of_the_angle_needs_no_key(void)
{
    static const int32_t coefficients[ANGLE_HARMONICS] = {0x01020304, -2, 3, -0x00FFFFFF};
    static const uint8_t expected[ANGLE_HARMONICS][4] = {
        {0x04, 0x03, 0x02, 0x01}, {0xFE, 0xFF, 0xFF, 0xFF}, {3, 0, 0, 0}, {0x01, 0x00, 0x00, 0xFF}};
    for (unsigned n = 0; n < ANGLE_HARMONICS; n++) {
        drive.task.angle_harmonics.c[n] = coefficients[n];
    }
    for (uint8_t n = 0; n < ANGLE_HARMONICS; n++) {
        const uint8_t command[1] = {(uint8_t)(ANGLE_CORRECTION + n)};
        can_frame_t answer = {.length = 1};
        TEST_ASSERT_TRUE(pulse_access_is_command(command[0]));
        TEST_ASSERT_EQUAL_INT(XCP_OK, pulse_access_command(&drive, false, command, 1));
        pulse_access_state(&drive, command[0], &answer);
        TEST_ASSERT_EQUAL_UINT8(5, answer.length);
        TEST_ASSERT_EQUAL_UINT8_ARRAY(expected[n], &answer.data[1], 4);
    }
    TEST_ASSERT_FALSE(pulse_access_is_command(ANGLE_CORRECTION + ANGLE_HARMONICS));
}

void test_the_state_is_phase_failure_and_consent(void)
{
    drive.task.pulsing.phase = PULSES_FAILED;
    drive.task.pulsing.failure = PULSES_CURRENT;
    for (uint8_t agreed = 0; agreed <= 1; agreed++) {
        can_frame_t answer = {.length = 8};
        drive.request.pulses_agreed = agreed != 0U;
        pulse_access_state(&drive, PULSE_STATE, &answer);
        TEST_ASSERT_EQUAL_UINT8(4, answer.length);
        TEST_ASSERT_EQUAL_UINT8(PULSES_FAILED, answer.data[1]);
        TEST_ASSERT_EQUAL_UINT8(PULSES_CURRENT, answer.data[2]);
        TEST_ASSERT_EQUAL_UINT8(agreed, answer.data[3]);
    }
}
