/* SPDX-License-Identifier: Apache-2.0 */
/* Which frames of the calibration protocol are commands for the scope, and which for the voltage pulses. */
#include "calibration/xcp_access.h"

#include <stddef.h>
#include <string.h>

#include "calibration/pulse_access.h"
#include "hal/mock_temperature.h"
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

void test_a_command_of_the_scope_may_fill_the_whole_packet(void)
{
    connect();
    TEST_ASSERT_TRUE(send(8, USER_CMD, STOP));
    TEST_ASSERT_EQUAL_HEX8(0xFF, answer.data[0]);
}

void test_measurements_freeze_frame_and_scope_can_be_read_and_nothing_behind_them(void)
{
    const xcp_area_t expected[XCP_ACCESS_AREAS] = {{&access.measurements, sizeof access.measurements},
                                                   {&freeze, sizeof freeze},
                                                   {&scope.capture, offsetof(capture_t, next)},
                                                   {scope.memory, sizeof scope.memory}};
    for (int k = 0; k < XCP_ACCESS_AREAS; k++) {
        TEST_ASSERT_EQUAL_PTR(expected[k].start, access.area[k].start);
        TEST_ASSERT_EQUAL_UINT32(expected[k].size, access.area[k].size);
    }
}

/* By hand: 0x80000003 turned left by 7 bits is 0x000001C0. */
void test_the_key_is_the_turned_seed_with_the_constant(void)
{
    const can_frame_t seed = {.id = XCP_ID_COMMAND, .length = 3, .data = {0xF8, 0, 1}};
    can_frame_t unlock = {.id = XCP_ID_COMMAND, .length = 6, .data = {0xF7, 4}};
    connect();
    xcp_access_receive(&access, &drive, &scope, &seed);
    access.xcp.seed = 0x80000003U;
    const uint32_t key = 0x000001C0U ^ 0x5A17F10CU;
    for (int k = 0; k < 4; k++) {
        unlock.data[2 + k] = (uint8_t)(key >> 8 * k);
    }
    xcp_access_receive(&access, &drive, &scope, &unlock);
    TEST_ASSERT_TRUE(access.xcp.unlocked);
}

/* The first, the last and no other value of the page are new. */
void test_new_values_act_with_the_next_step_and_once(void)
{
    const int last = CALIBRATION_COUNT - 1;
    const float between = access.working[1];
    access.working[0] = 20000.0F;
    access.working[last] = 2.0F * access.working[last];
    access.xcp.generation++;
    hal_temperature_processor_dC_IgnoreAndReturn(250);
    xcp_access_step(&access, &drive, 1);
    TEST_ASSERT_FLOAT_WITHIN(4.5F, 20000.0F, calibration_get(&drive, (calibration_id_t)0));
    TEST_ASSERT_FLOAT_WITHIN(1e-3F, access.working[last], calibration_get(&drive, (calibration_id_t)last));
    TEST_ASSERT_EQUAL_FLOAT(between, access.applied_value[1]);
    TEST_ASSERT_EQUAL_UINT32(access.xcp.generation, access.applied);
}

/* The commands of pulses and movement are 0x10 ... 0x13; the neighbours are the scope's, which knows neither. */
void test_the_commands_of_the_voltage_pulses_are_theirs(void)
{
    connect();
    drive.task.pulsing.failure = PULSES_MOVED;
    TEST_ASSERT_TRUE(send(2, USER_CMD, PULSE_STATE));
    TEST_ASSERT_EQUAL_UINT8(3, answer.length);
    TEST_ASSERT_EQUAL_HEX8(0xFF, answer.data[0]);
    TEST_ASSERT_EQUAL_UINT8(PULSES_MOVED, answer.data[2]);
    drive.task.movement.failure = MOVEMENT_FAILURE_LONG;
    TEST_ASSERT_TRUE(send(2, USER_CMD, MOVEMENT_STATE));
    TEST_ASSERT_EQUAL_UINT8(3, answer.length);
    TEST_ASSERT_EQUAL_UINT8(MOVEMENT_FAILURE_LONG, answer.data[2]);
    for (uint8_t command = PULSE_SET; command <= PULSE_START; command++) {
        TEST_ASSERT_TRUE(send(2, USER_CMD, command));
        TEST_ASSERT_EQUAL_HEX8(0xFE, answer.data[0]);
        TEST_ASSERT_EQUAL_HEX8(0x25, answer.data[1]); /* they need the key */
    }
    TEST_ASSERT_TRUE(send(2, USER_CMD, PULSE_SET - 1));
    TEST_ASSERT_EQUAL_HEX8(0x20, answer.data[1]);
    TEST_ASSERT_TRUE(send(2, USER_CMD, MOVEMENT_STATE + 1));
    TEST_ASSERT_EQUAL_HEX8(0x20, answer.data[1]);
}
