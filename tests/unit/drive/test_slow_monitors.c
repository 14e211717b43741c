/* SPDX-License-Identifier: Apache-2.0 */
/* What the monitors of the 1 kHz task get from the drive: each of them is tested in tests/unit/safety. */
#include "drive/slow_monitors.h"

#include "control/current/transform.h"
#include "hal/mock_adc.h"
#include "hal/mock_angle.h"
#include "hal/mock_irq.h"
#include "hal/mock_pwm.h"
#include "hal/mock_temperature.h"
#include "seam.h"
#include "types/faults.h"
#include "unity.h"

#define I_Q 6000
#define OF_A_MOVEMENT (FAULT_TEMPERATURE | FAULT_OVER_SPEED | FAULT_INPUT | FAULT_CURRENT_STUCK)

static snapshot_t snapshot;

/* The currents of the phases at 0 degrees of the rotor are those of (i_d, i_q) turned by theta. */
static void turn_to(uint32_t theta_e)
{
    snapshot.sample.theta_e = theta_e;
    const ab_q30_t i = inverse_park_q30((dq_q15_t){0, I_Q}, fx_rotation(theta_e));
    snapshot.sample.i_ab = fx_pair(i.alpha >> 15, i.beta >> 15);
}

void setUp(void)
{
    seam_start();
    snapshot = (snapshot_t){
        .sample = {.acting = true, .v_dc = 12000, .point = {.i = {0, I_Q}, .omega = Q31(0.05)}},
        .window = {.acting = true, .sum_i = {0, 10 * I_Q}},
        .gates = true,
        .inverter_dC = 250,
        .winding_dC = 250,
        .known_permille = 1000,
    };
    drive.task.i_ref = (dq_q15_t){0, I_Q};
    turn_to(0);
}

void tearDown(void)
{
}

/* All faults of so many steps, in which the field turns by a thirteenth of a turn each. */
static uint32_t faults_of(int steps)
{
    uint32_t faults = 0;
    for (int n = 0; n < steps; n++) {
        turn_to((uint32_t)n * (UINT32_MAX / 13U));
        faults |= slow_monitors_step(&drive, &snapshot);
    }
    return faults;
}

/* A phase whose lead is open: the two others carry opposite currents. */
static uint32_t faults_without(int phase)
{
    uint32_t faults = 0;
    for (int n = 0; n < 40; n++) {
        turn_to((uint32_t)n * (UINT32_MAX / 13U));
        abc_q15_t i = measure_phases(snapshot.sample.i_ab, 0);
        int32_t *x[3] = {&i.a, &i.b, &i.c};
        const int32_t half = *x[phase] / 2;
        *x[phase] = 0;
        *x[(phase + 1) % 3] += half;
        *x[(phase + 2) % 3] += half;
        snapshot.sample.i_ab = fx_pair(i.a, (i.b - i.c) * 37837 / 65536); /* 1/sqrt(3) */
        faults |= slow_monitors_step(&drive, &snapshot);
    }
    return faults;
}

void test_currents_that_follow_their_reference_are_no_fault(void)
{
    TEST_ASSERT_EQUAL_HEX32(0, faults_of(40) & (FAULT_PHASE_LOST | FAULT_CONTROL | OF_A_MOVEMENT));
}

void test_each_phase_is_compared_with_its_own_reference(void)
{
    for (int phase = 0; phase < 3; phase++) {
        setUp();
        TEST_ASSERT_EQUAL_HEX32(FAULT_PHASE_LOST, faults_without(phase) & FAULT_PHASE_LOST);
        setUp();
        snapshot.sample.acting = false; /* without switching no current follows */
        TEST_ASSERT_EQUAL_HEX32(0, faults_without(phase) & FAULT_PHASE_LOST);
    }
}

/* (MN-43): 8000 * 30,000/2^15 = 7324 of missing rotational voltage, and as much current: more than the reference. */
void test_no_phase_is_lost_while_the_tracked_speed_is_far_behind(void)
{
    seam.motor.plausibility.behind_gain = Q16_ONE;
    drive.task.psi_ref = (dq_q15_t){30000, 0};
    snapshot.lag = 8000;
    TEST_ASSERT_EQUAL_HEX32(0, faults_without(0) & FAULT_PHASE_LOST);
    snapshot.lag = 0;
    TEST_ASSERT_EQUAL_HEX32(FAULT_PHASE_LOST, faults_without(0) & FAULT_PHASE_LOST);
}

static uint32_t faults_of_a_wrong_zero(bool acting, bool gates, q31_t omega)
{
    setUp();
    snapshot.sample.acting = acting;
    snapshot.gates = gates;
    snapshot.sample.point.omega = omega;
    return faults_of(60) & FAULT_INPUT;
}

void test_a_wrong_zero_shows_only_where_no_current_can_flow(void)
{
    TEST_ASSERT_EQUAL_HEX32(FAULT_INPUT, faults_of_a_wrong_zero(false, false, 0));
    TEST_ASSERT_EQUAL_HEX32(0, faults_of_a_wrong_zero(true, false, 0));
    TEST_ASSERT_EQUAL_HEX32(0, faults_of_a_wrong_zero(false, true, 0));
    TEST_ASSERT_EQUAL_HEX32(0, faults_of_a_wrong_zero(false, false, Q31(0.05)));
}

/* In a movement the others have no meaning: here the current is far from its reference. */
void test_in_a_movement_the_faults_that_need_no_motor_data_remain(void)
{
    for (int k = 0; k < 2; k++) {
        setUp();
        drive.task.movement.movement = MOVEMENT_SPIN;
        drive.task.movement.phase = (k == 1) ? MOVEMENT_PHASE_AGREED : MOVEMENT_PHASE_IDLE;
        drive.task.i_ref = (dq_q15_t){0, -3 * I_Q};
        TEST_ASSERT_EQUAL_HEX32((k == 1) ? 0U : (uint32_t)FAULT_CONTROL, faults_of(30) & FAULT_CONTROL);
        snapshot.sample.point.omega = Q31(0.999);
        TEST_ASSERT_EQUAL_HEX32(FAULT_OVER_SPEED, faults_of(10) & FAULT_OVER_SPEED);
        snapshot.sample.point.omega = 0;
        snapshot.winding_dC = 3000;
        TEST_ASSERT_EQUAL_HEX32(FAULT_TEMPERATURE, faults_of(200) & FAULT_TEMPERATURE);
        snapshot.known_permille = 800;
        TEST_ASSERT_EQUAL_HEX32(FAULT_INPUT, faults_of(30) & FAULT_INPUT);
        TEST_ASSERT_EQUAL_HEX32(0, faults_of(1) & FAULT_GATE);
        drive.task.gate_fault.switch_shorted = true;
        TEST_ASSERT_EQUAL_HEX32(FAULT_GATE, faults_of(1) & FAULT_GATE);
    }
}

/* Seven updates of ten steps are 70 ms. */
void test_updates_beyond_the_gate_count_for_the_robust_identification_only(void)
{
    for (int k = 0; k < 3; k++) {
        setUp();
        snapshot.mrai_is_chosen = k == 1;
        drive.task.identify.gate_exceeded_updates = (k == 2) ? 6 : 7;
        TEST_ASSERT_EQUAL_HEX32((k == 0) ? (uint32_t)FAULT_TORQUE : 0U,
                                slow_monitors_step(&drive, &snapshot) & FAULT_TORQUE);
    }
}

/* The paper's identification reports no updates beyond the gate: not even one step counts. */
void test_the_paper_s_identification_exceeds_no_gate(void)
{
    seam.motor.plausibility.gate_exceeded_steps = 1;
    drive.task.identify.gate_exceeded_updates = 7;
    for (int k = 0; k < 2; k++) {
        snapshot.mrai_is_chosen = k == 1;
        TEST_ASSERT_EQUAL_HEX32((k == 0) ? (uint32_t)FAULT_TORQUE : 0U,
                                slow_monitors_step(&drive, &snapshot) & FAULT_TORQUE);
    }
}

/* Each step takes an eighth of the distance: 6000, 4500, 3188 in q, of which phases b and c carry 0.866 at 0 degrees. A
 * current that has not yet reversed is not lost, one that has ended too early is. */
void test_a_law_that_answers_slowly_is_compared_with_the_reference_that_it_follows(void)
{
    seam.motor.plausibility.answer_rate = Q15(0.125);
    drive.task.plausibility.expected = (dq_q15_t){0, I_Q};
    drive.task.i_ref.q = -I_Q;
    const plausibility_state_t *state = &drive.task.plausibility;
    (void)slow_monitors_step(&drive, &snapshot);
    for (int phase = 0; phase < 3; phase++) {
        TEST_ASSERT_EQUAL_INT(0, state->lost[phase][0] + state->lost[phase][1]);
    }
    snapshot.sample.i_ab = 0;
    (void)slow_monitors_step(&drive, &snapshot);
    TEST_ASSERT_EQUAL_INT(1, state->lost[1][0]);
    TEST_ASSERT_EQUAL_INT(1, state->lost[2][1]);
}

/* A deviation counts once while the voltage is limited, else five times. */
void test_a_deviation_with_limited_voltage_counts_less(void)
{
    drive.task.i_ref = (dq_q15_t){0, -I_Q};
    for (int k = 0; k < 2; k++) {
        drive.task.plausibility.deviation = 0;
        snapshot.sample.voltage_limited = k == 1;
        (void)slow_monitors_step(&drive, &snapshot);
        TEST_ASSERT_EQUAL_INT((k == 1) ? 1 : 5, drive.task.plausibility.deviation);
    }
}

void test_a_hot_inverter_is_found_after_its_time(void)
{
    snapshot.inverter_dC = seam.motor.plausibility.inverter_trip_dC;
    TEST_ASSERT_EQUAL_HEX32(0, faults_of(seam.motor.plausibility.hot_steps - 1) & FAULT_TEMPERATURE);
    TEST_ASSERT_EQUAL_HEX32(FAULT_TEMPERATURE, faults_of(1) & FAULT_TEMPERATURE);
}

/* Deviation of the power in counts, at standstill, with a winding at 150 degrees C: 43262015/2^31 of 20,000 are 403. */
static int32_t deviation_with(q15_t u_q)
{
    setUp();
    snapshot.winding_dC = 1500;
    snapshot.sample.point = (operating_point_t){.i = {0, 20000}, .u = {0, u_q}};
    (void)faults_of(40);
    return drive.task.torque_monitor.deviation / 65536;
}

void test_the_power_of_the_resistance_at_the_winding_s_temperature_is_no_torque(void)
{
    TEST_ASSERT_INT32_WITHIN(2, 0, deviation_with(403));
    TEST_ASSERT_INT32_WITHIN(3, 610, deviation_with(1403)); /* 1000 * 20,000/2^15 */
}

/* Phase a of the sample half a step before has a constant part of five times i_dead. */
static void start_side(q31_t omega, bool acting)
{
    setUp();
    snapshot.generation = 100;
    snapshot.sample.point.omega = omega;
    snapshot.sample.acting = acting;
    const int32_t constant = 5 * seam.motor.plausibility.i_dead;
    drive.samples.slot[95 % SAMPLE_SLOTS] = snapshot.sample;
    drive.samples.slot[95 % SAMPLE_SLOTS].i_ab += (fx_pair_t)constant; /* alpha */
}

/* Whether the upper switches are chosen after so many steps of it. The other samples of the step have no constant
 * part. */
static bool is_upper(q31_t omega, bool acting, uint32_t steps)
{
    start_side(omega, acting);
    for (uint32_t n = 0; n < steps; n++) {
        (void)slow_monitors_step(&drive, &snapshot);
    }
    return short_side_is_upper(&drive.task.short_side, seam.motor.plausibility.i_dead);
}

/* Slowly, the second harmonic of a half wave looks constant. */
void test_the_sample_half_a_step_before_counts_for_the_side_of_a_short_circuit(void)
{
    TEST_ASSERT_TRUE(is_upper(Q31(0.3), true, 40));
    TEST_ASSERT_FALSE(is_upper(Q31(0.3), true, 4));
    TEST_ASSERT_FALSE(is_upper(Q31(0.3), false, 40));
    TEST_ASSERT_FALSE(is_upper(Q31(0.02), true, 40));
}

/* Its phase currents are not controlled. */
void test_a_sample_half_a_step_before_that_did_not_switch_does_not_count_for_the_side(void)
{
    start_side(Q31(0.3), true);
    drive.samples.slot[95 % SAMPLE_SLOTS].acting = false;
    for (int n = 0; n < 40; n++) {
        (void)slow_monitors_step(&drive, &snapshot);
        TEST_ASSERT_INT32_WITHIN(2 * 256, 0, drive.task.short_side.a_q8);
    }
}

static bool is_upper_after(bool shorted, uint32_t faults)
{
    TEST_ASSERT_TRUE(is_upper(Q31(0.3), true, 40));
    drive.samples.slot[95 % SAMPLE_SLOTS].acting = false;
    snapshot.sample.acting = false;
    snapshot.shorted = shorted;
    snapshot.faults = faults;
    (void)slow_monitors_step(&drive, &snapshot);
    return short_side_is_upper(&drive.task.short_side, seam.motor.plausibility.i_dead);
}

void test_the_side_is_kept_in_the_short_circuit_and_while_a_fault_is_latched(void)
{
    TEST_ASSERT_TRUE(is_upper_after(true, 0));
    TEST_ASSERT_TRUE(is_upper_after(false, FAULT_ANGLE));
    TEST_ASSERT_FALSE(is_upper_after(false, 0));
}

/* Phase a keeps its value while the sum of the others moves. */
void test_a_stuck_sensor_is_found_in_a_movement_too(void)
{
    for (int k = 0; k < 2; k++) {
        setUp();
        drive.task.movement.movement = MOVEMENT_SPIN;
        drive.task.movement.phase = (k == 1) ? MOVEMENT_PHASE_AGREED : MOVEMENT_PHASE_IDLE;
        uint32_t faults = 0;
        for (int n = 0; n < 40; n++) {
            const int32_t moved = (n & 1) ? 600 : 0;
            snapshot.sample.i_ab = fx_pair(2000 + moved, 0);
            snapshot.sample.zero_q28 = -moved * 8192;
            faults |= slow_monitors_step(&drive, &snapshot);
        }
        TEST_ASSERT_EQUAL_HEX32(FAULT_CURRENT_STUCK, faults & FAULT_CURRENT_STUCK);
    }
}

static void step(void)
{
    (void)slow_monitors_step(&drive, &snapshot);
}

static void steps(int count)
{
    for (int n = 0; n < count; n++) {
        step();
    }
}

/* The compensation of the first step is new: the comparisons begin with the second one. */
static bool is_angle_compared(uint32_t window_turns_q29, q31_t omega)
{
    setUp();
    seam.motor.identify.window_turns_q29 = window_turns_q29;
    snapshot.sample.point.omega = omega;
    steps(2);
    TEST_ASSERT_EQUAL_INT(drive.task.frozen_angle.standing, drive.task.launch_power.steady);
    return drive.task.frozen_angle.standing == 1;
}

/* 2^30 times 2^28 is a quarter of a turn in units of 2^-60. */
void test_up_to_a_quarter_of_a_turn_in_a_step_the_angles_are_compared(void)
{
    TEST_ASSERT_TRUE(is_angle_compared(1U << 28, 1 << 30));
    TEST_ASSERT_TRUE(is_angle_compared(1U << 28, -(1 << 30)));
    TEST_ASSERT_FALSE(is_angle_compared(1U << 28, (1 << 30) + 1));
    TEST_ASSERT_FALSE(is_angle_compared(1U << 28, -(1 << 30) - 1));
}

/* It changes the residual of the voltages along the current, as a jump of the gain would. */
void test_a_new_compensation_begins_the_comparison_of_the_gain_anew(void)
{
    steps(seam.motor.torque_monitor.settle_steps + 3);
    TEST_ASSERT_GREATER_THAN_UINT8(0, drive.task.gain_jump.steps);
    drive.parameters.modulate.dead_time_q16++;
    step();
    TEST_ASSERT_EQUAL_UINT8(0, drive.task.gain_jump.steps);
    step();
    TEST_ASSERT_EQUAL_UINT8(1, drive.task.gain_jump.steps);
}

void test_without_a_complete_window_no_angle_is_compared(void)
{
    for (int k = 0; k < 4; k++) {
        setUp();
        steps(3);
        TEST_ASSERT_EQUAL_INT(2, drive.task.frozen_angle.standing);
        snapshot.window.acting = k != 1;
        snapshot.sample.acting = k != 2;
        snapshot.mrai_is_chosen = k == 3;
        step();
        TEST_ASSERT_EQUAL_INT((k == 0) ? 3 : 0, drive.task.frozen_angle.standing);
        TEST_ASSERT_EQUAL_INT((k == 0) ? 3 : 0, drive.task.launch_power.steady);
    }
}

/* The voltage changes by twice the threshold v_0 at an angle at which the smallest phase current is 2296, above 2 i_0,
 * and at one at which it is 0: there the threshold is eight times as large. */
void test_a_voltage_that_changes_at_a_standing_angle_counts_with_all_phase_currents(void)
{
    for (int k = 0; k < 2; k++) {
        setUp();
        seam.motor.launch_power.i_min = Q15_MAX; /* this monitor would find it, too */
        snapshot.sample.point.omega = 0;
        turn_to((k == 0) ? 0x10000000U : 0U);
        steps(30);
        snapshot.window.sum_u.q += 2 * seam.motor.frozen_angle.v_0;
        steps(20);
        TEST_ASSERT_EQUAL_UINT8((k == 0) ? seam.motor.frozen_angle.fault_steps : 0, drive.task.frozen_angle.frozen);
        TEST_ASSERT_EQUAL_HEX32((k == 0) ? (uint32_t)FAULT_ANGLE_OFFSET : 0U,
                                slow_monitors_step(&drive, &snapshot) & FAULT_ANGLE_OFFSET);
    }
}

/* 198674/65536 of the change of the flux. */
void test_the_voltage_that_changes_the_flux_is_removed(void)
{
    snapshot.window.sum_u = (dq_q15_t){-5000, 7000};
    steps(2);
    drive.task.psi_ref.d += 1000;
    drive.task.psi_ref.q -= 2000;
    step();
    TEST_ASSERT_INT32_WITHIN(1, -5000 - 3031, drive.task.frozen_angle.u_standing.d);
    TEST_ASSERT_INT32_WITHIN(1, 7000 + 6063, drive.task.frozen_angle.u_standing.q);
}

/* 140 * 10,000/2^15 = 43 is above v_lag = 42, 138 * 10,000/2^15 = 42 is not. */
void test_while_the_tracked_speed_is_behind_the_comparisons_begin_anew(void)
{
    drive.task.psi_ref = (dq_q15_t){10000, 0};
    steps(6);
    snapshot.lag = 138;
    step();
    TEST_ASSERT_EQUAL_UINT8(6, drive.task.frozen_angle.standing);
    TEST_ASSERT_EQUAL_UINT8(6, drive.task.launch_power.steady);
    snapshot.lag = -140;
    step();
    TEST_ASSERT_EQUAL_UINT8(1, drive.task.frozen_angle.standing);
    TEST_ASSERT_EQUAL_UINT8(1, drive.task.launch_power.steady);
}

/* Whether the power is compared with these deviations of the sample and of the mean of the step from the reference. */
static bool is_power_compared(dq_q15_t of_sample, dq_q15_t of_mean)
{
    setUp();
    drive.task.i_ref = (dq_q15_t){-2000, I_Q};
    snapshot.sample.point.i = (dq_q15_t){of_sample.d - 2000, of_sample.q + I_Q};
    snapshot.i_mean = (dq_q15_t){of_mean.d - 2000, of_mean.q + I_Q};
    steps(2);
    TEST_ASSERT_EQUAL_UINT8(1, drive.task.frozen_angle.standing);
    if (drive.task.launch_power.steady == 1) {
        TEST_ASSERT_EQUAL_INT(-2000, drive.task.launch_power.i_ref.d);
        TEST_ASSERT_EQUAL_INT(I_Q, drive.task.launch_power.i_ref.q);
    }
    return drive.task.launch_power.steady == 1;
}

/* i_0 is 819. */
void test_the_power_is_compared_while_the_sample_or_the_mean_is_near_the_reference(void)
{
    const dq_q15_t far = {2000, 2000};
    for (int sign = -1; sign <= 1; sign += 2) {
        TEST_ASSERT_TRUE(is_power_compared((dq_q15_t){sign * 818, 0}, far));
        TEST_ASSERT_FALSE(is_power_compared((dq_q15_t){sign * 819, 0}, far));
        TEST_ASSERT_TRUE(is_power_compared((dq_q15_t){0, sign * 818}, far));
        TEST_ASSERT_FALSE(is_power_compared((dq_q15_t){0, sign * 819}, far));
        TEST_ASSERT_TRUE(is_power_compared(far, (dq_q15_t){sign * 810, 0}));
        TEST_ASSERT_FALSE(is_power_compared(far, (dq_q15_t){sign * 830, 0}));
        TEST_ASSERT_TRUE(is_power_compared(far, (dq_q15_t){0, sign * 810}));
        TEST_ASSERT_FALSE(is_power_compared(far, (dq_q15_t){0, sign * 830}));
    }
}

/* Four pole pairs: 0x01234567 is 0x048D159C of the field. A prediction differs from the sensor's angle. */
void test_the_power_waits_while_the_angle_is_a_prediction(void)
{
    drive.period.angle_tracker.pole_pairs = 4;
    drive.period.angle_tracker.offset = 0x20000000U;
    snapshot.sample.theta_m = 0x01234567U;
    turn_to(0x248D159CU);
    steps(3);
    TEST_ASSERT_FALSE(drive.task.launch_power.waited);
    TEST_ASSERT_EQUAL_UINT8(2, drive.task.launch_power.steady);
    turn_to(0x248D159DU);
    step();
    TEST_ASSERT_TRUE(drive.task.launch_power.waited);
    TEST_ASSERT_EQUAL_UINT8(2, drive.task.launch_power.steady);
}

/* Whether a constant part of phase a counts for the side of the short circuit, if the field turns by the product. */
static bool is_side_updated(uint32_t window_turns_q29, q31_t omega)
{
    setUp();
    seam.motor.identify.window_turns_q29 = window_turns_q29;
    snapshot.sample.point.omega = omega;
    snapshot.sample.i_ab += (fx_pair_t)2000; /* alpha */
    step();
    return drive.task.short_side.a_q8 != 0;
}

/* 1/32 of a turn is 2^55 in units of 2^-60, a whole turn 2^60. */
void test_within_a_thirty_second_of_a_whole_turn_the_side_is_not_updated(void)
{
    TEST_ASSERT_FALSE(is_side_updated(1U << 25, (1 << 30) - 1));
    TEST_ASSERT_TRUE(is_side_updated(1U << 25, 1 << 30));
    TEST_ASSERT_TRUE(is_side_updated(1U << 30, (1 << 30) - (1 << 25) - 1));
    TEST_ASSERT_FALSE(is_side_updated(1U << 30, (1 << 30) - (1 << 25)));
}
