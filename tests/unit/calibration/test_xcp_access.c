/* SPDX-License-Identifier: Apache-2.0 */
/* Which frames of the calibration protocol are commands for the scope, and which for the voltage pulses. */
#include "calibration/xcp_access.h"

#include <string.h>

#include "calibration/pulse_access.h"
#include "unity.h"

#define USER_CMD 0xF1
#define STOP 6 /* of the scope: accepted in every state */

static drive_t drive;
static freeze_frame_t freeze;
static scope_t scope;
static xcp_access_t access;
static can_frame_t answer;

static bool send(uint8_t length, uint8_t first, uint8_t second)
{
    const can_frame_t frame = {.id = XCP_ID_COMMAND, .length = length, .data = {first, second}};
    xcp_access_receive(&access, &drive, &scope, &frame);
    const bool answers = xcp_access_next(&access, &answer);
    if (answers) {
        TEST_ASSERT_EQUAL_HEX32(XCP_ID_ANSWER, answer.id);
        xcp_access_sent(&access);
    }
    return answers;
}

void setUp(void)
{
    drive_init(&drive, &motor);
    memset(&scope, 0, sizeof scope);
    memset(&access, 0, sizeof access);
    xcp_access_init(&access, &drive, &freeze, &scope, 1);
}

void tearDown(void)
{
}

static void connect(void)
{
    TEST_ASSERT_TRUE(send(2, 0xFF, 0));
    TEST_ASSERT_EQUAL_HEX8(0xFF, answer.data[0]);
}

void test_before_connect_the_scope_takes_no_command(void)
{
    scope.capture.state = CAPTURE_ARMED;
    TEST_ASSERT_FALSE(send(2, USER_CMD, STOP));
    TEST_ASSERT_EQUAL_INT(CAPTURE_ARMED, scope.capture.state);
    connect();
    TEST_ASSERT_TRUE(send(2, USER_CMD, STOP));
    TEST_ASSERT_EQUAL_HEX8(0xFF, answer.data[0]);
    TEST_ASSERT_EQUAL_INT(CAPTURE_IDLE, scope.capture.state);
}

void test_other_commands_are_the_protocols(void)
{
    connect();
    scope.capture.state = CAPTURE_ARMED;
    TEST_ASSERT_TRUE(send(2, 0xFD, STOP)); /* GET_STATUS */
    TEST_ASSERT_EQUAL_HEX8(0xFF, answer.data[0]);
    TEST_ASSERT_EQUAL_UINT8(6, answer.length);
    TEST_ASSERT_EQUAL_INT(CAPTURE_ARMED, scope.capture.state);
}

void test_a_frame_without_data_or_longer_than_a_packet_is_no_command(void)
{
    connect();
    scope.capture.state = CAPTURE_ARMED;
    TEST_ASSERT_FALSE(send(0, USER_CMD, STOP));
    TEST_ASSERT_FALSE(send(9, USER_CMD, STOP));
    TEST_ASSERT_EQUAL_INT(CAPTURE_ARMED, scope.capture.state);
}

void test_a_command_of_the_scope_that_is_unknown_or_too_short_has_the_protocols_error(void)
{
    connect();
    TEST_ASSERT_TRUE(send(2, USER_CMD, 99));
    TEST_ASSERT_EQUAL_HEX8(0xFE, answer.data[0]);
    TEST_ASSERT_EQUAL_HEX8(0x20, answer.data[1]);
    TEST_ASSERT_TRUE(send(1, USER_CMD, STOP));
    TEST_ASSERT_EQUAL_HEX8(0xFE, answer.data[0]);
    TEST_ASSERT_EQUAL_HEX8(0x21, answer.data[1]);
}

/* The commands of the pulses are 0x10 ... 0x12; the neighbours are the scope's, which knows neither. */
void test_the_commands_of_the_voltage_pulses_are_theirs(void)
{
    connect();
    drive.task.pulsing.failure = PULSES_MOVED;
    TEST_ASSERT_TRUE(send(2, USER_CMD, PULSE_STATE));
    TEST_ASSERT_EQUAL_UINT8(3, answer.length);
    TEST_ASSERT_EQUAL_HEX8(0xFF, answer.data[0]);
    TEST_ASSERT_EQUAL_UINT8(PULSES_MOVED, answer.data[2]);
    for (uint8_t command = PULSE_SET; command <= PULSE_START; command++) {
        TEST_ASSERT_TRUE(send(2, USER_CMD, command));
        TEST_ASSERT_EQUAL_HEX8(0xFE, answer.data[0]);
        TEST_ASSERT_EQUAL_HEX8(0x25, answer.data[1]); /* they need the key */
    }
    TEST_ASSERT_TRUE(send(2, USER_CMD, PULSE_SET - 1));
    TEST_ASSERT_EQUAL_HEX8(0x20, answer.data[1]);
    TEST_ASSERT_TRUE(send(2, USER_CMD, PULSE_STATE + 1));
    TEST_ASSERT_EQUAL_HEX8(0x20, answer.data[1]);
}
