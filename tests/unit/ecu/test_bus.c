/* SPDX-License-Identifier: Apache-2.0 */
/* One ECU between bus, board and drive: what arrives has its effect, and what happens is transmitted. */
#include <math.h>

#include "comm/e2e.h"
#include "drive/data_check.h"
#include "ecu/ecu_private.h"
#include "ecu_bench.h"
#include "hal/mock_can.h"
#include "hal/mock_system.h"
#include "unity.h"

/* Copied by hand from firmware/comm/fluxtrue.dbc; a count of hsm1 is 0.1 N·m or 0.01 kW. */
#define COMMAND_ID 0x110U
#define COMMAND_DATA_ID 0x1101U
#define ENABLE 0x10U
#define RESET 0x20U
#define MODE_TORQUE 0x40U
#define BATTERY_ID 0x111U
#define BATTERY_DATA_ID 0x1111U
#define COMMISSION_ID 0x112U
#define COMMISSION_DATA_ID 0x1121U
#define PULSES 0x40U /* in byte 5 */
#define STATUS_ID 0x210U
#define DIAG_BUS_ID 0x232U
#define DIAG_TASK_ID 0x233U

#define CYCLE_MS 10
#define PER_UNIT_1 65536 /* of q15 in q31 */
#define COUNT_PER_V (32768.0 / 540.0)

static uint8_t command_counter, battery_counter, commission_counter;

void setUp(void)
{
    board_start();
    board.counts.v_dc = (uint16_t)(350.0F / motor.v_dc_full_scale_V * 4096.0F);
    command_counter = battery_counter = commission_counter = 0;
}

void tearDown(void)
{
}

static void put(can_frame_t *frame, int at, int counts)
{
    frame->data[at] = (uint8_t)((unsigned)counts & 0xFFU);
    frame->data[at + 1] = (uint8_t)((unsigned)counts >> 8 & 0xFFU);
}

/* A command with limits of 200 N·m and 150 N·m, every 10 ms for this time. */
static void command(unsigned bits, int torque_counts, int ms)
{
    for (int n = 0; n < ms; n++) {
        if (n % CYCLE_MS == 0) {
            board.arriving = (can_frame_t){.id = COMMAND_ID, .length = 8, .data = {0, (uint8_t)bits}};
            put(&board.arriving, 2, torque_counts);
            put(&board.arriving, 4, 2000);
            put(&board.arriving, 6, 1500);
            e2e_protect(COMMAND_DATA_ID, &command_counter, &board.arriving);
            board.waiting = 1;
        }
        tasks(1);
    }
}

static void battery(int drive_counts, int regen_counts)
{
    board.arriving = (can_frame_t){.id = BATTERY_ID, .length = 8};
    put(&board.arriving, 2, drive_counts);
    put(&board.arriving, 4, regen_counts);
    e2e_protect(BATTERY_DATA_ID, &battery_counter, &board.arriving);
    board.waiting = 1;
    tasks(1);
}

static void only(board_output_t first, board_output_t second)
{
    for (int n = 0; n < BOARD_OUTPUTS; n++) {
        TEST_ASSERT_EQUAL(n == (int)first || n == (int)second, board.outputs[n]);
    }
}

static void drive_until_enabled(void)
{
    tasks(100);
    command(MODE_TORQUE, 0, 100);
    TEST_ASSERT_EQUAL_INT(STATE_READY, ecu.supervisor.state);
    command(MODE_TORQUE | ENABLE, 0, 1);
    TEST_ASSERT_EQUAL_INT(STATE_RUN, ecu.supervisor.state);
}

void test_the_board_follows_the_mode_of_the_bus_through_precharge_and_discharge(void)
{
    tasks(100);
    TEST_ASSERT_EQUAL_INT(STATE_STANDBY, ecu.supervisor.state);
    command(MODE_TORQUE, 0, 30);
    TEST_ASSERT_EQUAL_INT(STATE_PRECHARGE, ecu.supervisor.state);
    only(BOARD_PRECHARGE, BOARD_PRECHARGE);
    command(MODE_TORQUE, 0, 70);
    TEST_ASSERT_EQUAL_INT(STATE_READY, ecu.supervisor.state);
    only(BOARD_MAIN_CONTACTOR, BOARD_GATE_DRIVER);
    command(0, 0, 20);
    TEST_ASSERT_EQUAL_INT(STATE_DISCHARGE, ecu.supervisor.state);
    only(BOARD_DISCHARGE, BOARD_DISCHARGE);
}

void test_an_enabled_drive_is_switched_and_given_the_requested_torque(void)
{
    drive_until_enabled();
    TEST_ASSERT_TRUE(ecu.drive.request.enable);
    TEST_ASSERT_EQUAL_INT(0, ecu.drive.request.torque_arbitrated);
    command(MODE_TORQUE | ENABLE, -500, CYCLE_MS); /* later the missing currents would be a fault */
    TEST_ASSERT_LESS_THAN_INT(-1000, ecu.drive.request.torque_arbitrated);
    TEST_ASSERT_TRUE(ecu.drive.request.enable);
    command(MODE_TORQUE, 0, 60);
    TEST_ASSERT_FALSE(ecu.drive.request.enable);
    TEST_ASSERT_EQUAL_INT(0, ecu.drive.request.torque_arbitrated);
}

/* At 2 N·m the missing currents are no fault. */
void test_a_command_that_does_not_arrive_for_30_ms_ends_torque_and_enable(void)
{
    drive_until_enabled();
    command(MODE_TORQUE | ENABLE, 20, 3 * CYCLE_MS);
    TEST_ASSERT_GREATER_THAN_INT(200, ecu.drive.request.torque_arbitrated);
    tasks(30 - CYCLE_MS - 1);
    TEST_ASSERT_GREATER_THAN_INT(200, ecu.drive.request.torque_arbitrated);
    tasks(2);
    TEST_ASSERT_EQUAL_INT(0, ecu.drive.request.torque_arbitrated);
    TEST_ASSERT_FALSE(ecu.drive.request.enable);
    TEST_ASSERT_EQUAL_UINT16(1, ecu.rx.time_outs);
}

void test_a_reset_by_the_bus_clears_the_faults_of_the_drive(void)
{
    board.counts.v_dc = 0; /* discharged */
    tasks(100);
    drive_raise_fault(&ecu.drive, FAULT_ANGLE_OFFSET);
    command(0, 0, 20);
    TEST_ASSERT_EQUAL_HEX32(FAULT_ANGLE_OFFSET, ecu.drive.fast.faults);
    TEST_ASSERT_EQUAL_INT(STATE_FAULT, ecu.supervisor.state);
    command(RESET, 0, 20);
    TEST_ASSERT_EQUAL_HEX32(0, ecu.drive.fast.faults);
    TEST_ASSERT_EQUAL_INT(STATE_STANDBY, ecu.supervisor.state);
}

typedef enum { INTACT, LOST, WRONG_CRC, WRONG_ID, REPEATED, DAMAGES } damage_t;

static void commission(unsigned pulses, damage_t damage)
{
    static can_frame_t last;
    if (damage != REPEATED) {
        last = (can_frame_t){.id = COMMISSION_ID, .length = 8, .data = {0, 0, 0, 0, 0, (uint8_t)pulses}};
        e2e_protect((damage == WRONG_ID) ? COMMAND_DATA_ID : COMMISSION_DATA_ID, &commission_counter, &last);
    }
    board.arriving = last;
    board.arriving.data[0] ^= (damage == WRONG_CRC) ? 1U : 0U;
    board.waiting = (damage == LOST) ? 0 : 1;
    tasks(1);
}

/* Both messages every 10 ms for this time, without a torque request. */
static void both(unsigned bits, unsigned pulses, damage_t damage, int ms)
{
    for (int n = 0; n < ms; n += CYCLE_MS) {
        command(bits, 0, CYCLE_MS - 1);
        commission(pulses, damage);
    }
}

/* A drive in run with a consent that has been given in ready. */
static void run_with_consent(void)
{
    tasks(100);
    both(MODE_TORQUE, 0, INTACT, 100);
    TEST_ASSERT_EQUAL_INT(STATE_READY, ecu.supervisor.state);
    TEST_ASSERT_FALSE(ecu.drive.request.pulses_agreed);
    both(MODE_TORQUE, PULSES, INTACT, 10);
    TEST_ASSERT_TRUE(ecu.drive.request.pulses_agreed);
    both(MODE_TORQUE | ENABLE, PULSES, INTACT, 200);
    TEST_ASSERT_EQUAL_INT(STATE_RUN, ecu.supervisor.state);
    TEST_ASSERT_TRUE(ecu.drive.request.pulses_agreed);
}

/* One damaged frame or two change nothing. Intact ones do not bring the consent back in run. */
void test_a_consent_to_pulses_lasts_as_long_as_intact_frames_arrive(void)
{
    for (damage_t damage = LOST; damage < DAMAGES; damage++) {
        run_with_consent();
        both(MODE_TORQUE | ENABLE, PULSES, damage, 20);
        TEST_ASSERT_TRUE(ecu.drive.request.pulses_agreed);
        both(MODE_TORQUE | ENABLE, PULSES, damage, 20);
        TEST_ASSERT_FALSE(ecu.drive.request.pulses_agreed);
        both(MODE_TORQUE | ENABLE, PULSES, INTACT, 50);
        both(MODE_TORQUE | ENABLE, 0, INTACT, 50);
        both(MODE_TORQUE | ENABLE, PULSES, INTACT, 50);
        TEST_ASSERT_FALSE(ecu.drive.request.pulses_agreed);
        TEST_ASSERT_EQUAL_INT(STATE_RUN, ecu.supervisor.state);
        both(MODE_TORQUE, 0, INTACT, 50);
        both(MODE_TORQUE, PULSES, INTACT, 50);
        TEST_ASSERT_TRUE(ecu.drive.request.pulses_agreed);
    }
}

void test_without_a_consent_of_the_bus_a_start_over_xcp_is_refused(void)
{
    drive_until_enabled();
    both(MODE_TORQUE | ENABLE, 0, INTACT, 50);
    both(MODE_TORQUE | ENABLE, PULSES, INTACT, 50); /* too late: not in ready */
    ecu.drive.request.pulses.starts++;
    tasks(1);
    TEST_ASSERT_EQUAL_INT(PULSES_FAILED, ecu.drive.task.pulsing.phase);
    TEST_ASSERT_EQUAL_INT(PULSES_NO_CONSENT, ecu.drive.task.pulsing.failure);
}

/* P_b = 324 kW: 32.4 kW and 16.2 kW are a tenth and a twentieth. */
void test_the_batterys_limits_of_the_bus_reach_the_drive(void)
{
    battery(3240, 1620);
    battery(3240, 1620);
    TEST_ASSERT_INT_WITHIN(1, 3276, ecu.drive.request.limits.power_drive);
    TEST_ASSERT_INT_WITHIN(1, 1638, ecu.drive.request.limits.power_regen);
}

/* An enabled drive with this torque, in q15, whose own limits allow so much. */
static void run_with(int torque, int allowed)
{
    drive_until_enabled();
    ecu.arbitration_state = (arbitrate_state_t){.torque_arbitrated = torque * PER_UNIT_1};
    ecu.drive.task.allowed.torque_limited = (q15_t)allowed;
    ecu_task_1khz(&ecu);
}

/* The torque leaves with slew and jerk: the limit may not cut it off at once. */
void test_the_limit_of_the_drive_is_not_below_the_torque_that_is_still_arbitrated(void)
{
    run_with(6000, 6000);
    const int arbitrated = ecu.drive.request.torque_arbitrated;
    TEST_ASSERT_GREATER_THAN_INT(5000, arbitrated);
    ecu.rx.command.limit_drive_Nm = ecu.rx.command.limit_regen_Nm = 1.0F;
    ecu_convert(&ecu, true);
    ecu.drive.task.allowed.torque_limited = (q15_t)arbitrated;
    ecu_task_1khz(&ecu);
    TEST_ASSERT_GREATER_THAN_INT(4000, ecu.drive.request.torque_arbitrated);
    TEST_ASSERT_EQUAL_INT(ecu.drive.request.torque_arbitrated, ecu.drive.request.limits.torque_drive);
    TEST_ASSERT_EQUAL_INT(ecu.drive.request.torque_arbitrated, ecu.drive.request.limits.torque_regen);
}

/* When the limit rises again, the torque must rise from there. One jerk above the limit is allowed. */
void test_the_arbitrated_torque_does_not_stay_above_what_the_drive_can_give(void)
{
    run_with(6000, 1000);
    TEST_ASSERT_LESS_OR_EQUAL_INT(1000 + 2405007 / PER_UNIT_1 + 1, ecu.drive.request.torque_arbitrated);
}

/* The current of a tenth of a second at more than 100 N·m, which the bridge of a healthy drive makes. */
static uint32_t fault_of_current(int ms)
{
    board.converted = (current_counts_t){2048, 2048 + 650, 2048 - 650};
    uint32_t faults = 0;
    for (int n = 0; n < ms; n++) {
        ecu.drive.samples.slot[ecu.drive.samples.generation % SAMPLE_SLOTS].acting = true;
        ecu_task_1khz(&ecu);
        faults |= ecu.drive.request.faults;
    }
    return faults;
}

void test_the_second_level_permits_the_torque_that_the_bus_has_requested(void)
{
    command(MODE_TORQUE | ENABLE, 1320, 2 * CYCLE_MS);
    TEST_ASSERT_EQUAL_HEX32(0, fault_of_current(30));
}

void test_the_second_level_does_not_permit_more_than_the_bus_has_requested(void)
{
    command(MODE_TORQUE | ENABLE, 100, 2 * CYCLE_MS);
    TEST_ASSERT_EQUAL_HEX32(FAULT_TORQUE, fault_of_current(30));
}

/* It has a time-out of 35 ms of its own, and its bound falls with the calibrated slew. */
void test_the_second_level_permits_no_torque_any_more_after_the_commands_have_ended(void)
{
    command(MODE_TORQUE | ENABLE, 1320, 2 * CYCLE_MS);
    TEST_ASSERT_GREATER_THAN_INT32(10000, ecu.second_level.permitted.positive.bound);
    tasks(500);
    TEST_ASSERT_EQUAL_INT32(0, ecu.second_level.permitted.positive.bound);
    TEST_ASSERT_EQUAL_HEX32(FAULT_TORQUE, fault_of_current(30));
}

/* The same currents in the q axis, and a quarter of an electrical turn later in the d axis, where they make none
 * without a current in the q axis. */
void test_the_second_level_uses_the_angle_of_its_sample(void)
{
    static const uint32_t quarter = (uint32_t)(0x100000000ULL / 4U / 3U); /* 3 pole pairs */
    board.converted = (current_counts_t){2048, 2048 + 650, 2048 - 650};
    int32_t mean[2];
    for (uint32_t n = 0; n < 2U; n++) {
        ecu_init(&ecu, &motor);
        sample_t *sample = &ecu.drive.samples.slot[ecu.drive.samples.generation % SAMPLE_SLOTS];
        sample->acting = true;
        sample->theta_m = n * quarter;
        ecu_task_1khz(&ecu);
        mean[n] = ecu.second_level.mean_q8;
    }
    TEST_ASSERT_GREATER_THAN_INT32(0, mean[0]);
    TEST_ASSERT_INT32_WITHIN(mean[0] / 20, 0, mean[1]);
}

void test_damaged_constants_of_the_second_level_are_a_fault_within_two_passes(void)
{
    static second_level_constants_t damaged;
    static motor_t other;
    damaged = *motor.second_level;
    damaged.tolerance ^= 0x100;
    other = motor;
    other.second_level = &damaged;
    ecu_init(&ecu, &other);
    tasks(2 * (int)(sizeof damaged / SECOND_LEVEL_SLICE) + 2);
    TEST_ASSERT_EQUAL_HEX32(FAULT_CONFIG, ecu.drive.fast.faults & FAULT_CONFIG);
    TEST_ASSERT_EQUAL_INT(MOTOR_CHECK_LIVE_DATA, drive_motor_check(&ecu.drive));
}

/* Two of the three copies are right. The step itself uses the pointer: it is restored before. */
void test_a_damaged_pointer_to_the_motor_data_is_restored_before_it_is_used(void)
{
    tasks(10);
    ecu.drive.motor = NULL;
    ecu_task_1khz(&ecu);
    TEST_ASSERT_EQUAL_PTR(&motor, ecu.drive.motor);
}

/* The state is in the bits from 12 on of INV_Status. */
void test_state_and_faults_of_the_state_machine_are_transmitted(void)
{
    tasks(200);
    TEST_ASSERT_EQUAL_HEX8(STATE_STANDBY << 4, board.last[STATUS_ID].data[1] & 0xF0U);
    board.gate_fault = true;
    tasks(20);
    TEST_ASSERT_EQUAL_HEX8(ecu.supervisor.state << 4, board.last[STATUS_ID].data[1] & 0xF0U);
    TEST_ASSERT_NOT_EQUAL(STATE_STANDBY, ecu.supervisor.state);
}

static unsigned word_of(uint32_t id, int at)
{
    return board.last[id].data[at] | (unsigned)board.last[id].data[at + 1] << 8;
}

void test_what_the_port_counts_is_transmitted(void)
{
    hal_can_lost_IgnoreAndReturn(0x1234);
    hal_can_bus_off_IgnoreAndReturn(0x56);
    hal_system_stack_unused_IgnoreAndReturn(0x789);
    hal_system_reset_cause_IgnoreAndReturn(RESET_WATCHDOG);
    tasks(200);
    TEST_ASSERT_EQUAL_HEX(0x1234, word_of(DIAG_BUS_ID, 0));
    TEST_ASSERT_EQUAL_HEX(0x56, board.last[DIAG_BUS_ID].data[6]);
    TEST_ASSERT_EQUAL_HEX(0x789, word_of(DIAG_TASK_ID, 4));
    TEST_ASSERT_EQUAL_HEX(RESET_WATCHDOG, board.last[DIAG_TASK_ID].data[6] & 0x0FU);
}

void test_gates_that_read_back_as_enabled_in_the_test_of_the_shut_off_paths_are_a_fault(void)
{
    board.fitted = true;
    board.supply = false;
    board.switching = true;
    tasks(5);
    TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_GATE_DISABLE, ecu.supervisor.faults);
}

/* The supply is missing for more than 10 ms although the state needs it. */
void test_a_supply_that_goes_missing_while_the_drive_needs_it_is_a_fault(void)
{
    drive_until_enabled();
    ecu.shut_off.stage = 1; /* a watchdog is fitted, and the test has passed */
    ecu_seal_flags(&ecu);
    board.fitted = true;
    board.supply = false;
    command(MODE_TORQUE | ENABLE, 0, 10);
    TEST_ASSERT_EQUAL_HEX16(0, ecu.supervisor.faults);
    command(MODE_TORQUE | ENABLE, 0, 2);
    TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_GATE_SUPPLY, ecu.supervisor.faults);
}

/* Without a tool's capture each first fault leaves one, also a fault outside of the drive. */
void test_a_fault_of_the_state_machine_freezes_scope_and_freeze_frame(void)
{
    tasks(100);
    TEST_ASSERT_EQUAL_UINT8(0, ecu.scope.capture.frozen);
    TEST_ASSERT_EQUAL_UINT8(0, ecu.freeze.frozen);
    board.gate_fault = true;
    tasks(2);
    TEST_ASSERT_EQUAL_UINT8(1, ecu.scope.capture.frozen);
    TEST_ASSERT_EQUAL_UINT8(1, ecu.freeze.frozen);
    TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_GATE, ecu.freeze.ecu_faults);
}

void test_the_measurements_for_the_calibration_tool_are_taken_in_each_step(void)
{
    tasks(1);
    TEST_ASSERT_INT_WITHIN(60, (int)(350.0 * COUNT_PER_V), ecu.xcp.measurements.v_dc_V);
    board.counts.v_dc /= 2U;
    tasks(1);
    TEST_ASSERT_INT_WITHIN(60, (int)(175.0 * COUNT_PER_V), ecu.xcp.measurements.v_dc_V);
}

void test_the_step_is_rounded_to_the_nearest_nanosecond(void)
{
    static motor_t other;
    other = motor;
    for (int n = 0; n < 64; n++) {
        other.bases.step_s = 0.0009F + (float)n * 6e-11F;
        ecu_init(&ecu, &other);
        const double wanted = (double)(other.bases.step_s * 1e9F);
        TEST_ASSERT_TRUE(fabs((double)(ecu.clock.step_us * 1000U + ecu.clock.step_ns) - wanted) <= 0.5);
    }
}
