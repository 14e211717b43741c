/* SPDX-License-Identifier: Apache-2.0 */
/* Whether recalled values describe this machine: what counts as an update, what confirms and what rejects them. */
#include "drive/recall.h"

#include "hal/mock_adc.h"
#include "hal/mock_angle.h"
#include "hal/mock_irq.h"
#include "hal/mock_pwm.h"
#include "hal/mock_temperature.h"
#include "seam.h"
#include "unity.h"

#define RECALLED 1234567 /* Q27, of the magnet flux */
#define FAST Q31(0.5)
#define SLOW Q31(0.001)

static identify_state_t *const state = &drive.task.identify;

/* In the step before the update's last one, with enough torque and no residual; FAST is twice the corner. */
void setUp(void)
{
    seam_start();
    seam.motor.identify.local_corner = 8192;
    recall_begin(&drive);
    state->kalman.x_q27[IDENTIFY_FLUX] = RECALLED;
    state->steps = 9;
    state->kept.update_valid = true;
    state->mean.e = (dq_q30_t){0, 0};
    drive.task.identification.torque_estimated = motor.identify.torque_min;
}

void tearDown(void)
{
}

static void updates(unsigned count, q31_t omega)
{
    for (unsigned n = 0; n < count; n++) {
        recall_step(&drive, omega);
    }
}

static void agree_at(int32_t speed_q15, int torque_sign)
{
    drive.task.identification.torque_estimated = (q15_t)(torque_sign * motor.identify.torque_min);
    updates(3, speed_q15 * 65536);
}

/* A recalled voltage drop that explains a quarter of the voltage base, far more than the bound. */
static void drop_explains(int32_t h_q30)
{
    state->kalman.x_q27[IDENTIFY_DROP] = IDENTIFY_ONE_Q27;
    state->mean.q.h_q30[IDENTIFY_DROP] = h_q30;
}

static void assert_undecided(void)
{
    TEST_ASSERT_TRUE(drive.task.recall.unconfirmed);
    TEST_ASSERT_EQUAL_INT32(RECALLED, state->kalman.x_q27[IDENTIFY_FLUX]);
}

static void assert_rejected(void)
{
    TEST_ASSERT_FALSE(drive.task.recall.unconfirmed);
    TEST_ASSERT_EQUAL_INT32(0, state->kalman.x_q27[IDENTIFY_FLUX]);
}

void test_three_updates_without_a_residual_confirm_the_values(void)
{
    for (int negative = 0; negative <= 1; negative++) {
        const q31_t omega = negative ? -FAST : FAST;
        setUp();
        drive.task.identification.torque_estimated = (q15_t)(negative ? -motor.identify.torque_min
                                                                      : motor.identify.torque_min);
        updates(2, omega);
        assert_undecided();
        updates(1, omega);
        TEST_ASSERT_FALSE(drive.task.recall.unconfirmed);
        TEST_ASSERT_EQUAL_INT32(RECALLED, state->kalman.x_q27[IDENTIFY_FLUX]);
    }
}

/* Below twice the corner of 8192 a voltage drop can hide an error of the flux at one speed. */
void test_below_twice_the_corner_agreement_at_one_speed_confirms_nothing(void)
{
    const int32_t speeds[] = {16383, -16383, 1000, -1000};
    for (unsigned k = 0; k < 4U; k++) {
        setUp();
        drop_explains(Q31(0.125));
        for (int n = 0; n < 10; n++) {
            agree_at(speeds[k], 1);
        }
        assert_undecided();
    }
    agree_at(16384, 1);
    TEST_ASSERT_FALSE(drive.task.recall.unconfirmed);
}

void test_agreement_at_a_second_speed_or_with_torque_in_the_other_direction_confirms_the_values(void)
{
    static const struct {
        int32_t speed;
        int torque_sign;
        bool confirms;
    } second[] = {{9000, 1, true},  {8999, 1, false},   {4000, 1, true},    {4001, 1, false}, {6000, -1, true},
                  {-6000, 1, true}, {-6000, -1, false}, {-8999, -1, false}, {-9000, -1, true}};
    for (unsigned k = 0; k < sizeof second / sizeof second[0]; k++) {
        setUp();
        drop_explains(Q31(0.125));
        agree_at(6000, 1);
        assert_undecided();
        agree_at(second[k].speed, second[k].torque_sign);
        TEST_ASSERT_EQUAL(second[k].confirms, !drive.task.recall.unconfirmed);
    }
}

/* Q31(0.25) of speed and 80000000 of noise: a quarter of it is 5000000 in Q30, nine tenths of that are allowed. The
 * drop of one sigma explains h in Q30; the comparison is in steps of 32. */
void test_where_resistance_and_drop_explain_little_one_speed_is_enough(void)
{
    static const struct {
        identify_index_t index;
        int32_t h_q30;
        bool confirms;
    } given[] = {{IDENTIFY_DROP, 4499968, true},
                 {IDENTIFY_DROP, 4500032, false},
                 {IDENTIFY_R, 4499968, true},
                 {IDENTIFY_R, 4500032, false},
                 {IDENTIFY_DROP, -4500064, false}};
    for (unsigned k = 0; k < 2U * sizeof given / sizeof given[0]; k++) {
        setUp();
        seam.motor.identify.noise_flux_q30 = 80000000;
        state->kalman.x_q27[given[k / 2U].index] = IDENTIFY_ONE_Q27;
        (k % 2U == 0U ? &state->mean.d : &state->mean.q)->h_q30[given[k / 2U].index] = given[k / 2U].h_q30;
        agree_at(8192, 1);
        TEST_ASSERT_EQUAL(given[k / 2U].confirms, !drive.task.recall.unconfirmed);
    }
}

/* The speed grows slowly, and the values agree throughout: the first speed counts, and no agreement is lost. */
void test_a_ramp_confirms_the_values_once_its_speed_has_grown_enough(void)
{
    drop_explains(Q31(0.125));
    agree_at(6000, 1);
    agree_at(7500, 1);
    updates(1, 8999 * 65536);
    assert_undecided();
    updates(1, 9000 * 65536);
    TEST_ASSERT_FALSE(drive.task.recall.unconfirmed);
}

/* The agreement at the first speed remains; at the second one it must begin anew. */
void test_a_residual_at_the_second_speed_confirms_nothing(void)
{
    drop_explains(Q31(0.125));
    agree_at(6000, 1);
    state->mean.e.q = Q31(0.5);
    updates(1, 12000 * 65536);
    state->mean.e.q = 0;
    updates(2, 12000 * 65536);
    assert_undecided();
    updates(1, 12000 * 65536);
    TEST_ASSERT_FALSE(drive.task.recall.unconfirmed);
}

void test_fifty_updates_that_agree_at_one_speed_alone_reject_the_values(void)
{
    drop_explains(Q31(0.125));
    updates(49, 6000 * 65536);
    assert_undecided();
    updates(1, 6000 * 65536);
    assert_rejected();
}

void test_an_update_that_tells_too_little_does_not_count(void)
{
    state->steps = 8;
    updates(200, FAST);
    assert_undecided();
    setUp();
    state->kept.update_valid = false;
    updates(200, FAST);
    assert_undecided();
    setUp();
    drive.task.identification.torque_estimated = (q15_t)(motor.identify.torque_min - 1);
    updates(200, FAST);
    assert_undecided();
}

/* A residual of the whole voltage base; agreement must begin anew after it. */
void test_a_residual_of_either_axis_ends_the_agreement(void)
{
    for (int axis = 0; axis < 2; axis++) {
        setUp();
        updates(2, FAST);
        *(axis == 0 ? &state->mean.e.d : &state->mean.e.q) = -Q31(0.5);
        updates(1, FAST);
        state->mean.e = (dq_q30_t){0, 0};
        updates(2, FAST);
        assert_undecided();
        updates(1, FAST);
        TEST_ASSERT_FALSE(drive.task.recall.unconfirmed);
    }
}

/* At half of the base speed and with 0.0745 (80000000 in Q30) of noise a quarter of it is 10000000 in Q30; nine tenths
 * of that are allowed, because the mean contains nine of the ten steps. */
void test_residuals_of_a_quarter_of_the_noise_of_the_flux_agree_and_larger_ones_of_either_axis_do_not(void)
{
    const dq_q30_t larger[] = {{9000001, 0}, {-9000001, 0}, {0, 9000001}, {0, -9000001}};
    seam.motor.identify.noise_flux_q30 = 80000000;
    state->mean.e = (dq_q30_t){9000000, -9000000};
    updates(3, FAST);
    TEST_ASSERT_FALSE(drive.task.recall.unconfirmed);
    for (unsigned k = 0; k < sizeof larger / sizeof larger[0]; k++) {
        setUp();
        seam.motor.identify.noise_flux_q30 = 80000000;
        state->mean.e = larger[k];
        updates(3, FAST);
        assert_undecided();
    }
}

/* Half of a corner at 1000 counts. */
void test_updates_count_as_trials_from_half_of_the_corner_speed_on(void)
{
    seam.motor.identify.local_corner = 1000;
    state->mean.e.d = Q31(0.5);
    updates(200, 499 << 16);
    assert_undecided();
    updates(50, -(500 << 16));
    assert_rejected();
}

void test_fifty_updates_with_a_residual_at_speed_reject_the_values_and_at_low_speed_none_does(void)
{
    state->mean.e.d = Q31(0.5);
    updates(200, SLOW);
    assert_undecided();
    updates(49, FAST);
    assert_undecided();
    updates(1, FAST);
    assert_rejected();
}

void test_three_updates_beyond_the_gate_reject_the_values_at_any_time(void)
{
    state->steps = 0;
    state->gate_exceeded_updates = 2;
    updates(1, FAST);
    assert_undecided();
    state->gate_exceeded_updates = 3;
    updates(1, FAST);
    assert_rejected();
}
