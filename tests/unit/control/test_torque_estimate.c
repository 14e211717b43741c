/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "control/mrai/torque_estimate.h"
#include "fixture.h"
#include "unity.h"

static torque_sum_t sum;
static torque_mean_t mean;

void setUp(void)
{
    sum = (torque_sum_t){0};
    mean = (torque_mean_t){0};
}

void tearDown(void)
{
}

static void add(int32_t i_d, int32_t i_q, int32_t psi_d, int32_t psi_q, int32_t delta)
{
    const dq_q15_t i = {i_d, i_q};
    const flux_point_t flux = {.psi_d = psi_d, .psi_q = psi_q};
    torque_estimate_add(&sum, &i, &flux, delta);
}

/* Torque of a single period. */
static q15_t torque(int32_t i_d, int32_t i_q, int32_t psi_d, int32_t psi_q, int32_t delta)
{
    add(i_d, i_q, psi_d, psi_q, delta);
    return torque_estimate_mean(&mean, &sum);
}

/* By hand: (0.5 + 0.1) 0.25 - 0.2 (-0.5) = 0.25. */
void test_the_torque_is_psi_d_i_q_minus_psi_q_i_d_with_the_identified_flux(void)
{
    TEST_ASSERT_INT_WITHIN(1, 8192, torque(-16384, 8192, 16384, 6554, 3277));
}

void test_the_torque_of_motor_and_generator_has_the_same_magnitude(void)
{
    const q15_t a = torque(-7000, 11000, 16000, 9000, -188);
    TEST_ASSERT_INT_WITHIN(1, -a, torque(-7000, -11000, 16000, -9000, -188));
}

/* Errors: the rounding of the mean (0.5) and the LSB of the sum. */
void test_every_operating_point_follows_the_twin(void)
{
    const fixture_t f = fixture();
    worst_t worst = {0};
    uint64_t seed = 91;
    for (int n = 0; n < 200000; n++) {
        const dq_q15_t i = {random_in(&seed, -32768, 32767), random_in(&seed, -32768, 32767)};
        const dq_q15_t psi = {random_in(&seed, -20000, 20000), random_in(&seed, -32768, 32767)};
        const int32_t delta = random_in(&seed, -7600, 7600);
        const twin_flux_t si = {.psi_d = from_q15(psi.d) * f.psi, .psi_q = from_q15(psi.q) * f.psi};
        const double t = twin_torque(&f.si, (twin_dq_t){from_q15(i.d) * f.i, from_q15(i.q) * f.i}, &si,
                                     from_q15(delta) * f.psi);
        const q15_t y = torque(i.d, i.q, psi.d, psi.q, delta);
        worst_note(&worst, y - twin_clamp(t / f.t * 32768.0, -32768, 32767), "i %d %d psi %d %d", i.d, i.q, psi.d,
                   psi.q);
    }
    ASSERT_WORST(worst, 0.51);
}

/* The number of periods varies, because the task may be a period early or late. With psi = 1/2 period n has 250 n. */
void test_the_mean_is_taken_over_the_periods_since_the_last_mean(void)
{
    int n = 0;
    for (int block = 9; block <= 12; block++) {
        const int first = n;
        for (; n < first + block; n++) {
            add(0, 500 * n, 16384, 0, 0);
        }
        TEST_ASSERT_INT_WITHIN(1, (2 * first + block - 1) * 125, torque_estimate_mean(&mean, &sum));
    }
}

void test_without_a_new_period_the_mean_keeps_its_value(void)
{
    TEST_ASSERT_EQUAL_INT(5000, torque(0, 10000, 16384, 0, 0));
    TEST_ASSERT_EQUAL_INT(5000, torque_estimate_mean(&mean, &sum));
}

/* The difference of the sums may have wrapped and cannot be used. */
void test_after_more_periods_than_the_sum_holds_the_mean_keeps_its_value(void)
{
    TEST_ASSERT_EQUAL_INT(5000, torque(0, 10000, 16384, 0, 0));
    for (int n = 0; n < 64; n++) {
        add(0, 32767, 32767, 0, 0);
    }
    TEST_ASSERT_EQUAL_INT(5000, torque_estimate_mean(&mean, &sum));
    TEST_ASSERT_EQUAL_INT(5000, torque(0, 10000, 16384, 0, 0));
}

void test_sum_and_count_may_wrap(void)
{
    sum = (torque_sum_t){INT32_MAX - 5, -1};
    mean.last = sum;
    for (int n = 0; n < 63; n++) {
        add(-32768, 32767, 32767, 32767, 0); /* nearly two, the largest torque of a period */
    }
    TEST_ASSERT_EQUAL_INT32(62, sum.count);
    TEST_ASSERT_EQUAL_INT(32767, torque_estimate_mean(&mean, &sum));
    sum = (torque_sum_t){INT32_MIN + 5, INT32_MAX};
    mean.last = sum;
    for (int n = 0; n < 10; n++) {
        add(0, -10000, 16384, 0, 0);
    }
    TEST_ASSERT_EQUAL_INT(-5000, torque_estimate_mean(&mean, &sum));
}

/* The mean is rounded half up with either sign. Each period adds a truncation of half an LSB of Q24 on average, which
 * the expected value contains. */
void test_the_mean_is_rounded_to_half_an_lsb_for_every_sum(void)
{
    worst_t worst = {0};
    for (int total = -327680 * 512; total <= 327670 * 512; total += 3001) {
        mean = (torque_mean_t){0};
        const torque_sum_t ten = {total, 10};
        const double exact = (total + 5) / 512.0 / 10.0;
        worst_note(&worst, torque_estimate_mean(&mean, &ten) - exact, "sum %d", total);
    }
    ASSERT_WORST(worst, 0.5);
}

void test_ten_thousand_blocks_of_alternating_torque_have_no_bias(void)
{
    int64_t all = 0;
    for (int n = 0; n < 200000; n++) {
        add(0, (n & 1) ? 1001 : -1001, 32767, 0, 0);
        all += (n % 10 == 9) ? torque_estimate_mean(&mean, &sum) : 0;
    }
    TEST_ASSERT_EQUAL_INT(0, all);
}

void test_torque_beyond_the_base_saturates(void)
{
    TEST_ASSERT_EQUAL_INT(32767, torque(-32768, 32767, 32767, 32767, 16384));
    TEST_ASSERT_EQUAL_INT(-32768, torque(32767, -32768, 32767, 32767, 16384));
    TEST_ASSERT_EQUAL_INT(-32768, torque(-32768, 32767, -32768, -32768, -16384));
    TEST_ASSERT_EQUAL_INT(32767, torque(32767, -32768, -32768, -32768, -16384));
}
