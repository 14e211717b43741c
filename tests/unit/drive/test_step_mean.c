/* SPDX-License-Identifier: Apache-2.0 */
/* Which means the task takes over a step: of the window's sums, or the last sample. */
#include "drive/step_mean.h"

#include "hal/mock_adc.h"
#include "hal/mock_angle.h"
#include "hal/mock_irq.h"
#include "hal/mock_pwm.h"
#include "hal/mock_temperature.h"
#include "seam.h"
#include "unity.h"

#define PERIODS 10 /* of hsm1 in a step */

static snapshot_t snapshot;

/* Sample and sums have nothing in common, nor have i and u, d and q. */
void setUp(void)
{
    seam_start();
    TEST_ASSERT_EQUAL_INT(PERIODS, motor.bases.periods_per_step);
    snapshot = (snapshot_t){.sample.point.i = {-3000, 4000},
                            .sample.point.u = {700, -9000},
                            .window.sum_i = {-20000 * PERIODS, 15000 * PERIODS},
                            .window.sum_u = {1100 * PERIODS + 4, -2600 * PERIODS - 6}};
}

void tearDown(void)
{
}

static void take(bool mrai_is_chosen, bool acting)
{
    snapshot.mrai_is_chosen = mrai_is_chosen;
    snapshot.window.acting = acting;
    step_mean_take(&drive, &snapshot);
}

static void assert_means(dq_q15_t i, dq_q15_t u)
{
    TEST_ASSERT_EQUAL_INT32(i.d, snapshot.i_mean.d);
    TEST_ASSERT_EQUAL_INT32(i.q, snapshot.i_mean.q);
    TEST_ASSERT_EQUAL_INT32(u.d, snapshot.u_mean.d);
    TEST_ASSERT_EQUAL_INT32(u.q, snapshot.u_mean.q);
}

/* 1100.4 is rounded to 1100, -2600.6 to -2601. */
void test_a_window_of_the_robust_identification_gives_the_means_of_its_sums(void)
{
    take(false, true);
    assert_means((dq_q15_t){-20000, 15000}, (dq_q15_t){1100, -2601});
}

void test_without_sums_the_last_sample_counts(void)
{
    for (int n = 0; n < 3; n++) {
        const bool mrai_is_chosen = n > 0;
        take(mrai_is_chosen, n == 2);
        assert_means((dq_q15_t){-3000, 4000}, (dq_q15_t){700, -9000});
    }
}

/* 5000 = sqrt(3000^2 + 4000^2); the root rounds by less than a count. */
void test_the_magnitude_is_always_that_of_the_sample(void)
{
    for (int n = 0; n < 4; n++) {
        snapshot.i_magnitude = 0;
        take(n / 2 == 1, n % 2 == 1);
        TEST_ASSERT_INT32_WITHIN(1, 5000, snapshot.i_magnitude);
    }
}

/* The largest sums of 10 periods, of both signs: neither the product overflows nor the mean saturates. */
void test_the_mean_of_the_largest_sums_is_the_largest_value(void)
{
    const dq_q15_t mean = step_mean_of(&drive, (dq_q15_t){32767 * PERIODS, -32768 * PERIODS});
    TEST_ASSERT_EQUAL_INT32(32767, mean.d);
    TEST_ASSERT_EQUAL_INT32(-32768, mean.q);
}
