/* SPDX-License-Identifier: Apache-2.0 */
#include "rotor.h"

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* Tolerance: a few roundings of numbers around 1. */
void test_a_rotation_is_cosine_and_sine_of_its_angle(void)
{
    for (double a = -0.5; a <= 0.5; a += 0.00013) {
        const rotation_t t = rotation_of(a);
        TEST_ASSERT_DOUBLE_WITHIN(3e-16, cos(a), t.c);
        TEST_ASSERT_DOUBLE_WITHIN(3e-16, sin(a), t.s);
    }
}

void test_sinc_is_one_at_zero_and_sine_over_angle_elsewhere(void)
{
    TEST_ASSERT_DOUBLE_WITHIN(0.0, 1.0, sinc_of(0.0));
    for (double a = 0.00007; a <= 1.0; a += 0.00013) {
        TEST_ASSERT_DOUBLE_WITHIN(6e-16, sin(a) / a, sinc_of(a));
        TEST_ASSERT_DOUBLE_WITHIN(6e-16, sin(a) / a, sinc_of(-a));
    }
}

void test_rotations_add_like_angles(void)
{
    const rotation_t t = rotation_add(rotation_of(2.0), rotation_of(-0.2));
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, cos(1.8), t.c);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, sin(1.8), t.s);
}

/* At 90 degrees d = 3 lies along beta and q = 2 along negative alpha. */
void test_rotor_and_stationary_frame_differ_by_the_angle(void)
{
    const rotation_t quarter = {0.0, 1.0};
    const double dq[2] = {3.0, 2.0};
    double ab[2], back[2];
    to_stationary(quarter, dq, ab);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, -2.0, ab[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 3.0, ab[1]);
    to_rotor(quarter, ab, back);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 3.0, back[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 2.0, back[1]);
}

/* Amplitude-invariant, alpha along phase a; a zero sequence has no effect. */
void test_phases_are_the_projections_of_the_vector(void)
{
    const double third = 2.0943951023931953, ab[2] = {5.0 * cos(0.7), 5.0 * sin(0.7)};
    double abc[3], back[2];
    to_phases(ab, abc);
    for (int x = 0; x < 3; x++) {
        TEST_ASSERT_DOUBLE_WITHIN(2e-15, 5.0 * cos(0.7 - third * x), abc[x]);
        abc[x] += 100.0;
    }
    from_phases(abc, back);
    TEST_ASSERT_DOUBLE_WITHIN(1e-13, ab[0], back[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-13, ab[1], back[1]);
}
