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

/* The bound above for angles of 32 bits: every rest between two of 16 bits, by a stride that is a large prime. */
void test_the_rotation_by_any_angle_of_32_bits_is_as_exact(void)
{
    worst_t sine = {0};
    worst_t cosine = {0};
    uint32_t angle = 0;
    for (int32_t n = 0; n < 400000; n++) {
        angle += 1999999973U;
        const uint32_t got = fx_rotation(angle);
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

static void note_angle(worst_t *worst, int32_t y, int32_t x)
{
    if ((x != 0) || (y != 0)) {
        const long double got = fx_atan2((q15_t)y, (q15_t)x) * (TURN / 4294967296.0L);
        worst_note(worst, remainderl(got - atan2l(y, x), TURN), y, x);
    }
}

/* Bound: 1.53e-5 rad of the truncated ratio and 0.5e-5 rad of the table, for every vector. */
void test_the_angle_of_every_small_vector_is_right(void)
{
    worst_t worst = {0};
    for (int32_t y = -300; y <= 300; y++) {
        for (int32_t x = -300; x <= 300; x++) {
            note_angle(&worst, y, x);
        }
    }
    worst_expect(&worst, "fx_atan2", 2.1e-5L);
}

void test_the_angle_of_every_vector_on_the_border_of_the_plane_is_right(void)
{
    worst_t worst = {0};
    for (int32_t v = -32768; v <= 32767; v++) {
        note_angle(&worst, v, 32767);
        note_angle(&worst, v, -32768);
        note_angle(&worst, 32767, v);
        note_angle(&worst, -32768, v);
    }
    for (int32_t i = 0; i < 1000000; i++) {
        note_angle(&worst, random_s16(), random_s16());
    }
    worst_expect(&worst, "fx_atan2", 2.1e-5L);
}

void test_angles_on_axes_and_diagonals_are_exact(void)
{
    for (int32_t r = 1; r <= 32767; r++) {
        const q15_t p = (q15_t)r;
        const q15_t n = (q15_t)-r;
        expect_equal("east", 0, r, fx_atan2(0, p), 0);
        expect_equal("north-east", r, r, fx_atan2(p, p), INT64_C(0x20000000));
        expect_equal("north", r, 0, fx_atan2(p, 0), INT64_C(0x40000000));
        expect_equal("north-west", r, -r, fx_atan2(p, n), INT64_C(0x60000000));
        expect_equal("west", 0, -r, fx_atan2(0, n), INT64_C(0x80000000));
        expect_equal("south-west", -r, -r, fx_atan2(n, n), INT64_C(0xA0000000));
        expect_equal("south", -r, 0, fx_atan2(n, 0), INT64_C(0xC0000000));
        expect_equal("south-east", -r, r, fx_atan2(n, p), INT64_C(0xE0000000));
    }
    TEST_ASSERT_EQUAL_HEX32(0xA0000000, fx_atan2(Q15_MIN, Q15_MIN));
    TEST_ASSERT_EQUAL_HEX32(0x80000000, fx_atan2(0, Q15_MIN));
}

void test_the_angle_of_no_vector_is_zero(void)
{
    TEST_ASSERT_EQUAL_HEX32(0, fx_atan2(0, 0));
}

/* 3.2e-5 of a vector of length 1 turns it by at most 4.5e-5 rad; 2.1e-5 for the way back. */
void test_the_angle_of_a_unit_vector_is_the_angle_it_was_made_from(void)
{
    worst_t worst = {0};
    for (int32_t angle = 0; angle <= 65535; angle++) {
        const fx_sincos_t unit = fx_sincos((uint16_t)angle);
        const uint32_t back = fx_atan2(unit.sin, unit.cos) - ((uint32_t)angle << 16);
        worst_note(&worst, (int32_t)back * (TURN / 4294967296.0L), angle, 0);
    }
    worst_expect(&worst, "round trip", 6.6e-5L);
}
