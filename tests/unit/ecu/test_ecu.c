/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "calibration/calibration.h"
#include "dc_sensor_sample.h"
#include "drive/data_check.h"
#include "ecu/ecu_private.h"
#include "ecu_bench.h"
#include "unity.h"

/* The signatures of docs/theory/third-level.md, (QA-1) and (QA-2), in another arithmetic. */
static uint32_t right_answer(uint64_t asked)
{
    uint64_t first = asked, second = asked;
    for (uint64_t n = 1; n <= 9; n++) {
        first = ((first / 2U) + (first % 2U << 31)) ^ (n * 2654435761ULL % 4294967296ULL);
    }
    for (uint64_t n = 81; n <= 83; n++) {
        second = (second ^ n) * 16777619ULL % 4294967296ULL;
    }
    return (uint32_t)(first ^ second);
}

void setUp(void)
{
    board_start();
}

void tearDown(void)
{
}

void test_each_question_has_the_answer_of_the_documented_signatures(void)
{
    board.fitted = true;
    board.switching = false;
    for (board.question = 0; board.question < 16U; board.question++) {
        ecu.shut_off.tested = true; /* the test would want wrong answers */
        tasks(1);
        TEST_ASSERT_EQUAL_HEX32(right_answer(board.question), board.answered);
    }
}

/* Up to 39 periods are a late task, which has a fault of its own. */
void test_an_interrupt_that_stands_still_or_runs_away_makes_the_answer_wrong(void)
{
    static const struct {
        int periods;
        bool right;
    } cases[] = {{10, true}, {0, false}, {1, true}, {39, true}, {40, false}, {10, true}};
    board.fitted = true;
    board.question = 5;
    for (unsigned n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        task_after(cases[n].periods);
        TEST_ASSERT_EQUAL(cases[n].right, board.answered == right_answer(5));
    }
}

void test_the_test_at_start_gives_wrong_answers_and_switches_the_supply(void)
{
    board.fitted = true;
    board.switching = false;
    board.supply = false;
    tasks(1);
    TEST_ASSERT_TRUE(board.outputs[BOARD_GATE_DRIVER]);
    board.supply = true;
    tasks(2);
    TEST_ASSERT_FALSE(board.outputs[BOARD_GATE_DRIVER]);
    board.supply = false;
    tasks(2);
    TEST_ASSERT_TRUE(board.outputs[BOARD_GATE_DRIVER]);
    board.supply = true;
    tasks(2);
    TEST_ASSERT_EQUAL_HEX32(~right_answer(0), board.answered);
    board.supply = false;
    tasks(2);
    TEST_ASSERT_EQUAL_HEX32(right_answer(0), board.answered);
    board.supply = true;
    tasks(2);
    TEST_ASSERT_TRUE(ecu.shut_off.tested);
    TEST_ASSERT_FALSE(board.outputs[BOARD_GATE_DRIVER]);
}

static void enter(ecu_state_t state)
{
    ecu.supervisor.state = state;
    ecu_seal_flags(&ecu);
    tasks(1);
    TEST_ASSERT_EQUAL_INT(state, ecu.supervisor.state);
}

/* With the dc link connected the test would switch a supply that the bridge may need. */
void test_the_test_waits_where_the_dc_link_is_connected_and_the_supply_follows_the_state(void)
{
    board.fitted = true;
    board.switching = board.supply = false;
    enter(STATE_PRECHARGE);
    TEST_ASSERT_FALSE(board.outputs[BOARD_GATE_DRIVER]);
    enter(STATE_READY);
    TEST_ASSERT_TRUE(board.outputs[BOARD_GATE_DRIVER]);
    TEST_ASSERT_FALSE(ecu.shut_off.supply_on);
    enter(STATE_STANDBY);
    TEST_ASSERT_TRUE(ecu.shut_off.supply_on && board.outputs[BOARD_GATE_DRIVER]);
}

/* A tenth and a fifth of T_b; without a valid command both are zero. */
void test_the_vehicles_limits_reach_the_drive_in_the_same_step(void)
{
    ecu.rx.command.limit_drive_Nm = 29.4664F;
    ecu.rx.command.limit_regen_Nm = 58.9328F;
    ecu.rx.command_channel.alive = true;
    ecu_convert(&ecu, true);
    tasks(1);
    TEST_ASSERT_EQUAL_INT(3277, ecu.drive.request.limits.torque_drive);
    TEST_ASSERT_EQUAL_INT(6554, ecu.drive.request.limits.torque_regen);
    ecu.rx.command_channel.alive = false;
    tasks(1);
    TEST_ASSERT_EQUAL_INT(0, ecu.drive.request.limits.torque_drive);
    TEST_ASSERT_EQUAL_INT(0, ecu.drive.request.limits.torque_regen);
}

/* The conversion is in floating point: a step without a frame does not need its time. */
void test_a_step_without_a_frame_keeps_the_commands_that_were_converted_with_the_last_one(void)
{
    ecu.rx.command_channel.alive = true;
    ecu_seal_flags(&ecu);
    ecu.rx.command.torque_requested_Nm = 29.4664F;
    tasks(1);
    TEST_ASSERT_EQUAL_INT(0, ecu.commanded.torque_requested);
}

/* 132 N·m are 14679 counts, 962002944 in q31. The slew makes this in 40 ms, the jerk makes the full rate in 10 ms, the
 * ramp takes full torque to zero in 15 ms; it is rounded up, so that it ends in time. 0.25 N·m of 294.664 N·m are 27.8
 * counts. */
void test_the_torque_changes_at_the_rates_of_the_bus_documentation(void)
{
    TEST_ASSERT_EQUAL_INT32(24050073, ecu.arbitration_config.slew);
    TEST_ASSERT_EQUAL_INT32(2405007, ecu.arbitration_config.jerk);
    TEST_ASSERT_EQUAL_INT32(64133530, ecu.arbitration_config.ramp_out);
    TEST_ASSERT_EQUAL_INT(28, ecu.arbitration_config.dead_band);
}

/* 8 periods at 9 kHz are a step of 888.889 us, in which 0.889 of the change per millisecond is allowed. The tolerance
 * is 2^-24, the rounding of single precision. */
void test_the_rates_hold_in_true_time_for_a_step_that_is_not_a_millisecond(void)
{
    static motor_t other;
    other = motor;
    other.bases.step_s = 8.0F / 9000.0F;
    ecu_init(&ecu, &other);
    TEST_ASSERT_EQUAL_UINT32(888, ecu.clock.step_us);
    TEST_ASSERT_UINT32_WITHIN(1, 889, ecu.clock.step_ns);
    TEST_ASSERT_INT32_WITHIN(30, 21377843, ecu.arbitration_config.slew);
    TEST_ASSERT_INT32_WITHIN(3, 1900253, ecu.arbitration_config.jerk);
    TEST_ASSERT_INT32_WITHIN(80, 57007582, ecu.arbitration_config.ramp_out);
}

void test_the_watchdog_is_started_once_and_then_served_by_every_task(void)
{
    tasks(100);
    TEST_ASSERT_EQUAL_INT(1, board.watchdog_starts);
    TEST_ASSERT_EQUAL_INT(99, board.watchdog_services);
    TEST_ASSERT_EQUAL_UINT16(0, ecu.liveness.held);
}

void test_the_watchdog_is_not_served_while_the_fast_interrupt_is_stalled(void)
{
    tasks(10);
    const int before = board.watchdog_services;
    for (int n = 0; n < 5; n++) {
        task_after(0);
    }
    TEST_ASSERT_EQUAL_INT(before, board.watchdog_services);
    TEST_ASSERT_EQUAL_UINT16(5, ecu.liveness.held);
    TEST_ASSERT_TRUE(board.outputs[BOARD_SAFE_STATE]);
    TEST_ASSERT_TRUE((ecu.supervisor.faults & ECU_FAULT_STALL) != 0U);
}

void test_the_watchdog_is_not_served_while_the_identification_is_stalled(void)
{
    tasks(10);
    const int before = board.watchdog_services;
    ecu.drive.request.identification_mode = IDENTIFICATION_PAPER;
    data_check_accept_options(&ecu.drive);
    board.mrai_hangs = true;
    tasks(5);
    TEST_ASSERT_EQUAL_INT(before, board.watchdog_services);
    TEST_ASSERT_EQUAL_UINT16(5, ecu.liveness.held);
}

/* All of it would act until the next start. */
void test_damaged_options_and_rates_are_a_fault_in_the_next_step(void)
{
    bool *const options[] = {&ecu.drive.request.current_mode, &ecu.drive.request.torque_loop,
                             &ecu.drive.request.identification, &ecu.drive.request.trim};
    int32_t *const rates[] = {&ecu.arbitration_config.slew, &ecu.arbitration_config.jerk,
                              &ecu.arbitration_config.ramp_out, &ecu.arbitration_config.omega_standstill};
    for (unsigned k = 0; k < 9U; k++) {
        ecu_init(&ecu, &motor);
        tasks(10);
        TEST_ASSERT_EQUAL_HEX32(0, ecu.drive.fast.faults);
        if (k < 4U) {
            *options[k] = !*options[k];
        } else if (k < 8U) {
            *rates[k - 4U] ^= 0x100;
        } else {
            ecu.arbitration_config.dead_band ^= 0x100;
        }
        tasks(2);
        TEST_ASSERT_EQUAL_HEX32(FAULT_CONFIG, ecu.drive.fast.faults);
        TEST_ASSERT_EQUAL_INT(MOTOR_CHECK_LIVE_DATA, drive_motor_check(&ecu.drive));
    }
}

/* Only a frame or a transition of the state machine would set them again. */
void test_a_damaged_flag_of_bus_or_state_machine_is_a_fault_in_the_next_step(void)
{
    void *const flags[] = {&ecu.rx.limits_channel.alive,   &ecu.rx.limits_channel.seen, &ecu.rx.command_channel.alive,
                           &ecu.rx.command_channel.failed, &ecu.supervisor.enabled,     &ecu.supervisor.enable_seen,
                           &ecu.supervisor.reset_seen,     &ecu.supervisor.state};
    for (unsigned k = 0; k < sizeof flags / sizeof flags[0]; k++) {
        ecu_init(&ecu, &motor);
        tasks(10);
        *(uint8_t *)flags[k] ^= 1U;
        tasks(2);
        TEST_ASSERT_EQUAL_HEX32(FAULT_CONFIG, ecu.drive.fast.faults);
        TEST_ASSERT_EQUAL_INT(MOTOR_CHECK_LIVE_DATA, drive_motor_check(&ecu.drive));
    }
}

/* The machine turns at the speed of the short circuit, and the bridge has no supply: only the board's hardware can hold
 * it. With the supply it is the firmware's. */
void test_without_gate_supply_the_hardware_holds_the_bridge_of_a_fast_machine(void)
{
    tasks(10);
    TEST_ASSERT_FALSE(board.outputs[BOARD_SAFE_STATE]);
    ecu.drive.task.safe_state.rectifies = true;
    task_after(10);
    TEST_ASSERT_TRUE(board.outputs[BOARD_SAFE_STATE]);
    ecu.supervisor.state = STATE_SAFE_STATE;
    ecu.drive.task.safe_state = (safe_state_state_t){.rectifies = true, .line_emf = Q15_MAX, .speed = Q15_MAX};
    ecu_seal_flags(&ecu);
    task_after(10);
    TEST_ASSERT_TRUE(board.outputs[BOARD_GATE_DRIVER]);
    TEST_ASSERT_FALSE(board.outputs[BOARD_SAFE_STATE]);
}

void test_until_the_speed_is_known_the_hardware_holds_the_bridge(void)
{
    task_after(10);
    TEST_ASSERT_TRUE(board.outputs[BOARD_SAFE_STATE]);
    task_after(10);
    TEST_ASSERT_FALSE(board.outputs[BOARD_SAFE_STATE]);
}

/* The speed is still known, by what has outlasted the reset. */
void test_after_a_reset_at_speed_contactor_and_gate_supply_stay_on_from_the_first_step(void)
{
    ecu.drive.task.safe_state = (safe_state_state_t){.rectifies = true, .line_emf = Q15_MAX, .speed = Q15_MAX};
    ecu_continue(&ecu);
    task_after(10);
    TEST_ASSERT_TRUE(board.outputs[BOARD_MAIN_CONTACTOR] && board.outputs[BOARD_GATE_DRIVER]);
    TEST_ASSERT_FALSE(board.outputs[BOARD_SAFE_STATE]);
    TEST_ASSERT_EQUAL_INT(STATE_SAFE_STATE, ecu.supervisor.state);
    task_after(10);
    TEST_ASSERT_EQUAL_HEX32(0, ecu.drive.fast.faults);
}

void test_one_millisecond_without_interrupts_is_no_fault_yet(void)
{
    tasks(10);
    task_after(0);
    tasks(1);
    task_after(0);
    tasks(10);
    TEST_ASSERT_EQUAL_HEX16(0, ecu.supervisor.faults);
    TEST_ASSERT_FALSE(board.outputs[BOARD_SAFE_STATE]);
}

void test_a_late_task_is_counted_and_three_in_a_row_are_a_fault(void)
{
    tasks(10);
    task_after(15);
    task_after(15);
    tasks(1);
    TEST_ASSERT_EQUAL_UINT16(2, ecu.liveness.task_overruns);
    TEST_ASSERT_EQUAL_HEX16(0, ecu.supervisor.faults);
    task_after(20);
    task_after(20);
    task_after(20);
    TEST_ASSERT_EQUAL_UINT16(5, ecu.liveness.task_overruns);
    TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_TASK, ecu.supervisor.faults);
}

void test_a_task_with_some_jitter_is_in_time(void)
{
    tasks(10);
    for (int n = 0; n < 100; n++) {
        task_after((n % 2 == 0) ? 14 : 6);
    }
    TEST_ASSERT_EQUAL_UINT16(0, ecu.liveness.task_overruns);
}

void test_a_gate_driver_fault_reaches_the_fault_word(void)
{
    tasks(100);
    board.gate_fault = true;
    tasks(1);
    TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_GATE, ecu.supervisor.faults);
}

/* In 100 ms: five messages every 10 ms, seven every 100 ms; the message of 1 s is due in the first 100 ms. */
void test_frames_that_find_no_mailbox_are_counted_and_not_kept(void)
{
    tasks(100);
    const int before = board.sent;
    TEST_ASSERT_EQUAL_INT(5 * 10 + 7 + 1, before);
    board.mailboxes_full = true;
    tasks(100);
    TEST_ASSERT_EQUAL_UINT16(5 * 10 + 7, ecu.not_sent);
    TEST_ASSERT_EQUAL_INT(before, board.sent);
    board.mailboxes_full = false;
    tasks(1);
    TEST_ASSERT_LESS_OR_EQUAL_INT(before + 1, board.sent);
}

/* Only INV_Identification, every 10 ms, contains the resistance. */
void test_a_frame_with_nan_is_counted_and_not_sent(void)
{
    static motor_t broken;
    broken = motor;
    broken.r_ohm_20 = NAN;
    ecu_init(&ecu, &broken);
    tasks(100);
    TEST_ASSERT_EQUAL_UINT16(10, ecu.not_sent);
    TEST_ASSERT_EQUAL_INT(4 * 10 + 7 + 1, board.sent);
}

/* CONNECT with two bytes; the answer begins with 0xFF. */
void test_a_command_of_the_calibration_tool_is_answered_in_the_same_task(void)
{
    board.arriving = (can_frame_t){.id = XCP_ID_COMMAND, .length = 2, .data = {0xFF, 0}};
    board.waiting = 1;
    tasks(1);
    TEST_ASSERT_EQUAL_INT(1, board.answers);
    TEST_ASSERT_EQUAL_HEX8(0xFF, board.last_answer.data[0]);
    TEST_ASSERT_EQUAL_UINT16(0, ecu.rx.count[RX_IGNORED]);
    tasks(5);
    TEST_ASSERT_EQUAL_INT(1, board.answers);
}

void test_an_answer_that_finds_no_mailbox_waits_for_one(void)
{
    board.arriving = (can_frame_t){.id = XCP_ID_COMMAND, .length = 2, .data = {0xFF, 0}};
    board.waiting = 1;
    board.mailboxes_full = true;
    tasks(5);
    TEST_ASSERT_EQUAL_INT(0, board.answers);
    board.mailboxes_full = false;
    tasks(2);
    TEST_ASSERT_EQUAL_INT(1, board.answers);
}

/* The same number as an extended identifier of 29 bits belongs to another sender. */
void test_an_extended_identifier_is_no_command_of_the_calibration_tool(void)
{
    board.arriving = (can_frame_t){.id = XCP_ID_COMMAND, .extended = true, .length = 2, .data = {0xFF, 0}};
    board.waiting = 1;
    tasks(2);
    TEST_ASSERT_EQUAL_INT(0, board.answers);
    TEST_ASSERT_EQUAL_UINT16(1, ecu.rx.count[RX_IGNORED]);
}

/* 32 frames are more than a bus of 1 Mbit/s can transmit in a millisecond. The limit bounds the time of the task. */
void test_a_task_takes_a_bounded_number_of_frames(void)
{
    board.waiting = 100;
    tasks(1);
    TEST_ASSERT_EQUAL_UINT16(32, ecu.rx.count[RX_IGNORED]);
}

void test_without_a_bus_nothing_is_switched_on(void)
{
    tasks(1000);
    TEST_ASSERT_EQUAL_INT(STATE_STANDBY, ecu.supervisor.state);
    for (int n = 0; n < BOARD_OUTPUTS; n++) {
        TEST_ASSERT_FALSE(board.outputs[n]);
    }
    TEST_ASSERT_FALSE(ecu.drive.request.enable);
}

void test_calibrating_one_value_keeps_the_measured_compensation(void)
{
    const compensation_t measured = {motor.parameters.modulate.dead_time_q16 / 2 + 100,
                                     motor.parameters.modulate.knee_q17, 1};
    TEST_ASSERT_TRUE(drive_compensate(&ecu.drive, &measured));
    ecu.xcp.xcp.ecu_page = XCP_PAGE_WORKING;
    ecu.xcp.working[CALIBRATION_observer_m] = 2.5F;
    ecu.xcp.xcp.generation++;
    xcp_access_step(&ecu.xcp, &ecu.drive, 1);
    TEST_ASSERT_FLOAT_WITHIN(0.001F, 2.5F, calibration_get(&ecu.drive, CALIBRATION_observer_m));
    TEST_ASSERT_EQUAL_INT(motor.parameters.modulate.dead_time_q16 + 200, ecu.drive.parameters.modulate.dead_time_q16);
    ecu.xcp.working[CALIBRATION_dead_time_compensation] = 0.5F;
    ecu.xcp.xcp.generation++;
    xcp_access_step(&ecu.xcp, &ecu.drive, 1);
    TEST_ASSERT_FLOAT_WITHIN(0.001F, 0.5F, calibration_get(&ecu.drive, CALIBRATION_dead_time_compensation));
}

/* Also that of a motor with a device drop, which the compensation contains. */
void test_a_calibration_value_that_was_read_may_be_written_back_and_changes_nothing(void)
{
    for (calibration_id_t id = (calibration_id_t)0; id < CALIBRATION_COUNT; id++) {
        const motor_parameters_t before = ecu.drive.parameters;
        const float value = calibration_get(&ecu.drive, id);
        TEST_ASSERT_TRUE(value >= calibration_info[id].lo && value <= calibration_info[id].hi);
        calibration_set(&ecu.drive, id, value);
        TEST_ASSERT_FLOAT_WITHIN(1e-3F * value, value, calibration_get(&ecu.drive, id));
        TEST_ASSERT_INT_WITHIN(2, before.modulate.dead_time_q16, ecu.drive.parameters.modulate.dead_time_q16);
    }
    TEST_ASSERT_FLOAT_WITHIN(0.001F, 1.0F, calibration_get(&ecu.drive, CALIBRATION_dead_time_compensation));
}

/* The drive stores the smallest accepted value of each calibration as a value above zero. */
void test_the_smallest_value_of_a_calibration_is_one_step_of_its_format(void)
{
    for (int k = 0; k < CALIBRATION_COUNT; k++) {
        const calibration_id_t id = (calibration_id_t)k;
        const float least = calibration_range(&ecu.drive, id).least;
        TEST_ASSERT_EQUAL_FLOAT(least, ecu.xcp.limits[k].least);
        TEST_ASSERT_TRUE(least >= 0.0F && least < 0.05F * calibration_info[k].hi);
        if (least > 0.0F) {
            calibration_set(&ecu.drive, id, 1.001F * least);
            TEST_ASSERT_TRUE(calibration_get(&ecu.drive, id) > 0.0F);
            TEST_ASSERT_TRUE(ecu.drive.mrai_parameters.psi_drift_full > 0);
            TEST_ASSERT_TRUE(ecu.drive.mrai_parameters.r_drift_full > 0);
        }
    }
    calibration_set(&ecu.drive, CALIBRATION_torque_slew_Nm_per_s, 0.0F);
    TEST_ASSERT_EQUAL_INT(Q15_MAX, ecu.drive.parameters.torque_slew);
}

/* The frame contains the 32 ms of current before the fault, the newest last. A second fault and later currents do not
 * change it. */
void test_the_first_fault_freezes_the_values_before_it(void)
{
    freeze_frame_t frame = {0};
    measurements_t now = {.psi_f_Vs = 0.07F, .r_ohm = 0.02F, .motor_check = 3};
    for (int ms = 1; ms <= 100; ms++) {
        now.i_q_A = (int16_t)(10 * ms);
        now.speed_rpm = (ms == 99) ? 1e9F : -50.5F;
        now.fault_word = (ms >= 100) ? 4U : 0U;
        const bool changed = freeze_frame_step(&frame, &now, 0, (ms < 100) ? STATE_RUN : STATE_FAULT, 1);
        TEST_ASSERT_EQUAL(ms == 100, changed);
    }
    now.i_q_A = 7;
    now.fault_word = 6U;
    TEST_ASSERT_FALSE(freeze_frame_step(&frame, &now, 1, STATE_FAULT, 1));
    TEST_ASSERT_EQUAL_INT(1, frame.frozen);
    TEST_ASSERT_EQUAL_UINT32(100, frame.time_ms);
    TEST_ASSERT_EQUAL_UINT32(4, frame.fault_word);
    TEST_ASSERT_EQUAL_INT(0, frame.ecu_faults);
    TEST_ASSERT_EQUAL_INT(STATE_RUN, frame.state);
    TEST_ASSERT_EQUAL_FLOAT(0.07F, frame.psi_f_Vs);
    TEST_ASSERT_EQUAL_FLOAT(0.02F, frame.r_ohm);
    TEST_ASSERT_EQUAL_UINT8(3, frame.motor_check);
    for (int n = 0; n < 32; n++) {
        TEST_ASSERT_EQUAL_INT(10 * (69 + n), frame.i_q_A[(frame.oldest + (unsigned)n) % FREEZE_FRAME_SAMPLES]);
    }
    TEST_ASSERT_EQUAL_INT(-50, frame.speed_rpm[frame.oldest]);
    TEST_ASSERT_EQUAL_INT(32767, frame.speed_rpm[(frame.oldest + 30U) % FREEZE_FRAME_SAMPLES]);
    /* After the reset it records again, and the next fault is frozen. */
    now.fault_word = 0;
    TEST_ASSERT_TRUE(freeze_frame_step(&frame, &now, 0, STATE_STANDBY, 1));
    TEST_ASSERT_EQUAL_INT(0, frame.frozen);
    TEST_ASSERT_FALSE(freeze_frame_step(&frame, &now, 0, STATE_STANDBY, 1));
    TEST_ASSERT_TRUE(freeze_frame_step(&frame, &now, 8, STATE_FAULT, 1));
    TEST_ASSERT_EQUAL_INT(1, frame.frozen);
    TEST_ASSERT_EQUAL_INT(8, frame.ecu_faults);
    TEST_ASSERT_EQUAL_INT(STATE_STANDBY, frame.state);
}

/* A period that passes while the counts are read: they and the angle are taken from the next one. */
void test_the_second_level_takes_counts_and_angle_of_the_same_period(void)
{
    board.converted = (current_counts_t){2048, 2048 + 650, 2048 - 650};
    ecu_task_1khz(&ecu);
    TEST_ASSERT_EQUAL_INT32(0, ecu.second_level.mean_q8); /* the bridge does not switch */
    board.period_passes = true;
    ecu_task_1khz(&ecu);
    TEST_ASSERT_GREATER_THAN_INT32(0, ecu.second_level.mean_q8);
}

/* 0.37 of full scale in the q axis without any request, of which the first level's scaling knows nothing: 29 steps for
 * the mean and the confirmation, and one step until the drive has latched the fault. */
void test_torque_that_no_frame_permits_is_a_fault_of_the_drive(void)
{
    sample_t *sample = &ecu.drive.samples.slot[ecu.drive.samples.generation % SAMPLE_SLOTS];
    sample->acting = true;
    board.converted = (current_counts_t){2048, 2048 + 650, 2048 - 650};
    for (int n = 0; n < 30; n++) {
        ecu_task_1khz(&ecu);
    }
    TEST_ASSERT_EQUAL_HEX32(FAULT_TORQUE, ecu.drive.request.faults);
    sample->acting = false;
    ecu_task_1khz(&ecu);
    TEST_ASSERT_EQUAL_HEX32(FAULT_TORQUE,
                            ecu.drive.commands.slot[ecu.drive.commands.generation & 1U].faults & FAULT_TORQUE);
    TEST_ASSERT_EQUAL_HEX32(0, ecu.drive.request.faults);
}

static uint32_t latched_after_step_with_dc_gain(double gain)
{
    *sample_box_begin(&ecu.drive.samples) = sample_with_dc_gain(gain);
    sample_box_publish(&ecu.drive.samples);
    ecu_task_1khz(&ecu);
    return ecu.drive.commands.slot[ecu.drive.commands.generation & 1U].faults;
}

/* The drive latches it in the same step, the eighth of the wrong gain. */
void test_a_dc_voltage_sensor_whose_gain_jumps_is_a_fault_of_the_drive(void)
{
    for (int n = 0; n < 10; n++) {
        latched_after_step_with_dc_gain(1.0);
    }
    for (int n = 0; n < 7; n++) {
        TEST_ASSERT_EQUAL_HEX32(0, latched_after_step_with_dc_gain(1.2) & FAULT_INPUT);
    }
    TEST_ASSERT_EQUAL_HEX32(FAULT_INPUT, latched_after_step_with_dc_gain(1.2) & FAULT_INPUT);
}

/* The angle is not that of the second level's data, and the currents are those of a protected message. */
void test_the_second_level_compares_nothing_while_a_movement_is_agreed(void)
{
    sample_t *sample = &ecu.drive.samples.slot[ecu.drive.samples.generation % SAMPLE_SLOTS];
    sample->acting = true;
    ecu.supervisor.state = STATE_READY;
    ecu_seal_flags(&ecu);
    ecu.rx.commission = (bus_commission_t){.movement = MOVEMENT_SPIN, .pole_pairs = 3};
    ecu.rx.commission_channel.alive = true;
    board.converted = (current_counts_t){2048, 2048 + 650, 2048 - 650};
    for (int n = 0; n < 25; n++) {
        ecu.rx.commission_channel.age_us = 0;
        ecu_task_1khz(&ecu);
    }
    TEST_ASSERT_TRUE(movement_is_agreed(&ecu.drive.task.movement));
    TEST_ASSERT_EQUAL_INT32(0, ecu.second_level.mean_q8);
    TEST_ASSERT_EQUAL_HEX32(0, ecu.drive.request.faults);
}

void test_a_consent_to_pulses_leaves_the_second_level_as_it_is(void)
{
    sample_t *sample = &ecu.drive.samples.slot[ecu.drive.samples.generation % SAMPLE_SLOTS];
    sample->acting = true;
    ecu.supervisor.state = STATE_READY;
    ecu_seal_flags(&ecu);
    ecu.rx.commission = (bus_commission_t){.pulses = true};
    ecu.rx.commission_channel.alive = true;
    board.converted = (current_counts_t){2048, 2048 + 650, 2048 - 650};
    ecu_task_1khz(&ecu);
    TEST_ASSERT_TRUE(ecu.drive.request.pulses_agreed);
    TEST_ASSERT_FALSE(movement_is_agreed(&ecu.drive.task.movement));
    TEST_ASSERT_TRUE(ecu.second_level.mean_q8 != 0);
}

#define MID_SCALE 2048
#define D_COUNTS 600 /* 0.29 of full scale against the d axis, 0.32 in the q axis */
#define Q_COUNTS 560

/* The second level's torque of one step, with these currents, after a start that has recalled this value. */
static int32_t own_torque_after_recall(identify_index_t index, int32_t x_q27, bool confirmed)
{
    ecu_init(&ecu, &motor);
    identify_record_t record = drive_identified_record(&ecu.drive);
    record.x_q27[index] = x_q27;
    TEST_ASSERT_TRUE(drive_recall(&ecu.drive, &record));
    ecu.drive.task.recall.unconfirmed = !confirmed;
    board.converted = (current_counts_t){MID_SCALE - D_COUNTS, MID_SCALE + D_COUNTS / 2 + Q_COUNTS,
                                         MID_SCALE + D_COUNTS / 2 - Q_COUNTS};
    tasks(1); /* the fast ISR copies the deviation of the d axis in the periods of the next step */
    for (int n = 0; n < NOMINAL_PERIODS; n++) {
        fast_isr(&ecu.drive);
    }
    ecu.drive.samples.slot[ecu.drive.samples.generation % SAMPLE_SLOTS].acting = true;
    ecu_task_1khz(&ecu);
    return ecu.second_level.mean_q8;
}

/* A machine of another record: what it says would take a fifth of the torque from the second level's. */
void test_the_second_level_uses_recalled_values_when_they_are_confirmed(void)
{
    static const identify_index_t identified[] = {IDENTIFY_FLUX, IDENTIFY_LQ};
    for (unsigned n = 0; n < sizeof identified / sizeof *identified; n++) {
        const int32_t of_tables = own_torque_after_recall(identified[n], 0, true);
        TEST_ASSERT_GREATER_THAN_INT32(0, of_tables);
        const int32_t low = -3 * (int32_t)IDENTIFY_ONE_Q27;
        TEST_ASSERT_EQUAL_INT32(of_tables, own_torque_after_recall(identified[n], low, false));
        TEST_ASSERT_LESS_THAN_INT32(of_tables - of_tables / 20, own_torque_after_recall(identified[n], low, true));
    }
}
