/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "control/current/transform.h"
#include "fixture.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static double clip(double x)
{
    return twin_clamp(x, -32768.0, 32767.0);
}

/* The twin's angle is exact. Sine and cosine have an error of up to 1.05 LSB each: 1.05 sqrt(2) |v|, plus 0.5 of
 * rounding. */
void test_park_and_its_inverse_follow_the_twin_at_every_angle(void)
{
    worst_t worst = {0};
    uint64_t seed = 12;
    for (uint32_t angle = 0; angle < 65536U; angle++) {
        const double rad = angle * (2.0 * 3.14159265358979323846 / 65536.0);
        const ab_q15_t x = {(q15_t)random_in(&seed, -32768, 32767), (q15_t)random_in(&seed, -32768, 32767)};
        const fx_pair_t at = fx_rotation(angle << 16);
        const dq_q15_t forward = park(x, at);
        const ab_q30_t back = inverse_park_q30((dq_q15_t){x.alpha, x.beta}, at);
        const twin_dq_t f = twin_park((twin_ab_t){x.alpha, x.beta}, rad);
        const twin_ab_t b = twin_park_inverse((twin_dq_t){x.alpha, x.beta}, rad);
        worst_note(&worst, forward.d - clip(f.d), "d of %d %d at %u", x.alpha, x.beta, angle);
        worst_note(&worst, forward.q - clip(f.q), "q of %d %d at %u", x.alpha, x.beta, angle);
        worst_note(&worst, back.alpha / 32768.0 - b.alpha, "alpha of %d %d at %u", x.alpha, x.beta, angle);
        worst_note(&worst, back.beta / 32768.0 - b.beta, "beta of %d %d at %u", x.alpha, x.beta, angle);
    }
    ASSERT_WORST(worst, 2.0);
}

/* A rotated component may exceed the format and must saturate, not wrap. */
void test_park_of_the_longest_vector_saturates_and_keeps_its_sign(void)
{
    const fx_pair_t at = fx_rotation(0x20000000U); /* 45 degrees */
    const dq_q15_t y = park((ab_q15_t){INT16_MIN, INT16_MIN}, at);
    TEST_ASSERT_EQUAL_INT(INT16_MIN, y.d);
    TEST_ASSERT_INT_WITHIN(1, 0, y.q);
    const dq_q15_t z = park((ab_q15_t){INT16_MAX, INT16_MAX}, at);
    TEST_ASSERT_EQUAL_INT(INT16_MAX, z.d);
    const ab_q30_t back = inverse_park_q30((dq_q15_t){INT16_MIN, INT16_MIN}, fx_rotation(0xE0000000U));
    TEST_ASSERT_INT_WITHIN(32768, -1518500250, back.alpha); /* -sqrt(2) in Q30 */
}
