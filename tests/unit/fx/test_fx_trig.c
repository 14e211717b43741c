/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <stdlib.h>

#include "fx/trig.h"
#include "fx_vectors.h"
#include "unity.h"

#define TURN 6.283185307179586476925L

void setUp(void)
{
}

void tearDown(void)
{
}

/* Bound: 0.95e-5 of the truncated rotation, 1.53e-5 of the rounding, and near +1 another 0.6e-5
 * where the table is lowered to stay in int32; the peak itself, 32767 for 32768, is 3.05e-5. */
void test_sine_and_cosine_of_every_angle_are_within_four_in_a_hundred_thousand(void)
{
    worst_t sine = {0};
    worst_t cosine = {0};
    for (int32_t angle = 0; angle <= 65535; angle++) {
        const fx_sincos_t got = fx_sincos((uint16_t)angle);
        const long double radians = angle * TURN / 65536.0L;
        worst_note(&sine, (got.sin / 32768.0L) - sinl(radians), angle, got.sin);
        worst_note(&cosine, (got.cos / 32768.0L) - cosl(radians), angle, got.cos);
    }
    worst_expect(&sine, "sin", 3.2e-5L);
    worst_expect(&cosine, "cos", 3.2e-5L);
}

/* The same bound for angles of 32 bits; the stride is a large prime, so that angles between those of 16 bits occur. */
void test_the_rotation_by_an_angle_of_32_bits_keeps_the_same_bound(void)
{
    worst_t sine = {0};
    worst_t cosine = {0};
    uint32_t angle = 0;
    for (int32_t n = 0; n < 400000; n++) {
        angle += 1999999973U;
        const uint32_t got = fx_rotation(angle);
        expect_equal("fx_unit_vector", (int64_t)angle, 0, fx_unit_vector(angle), got);
        const long double radians = angle * TURN / 4294967296.0L;
        worst_note(&sine, ((int16_t)(got >> 16) / 32768.0L) - sinl(radians), (int32_t)angle, (int16_t)(got >> 16));
        worst_note(&cosine, ((int16_t)(got & 0xFFFFU) / 32768.0L) - cosl(radians), (int32_t)angle,
                   (int16_t)(got & 0xFFFFU));
    }
    worst_expect(&sine, "sin", 3.2e-5L);
    worst_expect(&cosine, "cos", 3.2e-5L);
}

void test_sine_and_cosine_at_the_axes_are_exact_or_saturated(void)
{
    const fx_sincos_t east = fx_sincos(0x0000U);
    const fx_sincos_t north = fx_sincos(0x4000U);
    const fx_sincos_t west = fx_sincos(0x8000U);
    const fx_sincos_t south = fx_sincos(0xC000U);
    TEST_ASSERT_EQUAL_INT16(0, east.sin);
    TEST_ASSERT_EQUAL_INT16(32767, east.cos);
    TEST_ASSERT_EQUAL_INT16(32767, north.sin);
    TEST_ASSERT_EQUAL_INT16(0, north.cos);
    TEST_ASSERT_EQUAL_INT16(0, west.sin);
    TEST_ASSERT_EQUAL_INT16(-32768, west.cos);
    TEST_ASSERT_EQUAL_INT16(-32768, south.sin);
    TEST_ASSERT_EQUAL_INT16(0, south.cos);
}

/* A kink between two table cells would be a torque ripple: neighbours differ by 2 pi / 2^16 of full
 * scale, 3.14 LSB, so that more than 5 LSB would be a jump. */
void test_sine_has_no_jump_between_neighbouring_angles(void)
{
    for (int32_t angle = 0; angle <= 65535; angle++) {
        const fx_sincos_t here = fx_sincos((uint16_t)angle);
        const fx_sincos_t next = fx_sincos((uint16_t)(angle + 1));
        TEST_ASSERT_LESS_OR_EQUAL_INT32(5, abs(next.sin - here.sin));
        TEST_ASSERT_LESS_OR_EQUAL_INT32(5, abs(next.cos - here.cos));
    }
}
