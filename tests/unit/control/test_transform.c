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

/* Half an LSB of the one rounding, and 1/3, 2/3, 1/sqrt(3) in q15: 0.5 + 3 * 0.33 (alpha), 2 * 0.5 (beta). */
void test_clarke_follows_its_equation_for_every_corner_and_at_random(void)
{
    worst_t worst = {0};
    uint64_t seed = 11;
    for (int n = 0; n < 300000; n++) {
        static const int16_t corner[3] = {INT16_MIN, 0, INT16_MAX};
        abc_q15_t x = {corner[n % 3], corner[n / 3 % 3], corner[n / 9 % 3]};
        if (n >= 27) {
            x = (abc_q15_t){(q15_t)random_in(&seed, -32768, 32767), (q15_t)random_in(&seed, -32768, 32767),
                            (q15_t)random_in(&seed, -32768, 32767)};
        }
        const ab_q15_t y = clarke(x);
        const twin_ab_t t = twin_clarke((twin_abc_t){x.a, x.b, x.c});
        worst_note(&worst, y.alpha - clip(t.alpha), "alpha of %d %d %d", x.a, x.b, x.c);
        worst_note(&worst, y.beta - clip(t.beta), "beta of %d %d %d", x.a, x.b, x.c);
    }
    ASSERT_WORST(worst, 1.5);
}

void test_clarke_ignores_a_common_current_to_one_lsb(void)
{
    for (int x = -32768; x <= 32767; x += 13) {
        const ab_q15_t y = clarke((abc_q15_t){(q15_t)x, (q15_t)x, (q15_t)x});
        TEST_ASSERT_INT_WITHIN(1, 0, y.alpha);
        TEST_ASSERT_EQUAL_INT(0, y.beta);
    }
}

/* The angle of a is exact in the twin; sine and cosine are each good to 1.05 LSB, so |v| 1.05 sqrt(2) at most, plus
 * 0.5. */
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

/* Saturation instead of a wrap where the rotated vector leaves the square. */
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
