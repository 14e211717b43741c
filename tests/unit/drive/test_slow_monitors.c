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

/* Whether the upper switches are chosen after so many steps in which phase a of the sample half a step before has a
 * constant part of five times i_dead. The other samples of the step have none. */
static bool is_upper(q31_t omega, bool acting, uint32_t steps)
{
    setUp();
    snapshot.generation = 100;
    snapshot.sample.point.omega = omega;
    snapshot.sample.acting = acting;
    const int32_t constant = 5 * seam.motor.plausibility.i_dead;
    drive.samples.slot[95 % SAMPLE_SLOTS] = snapshot.sample;
    drive.samples.slot[95 % SAMPLE_SLOTS].i_ab += (fx_pair_t)constant; /* alpha */
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
