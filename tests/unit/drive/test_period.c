/* SPDX-License-Identifier: Apache-2.0 */
/* What the stages of a PWM period hand over to one another. Each stage is tested in tests/unit/control; here a copy of
 * the drive computes it with the same samples, and the period must have used its result. */
#include "control/current/transform.h"
#include "drive/acquire.h"
#include "drive/turning_modulate.h"
#include "hal/mock_adc.h"
#include "hal/mock_angle.h"
#include "hal/mock_irq.h"
#include "hal/mock_pwm.h"
#include "hal/mock_temperature.h"
#include "seam.h"
#include "types/faults.h"
#include "unity.h"

static drive_t twin;

void setUp(void)
{
    seam_start();
}

void tearDown(void)
{
}

static const sample_t *published(void)
{
    return sample_box_last(&drive.samples);
}

static void period_without_task(void)
{
    seam.log[0] = '\0';
    fast_isr(&drive);
}

/* Samples of earlier periods that were limited: the ring returns to their places. */
static void leave_old_samples(void)
{
    for (uint32_t n = 1; n < SAMPLE_SLOTS; n++) {
        sample_t *sample = &drive.samples.slot[(drive.samples.generation + n) % SAMPLE_SLOTS];
        sample->point.u = (dq_q15_t){1111, 2222};
        sample->voltage_limited = true;
        sample->pulses_clamped = true;
    }
}

void test_without_switching_no_voltage_acts_and_none_is_limited(void)
{
    seam_period();
    leave_old_samples();
    drive.fast.u_next = (dq_q15_t){-333, 444};
    seam_period();
    TEST_ASSERT_EQUAL_INT32(0, published()->point.u.d);
    TEST_ASSERT_EQUAL_INT32(0, published()->point.u.q);
    TEST_ASSERT_FALSE(published()->voltage_limited);
    TEST_ASSERT_FALSE(published()->pulses_clamped);
    TEST_ASSERT_EQUAL_INT32(0, drive.fast.u_next.d);
    TEST_ASSERT_EQUAL_INT32(0, drive.fast.u_next.q);
}

/* The bridge acted in the first five periods of the window. */
void test_a_window_in_which_switching_ends_is_invalid(void)
{
    seam_run();
    seam_periods(35);
    TEST_ASSERT_TRUE(window_box_at(&drive.windows)->acting);
    drive_raise_fault(&drive, FAULT_TORQUE);
    seam_periods(5);
    TEST_ASSERT_EQUAL_UINT32(4, drive.windows.generation);
    TEST_ASSERT_FALSE(window_box_at(&drive.windows)->acting);
}

void test_each_fault_of_the_task_alone_is_latched(void)
{
    for (unsigned bit = 0; bit < 16; bit++) {
        setUp();
        seam_run();
        seam_periods(3);
        command_t command = *command_box_read(&drive.commands);
        command.run = (uint8_t)BRIDGE_OFF;
        command.faults = 1U << bit;
        command_box_write(&drive.commands, command);
        period_without_task();
        TEST_ASSERT_EQUAL_HEX32(1U << bit, drive.fast.faults);
    }
}

/* The task never sends both; a damaged command must not start a bridge with a fault. */
void test_a_reset_together_with_the_command_to_run_is_ignored(void)
{
    seam_run();
    seam_periods(3);
    command_t command = *command_box_read(&drive.commands);
    drive_raise_fault(&drive, FAULT_GATE);
    command.fault_resets++;
    command_box_write(&drive.commands, command);
    period_without_task();
    TEST_ASSERT_EQUAL_HEX32(FAULT_GATE, drive.fast.faults);
    TEST_ASSERT_FALSE(seam.gates);
}

/* A copy of the drive before the period, with the sample of this period. */
static acquired_t acquire_in_twin(sample_t *sample, bool settled)
{
    twin = drive;
    seam.log[0] = '\0';
    const acquired_t acquired = acquire_sample(&twin, sample, settled);
    sample->point.i = park_pair(sample->i_ab, fx_rotation(sample->theta_e));
    sample->point.flux = flux_table_step(&twin.period.flux_table, sample->point.i);
    return acquired;
}

/* The duties of a voltage, and the voltage that they make. */
static void expect_duties(const modulate_config_t *config, const sample_t *sample, const current_control_out_t *wanted,
                          int32_t angle_step)
{
    const fx_pair_t i = fx_pair(sample->point.i.d, sample->point.i.q);
    const fx_pair_t at = fx_rotation(sample->theta_e + (uint32_t)angle_step + (uint32_t)(angle_step >> 1));
    const modulate_out_t made = modulate_step(config, wanted->v, i, at);
    const bool changed = made.limited != 0U || wanted->limited != 0U;
    const dq_q15_t u = changed ? modulate_applied(config, &made.duty, i, at, sample->v_dc) : wanted->u;
    TEST_ASSERT_EQUAL_UINT32(made.duty.a, seam.duty.a);
    TEST_ASSERT_EQUAL_UINT32(made.duty.b, seam.duty.b);
    TEST_ASSERT_EQUAL_UINT32(made.duty.c, seam.duty.c);
    TEST_ASSERT_EQUAL_INT32(u.d, drive.fast.u_next.d);
    TEST_ASSERT_EQUAL_INT32(u.q, drive.fast.u_next.q);
    TEST_ASSERT_EQUAL(made.limited != 0U, published()->pulses_clamped);
    TEST_ASSERT_EQUAL(wanted->limited != 0U, published()->voltage_limited);
}

/* From no voltage to one far beyond the circle, at angles of a whole turn: some pulses are clamped, some are not. */
void test_duties_and_voltage_of_the_usual_route_are_those_of_control_and_modulation(void)
{
    int clamped[2] = {0, 0};
    for (int n = 0; n < 48; n++) {
        setUp();
        seam.theta_m = (uint32_t)n * 29826162U; /* a 144th of a turn; hsm1 has three pole pairs */
        seam_current(30.0, -20.0, -10.0);
        seam_run();
        seam_periods(24);
        TEST_ASSERT_TRUE(drive.fast.is_settled);
        leave_old_samples();
        drive.fast.current_control.s_q_q30 = 20000000 * n;
        sample_t sample = {0};
        const acquired_t acquired = acquire_in_twin(&sample, true);
        const current_control_in_t in = {&command_box_read(&twin.commands)->target, &sample.point.flux, sample.v_dc};
        const current_control_out_t wanted = current_control_step(&twin.parameters.current_control,
                                                                  &twin.fast.current_control, &in);
        period_without_task();
        expect_duties(&twin.parameters.modulate, &sample, &wanted, acquired.angle_step);
        clamped[published()->pulses_clamped ? 1 : 0]++;
    }
    TEST_ASSERT_GREATER_THAN_INT(5, clamped[0]);
    TEST_ASSERT_GREATER_THAN_INT(5, clamped[1]);
}

/* hsm1 with the law for a field that turns far, and a knee that widens with the speed. */
static void start_turning(void)
{
    setUp();
    seam.motor.turning_control = (turning_control_config_t){.per_period_q29 = Q31(0.5),
                                                            .approach_q32 = Q31(0.72),
                                                            .feedback_q32 = Q31(0.56),
                                                            .integral_q32 = Q31(0.09),
                                                            .knee_turns_q27 = 1 << 26};
    seam.motor.parameters.current_control.sigma_q24 = 0;
    seam.motor.parameters.current_control.integral_gain = 0;
    drive.parameters.current_control = seam.motor.parameters.current_control;
    seam_run();
}

/* 3 * 5 10^7 of 2^32 are 12.6 degrees of the field per period. */
static void turn_periods(int count)
{
    for (int n = 0; n < count; n++) {
        seam.theta_m += 50000000U;
        period_without_task();
        drive.fast.silent_steps = 0; /* the task is not part of this test */
    }
}

void test_the_law_for_a_field_that_turns_far_gets_current_angle_and_identified_flux(void)
{
    int limited[2] = {0, 0};
    for (int n = 0; n < 40; n++) {
        start_turning();
        turn_periods(200 + n);
        TEST_ASSERT_EQUAL_HEX32(0, drive.fast.faults);
        leave_old_samples();
        seam_current(1.5, -1.0, -0.5);
        drive.psi_d_error = -1500;
        turning_control_reset(&drive.fast.turning_control, &published()->point.flux);
        drive.fast.turning_control.s.q = 3000000 * n;
        seam.theta_m += 50000000U;
        sample_t sample = {0};
        const acquired_t acquired = acquire_in_twin(&sample, false);
        const turning_control_in_t in = {{&command_box_read(&twin.commands)->target, &sample.point.flux, sample.v_dc},
                                         sample.point.i,
                                         acquired.angle_step,
                                         -1500};
        const current_control_out_t wanted = turning_control_step(
            &seam.motor.turning_control, &twin.parameters.current_control, &twin.fast.turning_control, &in);
        const modulate_config_t modulate = turning_modulate(&twin.parameters.modulate, 1 << 26, acquired.angle_step);
        TEST_ASSERT_LESS_THAN_INT32(twin.parameters.modulate.knee_q17, modulate.knee_q17);
        period_without_task();
        TEST_ASSERT_EQUAL_MEMORY(&twin.fast.turning_control, &drive.fast.turning_control,
                                 sizeof twin.fast.turning_control);
        expect_duties(&modulate, &sample, &wanted, acquired.angle_step);
        limited[(published()->voltage_limited || published()->pulses_clamped) ? 1 : 0]++;
    }
    TEST_ASSERT_GREATER_THAN_INT(5, limited[0]);
    TEST_ASSERT_GREATER_THAN_INT(5, limited[1]);
}

/* Its route counts the periods since switching was enabled in every period. */
void test_the_voltage_of_a_bridge_that_has_run_for_long_stays_known(void)
{
    start_turning();
    turn_periods(2);
    for (int n = 0; n < 600; n++) {
        turn_periods(1);
        TEST_ASSERT_TRUE(published()->acting);
        TEST_ASSERT_EQUAL_UINT8(3, drive.fast.periods_since_enable);
    }
}

/* The voltage of the first pulse, 0.25 of the largest one along d at an angle of 0: phase a is above the others. */
void test_pulses_make_their_voltage_and_nothing_is_identified_meanwhile(void)
{
    seam_run();
    seam_periods(25);
    TEST_ASSERT_TRUE(published()->acting);
    drive.pulses = (pulses_config_t){.d = {.v = 8192, .low = -3000, .high = 3000},
                                     .angle_max = 0x10000000U,
                                     .square_max = UINT32_MAX,
                                     .reversals = 100,
                                     .periods_max = 1000,
                                     .number = 1};
    drive.fast.current_control.s_q_q30 = 250000000;
    command_t command = *command_box_read(&drive.commands);
    command.run = (uint8_t)BRIDGE_PULSES;
    command_box_write(&drive.commands, command);
    period_without_task();
    TEST_ASSERT_EQUAL_STRING("arw+", seam.log);
    TEST_ASSERT_GREATER_THAN_UINT32(16384 + 1000, seam.duty.a);
    TEST_ASSERT_LESS_THAN_UINT32(16384 - 1000, seam.duty.b);
    TEST_ASSERT_UINT32_WITHIN(1, seam.duty.b, seam.duty.c);
    TEST_ASSERT_FALSE(published()->acting);
    TEST_ASSERT_EQUAL_INT32(0, drive.fast.current_control.s_q_q30);
    TEST_ASSERT_EQUAL_UINT8(0, drive.fast.periods_since_enable);
    for (int n = 0; n < 4; n++) {
        period_without_task();
    }
    TEST_ASSERT_EQUAL_UINT32(3, drive.windows.generation);
    TEST_ASSERT_FALSE(window_box_at(&drive.windows)->acting);
}

/* In a short circuit the flux is searched in the stator's frame, in every second period: its sum begins with the flux
 * at the angle of that sample, and two periods turn it by twice 150,000,000 of 2^32. */
void test_the_search_in_a_short_circuit_gets_the_angle_of_the_sample_and_the_turn_of_a_period(void)
{
    turn_periods(400);
    command_t command = *command_box_read(&drive.commands);
    command.faults = FAULT_TORQUE;
    command.safe = SAFE_SHORT_CIRCUIT;
    command_box_write(&drive.commands, command);
    const open_switch_state_t *state = &drive.fast.short_circuit.open_switch;
    turn_periods(1);
    TEST_ASSERT_TRUE(drive_is_shorted(&drive));
    TEST_ASSERT_FALSE(state->has_begun);
    for (int n = 0; n < 3 && !state->has_begun; n++) {
        turn_periods(1);
    }
    TEST_ASSERT_TRUE(state->has_begun);
    const flux_point_t *flux = &published()->point.flux;
    const ab_q30_t psi = inverse_park_q30((dq_q15_t){flux->psi_d, flux->psi_q}, fx_rotation(published()->theta_e));
    TEST_ASSERT_EQUAL_INT(transform_round(psi.alpha), state->begin_alpha);
    TEST_ASSERT_EQUAL_INT(transform_round(psi.beta), state->begin_beta);
    TEST_ASSERT_GREATER_THAN_INT(2000, state->begin_beta * state->begin_beta / 1000);
    drive.fast.short_circuit.open_switch.turned_q16 = 0;
    turn_periods(2);
    TEST_ASSERT_INT_WITHIN(4, 2 * (150000000 >> 16), state->turned_q16);
}

/* A sensor that resolves 20,000 of 2^32: every second reading repeats the one before it. */
void test_a_repeated_reading_of_a_slow_rotor_is_its_angle_and_the_speed_goes_on(void)
{
    for (int n = 0; n < 2000; n++) {
        seam.theta_m += (n & 1) ? 20000U : 0U;
        seam_period();
        TEST_ASSERT_EQUAL_HEX32(3U * seam.theta_m, published()->theta_e);
    }
    for (int n = 0; n < 2; n++) { /* 30,000 of the field per period, of 225,404,288 at the speed base: 1.33e-4 */
        seam.theta_m += (n & 1) ? 20000U : 0U;
        seam_period();
        TEST_ASSERT_INT_WITHIN(30000, 285819, published()->point.omega);
    }
}

void test_a_jump_is_no_repeated_reading(void)
{
    for (int n = 0; n < 100; n++) {
        seam.theta_m += 1000000U;
        seam_period();
    }
    TEST_ASSERT_EQUAL_UINT16(0, drive.fast.monitor.angle);
    seam.theta_m += 0x20000000U;
    seam_period();
    TEST_ASSERT_GREATER_THAN_UINT16(0, drive.fast.monitor.angle); /* counted as implausible */
    TEST_ASSERT_EQUAL_UINT32(0, drive.fast.angle_tracker.repeats);
}

void test_from_the_smallest_dc_voltage_on_the_acting_voltage_is_known(void)
{
    for (int below = 0; below <= 1; below++) {
        const sample_t sample = {.v_dc = drive.period.monitor.v_min - below};
        drive.fast.periods_since_enable = 3;
        (void)acquire_check(&drive, &sample, true);
        TEST_ASSERT_EQUAL_UINT8((below == 1) ? 0 : 3, drive.fast.periods_since_enable);
    }
}
