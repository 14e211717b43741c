/* SPDX-License-Identifier: Apache-2.0 */
#include "control/torque/i_d_limit.h"

#include <math.h>

#include "fixture.h"
#include "unity.h"

static fixture_t f;

void setUp(void)
{
    f = fixture();
}

void tearDown(void)
{
}

static q15_t limit(double psi_d_error, int16_t winding_dC)
{
    return i_d_limit_step(&f.i_d_limit, (q15_t)lround(psi_d_error * 32768.0), winding_dC);
}

/* By hand: 0.9 at 20 C minus 0.002 per K, and at most 0.8, the current circle. */
void test_the_limit_decreases_with_the_winding_temperature(void)
{
    TEST_ASSERT_INT_WITHIN(2, lround(0.8 * 32768.0), limit(0.0, 200));
    TEST_ASSERT_INT_WITHIN(4, lround(0.7 * 32768.0), limit(0.0, 1200));
    TEST_ASSERT_INT_WITHIN(4, lround(0.5 * 32768.0), limit(0.0, 2200));
    TEST_ASSERT_EQUAL_INT(0, limit(0.0, 6000));
}

/* 10 % less flux at 0.1 % per K means magnets at 120 C. */
void test_weak_magnets_count_as_hot_if_the_winding_is_cooler(void)
{
    TEST_ASSERT_INT_WITHIN(8, lround(0.7 * 32768.0), limit(-0.053, 300));
    TEST_ASSERT_INT_WITHIN(4, lround(0.5 * 32768.0), limit(-0.053, 2200));
}

/* At most 150 C: 0.9 - 130 K * 0.002 = 0.64. */
void test_the_estimated_magnet_temperature_does_not_exceed_the_assumed_one(void)
{
    TEST_ASSERT_INT_WITHIN(8, lround(0.64 * 32768.0), limit(-0.15, 300));
}

void test_strong_magnets_do_not_lower_the_temperature_below_that_of_the_winding(void)
{
    TEST_ASSERT_INT_WITHIN(4, lround(0.7 * 32768.0), limit(0.1, 1200));
}

/* 150 C: 0.9 - 130 K * 0.002 = 0.64. */
void test_without_a_winding_temperature_the_assumed_one_is_used_for_any_magnet_flux(void)
{
    TEST_ASSERT_INT_WITHIN(4, lround(0.64 * 32768.0), limit(0.0, INT16_MIN));
    TEST_ASSERT_INT_WITHIN(4, lround(0.64 * 32768.0), limit(0.1, INT16_MIN));
}

/* 1.5 I_b at 20 C: with 0.002 per K the limit reaches the current circle of 0.8 at 350 K above that. */
void test_a_demagnetisation_limit_above_the_current_base_acts_only_at_high_temperature(void)
{
    f.i_d_limit.i_20 = 49152;
    TEST_ASSERT_EQUAL_INT(f.i_d_limit.i_max, limit(0.0, 3600));
    TEST_ASSERT_INT_WITHIN(4, lround(0.7 * 32768.0), limit(0.0, 4200));
}

void test_no_argument_makes_the_limit_negative_or_larger_than_the_current_circle(void)
{
    static const int extremes[] = {INT16_MIN + 1, -1, 0, 1, INT16_MAX};
    for (int a = 0; a < 5; a++) {
        for (int b = 0; b < 5; b++) {
            const q15_t y = i_d_limit_step(&f.i_d_limit, (q15_t)extremes[a], (int16_t)extremes[b]);
            TEST_ASSERT_TRUE(y >= 0 && y <= f.i_d_limit.i_max);
        }
    }
}

/* Tolerance: the temperature of the magnets is truncated to a tenth of a degree, 7 LSB of the limit, and the limit by
 * 1 LSB. */
void test_the_limit_follows_the_twin(void)
{
    worst_t worst = {0};
    uint64_t seed = 5;
    f.si.i_max_A = from_q15(f.i_d_limit.i_max) * f.i;
    for (int n = 0; n < 100000; n++) {
        const int dC = random_in(&seed, -400, 2500);
        const int delta = random_in(&seed, -6000, 2500);
        const q15_t y = i_d_limit_step(&f.i_d_limit, (q15_t)delta, (int16_t)dC);
        const double t = twin_i_d_limit(&f.si, delta / 32768.0 * f.psi, dC / 10.0);
        worst_note(&worst, y - t / f.i * 32768.0, "dC %d, psi %d", dC, delta);
    }
    ASSERT_WORST(worst, 8.0);
}
