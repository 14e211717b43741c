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

static bool send_frame(can_frame_t frame)
{
    frame.id = XCP_ID_COMMAND;
    xcp_access_receive(&access, &drive, &scope, &frame);
    const bool answers = xcp_access_next(&access, &answer);
    if (answers) {
        TEST_ASSERT_EQUAL_HEX32(XCP_ID_ANSWER, answer.id);
        xcp_access_sent(&access);
    }
    return answers;
}

static bool send(uint8_t length, uint8_t first, uint8_t second)
{
    return send_frame((can_frame_t){.length = length, .data = {first, second}});
}

/* The first bytes of the answer. An error packet starts with 0xFE and its number. */
static void expect(uint8_t first, uint8_t second)
{
    TEST_ASSERT_EQUAL_HEX8(first, answer.data[0]);
    TEST_ASSERT_EQUAL_HEX8(second, answer.data[1]);
}

/* The memory before xcp_access_init() is not zero. */
void setUp(void)
{
    drive_init(&drive, &motor);
    memset(&scope, 0, sizeof scope);
    memset(&access, 0xA5, sizeof access);
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
    xcp_put_u32(&unlock.data[2], 0x000001C0U ^ 0x5A17F10CU);
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
    TEST_ASSERT_EQUAL_FLOAT(0.0F, access.limits[0].lo); /* nothing is stored behind the values */
}

static void step(void)
{
    hal_temperature_processor_dC_IgnoreAndReturn(250);
    xcp_access_step(&access, &drive, 1);
}

/* A value that the drive has changed itself after it was applied. */
void test_a_value_that_the_drive_has_changed_itself_is_kept_when_another_one_is_new(void)
{
    access.working[0] = 20000.0F;
    access.xcp.generation++;
    step();
    drive.parameters.torque_slew = 1;
    access.working[CALIBRATION_torque_loop_bandwidth_rad_s] = 100.0F;
    access.xcp.generation++;
    step();
    TEST_ASSERT_EQUAL_INT32(1, drive.parameters.torque_slew);
    TEST_ASSERT_FLOAT_WITHIN(0.016F, 100.0F, calibration_get(&drive, CALIBRATION_torque_loop_bandwidth_rad_s));
}

void test_a_value_acts_only_after_the_protocol_has_completed_it(void)
{
    const float before = calibration_get(&drive, CALIBRATION_torque_slew_Nm_per_s);
    access.working[0] = 20000.0F;
    step();
    TEST_ASSERT_EQUAL_FLOAT(before, calibration_get(&drive, CALIBRATION_torque_slew_Nm_per_s));
}

void test_at_the_start_each_value_is_that_of_the_drive_with_its_own_range(void)
{
    TEST_ASSERT_FALSE(access.answer_waits);
    for (int k = 0; k < CALIBRATION_COUNT; k++) {
        const float expected = calibration_get(&drive, (calibration_id_t)k);
        TEST_ASSERT_EQUAL_FLOAT(expected, access.reference[k]);
        TEST_ASSERT_EQUAL_FLOAT(expected, access.working[k]);
        TEST_ASSERT_EQUAL_FLOAT(expected, access.applied_value[k]);
        TEST_ASSERT_EQUAL_FLOAT(calibration_info[k].lo, access.limits[k].lo);
        TEST_ASSERT_EQUAL_FLOAT(calibration_info[k].hi, access.limits[k].hi);
    }
}

/* A step of 1 ms is 100 units of 10 us; 1.2452 ms are 124.52 units, of which the nearest number is 125. */
void test_the_length_of_a_step_is_rounded_to_10_us(void)
{
    motor_t other = motor;
    TEST_ASSERT_EQUAL_UINT8(100, access.xcp.daq.step_10us);
    other.bases.step_s = 1.2452e-3F;
    drive.motor = &other;
    xcp_access_init(&access, &drive, &freeze, &scope, 1);
    TEST_ASSERT_EQUAL_UINT8(125, access.xcp.daq.step_10us);
}

static can_frame_t with_address(uint8_t code, uint8_t count, const void *object)
{
    can_frame_t frame = {.length = 8, .data = {code, count}};
    xcp_put_u32(&frame.data[4], xcp_address(object));
    return frame;
}

void test_a_master_reads_the_areas_and_no_other_memory(void)
{
    connect();
    freeze.now_ms = 0x12345678U;
    TEST_ASSERT_TRUE(send_frame(with_address(XCP_SHORT_UPLOAD, 4, &freeze.now_ms)));
    TEST_ASSERT_EQUAL_UINT8(5, answer.length);
    expect(0xFF, 0x78);
    TEST_ASSERT_EQUAL_HEX8(0x12, answer.data[4]);
    TEST_ASSERT_TRUE(send_frame(with_address(XCP_SHORT_UPLOAD, 4, &drive)));
    expect(0xFE, 0x24);
}

static bool download(int parameter, float value)
{
    (void)send_frame(with_address(XCP_SET_MTA, 0, &access.working[parameter]));
    can_frame_t frame = {.length = 6, .data = {XCP_DOWNLOAD, 4}};
    (void)memcpy(&frame.data[2], &value, sizeof value);
    return send_frame(frame);
}

void test_a_value_outside_of_its_range_is_refused(void)
{
    connect();
    access.xcp.unlocked = true;
    TEST_ASSERT_TRUE(download(CALIBRATION_torque_loop_bandwidth_rad_s, 500.5F));
    expect(0xFE, 0x22);
    TEST_ASSERT_TRUE(download(CALIBRATION_torque_loop_bandwidth_rad_s, 499.5F));
    TEST_ASSERT_EQUAL_HEX8(0xFF, answer.data[0]);
    step();
    TEST_ASSERT_FLOAT_WITHIN(0.016F, 499.5F, calibration_get(&drive, CALIBRATION_torque_loop_bandwidth_rad_s));
}

/* A list of one frame with the lowest byte of the freeze frame's time, in each step. */
static void start_list(void)
{
    static const can_frame_t allocate[] = {{.length = 1, .data = {XCP_FREE_DAQ}},
                                           {.length = 4, .data = {XCP_ALLOC_DAQ, 0, 1, 0}},
                                           {.length = 5, .data = {XCP_ALLOC_ODT, 0, 0, 0, 1}},
                                           {.length = 6, .data = {XCP_ALLOC_ODT_ENTRY, 0, 0, 0, 0, 1}},
                                           {.length = 6, .data = {XCP_SET_DAQ_PTR}}};
    static const can_frame_t run[] = {{.length = 8, .data = {XCP_SET_DAQ_LIST_MODE, 0, 0, 0, 0, 0, 1, 0}},
                                      {.length = 4, .data = {XCP_START_STOP_DAQ_LIST, 1}}};
    for (unsigned k = 0; k < sizeof allocate / sizeof allocate[0]; k++) {
        (void)send_frame(allocate[k]);
    }
    can_frame_t write = with_address(XCP_WRITE_DAQ, 0xFF, &freeze.now_ms);
    write.data[2] = 1;
    (void)send_frame(write);
    for (unsigned k = 0; k < sizeof run / sizeof run[0]; k++) {
        (void)send_frame(run[k]);
        TEST_ASSERT_EQUAL_HEX8(0xFF, answer.data[0]);
    }
}

static void next_is(uint8_t expected)
{
    can_frame_t frame = {0};
    TEST_ASSERT_TRUE(xcp_access_next(&access, &frame));
    TEST_ASSERT_EQUAL_HEX32(XCP_ID_ANSWER, frame.id);
    TEST_ASSERT_EQUAL_UINT8(2, frame.length);
    TEST_ASSERT_EQUAL_HEX8(0, frame.data[0]);
    TEST_ASSERT_EQUAL_HEX8(expected, frame.data[1]);
}

void test_a_measurement_list_is_sampled_in_each_step_and_its_frames_are_sent_once_in_their_order(void)
{
    can_frame_t frame = {0};
    connect();
    start_list();
    for (uint8_t value = 1; value <= 2; value++) {
        freeze.now_ms = value;
        step();
    }
    next_is(1);
    TEST_ASSERT_TRUE(send(2, XCP_GET_STATUS, 0)); /* its answer goes first, and its sending removes no sample */
    TEST_ASSERT_EQUAL_UINT8(6, answer.length);
    next_is(1);
    xcp_access_sent(&access);
    next_is(2);
    xcp_access_sent(&access);
    TEST_ASSERT_FALSE(xcp_access_next(&access, &frame));
}

/* The freeze frame needs its signals whether a tool is connected or not. */
void test_without_a_tool_only_the_signals_of_the_freeze_frame_are_measured(void)
{
    drive.task.torque_commanded = 11;
    drive.task.torque_corrected = 12;
    step();
    TEST_ASSERT_EQUAL_INT(11, access.measurements.torque_commanded_Nm);
    TEST_ASSERT_NOT_EQUAL_INT(12, access.measurements.torque_corrected_Nm);
    connect();
    step();
    TEST_ASSERT_EQUAL_INT(12, access.measurements.torque_corrected_Nm);
}

void test_a_setting_beyond_the_scope_s_range_and_an_arming_twice_have_the_protocol_s_errors(void)
{
    connect();
    TEST_ASSERT_TRUE(send_frame((can_frame_t){.length = 4, .data = {USER_CMD, SCOPE_SELECT, 0, CAPTURE_SIGNALS}}));
    expect(0xFE, 0x22);
    scope.capture.state = CAPTURE_ARMED;
    TEST_ASSERT_TRUE(send(2, USER_CMD, SCOPE_ARM));
    expect(0xFE, 0x10);
}

/* PULSE_DELAY = 0x0102 has four bytes after the code of user commands. */
void test_a_setting_of_the_voltage_pulses_needs_all_of_its_bytes(void)
{
    can_frame_t set = {.length = 4, .data = {USER_CMD, PULSE_SET, PULSE_DELAY, 0x02, 0x01}};
    connect();
    access.xcp.unlocked = true;
    drive.request.pulses.config.delay = 7;
    TEST_ASSERT_TRUE(send_frame(set));
    expect(0xFE, 0x21);
    TEST_ASSERT_EQUAL_INT(7, drive.request.pulses.config.delay);
    set.length = 5;
    TEST_ASSERT_TRUE(send_frame(set));
    TEST_ASSERT_EQUAL_HEX8(0xFF, answer.data[0]);
    TEST_ASSERT_EQUAL_INT(0x0102, drive.request.pulses.config.delay);
}

/* What a longer frame has left in the second byte is no part of a frame of one byte. */
void test_a_user_command_without_its_second_byte_is_too_short(void)
{
    connect();
    TEST_ASSERT_TRUE(send(1, USER_CMD, PULSE_STATE));
    expect(0xFE, 0x21);
}

/* The commands of pulses, movement and angle are 0x10 ... 0x17; the neighbours are the scope's, which knows neither. */
void test_the_commands_of_the_voltage_pulses_are_theirs(void)
{
    connect();
    drive.task.pulsing.failure = PULSES_MOVED;
    TEST_ASSERT_TRUE(send(2, USER_CMD, PULSE_STATE));
    TEST_ASSERT_EQUAL_UINT8(4, answer.length);
    TEST_ASSERT_EQUAL_HEX8(0xFF, answer.data[0]);
    TEST_ASSERT_EQUAL_UINT8(PULSES_MOVED, answer.data[2]);
    TEST_ASSERT_EQUAL_UINT8(0, answer.data[3]);
    drive.request.pulses_agreed = true;
    TEST_ASSERT_TRUE(send(2, USER_CMD, PULSE_STATE));
    TEST_ASSERT_EQUAL_UINT8(1, answer.data[3]);
    drive.task.movement.failure = MOVEMENT_FAILURE_LONG;
    TEST_ASSERT_TRUE(send(2, USER_CMD, MOVEMENT_STATE));
    TEST_ASSERT_EQUAL_UINT8(3, answer.length);
    TEST_ASSERT_EQUAL_UINT8(MOVEMENT_FAILURE_LONG, answer.data[2]);
    drive.task.angle_harmonics.c[3] = -2;
    TEST_ASSERT_TRUE(send(2, USER_CMD, PULSE_ACCESS_LAST));
    TEST_ASSERT_EQUAL_UINT8(5, answer.length);
    TEST_ASSERT_EQUAL_HEX8(0xFE, answer.data[1]);
    for (uint8_t command = PULSE_SET; command <= PULSE_START; command++) {
        TEST_ASSERT_TRUE(send(2, USER_CMD, command));
        TEST_ASSERT_EQUAL_HEX8(0xFE, answer.data[0]);
        TEST_ASSERT_EQUAL_HEX8(0x25, answer.data[1]); /* they need the key */
    }
    TEST_ASSERT_TRUE(send(2, USER_CMD, PULSE_SET - 1));
    TEST_ASSERT_EQUAL_HEX8(0x20, answer.data[1]);
    TEST_ASSERT_TRUE(send(2, USER_CMD, PULSE_ACCESS_LAST + 1));
    TEST_ASSERT_EQUAL_HEX8(0x20, answer.data[1]);
}
