/* SPDX-License-Identifier: Apache-2.0 */
#include "ecu/supervisor.h"
#include "unity.h"

static supervisor_t s;
static supervisor_in_t in;

/* No fault, valid commands, mode off, no dc voltage, standstill. */
void setUp(void)
{
    s = (supervisor_t){0};
    in = (supervisor_in_t){.alive = true,
                           .torque_requested_is_zero = true,
                           .torque_arbitrated_is_zero = true,
                           .dc_safe = true,
                           .dc_settled = true,
                           .dc_near_battery = true,
                           .shut_off_tested = true,
                           .sensors_plausible = true,
                           .angle_absolute = true,
                           .slow = true,
                           .elapsed_us = 1000};
}

void tearDown(void)
{
}

static ecu_state_t step(void)
{
    supervisor_step(&s, &in);
    return s.state;
}

static ecu_state_t steps(int count)
{
    for (int n = 0; n < count; n++) {
        supervisor_step(&s, &in);
    }
    return s.state;
}

/* Checks every step: with a check in every second step only, two alternating states would look like one. */
static void stays(ecu_state_t state, int count)
{
    for (int n = 0; n < count; n++) {
        TEST_ASSERT_EQUAL_INT(state, step());
    }
}

static void to_standby(void)
{
    TEST_ASSERT_EQUAL_INT(STATE_STANDBY, steps(60));
}

static void to_precharge(void)
{
    to_standby();
    in.torque_mode = true;
    TEST_ASSERT_EQUAL_INT(STATE_PRECHARGE, step());
}

static void voltage(bool there)
{
    in.dc_in_range = there;
    in.dc_safe = !there;
}

static void to_ready(void)
{
    to_precharge();
    voltage(true);
    TEST_ASSERT_EQUAL_INT(STATE_READY, step());
}

static void to_run(void)
{
    to_ready();
    in.enable = true;
    TEST_ASSERT_EQUAL_INT(STATE_RUN, step());
}

static void to_derate(void)
{
    to_run();
    in.derated = true;
    TEST_ASSERT_EQUAL_INT(STATE_DERATE, step());
}

static void to_safe(void)
{
    to_run();
    in.slow = false;
    in.drive_faults = 1;
    TEST_ASSERT_EQUAL_INT(STATE_SAFE_STATE, step());
}

static void to_fault(void)
{
    to_safe();
    in.slow = true;
    TEST_ASSERT_EQUAL_INT(STATE_FAULT, step());
}

static void to_discharge(void)
{
    to_ready();
    in.torque_mode = false;
    TEST_ASSERT_EQUAL_INT(STATE_DISCHARGE, step());
}

void test_start_up_ends_in_standby_when_the_measurement_is_plausible_but_not_before_50_ms(void)
{
    stays(STATE_INIT, 50);
    TEST_ASSERT_EQUAL_INT(STATE_STANDBY, step());
    setUp();
    in.sensors_plausible = false;
    stays(STATE_INIT, 200);
    in.sensors_plausible = true;
    TEST_ASSERT_EQUAL_INT(STATE_STANDBY, step());
}

void test_start_up_without_a_plausible_measurement_is_a_fault_after_500_ms(void)
{
    in.sensors_plausible = false;
    TEST_ASSERT_EQUAL_INT(STATE_INIT, steps(500));
    TEST_ASSERT_EQUAL_INT(STATE_FAULT, step());
    TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_SELF_TEST, s.faults);
    TEST_ASSERT_EQUAL_UINT8(33 + 6, s.first_fault);
}

/* The state is left in the first step in which more than its time has passed. */
static void leaves_after(ecu_state_t state, uint32_t ms)
{
    uint32_t us = 0;
    while (s.state == state && us < 6000000U) {
        us += in.elapsed_us;
        (void)step();
    }
    TEST_ASSERT_TRUE(us > ms * 1000U && us <= ms * 1000U + in.elapsed_us);
}

void test_the_times_of_the_states_hold_for_steps_that_are_not_a_millisecond(void)
{
    static const uint32_t step_us[] = {889U, 978U, 1000U, 1091U, 1111U};
    for (unsigned k = 0; k < sizeof step_us / sizeof step_us[0]; k++) {
        setUp();
        in.elapsed_us = step_us[k];
        leaves_after(STATE_INIT, 50);
        setUp();
        in.elapsed_us = step_us[k];
        in.sensors_plausible = false;
        leaves_after(STATE_INIT, 500);
        setUp();
        in.elapsed_us = step_us[k];
        to_precharge();
        leaves_after(STATE_PRECHARGE, 2000);
        setUp();
        in.elapsed_us = step_us[k];
        to_discharge();
        leaves_after(STATE_DISCHARGE, 5000);
    }
}

/* 32 bits of microseconds would wrap after 72 minutes; the count stops at one minute. */
void test_the_time_in_a_state_does_not_wrap(void)
{
    to_standby();
    in.elapsed_us = 1111;
    stays(STATE_STANDBY, 54055); /* 60.06 s */
    const uint32_t us = s.us;
    TEST_ASSERT_UINT32_WITHIN(1111, 60000000U, us);
    stays(STATE_STANDBY, 1000);
    TEST_ASSERT_EQUAL_UINT32(us, s.us);
    s.us = 59999999U;
    stays(STATE_STANDBY, 1);
    TEST_ASSERT_EQUAL_UINT32(60001110U, s.us);
    s.us = 60000000U;
    stays(STATE_STANDBY, 1);
    TEST_ASSERT_EQUAL_UINT32(60000000U, s.us);
}

void test_without_a_test_of_the_shut_off_paths_there_is_neither_standby_nor_precharge(void)
{
    in.shut_off_tested = false;
    stays(STATE_INIT, 500);
    TEST_ASSERT_EQUAL_INT(STATE_FAULT, step());
    TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_SELF_TEST, s.faults);
    setUp();
    to_standby();
    in.torque_mode = true;
    in.shut_off_tested = false;
    stays(STATE_STANDBY, 100);
    in.shut_off_tested = true;
    TEST_ASSERT_EQUAL_INT(STATE_PRECHARGE, step());
}

void test_a_shut_off_path_that_fails_trips_and_is_named(void)
{
    static const uint16_t faults[] = {ECU_FAULT_GATE_DISABLE, ECU_FAULT_GATE_SUPPLY, ECU_FAULT_WATCHDOG};
    for (unsigned n = 0; n < sizeof faults / sizeof faults[0]; n++) {
        setUp();
        to_run();
        in.torque_arbitrated_is_zero = false;
        in.shut_off_faults = faults[n];
        TEST_ASSERT_EQUAL_INT(STATE_SAFE_STATE, step());
        TEST_ASSERT_EQUAL_HEX16(faults[n], s.faults);
        TEST_ASSERT_EQUAL_UINT8(33U + 8U + n, s.first_fault);
    }
}

void test_bad_motor_data_end_in_fault(void)
{
    in.drive_faults = 1U << 7;
    TEST_ASSERT_EQUAL_INT(STATE_FAULT, step());
    TEST_ASSERT_EQUAL_UINT8(8, s.first_fault);
}

void test_precharge_closes_the_main_contactor_when_the_voltage_has_settled(void)
{
    to_precharge();
    TEST_ASSERT_TRUE(supervisor_outputs[s.state].precharge);
    TEST_ASSERT_FALSE(supervisor_outputs[s.state].contactor);
    voltage(true);
    in.dc_settled = false;
    TEST_ASSERT_EQUAL_INT(STATE_PRECHARGE, steps(10));
    in.dc_settled = true;
    TEST_ASSERT_EQUAL_INT(STATE_READY, step());
    TEST_ASSERT_TRUE(supervisor_outputs[s.state].contactor);
    TEST_ASSERT_FALSE(supervisor_outputs[s.state].precharge);
}

void test_precharge_that_takes_longer_than_2_s_is_a_fault(void)
{
    to_precharge();
    TEST_ASSERT_EQUAL_INT(STATE_PRECHARGE, steps(2000));
    TEST_ASSERT_EQUAL_INT(STATE_FAULT, step());
    TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_PRECHARGE, s.faults);
}

void test_bad_commands_end_ready_at_once_and_derate_when_no_torque_is_left(void)
{
    to_ready();
    in.failed = true;
    TEST_ASSERT_EQUAL_INT(STATE_SAFE_STATE, step());
    setUp();
    to_derate();
    in.failed = true;
    in.torque_arbitrated_is_zero = false;
    stays(STATE_DERATE, 10);
    in.torque_arbitrated_is_zero = true;
    TEST_ASSERT_EQUAL_INT(STATE_SAFE_STATE, step());
}

/* The battery's voltage comes in the step in which the time ends. */
void test_a_precharge_that_ends_too_late_is_the_fault_of_the_precharge(void)
{
    to_precharge();
    stays(STATE_PRECHARGE, 2000);
    voltage(true);
    TEST_ASSERT_EQUAL_INT(STATE_FAULT, step());
    TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_PRECHARGE, s.faults);
}

void test_a_dc_link_that_settles_beside_the_battery_is_a_fault_of_its_own_after_2_s(void)
{
    to_precharge();
    voltage(true);
    in.dc_near_battery = false;
    stays(STATE_PRECHARGE, 2000);
    TEST_ASSERT_EQUAL_INT(STATE_FAULT, step());
    TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_BATTERY_VOLTAGE, s.faults);
    TEST_ASSERT_EQUAL_UINT8(33 + 7, s.first_fault);
}

/* Without a voltage in range that has settled the precharge has not ended, whatever the battery's voltage is. */
void test_a_dc_link_that_does_not_charge_is_the_fault_of_the_precharge(void)
{
    for (int n = 0; n < 2; n++) {
        setUp();
        to_precharge();
        in.dc_near_battery = false;
        voltage(n == 1);
        in.dc_settled = n == 0;
        stays(STATE_PRECHARGE, 2000);
        TEST_ASSERT_EQUAL_INT(STATE_FAULT, step());
        TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_PRECHARGE, s.faults);
    }
}

void test_a_precharge_ends_when_the_voltage_comes_near_the_battery(void)
{
    to_precharge();
    voltage(true);
    in.dc_near_battery = false;
    stays(STATE_PRECHARGE, 1000);
    in.dc_near_battery = true;
    TEST_ASSERT_EQUAL_INT(STATE_READY, step());
}

void test_a_dc_voltage_that_contradicts_the_battery_ends_the_torque_by_a_ramp(void)
{
    to_run();
    in.torque_arbitrated_is_zero = false;
    in.dc_contradicts = true;
    stays(STATE_RUN, 10);
    TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_BATTERY_VOLTAGE, s.faults);
    in.torque_arbitrated_is_zero = true;
    TEST_ASSERT_EQUAL_INT(STATE_SAFE_STATE, step());
    TEST_ASSERT_EQUAL_INT(STATE_FAULT, step());
}

void test_mode_off_ends_precharge_and_ready_in_discharge(void)
{
    to_precharge();
    in.torque_mode = false;
    TEST_ASSERT_EQUAL_INT(STATE_DISCHARGE, step());
    TEST_ASSERT_TRUE(supervisor_outputs[s.state].discharge);
    setUp();
    to_discharge();
    TEST_ASSERT_EQUAL_INT(STATE_DISCHARGE, steps(100));
    voltage(false);
    TEST_ASSERT_EQUAL_INT(STATE_STANDBY, step());
}

/* Without the battery a machine that turns fast would charge the capacitor again while it is discharged. */
void test_the_contactor_stays_closed_until_the_machine_is_slow(void)
{
    to_ready();
    in.slow = false;
    in.torque_mode = false;
    stays(STATE_READY, 100);
    in.slow = true;
    TEST_ASSERT_EQUAL_INT(STATE_DISCHARGE, step());
}

void test_a_discharge_that_takes_longer_than_5_s_is_a_fault_and_is_not_tried_again_until_reset(void)
{
    to_discharge();
    TEST_ASSERT_EQUAL_INT(STATE_DISCHARGE, steps(5000));
    TEST_ASSERT_EQUAL_INT(STATE_FAULT, step());
    TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_DISCHARGE, s.faults);
    stays(STATE_FAULT, 100);
}

void test_disable_leaves_run_and_derate_only_when_no_torque_is_left(void)
{
    for (int derate = 0; derate <= 1; derate++) {
        setUp();
        derate ? to_derate() : to_run();
        in.enable = false;
        in.torque_arbitrated_is_zero = false;
        (void)steps(20);
        TEST_ASSERT_TRUE(supervisor_outputs[s.state].run);
        in.torque_arbitrated_is_zero = true;
        TEST_ASSERT_EQUAL_INT(STATE_READY, step());
    }
}

void test_derating_starts_and_ends(void)
{
    to_derate();
    TEST_ASSERT_EQUAL_INT(STATE_DERATE, steps(5));
    in.derated = false;
    TEST_ASSERT_EQUAL_INT(STATE_RUN, step());
}

void test_a_drive_fault_trips_from_ready_run_and_derate_at_once(void)
{
    void (*const from[])(void) = {to_ready, to_run, to_derate};
    for (int n = 0; n < 3; n++) {
        setUp();
        from[n]();
        in.torque_arbitrated_is_zero = false;
        in.drive_faults = 4;
        TEST_ASSERT_EQUAL_INT(STATE_SAFE_STATE, step());
        TEST_ASSERT_FALSE(supervisor_outputs[s.state].run);
        TEST_ASSERT_EQUAL_UINT8(3, s.first_fault);
    }
}

void test_a_gate_driver_fault_and_a_stalled_interrupt_trip_too(void)
{
    to_run();
    in.gate_fault = true;
    TEST_ASSERT_EQUAL_INT(STATE_SAFE_STATE, step());
    TEST_ASSERT_EQUAL_UINT8(33 + 3, s.first_fault);
    setUp();
    to_run();
    in.stalled = true;
    TEST_ASSERT_EQUAL_INT(STATE_SAFE_STATE, step());
    TEST_ASSERT_EQUAL_UINT8(33 + 5, s.first_fault);
}

void test_bad_commands_and_a_late_task_end_the_torque_first_and_then_the_run(void)
{
    to_run();
    in.torque_arbitrated_is_zero = false;
    in.failed = true;
    TEST_ASSERT_EQUAL_INT(STATE_RUN, steps(10));
    TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_PROTECTION, s.faults);
    in.torque_arbitrated_is_zero = true;
    TEST_ASSERT_EQUAL_INT(STATE_SAFE_STATE, step());
    TEST_ASSERT_EQUAL_INT(STATE_FAULT, step());
    setUp();
    to_derate();
    in.task_late = true;
    in.slow = false;
    TEST_ASSERT_EQUAL_INT(STATE_SAFE_STATE, steps(1000)); /* the contactor stays closed while the machine turns */
    in.slow = true;
    TEST_ASSERT_EQUAL_INT(STATE_FAULT, step());
    TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_TASK, s.faults);
}

void test_the_safe_state_is_left_only_when_the_machine_is_slow(void)
{
    to_safe();
    TEST_ASSERT_EQUAL_INT(STATE_SAFE_STATE, steps(1000));
    TEST_ASSERT_TRUE(supervisor_outputs[s.state].contactor);
    in.slow = true;
    TEST_ASSERT_EQUAL_INT(STATE_FAULT, step());
    TEST_ASSERT_FALSE(supervisor_outputs[s.state].contactor);
}

void test_mode_off_in_fault_discharges_and_comes_back_to_fault(void)
{
    to_fault();
    in.torque_mode = false;
    in.enable = false;
    TEST_ASSERT_EQUAL_INT(STATE_DISCHARGE, step());
    stays(STATE_DISCHARGE, 100);
    voltage(false);
    stays(STATE_FAULT, 100);
}

void test_a_time_out_leads_from_run_to_ready_and_enable_must_be_off_before_on(void)
{
    to_run();
    in.alive = false;
    in.enable = false;
    in.torque_arbitrated_is_zero = false;
    TEST_ASSERT_EQUAL_INT(STATE_RUN, steps(15));
    in.torque_arbitrated_is_zero = true;
    TEST_ASSERT_EQUAL_INT(STATE_READY, step());
    TEST_ASSERT_EQUAL_INT(REFUSED_COMMAND_TIMED_OUT, s.refused);
    in.alive = true;
    in.enable = true; /* it was never off */
    TEST_ASSERT_EQUAL_INT(STATE_READY, steps(10));
    in.enable = false;
    TEST_ASSERT_EQUAL_INT(STATE_READY, step());
    in.enable = true;
    TEST_ASSERT_EQUAL_INT(STATE_RUN, step());
}

void test_after_a_time_out_while_disabled_enable_must_be_off_first_and_nothing_is_refused(void)
{
    to_ready();
    in.alive = false;
    stays(STATE_READY, 5);
    TEST_ASSERT_EQUAL_INT(REFUSED_NONE, s.refused);
    TEST_ASSERT_EQUAL_UINT8(0, s.refused_count);
    in.alive = true;
    in.enable = true;
    stays(STATE_READY, 5);
    in.enable = false;
    stays(STATE_READY, 1);
    in.enable = true;
    TEST_ASSERT_EQUAL_INT(STATE_RUN, step());
}

void test_mode_off_disables_although_enable_is_held(void)
{
    to_run();
    in.torque_mode = false;
    TEST_ASSERT_EQUAL_INT(STATE_READY, step());
    TEST_ASSERT_EQUAL_INT(STATE_DISCHARGE, step());
}

static void refused(refused_t why)
{
    const uint8_t before = s.refused_count;
    in.enable = true;
    (void)step();
    TEST_ASSERT_FALSE(supervisor_outputs[s.state].run);
    TEST_ASSERT_EQUAL_INT(why, s.refused);
    TEST_ASSERT_EQUAL_UINT8(before + 1, s.refused_count);
    /* The reason of the refusal ends: an enable that is still held must not act. */
    in.torque_requested_is_zero = true;
    in.dc_in_range = true;
    in.sensors_plausible = true;
    in.angle_absolute = true;
    in.current_mode = false;
    (void)steps(5);
    TEST_ASSERT_FALSE(supervisor_outputs[s.state].run);
    TEST_ASSERT_EQUAL_UINT8(before + 1, s.refused_count);
}

void test_enable_with_a_torque_request_is_refused(void)
{
    to_ready();
    in.torque_requested_is_zero = false;
    refused(REFUSED_TORQUE_REQUEST_NOT_ZERO);
}

void test_enable_with_the_dc_voltage_out_of_range_is_refused(void)
{
    to_ready();
    in.dc_in_range = false;
    refused(REFUSED_DC_VOLTAGE_OUT_OF_RANGE);
}

void test_enable_with_an_implausible_sensor_is_refused(void)
{
    to_ready();
    in.sensors_plausible = false;
    refused(REFUSED_SENSOR_IMPLAUSIBLE);
}

/* The encoder's index passes later: the next rising edge of enable is granted. */
void test_enable_without_an_absolute_angle_is_refused(void)
{
    to_ready();
    in.angle_absolute = false;
    refused(REFUSED_ANGLE_NOT_ABSOLUTE);
    in.enable = false;
    (void)step();
    in.enable = true;
    TEST_ASSERT_EQUAL_INT(STATE_RUN, step());
    TEST_ASSERT_EQUAL_INT(REFUSED_NONE, s.refused);
}

/* The agreed movement turns the shaft past the encoder's index. */
void test_enable_without_an_absolute_angle_is_granted_to_an_imposed_one(void)
{
    to_ready();
    in.angle_absolute = false;
    in.angle_imposed = true;
    in.enable = true;
    TEST_ASSERT_EQUAL_INT(STATE_RUN, step());
    TEST_ASSERT_EQUAL_INT(REFUSED_NONE, s.refused);
}

void test_enable_after_an_early_end_of_a_movement_is_refused(void)
{
    to_ready();
    in.movement_ended = true;
    refused(REFUSED_MOVEMENT_ENDED);
}

void test_the_early_end_of_a_movement_leaves_run_and_is_named(void)
{
    to_run();
    in.movement_ended = true;
    TEST_ASSERT_EQUAL_INT(STATE_READY, step());
    TEST_ASSERT_EQUAL_INT(REFUSED_MOVEMENT_ENDED, s.refused);
    const uint8_t before = s.refused_count;
    stays(STATE_READY, 5); /* enable is still on: one message */
    TEST_ASSERT_EQUAL_UINT8(before, s.refused_count);
    in.movement_ended = false;
    stays(STATE_READY, 5);
    in.enable = false;
    (void)step();
    in.enable = true;
    TEST_ASSERT_EQUAL_INT(STATE_RUN, step());
}

void test_enable_in_the_locked_current_mode_is_refused(void)
{
    to_ready();
    in.torque_mode = false;
    in.current_mode = true;
    refused(REFUSED_MODE_LOCKED);
}

void test_enable_before_ready_is_refused(void)
{
    to_precharge();
    refused(REFUSED_NOT_READY);
    setUp();
    to_standby();
    refused(REFUSED_NOT_READY);
    setUp();
    to_discharge();
    in.enable = true;
    TEST_ASSERT_EQUAL_INT(STATE_DISCHARGE, step());
    TEST_ASSERT_EQUAL_INT(REFUSED_NOT_READY, s.refused);
}

void test_enable_in_fault_is_refused(void)
{
    to_fault();
    in.enable = false;
    (void)step();
    refused(REFUSED_FAULT);
    setUp();
    to_run();
    in.gate_fault = true; /* none of the drive */
    TEST_ASSERT_EQUAL_INT(STATE_FAULT, steps(2));
    in.enable = false;
    (void)step();
    refused(REFUSED_FAULT);
}

static void reset(void)
{
    in.reset = true;
    (void)step();
    in.reset = false;
}

void test_a_reset_with_enable_off_clears_faults_that_have_ended(void)
{
    to_fault();
    in.enable = false;
    (void)step();
    reset();
    TEST_ASSERT_EQUAL_UINT32(1, s.resets);
    in.drive_faults = 0; /* the drive has reset its faults */
    TEST_ASSERT_EQUAL_INT(STATE_STANDBY, step());
    TEST_ASSERT_EQUAL_UINT8(0, s.first_fault);
    TEST_ASSERT_EQUAL_INT(STATE_PRECHARGE, step());
}

void test_a_reset_does_not_clear_a_fault_that_persists(void)
{
    to_fault();
    in.enable = false;
    in.gate_fault = true;
    (void)step();
    reset();
    TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_GATE, s.faults);
    TEST_ASSERT_EQUAL_UINT8(33 + 3, s.first_fault); /* latched again at once, before the drive has reset its fault */
    TEST_ASSERT_EQUAL_INT(STATE_FAULT, steps(10));
    setUp();
    to_fault();
    in.enable = false;
    (void)step();
    reset();
    (void)steps(2);
    TEST_ASSERT_EQUAL_UINT8(0, s.first_fault);
    (void)step();
    TEST_ASSERT_EQUAL_UINT8(1, s.first_fault); /* the fault of the drive persists and is reported again */
    TEST_ASSERT_EQUAL_INT(STATE_FAULT, steps(10));
}

void test_a_reset_while_enabled_or_outside_fault_is_refused(void)
{
    to_fault();
    in.enable = true;
    reset();
    TEST_ASSERT_EQUAL_UINT32(0, s.resets);
    TEST_ASSERT_EQUAL_INT(REFUSED_RESET_WHILE_ENABLED, s.refused);
    setUp();
    to_ready();
    reset();
    TEST_ASSERT_EQUAL_UINT32(0, s.resets);
    TEST_ASSERT_EQUAL_INT(REFUSED_RESET_WHILE_ENABLED, s.refused);
}

void test_a_held_reset_counts_once(void)
{
    to_fault();
    in.enable = false;
    in.reset = true;
    (void)steps(50);
    TEST_ASSERT_EQUAL_UINT32(1, s.resets);
}

void test_the_counts_of_faults_and_refusals_stop_at_255(void)
{
    to_standby();
    for (int n = 0; n < 300; n++) {
        in.reset = true;
        (void)step();
        in.reset = false;
        (void)step();
    }
    TEST_ASSERT_EQUAL_UINT8(255, s.refused_count);
    for (int n = 0; n < 300; n++) {
        in.drive_faults = 1;
        (void)step();
        in.drive_faults = 0;
        (void)step();
    }
    TEST_ASSERT_EQUAL_UINT8(255, s.fault_count);
}

/* The transitions that docs/howto/can.md describes: one row per state, one bit per state that may follow. */
#define TO(state) (1U << STATE_##state)
static const unsigned allowed[STATES] = {
    [STATE_INIT] = TO(STANDBY) | TO(FAULT),
    [STATE_STANDBY] = TO(PRECHARGE) | TO(FAULT),
    [STATE_PRECHARGE] = TO(READY) | TO(DISCHARGE) | TO(FAULT),
    [STATE_READY] = TO(RUN) | TO(DISCHARGE) | TO(SAFE_STATE),
    [STATE_RUN] = TO(READY) | TO(DERATE) | TO(SAFE_STATE),
    [STATE_DERATE] = TO(READY) | TO(RUN) | TO(SAFE_STATE),
    [STATE_SAFE_STATE] = TO(FAULT),
    [STATE_FAULT] = TO(STANDBY) | TO(DISCHARGE),
    [STATE_DISCHARGE] = TO(STANDBY) | TO(FAULT),
};

static supervisor_in_t inputs_of(unsigned bits)
{
    return (supervisor_in_t){
        .drive_faults = bits & 1U,
        .alive = (bits >> 1 & 1U) != 0U,
        .failed = (bits >> 2 & 1U) != 0U,
        .torque_mode = (bits >> 3 & 1U) != 0U,
        .current_mode = (bits >> 3 & 3U) == 2U, /* the modes exclude each other */
        .enable = (bits >> 5 & 1U) != 0U,
        .reset = (bits >> 6 & 1U) != 0U,
        .torque_requested_is_zero = (bits >> 7 & 1U) != 0U,
        .torque_arbitrated_is_zero = (bits >> 8 & 1U) != 0U,
        .dc_in_range = (bits >> 9 & 1U) != 0U,
        .dc_safe = (bits >> 9 & 3U) == 2U, /* never both */
        .dc_near_battery = (bits >> 9 & 3U) != 3U,
        .dc_settled = (bits >> 11 & 1U) != 0U,
        .sensors_plausible = (bits >> 12 & 1U) != 0U,
        .slow = (bits >> 13 & 1U) != 0U,
        .derated = (bits >> 14 & 1U) != 0U,
        .angle_absolute = (bits >> 13 & 3U) != 1U, /* whatever the other conditions of enable are */
        .angle_imposed = (bits >> 14 & 3U) == 2U,
        .gate_fault = (bits >> 15 & 1U) != 0U,
        .task_late = (bits >> 16 & 1U) != 0U,
        .stalled = (bits >> 17 & 1U) != 0U,
        .dc_contradicts = (bits >> 20 & 1U) != 0U,
        .shut_off_tested = true,
    };
}

/* Conditions that hold for any inputs. They are written here independently, not taken from the table of transitions. */
static void check_transition(const supervisor_t *before, const supervisor_in_t *now)
{
    const bool ran = before->state == STATE_RUN || before->state == STATE_DERATE;
    const bool runs = s.state == STATE_RUN || s.state == STATE_DERATE;
    TEST_ASSERT_TRUE(s.state == before->state || (allowed[before->state] >> s.state & 1U) != 0U);
    if (runs && !ran) {
        TEST_ASSERT_TRUE(before->state == STATE_READY && now->alive && now->torque_mode);
        TEST_ASSERT_TRUE(before->enabled ||
                         (now->enable && !before->enable_seen && now->torque_requested_is_zero && now->dc_in_range &&
                          now->sensors_plausible && (now->angle_absolute || now->angle_imposed)));
        TEST_ASSERT_TRUE(s.faults == 0U && now->drive_faults == 0U);
    }
    if (now->drive_faults != 0U || now->gate_fault || now->stalled) {
        TEST_ASSERT_FALSE(runs);
    }
    const state_outputs_t *was = &supervisor_outputs[before->state], *is = &supervisor_outputs[s.state];
    if ((was->contactor && !is->contactor) || (was->gate_driver && !is->gate_driver)) {
        TEST_ASSERT_TRUE(now->slow); /* a machine that turns fast would charge the dc link */
    }
    if (ran && !runs && now->drive_faults == 0U && s.faults == 0U) {
        /* Torque is never cut by a state that could have ramped it down. */
        TEST_ASSERT_TRUE(now->torque_arbitrated_is_zero);
    }
    if (is->contactor && !was->contactor) {
        TEST_ASSERT_TRUE(now->dc_in_range && now->dc_settled && now->dc_near_battery);
    }
    if (s.resets != before->resets) {
        TEST_ASSERT_TRUE(before->state == STATE_FAULT && now->alive && now->reset && !now->enable);
    }
}

/* Every state with every combination of inputs, with and without faults that were latched before. */
void test_no_combination_of_inputs_makes_a_forbidden_transition(void)
{
    static const uint16_t latched[] = {0, ECU_FAULT_PROTECTION, ECU_FAULT_GATE | ECU_FAULT_DISCHARGE};
    unsigned seen[STATES] = {0};
    for (unsigned state = 0; state < STATES * 3U; state++) {
        for (unsigned bits = 0; bits < 1U << 21; bits++) {
            const supervisor_t before = {.state = (ecu_state_t)(state % STATES),
                                         .us = 100000,
                                         .faults = latched[state / STATES],
                                         .enabled = (bits >> 18 & 1U) != 0U && supervisor_outputs[state % STATES].run,
                                         .enable_seen = (bits >> 19 & 1U) != 0U};
            in = inputs_of(bits);
            s = before;
            supervisor_step(&s, &in);
            check_transition(&before, &in);
            seen[before.state] |= (s.state != before.state) ? 1U << s.state : 0U;
        }
    }
    /* Every allowed transition must have been seen. The long time-outs have their own tests. */
    for (unsigned state = 0; state < STATES; state++) {
        TEST_ASSERT_EQUAL_HEX(allowed[state], seen[state]);
    }
}

void test_no_two_outputs_conflict(void)
{
    for (int state = 0; state < STATES; state++) {
        const state_outputs_t *o = &supervisor_outputs[state];
        TEST_ASSERT_FALSE(o->discharge && (o->precharge || o->contactor));
        TEST_ASSERT_FALSE(o->precharge && o->contactor);
        TEST_ASSERT_TRUE(!o->run || (o->contactor && o->gate_driver));
    }
}

void test_the_first_fault_stays_and_a_lasting_one_counts_once(void)
{
    to_run();
    in.gate_fault = true;
    (void)step();
    in.drive_faults = 1;
    (void)steps(10);
    TEST_ASSERT_EQUAL_UINT8(33 + 3, s.first_fault);
    TEST_ASSERT_EQUAL_UINT8(2, s.fault_count);
}

void test_a_reset_that_began_without_commands_counts_with_the_first_one(void)
{
    to_fault();
    in.enable = false;
    in.alive = false;
    in.reset = true;
    (void)step();
    TEST_ASSERT_EQUAL_UINT32(0, s.resets);
    in.alive = true;
    (void)step();
    TEST_ASSERT_EQUAL_UINT32(1, s.resets);
}

void test_init_ends_with_the_first_microsecond_beyond_50_ms(void)
{
    s.us = 49000;
    TEST_ASSERT_EQUAL_INT(STATE_INIT, step());
    s.us = 49001;
    TEST_ASSERT_EQUAL_INT(STATE_STANDBY, step());
}

void test_without_commands_the_dc_link_is_not_charged(void)
{
    to_standby();
    in.torque_mode = true;
    in.alive = false;
    stays(STATE_STANDBY, 10);
}

void test_the_locked_current_mode_is_not_off(void)
{
    to_ready();
    in.torque_mode = false;
    in.current_mode = true;
    stays(STATE_READY, 10);
}

void test_outside_ready_and_run_nothing_stays_enabled(void)
{
    to_safe();
    TEST_ASSERT_FALSE(s.enabled);
}

/* A row outside the rows of its state would never be taken. */
void test_the_rows_of_each_state_are_those_that_begin_in_it(void)
{
    TEST_ASSERT_EQUAL_INT(0, supervisor_first[0]);
    for (int state = 0; state < STATES; state++) {
        TEST_ASSERT_TRUE(supervisor_first[state] < supervisor_first[state + 1]);
        for (int row = supervisor_first[state]; row < supervisor_first[state + 1]; row++) {
            TEST_ASSERT_EQUAL_INT(state, supervisor_table[row].from);
        }
    }
}
