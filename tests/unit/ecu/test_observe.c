/* SPDX-License-Identifier: Apache-2.0 */
#include "dc_sensor_sample.h"
#include "ecu/ecu_private.h"
#include "hal/mock_angle.h"
#include "hal/mock_can.h"
#include "hal/mock_system.h"
#include "unity.h"

/* hsm1: V_b = 540 V, I_b = 400 A, T_b = 294.664 N·m, omega_b = 3298.6724 rad/s, torque_max = 132 N·m, 3 pole pairs. */
#define TORQUE_MAX 14679
#define US 1000U

static ecu_t ecu;
static sample_t sample;
static supervisor_in_t seen;

void setUp(void)
{
    hal_system_reset_cause_IgnoreAndReturn(RESET_PIN);
    hal_angle_is_absolute_IgnoreAndReturn(true);
    ecu_init(&ecu, &motor);
    ecu.clock.elapsed_us = US;
    ecu.tx.pending = UINT16_MAX; /* each message */
    sample = (sample_t){.v_dc = (int32_t)(350.0 * COUNT_PER_V)};
}

void tearDown(void)
{
}

/* Publishes the sample of a period and returns the inputs of the state machine. */
static const supervisor_in_t *observe(void)
{
    *sample_box_begin(&ecu.drive.samples) = sample;
    sample_box_publish(&ecu.drive.samples);
    ecu_convert(&ecu, true);
    seen = ecu_observe(&ecu, false);
    return &seen;
}

/* From what the bus commands now. */
static arbitrate_in_t arbitration(void)
{
    ecu_convert(&ecu, true);
    return ecu_arbitration(&ecu);
}

static torque_limits_t battery_limits(void)
{
    ecu_convert(&ecu, true);
    return ecu_limits(&ecu);
}

static const supervisor_in_t *observe_v(double v_dc_V)
{
    sample.v_dc = (int32_t)(v_dc_V * COUNT_PER_V);
    return observe();
}

static uint32_t reported_derating_reason(void)
{
    telemetry_t telemetry = {0};
    ecu_telemetry(&ecu, &telemetry);
    return telemetry.derating_reason;
}

/* The limits of 140 V and 437.5 V are 8495 and 26548 counts. */
void test_the_dc_voltage_is_in_range_between_the_monitors_limits_and_at_them(void)
{
    static const struct {
        int32_t v_dc;
        bool in_range;
    } cases[] = {{8494, false}, {8495, true}, {26548, true}, {26549, false}};
    for (unsigned n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        sample.v_dc = cases[n].v_dc;
        TEST_ASSERT_EQUAL(cases[n].in_range, observe()->dc_in_range);
    }
}

void test_the_dc_voltage_is_safe_to_touch_below_60_V(void)
{
    TEST_ASSERT_TRUE(observe_v(59.9)->dc_safe);
    TEST_ASSERT_FALSE(observe_v(60.1)->dc_safe);
}

/* The band is 1 % of V_b, 5.4 V or 328 counts, on both sides of the voltage at its start. */
static void settles_in_50_ms_at(double v_dc_V)
{
    ecu.supervisor.state = STATE_PRECHARGE;
    for (int ms = 0; ms < 50; ms++) {
        TEST_ASSERT_FALSE(observe_v(v_dc_V)->dc_settled);
    }
    TEST_ASSERT_TRUE(observe_v(v_dc_V)->dc_settled);
}

void test_the_dc_voltage_has_settled_after_50_ms_within_one_percent_of_the_base(void)
{
    settles_in_50_ms_at(350.0);
    const int32_t reference = sample.v_dc;
    for (int sign = -1; sign <= 1; sign += 2) {
        sample.v_dc = reference + sign * 328;
        TEST_ASSERT_TRUE(observe()->dc_settled);
    }
    settles_in_50_ms_at((reference + 329.5) / COUNT_PER_V);
    settles_in_50_ms_at((reference + 0.5) / COUNT_PER_V);
}

/* A turning machine can rectify 270 V for a long time before the precharge to the 350 V of the battery. */
void test_a_voltage_that_was_there_before_the_precharge_has_not_settled(void)
{
    ecu.supervisor.state = STATE_STANDBY;
    for (int ms = 0; ms < 1000; ms++) {
        TEST_ASSERT_FALSE(observe_v(270.0)->dc_settled);
    }
    ecu.supervisor.state = STATE_PRECHARGE;
    for (int ms = 0; ms < 49; ms++) {
        TEST_ASSERT_FALSE(observe_v(270.0)->dc_settled);
    }
}

void test_a_voltage_that_moves_must_settle_again_however_long_it_has_stayed(void)
{
    settles_in_50_ms_at(350.0);
    for (int ms = 0; ms < 10000; ms++) {
        TEST_ASSERT_TRUE(observe_v(350.0)->dc_settled);
    }
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(50000U + US, ecu.settling.us);
    settles_in_50_ms_at(340.0);
}

/* 300 V against 350 V; the states differ in the contactor. */
void test_the_dc_voltage_is_compared_with_the_battery_of_the_bus(void)
{
    TEST_ASSERT_TRUE(observe_v(300.0)->dc_near_battery);
    ecu.rx.battery_V = 350.0F;
    TEST_ASSERT_FALSE(observe_v(350.0)->dc_near_battery);
    ecu.rx.limits_channel.alive = true;
    TEST_ASSERT_TRUE(observe_v(350.0)->dc_near_battery);
    ecu.supervisor.state = STATE_PRECHARGE;
    for (int ms = 0; ms < 300; ms++) {
        TEST_ASSERT_FALSE(observe_v(300.0)->dc_near_battery);
        TEST_ASSERT_FALSE(seen.dc_contradicts);
    }
    ecu.supervisor.state = STATE_READY;
    for (int ms = 0; ms < 250; ms++) {
        TEST_ASSERT_FALSE(observe_v(300.0)->dc_contradicts);
    }
    TEST_ASSERT_TRUE(observe_v(300.0)->dc_contradicts);
}

/* The limit is 2 % of 400 A, 655 counts. */
void test_current_while_switching_is_disabled_is_implausible_in_either_axis_and_direction(void)
{
    static const dq_q15_t allowed[] = {{655, 0}, {-655, 0}, {0, 655}, {0, -655}, {655, -655}};
    static const dq_q15_t too_much[] = {{656, 0}, {-656, 0}, {0, 656}, {0, -656}};
    for (unsigned n = 0; n < sizeof allowed / sizeof allowed[0]; n++) {
        sample.point.i = allowed[n];
        TEST_ASSERT_TRUE(observe()->sensors_plausible);
    }
    for (unsigned n = 0; n < sizeof too_much / sizeof too_much[0]; n++) {
        sample.point.i = too_much[n];
        ecu.drive.task.run_state = RUN_STATE_OFF;
        TEST_ASSERT_FALSE(observe()->sensors_plausible);
        ecu.drive.task.run_state = RUN_STATE_RUN;
        TEST_ASSERT_TRUE(observe()->sensors_plausible);
    }
}

/* The diodes conduct where the short circuit is the safe state, but not without a dc voltage, where that level is 0. */
void test_current_at_a_speed_at_which_the_diodes_conduct_is_plausible(void)
{
    sample.point.i = (dq_q15_t){-2000, 500};
    TEST_ASSERT_FALSE(observe()->sensors_plausible);
    ecu.drive.task.safe_state.rectifies = true;
    TEST_ASSERT_TRUE(observe()->sensors_plausible);
    sample.v_dc = 8494;
    TEST_ASSERT_FALSE(observe()->sensors_plausible);
    sample.v_dc = 8495;
    TEST_ASSERT_TRUE(observe()->sensors_plausible);
}

/* The magnets drive a current through a short circuit of the windings. */
void test_current_in_a_short_circuit_is_plausible(void)
{
    sample.point.i = (dq_q15_t){-20000, 0};
    ecu.drive.fast.short_circuit.holds = true;
    TEST_ASSERT_TRUE(observe()->sensors_plausible);
    ecu.drive.fast.short_circuit.holds = false;
    TEST_ASSERT_FALSE(observe()->sensors_plausible);
}

void test_sensors_are_not_plausible_before_the_first_period(void)
{
    TEST_ASSERT_FALSE(ecu_observe(&ecu, false).sensors_plausible);
    ecu.drive.request.enable = true;
    TEST_ASSERT_FALSE(ecu_observe(&ecu, false).sensors_plausible);
}

static bool slow_at(double line_emf_V)
{
    ecu.drive.task.safe_state.line_emf = (q15_t)(line_emf_V / (double)ecu.drive.motor->bases.voltage_V * 32768.0);
    return observe()->slow;
}

/* The line voltage follows from the known speed; the measured speed has no effect. */
void test_the_machine_is_slow_while_its_line_voltage_stays_below_60_V(void)
{
    sample.point.omega = INT32_MAX;
    TEST_ASSERT_TRUE(slow_at(59.9));
    sample.point.omega = 0;
    TEST_ASSERT_FALSE(slow_at(60.1));
}

void test_the_machine_is_not_slow_while_a_gate_fault_needs_contactor_and_supply(void)
{
    ecu.drive.task.gate_fault.holds_supply = true;
    TEST_ASSERT_FALSE(slow_at(0.0));
    ecu.drive.task.gate_fault.holds_supply = false;
    TEST_ASSERT_TRUE(slow_at(0.0));
}

/* The drive's motor with values of its own, which the caller changes. */
static motor_t *changed_motor(void)
{
    static motor_t changed;
    changed = motor;
    ecu.drive.motor = &changed;
    return &changed;
}

/* Of 480 V, 60 V are an eighth, 4096 counts exactly. */
void test_at_60_V_the_dc_link_is_not_safe_to_touch_and_the_machine_not_slow(void)
{
    changed_motor()->bases.voltage_V = 480.0F;
    for (int below = 0; below < 2; below++) {
        sample.v_dc = 4096 - below;
        ecu.drive.task.safe_state.line_emf = (q15_t)(4096 - below);
        TEST_ASSERT_EQUAL(below == 1, observe()->dc_safe);
        TEST_ASSERT_EQUAL(below == 1, seen.slow);
    }
}

/* A drive for a low voltage never reaches 60 V. Its limit is 0.8 of the lowest dc voltage at which it runs: 20 V. */
void test_at_a_low_dc_voltage_the_machine_is_slow_below_what_could_charge_the_link(void)
{
    motor_t *low = changed_motor();
    low->monitor.v_min = (int32_t)(20.0 / (double)motor.bases.voltage_V * 32768.0);
    TEST_ASSERT_TRUE(slow_at(15.9));
    TEST_ASSERT_FALSE(slow_at(16.1));
    low->monitor.v_min = 1000;
    ecu.drive.task.safe_state.line_emf = 800;
    TEST_ASSERT_FALSE(observe()->slow);
    ecu.drive.task.safe_state.line_emf = 799;
    TEST_ASSERT_TRUE(observe()->slow);
}

enum { PERIODS_IN_STEP = 10, V_0 = 425, QUARTER_OF_T_0 = 278 };

/* A point at half of the speed base with current in both axes and a flux that changes. */
static void compare_point(void)
{
    sample.acting = true;
    sample.point = (operating_point_t){
        .i = {-6000, 9000}, .u = {-4500, 7100}, .flux = {.psi_d = 14000, .psi_q = 9000}, .omega = 1 << 30};
    ecu.drive.task.torque_monitor.psi = (dq_q15_t){13500, 9400};
}

static void check_dc_sensor(void)
{
    *sample_box_begin(&ecu.drive.samples) = sample;
    sample_box_publish(&ecu.drive.samples);
    ecu_check_dc_sensor(&ecu);
}

/* (MN-45) of compare_point(), halved, in Q15: R = 0.01333 and 1/(omega_b T) = 0.30315 of hsm1. */
static int32_t half_kappa(double u_d, double u_q)
{
    const double w_d = 0.01333 * -6000.0 - 0.5 * 9200.0, w_q = 0.01333 * 9000.0 + 0.5 * 13750.0;
    const double e_d = u_d - 0.30315 * 500.0, e_q = u_q + 0.30315 * 400.0;
    return (int32_t)(16384.0 * (e_d * w_d + e_q * w_q) / (w_d * w_d + w_q * w_q));
}

/* Rounding of the voltages by 2 of 8300 counts makes 4 counts; the winding's drop alone makes 200. */
void test_the_dc_voltage_sensor_is_compared_by_the_motor_data(void)
{
    compare_point();
    check_dc_sensor();
    TEST_ASSERT_INT_WITHIN(5, half_kappa(-4500.0, 7100.0), ecu.dc_jump.half_kappa);
    TEST_ASSERT_EQUAL_INT(sample.v_dc, ecu.dc_jump.v_dc);
    TEST_ASSERT_EQUAL_INT(16384, ecu.dc_jump.omega);
}

/* The paper's law leaves no sums of the present step; nor does a bridge that did not switch throughout it. */
void test_the_dc_voltage_sensor_is_compared_by_the_steps_mean_voltage_if_there_is_one(void)
{
    const identify_window_t window = {.sum_u = {PERIODS_IN_STEP * -4000, PERIODS_IN_STEP * 6000}, .acting = true};
    for (int n = 0; n < 3; n++) {
        ecu.dc_jump = (dc_jump_state_t){0};
        compare_point();
        window_box_write(&ecu.drive.windows, (n == 2) ? &(identify_window_t){.sum_u = window.sum_u} : &window);
        ecu.drive.request.identification_mode = (n == 1) ? IDENTIFICATION_PAPER : IDENTIFICATION_ROBUST;
        check_dc_sensor();
        TEST_ASSERT_INT_WITHIN(5, (n == 0) ? half_kappa(-4000.0, 6000.0) : half_kappa(-4500.0, 7100.0),
                               ecu.dc_jump.half_kappa);
    }
}

void test_the_dc_voltage_sensor_is_compared_only_while_the_bridge_follows_the_torque_path(void)
{
    for (int n = 0; n < 3; n++) {
        compare_point();
        sample.acting = n != 1;
        ecu.drive.request.current_mode = n == 2;
        check_dc_sensor();
        TEST_ASSERT_EQUAL(n == 0, ecu.dc_jump.before != 0U);
    }
}

/* Without a winding's drop the rotational voltage is half of the flux. */
void test_the_dc_voltage_sensor_is_compared_above_four_times_the_inverters_voltage_error(void)
{
    compare_point();
    changed_motor()->torque_monitor.r = 0;
    sample.point.flux.psi_q = 0;
    for (int beyond = 0; beyond < 2; beyond++) {
        sample.point.flux.psi_d = 8 * V_0 + 2 * beyond;
        ecu.drive.task.torque_monitor.psi = (dq_q15_t){sample.point.flux.psi_d, 0};
        check_dc_sensor();
        TEST_ASSERT_EQUAL(beyond, ecu.dc_jump.before);
    }
}

static void check_compared_above(int32_t current)
{
    for (int beyond = 0; beyond < 2; beyond++) {
        sample.point.i = (dq_q15_t){0, current + 2 * beyond};
        check_dc_sensor();
        TEST_ASSERT_EQUAL(beyond, ecu.dc_jump.before);
    }
}

void test_the_dc_voltage_sensor_is_compared_above_the_motors_error_of_the_currents(void)
{
    compare_point();
    check_compared_above(motor.torque_monitor.i_0);
}

/* (MN-53): two percent of the full scale, where that is far above the largest current. */
void test_the_dc_voltage_sensor_is_compared_only_where_one_leg_at_most_may_carry_no_current(void)
{
    compare_point();
    changed_motor()->torque_monitor.i_0 = 100;
    check_compared_above(Q15(0.02));
}

void test_the_dc_voltage_sensor_is_compared_while_the_commanded_torque_is_steady(void)
{
    static const uint8_t steady[] = {1, 2, 3, 1};
    static const q15_t torque[] = {1000, 1000, 1000 + QUARTER_OF_T_0, 1001 + QUARTER_OF_T_0};
    compare_point();
    for (unsigned n = 0; n < sizeof steady; n++) {
        ecu.drive.task.torque_commanded = torque[n];
        check_dc_sensor();
        TEST_ASSERT_EQUAL_UINT8(steady[n], ecu.dc_jump.before);
    }
}

static void read_dc(double gain)
{
    sample = sample_with_dc_gain(gain);
    check_dc_sensor();
}

void test_a_dc_voltage_sensor_whose_gain_jumps_is_an_input_fault_in_the_eighth_step(void)
{
    ecu.drive.task.torque_monitor.psi.d = 14000;
    for (int n = 0; n < 6; n++) {
        read_dc(1.0);
    }
    for (int n = 0; n < 7; n++) {
        read_dc(1.2);
    }
    TEST_ASSERT_EQUAL_HEX32(0, ecu.drive.request.faults);
    read_dc(1.2);
    TEST_ASSERT_EQUAL_HEX32(FAULT_INPUT, ecu.drive.request.faults);
}

void test_the_command_of_the_bus_is_passed_on(void)
{
    const supervisor_in_t *out = observe();
    TEST_ASSERT_FALSE(out->alive || out->failed || out->torque_mode || out->current_mode || out->enable || out->reset ||
                      out->gate_fault);
    ecu.rx.command_channel = (rx_channel_t){.alive = true, .failed = true};
    ecu.rx.command = (bus_command_t){.enable = true, .mode = COMMAND_MODE_TORQUE};
    ecu.drive.fast.faults = 0x2005U;
    out = observe();
    TEST_ASSERT_TRUE(out->alive && out->failed && out->torque_mode && out->enable);
    TEST_ASSERT_FALSE(out->current_mode || out->reset);
    TEST_ASSERT_EQUAL_HEX32(0x2005U, out->drive_faults);
    TEST_ASSERT_EQUAL_UINT32(US, out->elapsed_us);
    ecu.rx.command = (bus_command_t){.fault_reset = true, .mode = COMMAND_MODE_CURRENT_LOCKED};
    out = observe();
    TEST_ASSERT_TRUE(out->current_mode && out->reset);
    TEST_ASSERT_FALSE(out->torque_mode || out->enable);
    TEST_ASSERT_TRUE(ecu_observe(&ecu, true).gate_fault);
}

/* An encoder before its index does not know the angle. */
void test_the_state_machine_is_told_whether_the_angle_is_absolute_and_the_shut_off_paths_work(void)
{
    TEST_ASSERT_TRUE(observe()->angle_absolute);
    TEST_ASSERT_FALSE(seen.shut_off_tested);
    TEST_ASSERT_EQUAL_HEX16(0, seen.shut_off_faults);
    ecu.shut_off = (shut_off_t){.tested = true, .faults = ECU_FAULT_WATCHDOG};
    TEST_ASSERT_TRUE(observe()->shut_off_tested);
    TEST_ASSERT_EQUAL_HEX16(ECU_FAULT_WATCHDOG, seen.shut_off_faults);
}

void test_an_angle_that_is_not_absolute_yet_is_reported(void)
{
    hal_angle_is_absolute_StopIgnore();
    hal_angle_is_absolute_ExpectAndReturn(false);
    TEST_ASSERT_FALSE(observe()->angle_absolute);
}

/* Only the imposed movement does without the angle, and only while it is agreed. */
void test_an_agreed_imposed_movement_is_reported(void)
{
    TEST_ASSERT_FALSE(observe()->angle_imposed);
    for (unsigned kind = MOVEMENT_NONE; kind <= MOVEMENT_CONNECTED; kind++) {
        for (unsigned phase = MOVEMENT_PHASE_IDLE; phase <= MOVEMENT_PHASE_ENDED; phase++) {
            ecu.drive.task.movement = (movement_state_t){.phase = (movement_phase_t)phase, .movement = (uint8_t)kind};
            const bool imposed = kind == MOVEMENT_IMPOSED && phase == MOVEMENT_PHASE_AGREED;
            TEST_ASSERT_EQUAL(imposed, observe()->angle_imposed);
        }
    }
}

/* The dead band of 0.25 N·m is rounded to 28 counts of 0.009 N·m: 0.256 N·m are 28 counts, 0.257 N·m are 29. */
void test_a_requested_torque_within_the_dead_band_is_zero(void)
{
    static const struct {
        float torque_Nm;
        bool is_zero;
    } cases[] = {{0.0F, true}, {0.256F, true}, {-0.256F, true}, {0.257F, false}, {-0.257F, false}, {-1e6F, false}};
    for (unsigned n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        ecu.rx.command.torque_requested_Nm = cases[n].torque_Nm;
        TEST_ASSERT_EQUAL(cases[n].is_zero, observe()->torque_requested_is_zero);
    }
}

void test_arbitrated_torque_is_zero_only_when_not_one_count_is_left(void)
{
    TEST_ASSERT_TRUE(observe()->torque_arbitrated_is_zero);
    ecu.arbitration_state.torque_arbitrated = -1;
    TEST_ASSERT_FALSE(observe()->torque_arbitrated_is_zero);
}

/* 29.4664 N·m is a tenth of the base, 3276.8 counts. */
void test_the_requested_torque_is_converted_and_limited_to_the_range_of_the_format(void)
{
    ecu.rx.command.torque_requested_Nm = 29.4664F;
    TEST_ASSERT_EQUAL_INT(3277, arbitration().torque_requested);
    ecu.rx.command.torque_requested_Nm = -29.4664F;
    TEST_ASSERT_EQUAL_INT(-3277, arbitration().torque_requested);
    ecu.rx.command.torque_requested_Nm = 295.0F;
    TEST_ASSERT_EQUAL_INT(32767, arbitration().torque_requested);
    ecu.rx.command.torque_requested_Nm = -295.0F;
    TEST_ASSERT_EQUAL_INT(-32767, arbitration().torque_requested);
}

/* A valid command is converted when it comes; a time-out clears it in a step without a frame. */
void test_a_command_is_converted_with_its_frame_and_in_each_step_without_a_valid_one(void)
{
    ecu.rx.command_channel.alive = true;
    ecu.rx.command.torque_requested_Nm = 29.4664F;
    ecu_convert(&ecu, false);
    TEST_ASSERT_EQUAL_INT(0, ecu.commanded.torque_requested);
    ecu_convert(&ecu, true);
    TEST_ASSERT_EQUAL_INT(3277, ecu.commanded.torque_requested);
    ecu.rx.command_channel.alive = false;
    ecu.rx.command.torque_requested_Nm = 0.0F;
    ecu_convert(&ecu, false);
    TEST_ASSERT_EQUAL_INT(0, ecu.commanded.torque_requested);
}

void test_torque_limits_are_never_larger_than_the_machines_torque_nor_negative(void)
{
    ecu.rx.command.limit_drive_Nm = 500.0F;
    ecu.rx.command.limit_regen_Nm = 29.4664F;
    TEST_ASSERT_EQUAL_INT(TORQUE_MAX, arbitration().limit_drive);
    TEST_ASSERT_EQUAL_INT(3277, arbitration().limit_regen);
    ecu.rx.command.limit_drive_Nm = 29.4664F;
    ecu.rx.command.limit_regen_Nm = 500.0F;
    TEST_ASSERT_EQUAL_INT(3277, arbitration().limit_drive);
    TEST_ASSERT_EQUAL_INT(TORQUE_MAX, arbitration().limit_regen);
    ecu.rx.command.limit_drive_Nm = ecu.rx.command.limit_regen_Nm = -1.0F;
    TEST_ASSERT_EQUAL_INT(0, arbitration().limit_drive);
    TEST_ASSERT_EQUAL_INT(0, arbitration().limit_regen);
}

void test_state_enable_command_and_faults_decide_whether_torque_runs_stops_or_ramps_out(void)
{
    ecu.rx.command_channel.alive = true;
    ecu.supervisor = (supervisor_t){.state = STATE_RUN, .enabled = true};
    sample.point.omega = -12345;
    (void)observe();
    arbitrate_in_t in = arbitration();
    TEST_ASSERT_TRUE(in.run && !in.stop && !in.ramp_out);
    TEST_ASSERT_EQUAL_INT32(-12345, in.omega);
    ecu.supervisor.enabled = false;
    in = arbitration();
    TEST_ASSERT_TRUE(in.run && in.stop && !in.ramp_out);
    ecu.supervisor.faults = ECU_FAULT_PROTECTION;
    TEST_ASSERT_TRUE(arbitration().ramp_out);
    ecu.supervisor.faults = 0;
    ecu.rx.command_channel.alive = false;
    TEST_ASSERT_TRUE(arbitration().ramp_out);
    ecu.supervisor.state = STATE_READY;
    TEST_ASSERT_FALSE(arbitration().run);
}

/* P_b = 1.5 * 540 V * 400 A = 324 kW: 32.4 kW are 3276.7 counts. */
void test_the_batterys_power_limits_act_while_they_arrive(void)
{
    ecu.rx.limits = (bus_power_limits_t){.drive_kW = 32.4F, .regen_kW = 16.2F};
    ecu.drive.request.limits = (torque_limits_t){.torque_drive = 1, .power_drive = 2, .power_regen = 3}; /* of before */
    torque_limits_t limits = battery_limits();
    TEST_ASSERT_EQUAL_INT(Q15_MAX, limits.power_drive);
    TEST_ASSERT_EQUAL_INT(Q15_MAX, limits.power_regen);
    TEST_ASSERT_EQUAL_INT(Q15_MAX, limits.torque_drive);
    ecu.rx.limits_channel = (rx_channel_t){.alive = true, .seen = true};
    limits = battery_limits();
    TEST_ASSERT_INT_WITHIN(1, 3276, limits.power_drive);
    TEST_ASSERT_INT_WITHIN(1, 1638, limits.power_regen);
    TEST_ASSERT_EQUAL_INT(Q15_MAX, limits.torque_drive);
    TEST_ASSERT_EQUAL_INT(Q15_MAX, limits.torque_regen);
    ecu.rx.limits.drive_kW = 325.0F;
    TEST_ASSERT_EQUAL_INT(Q15_MAX, battery_limits().power_drive);
}

void test_lost_battery_limits_keep_the_last_ones_end_the_torque_and_are_the_reported_reason(void)
{
    const torque_limits_t last = {.torque_drive = 1, .torque_regen = 2, .power_drive = 3276, .power_regen = 4};
    ecu.drive.request.limits = last;
    ecu.drive.task.derating = DERATING_INVERTER;
    ecu.rx.command.limit_drive_Nm = ecu.rx.command.limit_regen_Nm = 100.0F;
    ecu.rx.limits_channel = (rx_channel_t){.alive = true, .seen = true};
    TEST_ASSERT_GREATER_THAN_INT(0, arbitration().limit_drive);
    TEST_ASSERT_EQUAL_UINT32(1, reported_derating_reason());
    ecu.rx.limits_channel.alive = false;
    const torque_limits_t limits = battery_limits();
    TEST_ASSERT_EQUAL_MEMORY(&last, &limits, sizeof last);
    TEST_ASSERT_EQUAL_INT(0, arbitration().limit_drive);
    TEST_ASSERT_EQUAL_INT(0, arbitration().limit_regen);
    TEST_ASSERT_EQUAL_UINT32(7, reported_derating_reason());
    TEST_ASSERT_TRUE(observe()->derated);
}

/* The numbers are those of DeratingReason in the DBC. */
void test_the_first_derating_reason_is_reported_by_its_number_in_the_dbc(void)
{
    static const struct {
        uint32_t derating, reason;
    } cases[] = {
        {0, 0},
        {DERATING_REQUEST | DERATING_REACH, 0},
        {DERATING_INVERTER, 1},
        {DERATING_WINDING, 2},
        {DERATING_SENSOR, 6},
        {DERATING_DC_LOW, 3},
        {DERATING_DC_HIGH, 3},
        {DERATING_POWER, 4},
        {DERATING_MAGNET, 5},
        {DERATING_SPEED, 8},
        {DERATING_SPEED | DERATING_WINDING | DERATING_REACH, 2},
    };
    for (unsigned n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        ecu.drive.task.derating = (uint16_t)cases[n].derating;
        TEST_ASSERT_EQUAL_UINT32(cases[n].reason, reported_derating_reason());
        TEST_ASSERT_EQUAL(cases[n].reason != 0U, observe()->derated);
    }
}

/* As a memory error may set it. */
void test_a_bit_that_no_derating_has_is_reported_as_no_reason(void)
{
    ecu.drive.task.derating = (uint16_t)(1U << 15);
    TEST_ASSERT_EQUAL_UINT32(0, reported_derating_reason());
}

/* The vehicle allows 60 N·m of driving and 40 N·m of braking torque; the machine has 132 N·m. */
void test_the_limit_that_a_request_exceeds_is_reported_in_all_four_quadrants(void)
{
    static const struct {
        float torque_Nm;
        q31_t omega;
        request_limit_t reported;
    } cases[] = {
        {60.0F, 1 << 28, REQUEST_LIMIT_NONE},
        {60.1F, 1 << 28, REQUEST_LIMIT_VEHICLE_LIMIT},
        {-40.0F, 1 << 28, REQUEST_LIMIT_NONE},
        {-40.1F, 1 << 28, REQUEST_LIMIT_VEHICLE_LIMIT},
        {-60.0F, -(1 << 28), REQUEST_LIMIT_NONE},
        {-60.1F, -(1 << 28), REQUEST_LIMIT_VEHICLE_LIMIT},
        {40.0F, -(1 << 28), REQUEST_LIMIT_NONE},
        {40.1F, -(1 << 28), REQUEST_LIMIT_VEHICLE_LIMIT},
        {132.1F, 1 << 28, REQUEST_LIMIT_RATED_TORQUE},
        {-132.1F, 1 << 28, REQUEST_LIMIT_RATED_TORQUE},
        {131.9F, 1 << 28, REQUEST_LIMIT_VEHICLE_LIMIT},
        {0.0F, 0, REQUEST_LIMIT_NONE},
        {132.048F, 1 << 28, REQUEST_LIMIT_VEHICLE_LIMIT}, /* less than half a count: the rated torque, rounded */
        {-50.0F, DRIVE_STANDSTILL, REQUEST_LIMIT_NONE},   /* at standstill every torque counts as driving */
        {-50.0F, DRIVE_STANDSTILL + 1, REQUEST_LIMIT_VEHICLE_LIMIT},
    };
    ecu.rx.command.limit_drive_Nm = 60.0F;
    ecu.rx.command.limit_regen_Nm = 40.0F;
    for (unsigned n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        ecu.rx.command.torque_requested_Nm = cases[n].torque_Nm;
        sample.point.omega = cases[n].omega;
        (void)observe();
        telemetry_t telemetry = {0};
        ecu_telemetry(&ecu, &telemetry);
        TEST_ASSERT_EQUAL_UINT32(cases[n].reported, telemetry.request_limit);
    }
}

void test_also_a_small_request_is_compared_with_the_limit_of_its_direction(void)
{
    ecu.rx.command.limit_drive_Nm = 0.7F;
    ecu.rx.command.limit_regen_Nm = 0.2F;
    static const struct {
        float torque_Nm;
        request_limit_t reported;
    } cases[] = {{0.8F, REQUEST_LIMIT_VEHICLE_LIMIT}, {0.5F, REQUEST_LIMIT_NONE}, {-0.5F, REQUEST_LIMIT_VEHICLE_LIMIT}};
    sample.point.omega = 1 << 28;
    (void)observe();
    for (unsigned n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        ecu.rx.command.torque_requested_Nm = cases[n].torque_Nm;
        telemetry_t telemetry = {0};
        ecu_telemetry(&ecu, &telemetry);
        TEST_ASSERT_EQUAL_UINT32(cases[n].reported, telemetry.request_limit);
    }
}

void test_a_request_within_all_limits_that_the_machine_cannot_reach_is_reported(void)
{
    ecu.rx.command.limit_drive_Nm = 60.0F;
    ecu.rx.command.torque_requested_Nm = 50.0F;
    ecu.drive.task.derating = DERATING_REACH;
    telemetry_t telemetry = {0};
    ecu_telemetry(&ecu, &telemetry);
    TEST_ASSERT_EQUAL_UINT32(REQUEST_LIMIT_REACH, telemetry.request_limit);
}

/* The MRAI interrupt has not finished its newest point. */
static void begin_with_an_unfinished_point(identification_mode_t mode)
{
    ecu.drive.request.identification_mode = mode;
    ecu.drive.mrai.mailbox.generation = 10;
    ecu.drive.mrai.isr.finished = 9;
    ecu.liveness = (liveness_t){.started = true};
}

static void watch_a_step(void)
{
    ecu.drive.samples.generation += 10U;
    ecu_watch(&ecu);
}

/* The paper's identification is not stalled while it works on the newest point, if it has finished one since the last
 * check. */
void test_an_identification_is_stalled_when_it_finishes_nothing_in_three_steps(void)
{
    begin_with_an_unfinished_point(IDENTIFICATION_PAPER);
    ecu.drive.mrai.task.finished_seen = 8;
    for (uint32_t n = 1; n <= 3U; n++) {
        watch_a_step();
        TEST_ASSERT_EQUAL_UINT8(n - 1U, ecu.liveness.stalled_in_a_row);
    }
    TEST_ASSERT_FALSE(ecu_observe(&ecu, false).stalled);
    watch_a_step();
    TEST_ASSERT_TRUE(ecu_observe(&ecu, false).stalled);
    ecu.drive.mrai.isr.finished = 10;
    watch_a_step();
    TEST_ASSERT_FALSE(ecu_observe(&ecu, false).stalled);
}

/* Its interrupt has no work then. */
void test_an_identification_that_is_not_chosen_is_never_stalled(void)
{
    begin_with_an_unfinished_point(IDENTIFICATION_ROBUST);
    for (uint32_t n = 1; n <= 5U; n++) {
        watch_a_step();
    }
    TEST_ASSERT_FALSE(ecu_observe(&ecu, false).stalled);
}

/* The interrupts may have run for any time before the first step. */
void test_the_first_step_is_never_late(void)
{
    ecu.drive.samples.generation += 100U;
    ecu_watch(&ecu);
    TEST_ASSERT_EQUAL_UINT16(0, ecu.liveness.task_overruns);
    ecu.liveness.started = true;
    ecu.drive.samples.generation += 100U;
    ecu_watch(&ecu);
    TEST_ASSERT_EQUAL_UINT16(1, ecu.liveness.task_overruns);
}

/* GCC, which compiles the firmware, reads all bits of a bool's byte. Clang reads the lowest one, and the sanitizers
 * permit no other value than 0 and 1. */
#if defined(__clang__) || defined(SANITIZED)
#define BOOL_BITS 1U
#else
#define BOOL_BITS 8U
#endif

static void damage_is_found(void *at, unsigned bits)
{
    uint8_t *byte = at;
    for (unsigned bit = 0; bit < bits; bit++) {
        *byte ^= (uint8_t)(1U << bit);
        ecu_check_integrity(&ecu);
        TEST_ASSERT_TRUE(ecu.drive.data_check.damaged);
        ecu.drive.data_check.damaged = false;
        *byte ^= (uint8_t)(1U << bit);
    }
}

/* All flags are set: one that shared a bit with another would be hidden by it. */
void test_every_flipped_bit_of_the_flags_of_bus_states_and_shut_off_is_damage(void)
{
    bool *const flags[] = {&ecu.rx.limits_channel.alive,  &ecu.rx.limits_channel.seen,
                           &ecu.rx.command_channel.alive, &ecu.rx.command_channel.failed,
                           &ecu.supervisor.enabled,       &ecu.supervisor.enable_seen,
                           &ecu.supervisor.reset_seen,    &ecu.shut_off.tested,
                           &ecu.shut_off.supply_on,       &ecu.shut_off.wrong};
    for (unsigned n = 0; n < sizeof flags / sizeof flags[0]; n++) {
        *flags[n] = true;
    }
    ecu.supervisor.state = STATE_FAULT;
    ecu.shut_off.stage = 5;
    ecu_seal_flags(&ecu);
    ecu_check_integrity(&ecu);
    TEST_ASSERT_FALSE(ecu.drive.data_check.damaged);
    for (unsigned n = 0; n < sizeof flags / sizeof flags[0]; n++) {
        damage_is_found(flags[n], BOOL_BITS);
    }
    damage_is_found(&ecu.supervisor.state, 8);
    damage_is_found(&ecu.shut_off.stage, 8);
    damage_is_found(&ecu.shut_off.failed, 8);
    damage_is_found((uint8_t *)&ecu.shut_off.failed + 1, 8);
}

/* Every counter has a different value, so that two exchanged ones are found. */
void test_every_counter_of_the_bus_reaches_its_place_in_the_telemetry(void)
{
    for (uint16_t n = 0; n < RX_RESULTS; n++) {
        ecu.rx.count[n] = (uint16_t)(100 + n);
    }
    ecu.rx.time_outs = 201;
    ecu.rx.accepted = 202;
    ecu.rx.skipped = 203;
    ecu.not_sent = 204;
    ecu.liveness.task_overruns = 205;
    ecu.liveness.held = 206;
    ecu.supervisor = (supervisor_t){.state = STATE_FAULT,
                                    .faults = 0x21,
                                    .first_fault = 34,
                                    .fault_count = 3,
                                    .refused = REFUSED_SENSOR_IMPLAUSIBLE,
                                    .refused_count = 7};
    telemetry_t t = {0};
    hal_can_lost_IgnoreAndReturn(207);
    hal_can_bus_off_IgnoreAndReturn(208);
    hal_system_stack_unused_IgnoreAndReturn(209);
    ecu.tx.pending = 0;
    ecu_diagnostics(&ecu, &t); /* no message contains the counters */
    TEST_ASSERT_EQUAL_UINT32(0, t.diagnostics.crc_errors);
    ecu.tx.pending = UINT16_MAX;
    ecu_telemetry(&ecu, &t);
    ecu_diagnostics(&ecu, &t);
    TEST_ASSERT_EQUAL_UINT32(207, t.diagnostics.lost_frames);
    TEST_ASSERT_EQUAL_UINT32(208, t.diagnostics.bus_off);
    TEST_ASSERT_EQUAL_UINT32(209, t.diagnostics.stack_unused_bytes);
    TEST_ASSERT_EQUAL_UINT32(100 + RX_CRC, t.diagnostics.crc_errors);
    TEST_ASSERT_EQUAL_UINT32(100 + RX_REPEATED, t.diagnostics.repeated);
    TEST_ASSERT_EQUAL_UINT32(100 + RX_JUMP, t.diagnostics.jumps);
    TEST_ASSERT_EQUAL_UINT32(100 + RX_LENGTH, t.diagnostics.length_errors);
    TEST_ASSERT_EQUAL_UINT32(100 + RX_RANGE, t.diagnostics.range_errors);
    TEST_ASSERT_EQUAL_UINT32(100 + RX_ID, t.diagnostics.id_errors);
    TEST_ASSERT_EQUAL_UINT32(100 + RX_IGNORED, t.diagnostics.ignored);
    TEST_ASSERT_EQUAL_UINT32(201, t.diagnostics.time_outs);
    TEST_ASSERT_EQUAL_UINT32(202, t.diagnostics.accepted);
    TEST_ASSERT_EQUAL_UINT32(203, t.diagnostics.skipped);
    TEST_ASSERT_EQUAL_UINT32(204, t.diagnostics.not_sent);
    TEST_ASSERT_EQUAL_UINT32(205, t.diagnostics.task_overruns);
    TEST_ASSERT_EQUAL_UINT32(206, t.diagnostics.watchdog_held);
    TEST_ASSERT_EQUAL_UINT32(STATE_FAULT, t.state);
    TEST_ASSERT_EQUAL_HEX32(0x21, t.ecu_faults);
    TEST_ASSERT_EQUAL_UINT32(34, t.first_fault);
    TEST_ASSERT_EQUAL_UINT32(3, t.fault_count);
    TEST_ASSERT_EQUAL_UINT32(REFUSED_SENSOR_IMPLAUSIBLE, t.refused_reason);
    TEST_ASSERT_EQUAL_UINT32(7, t.refused_count);
}

/* 40 % of the largest current; a state in which a movement may begin, with and without a torque request. */
void test_the_movement_of_the_bus_reaches_the_drive_in_its_units(void)
{
    ecu.rx.commission = (bus_commission_t){.movement = 2,
                                           .direction = 1,
                                           .pole_pairs = 5,
                                           .reversed = true,
                                           .damped = true,
                                           .offset = 0xBEEF,
                                           .current_d_permille = -400,
                                           .current_q_permille = 200};
    movement_request_t wanted = ecu_movement(&ecu);
    TEST_ASSERT_FALSE(wanted.alive);
    ecu.rx.commission_channel.alive = true;
    wanted = ecu_movement(&ecu);
    TEST_ASSERT_TRUE(wanted.alive);
    TEST_ASSERT_EQUAL_UINT8(2, wanted.movement);
    TEST_ASSERT_EQUAL_UINT8(1, wanted.direction);
    TEST_ASSERT_EQUAL_UINT8(5, wanted.pole_pairs);
    TEST_ASSERT_TRUE(wanted.reversed);
    TEST_ASSERT_TRUE(wanted.damped);
    TEST_ASSERT_EQUAL_HEX16(0xBEEF, wanted.offset);
    TEST_ASSERT_INT32_WITHIN(1, -2 * motor.commission.i_max / 5, wanted.i.d);
    TEST_ASSERT_INT32_WITHIN(1, motor.commission.i_max / 5, wanted.i.q);
}

void test_a_movement_may_begin_in_standby_and_ready_without_a_torque_request(void)
{
    ecu.rx.commission_channel.alive = true;
    for (int state = STATE_INIT; state < STATES; state++) {
        ecu.supervisor.state = (ecu_state_t)state;
        ecu.rx.command.torque_requested_Nm = 0.0F;
        ecu_convert(&ecu, true);
        TEST_ASSERT_EQUAL(state == STATE_STANDBY || state == STATE_READY, ecu_movement(&ecu).may_begin);
        ecu.rx.command.torque_requested_Nm = -1.0F;
        ecu_convert(&ecu, true);
        TEST_ASSERT_FALSE(ecu_movement(&ecu).may_begin);
    }
}

/* One step with this signal of the last frame. */
static bool agrees(bool asked)
{
    ecu.rx.commission.pulses = asked;
    ecu_request_commissioning(&ecu);
    return ecu.drive.request.pulses_agreed;
}

/* A consent in this state, whatever has been before. */
static void agreed_in(ecu_state_t state)
{
    ecu.rx.commission_channel.alive = true;
    ecu.supervisor.state = state;
    TEST_ASSERT_FALSE(agrees(false));
    TEST_ASSERT_TRUE(agrees(true));
}

void test_a_consent_to_pulses_begins_in_standby_and_ready_without_a_torque_request(void)
{
    ecu.rx.commission_channel.alive = true;
    for (int state = STATE_INIT; state < STATES; state++) {
        ecu.supervisor.state = (ecu_state_t)state;
        ecu.rx.command.torque_requested_Nm = 1.0F;
        ecu_convert(&ecu, true);
        TEST_ASSERT_FALSE(agrees(false));
        TEST_ASSERT_FALSE(agrees(true));
        ecu.rx.command.torque_requested_Nm = 0.0F;
        ecu_convert(&ecu, true);
        TEST_ASSERT_FALSE(agrees(true)); /* refused before: it needs a change */
        TEST_ASSERT_FALSE(agrees(false));
        TEST_ASSERT_EQUAL(state == STATE_STANDBY || state == STATE_READY, agrees(true));
    }
}

/* Between two bursts a torque brakes the rotor. */
void test_a_consent_to_pulses_lasts_up_to_run_and_derate_and_beside_a_torque_request(void)
{
    agreed_in(STATE_STANDBY);
    ecu.rx.command.torque_requested_Nm = 5.0F;
    ecu_convert(&ecu, true);
    for (int state = STATE_STANDBY; state <= STATE_DERATE; state++) {
        ecu.supervisor.state = (ecu_state_t)state;
        TEST_ASSERT_TRUE(agrees(true));
    }
    TEST_ASSERT_FALSE(agrees(false));
    TEST_ASSERT_FALSE(agrees(true));
}

void test_a_state_without_the_dc_link_ends_the_consent_to_pulses_until_a_new_one(void)
{
    static const ecu_state_t ends[] = {STATE_INIT, STATE_SAFE_STATE, STATE_FAULT, STATE_DISCHARGE};
    for (unsigned n = 0; n < sizeof ends / sizeof ends[0]; n++) {
        agreed_in(STATE_READY);
        ecu.supervisor.state = ends[n];
        TEST_ASSERT_FALSE(agrees(true));
        ecu.supervisor.state = STATE_READY;
        TEST_ASSERT_FALSE(agrees(true));
        TEST_ASSERT_FALSE(agrees(false));
        TEST_ASSERT_TRUE(agrees(true));
    }
}

void test_a_time_out_ends_the_consent_to_pulses_until_a_new_one(void)
{
    agreed_in(STATE_READY);
    ecu.rx.commission_channel.alive = false;
    TEST_ASSERT_FALSE(agrees(true));
    TEST_ASSERT_FALSE(agrees(false)); /* the last frame's content is of no account */
    ecu.rx.commission_channel.alive = true;
    TEST_ASSERT_FALSE(agrees(true));
    agreed_in(STATE_READY);
}

void test_the_early_end_of_a_movement_is_seen(void)
{
    TEST_ASSERT_FALSE(observe()->movement_ended);
    ecu.drive.task.movement.phase = MOVEMENT_PHASE_AGREED;
    TEST_ASSERT_FALSE(observe()->movement_ended);
    ecu.drive.task.movement.phase = MOVEMENT_PHASE_ENDED;
    TEST_ASSERT_TRUE(observe()->movement_ended);
}
