/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "control/current/modulate.h"
#include "fixture.h"
#include "unity.h"
#include "worst.h"

static fixture_t f;
static struct {
    dq_q15_t v, i; /* per unit of v_ratio v_dc, of I_b */
    fx_pair_t advanced;
    int32_t v_dc;
} in;

typedef struct {
    duty_t duty;
    dq_q15_t applied; /* by modulate_applied() */
    bool limited;
} modulated_t;

static const double pi = 3.14159265358979323846;
static double theta;

void setUp(void)
{
    f = fixture();
    fixture_dead_time(&f, 0.0);
    fixture_min_pulse(&f, 0.0);
    in.v = (dq_q15_t){0, 0};
    in.i = (dq_q15_t){0, 0};
    in.v_dc = 20000;
    in.advanced = fx_rotation(0);
    theta = 0.0;
}

void tearDown(void)
{
}

static void ratio(double v_ratio)
{
    f.si.v_ratio = v_ratio;
    f.modulate.alpha_q31 = (q31_t)lround(v_ratio * 2147483648.0);
    f.modulate.side_q31 = (q31_t)lround(v_ratio * 0.86602540378443865 * 2147483648.0);
}

static void at_angle(int32_t fraction)
{
    in.advanced = fx_rotation((uint32_t)fraction << 16);
    theta = fraction * (2.0 * pi / 65536.0);
}

static fx_pair_t pair(dq_q15_t x)
{
    return fx_pair((q15_t)x.d, (q15_t)x.q);
}

static modulated_t step(void)
{
    /* Below this |v| no pulse can be limited with the shortest pulse and the dead time of the test (MO-11). */
    const double clear_max = (1.0 - 2.0 * (f.si.min_pulse_duty + f.si.dead_time_duty)) / sqrt(3.0) / f.si.v_ratio *
                             32768.0;
    const modulate_out_t out = modulate_step(&f.modulate, pair(in.v), pair(in.i), in.advanced);
    if (hypot(in.v.d, in.v.q) < 0.999 * clear_max) {
        const duty_t duty = modulate_clear(&f.modulate, pair(in.v), pair(in.i), in.advanced);
        TEST_ASSERT_EQUAL_UINT32(duty.a, out.duty.a);
        TEST_ASSERT_EQUAL_UINT32(duty.b, out.duty.b);
        TEST_ASSERT_EQUAL_UINT32(duty.c, out.duty.c);
        TEST_ASSERT_EQUAL_UINT32(0, out.limited);
    }
    return (modulated_t){out.duty, modulate_applied(&f.modulate, &out.duty, pair(in.i), in.advanced, in.v_dc),
                         out.limited != 0U};
}

static twin_modulate_t twin_step(void)
{
    const double v_max = f.si.v_ratio * from_q15(in.v_dc) * f.v;
    const twin_modulate_in_t t = {{from_q15(in.v.d) * v_max, from_q15(in.v.q) * v_max},
                                  {from_q15(in.i.d) * f.i, from_q15(in.i.q) * f.i},
                                  theta,
                                  from_q15(in.v_dc) * f.v};
    return twin_modulate(&f.si, &t);
}

static void compare_with_twin(worst_t *duty, worst_t *applied)
{
    const modulated_t y = step();
    const twin_modulate_t t = twin_step();
    const int32_t duties[3] = {(int32_t)y.duty.a, (int32_t)y.duty.b, (int32_t)y.duty.c};
    for (int x = 0; x < 3; x++) {
        worst_note(duty, duties[x] - t.duty[x] * 32768, "%d, v %d %d i %d %d at %.4f", x, in.v.d, in.v.q, in.i.d,
                   in.i.q, theta);
    }
    worst_note(applied, y.applied.d - t.applied.d / f.v * 32768, "d, v %d %d v_dc %d i %d %d at %.4f", in.v.d, in.v.q,
               in.v_dc, in.i.d, in.i.q, theta);
    worst_note(applied, y.applied.q - t.applied.q / f.v * 32768, "q, v %d %d v_dc %d i %d %d at %.4f", in.v.d, in.v.q,
               in.v_dc, in.i.d, in.i.q, theta);
}

static dq_q15_t random_dq(uint64_t *seed, int largest)
{
    return (dq_q15_t){random_in(seed, -largest, largest), random_in(seed, -largest, largest)};
}

void test_zero_voltage_gives_a_duty_of_one_half_on_every_phase(void)
{
    const modulated_t y = step();
    TEST_ASSERT_EQUAL_INT(16384, y.duty.a);
    TEST_ASSERT_EQUAL_INT(16384, y.duty.b);
    TEST_ASSERT_EQUAL_INT(16384, y.duty.c);
    TEST_ASSERT_FALSE(y.limited);
}

/* At the six corners, 2/3 v_dc along a phase axis, each leg is at a rail: 100 110 010 011 001 101. */
void test_at_the_corners_of_the_hexagon_every_leg_is_at_a_rail(void)
{
    static const int pattern[6][3] = {{1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}, {1, 0, 1}};
    ratio(2.0 / 3.0);
    for (int n = 0; n < 6; n++) {
        at_angle((n * 65536 + 3) / 6);
        in.v.d = 32767;
        const modulated_t y = step();
        TEST_ASSERT_INT_WITHIN(5, 32768 * pattern[n][0], y.duty.a);
        TEST_ASSERT_INT_WITHIN(5, 32768 * pattern[n][1], y.duty.b);
        TEST_ASSERT_INT_WITHIN(5, 32768 * pattern[n][2], y.duty.c);
    }
}

/* In the middle of a side of the hexagon |v| = v_dc/sqrt(3); by hand at 30 degrees: v = (1/2, 0, -1/2). */
void test_the_middle_of_a_side_has_one_leg_at_each_rail_and_one_in_the_middle(void)
{
    at_angle(65536 / 12);
    in.v.d = 32767; /* 0.57 of 0.57735: 0.4936 above and below one half */
    const modulated_t y = step();
    TEST_ASSERT_INT_WITHIN(5, 16384 + 0.4936 * 32768, y.duty.a);
    TEST_ASSERT_INT_WITHIN(5, 16384, y.duty.b);
    TEST_ASSERT_INT_WITHIN(5, 16384 - 0.4936 * 32768, y.duty.c);
    TEST_ASSERT_FALSE(y.limited);
}

/* Min-max zero sequence: the largest and the smallest duty always have the same distance from their rails. */
void test_the_zero_sequence_centres_the_largest_and_the_smallest_duty(void)
{
    uint64_t seed = 61;
    for (int n = 0; n < 200000; n++) {
        at_angle(random_in(&seed, 0, 65535));
        in.v = random_dq(&seed, 23000);
        const modulated_t y = step();
        const int a = (int)y.duty.a, b = (int)y.duty.b, c = (int)y.duty.c;
        const int hi = fx_max_s32(a, fx_max_s32(b, c));
        const int lo = fx_min_s32(a, fx_min_s32(b, c));
        TEST_ASSERT_INT_WITHIN(1, 32768, hi + lo);
    }
}

/* Tolerance in LSB. 1 LSB of v changes a duty by up to 0.57 sqrt(3). Sine and cosine have an error of 1 LSB:
 * 0.57 * 1.73 * sqrt(2) at |v| = 1; the rounding of the duty adds 0.5, the compensation 1. The applied voltage has the
 * errors of the duties and 1.5 of its own computation. */
void test_inside_the_hexagon_every_duty_follows_the_twin(void)
{
    worst_t worst = {0};
    worst_t applied = {0};
    uint64_t seed = 62;
    fixture_dead_time(&f, 0.02);
    for (int n = 0; n < 300000; n++) {
        at_angle(random_in(&seed, 0, 65535));
        in.v_dc = (q15_t)random_in(&seed, 12000, 32767);
        const double phi = random_in(&seed, 0, 65535) * (2.0 * pi / 65536.0);
        const double length = random_in(&seed, 0, 950) * 32.768;
        in.v = (dq_q15_t){(int32_t)lround(length * cos(phi)), (int32_t)lround(length * sin(phi))};
        in.i = random_dq(&seed, 20000);
        compare_with_twin(&worst, &applied);
    }
    ASSERT_WORST(worst, 4.0);
    ASSERT_WORST(applied, 4.0);
}

/* Beyond a side the outer legs are limited to their rails and the middle one is unchanged, which is the nearest point
 * of that side. By hand: the side from 0 to 60 degrees has the distance 1/sqrt(3) from the centre, at 30 degrees. */
void test_beyond_the_hexagon_the_nearest_point_of_its_side_is_applied(void)
{
    ratio(0.65); /* 1.13 of the inscribed circle */
    in.v_dc = 32767;
    for (int degrees = 12; degrees < 50; degrees += 7) {
        at_angle(degrees * 65536 / 360);
        in.v.d = 32767;
        const modulated_t y = step();
        const double angle = (degrees - 30) * pi / 180.0;
        const double along = 0.65 * sin(angle), across = fmin(0.65 * cos(angle), 1.0 / sqrt(3.0));
        /* In the frame of the rotor, whose d axis is at `degrees`. */
        TEST_ASSERT_INT_WITHIN(8, 32767 * (across * cos(angle) + along * sin(angle)), y.applied.d);
        TEST_ASSERT_INT_WITHIN(8, 32767 * (along * cos(angle) - across * sin(angle)), y.applied.q);
        TEST_ASSERT_TRUE(y.limited);
    }
}

/* Components up to 1 and 0.7, the largest after the limit of the current control: beyond the hexagon's corners. */
void test_beyond_the_hexagon_every_duty_follows_the_twin(void)
{
    worst_t worst = {0};
    worst_t applied = {0};
    uint64_t seed = 63;
    ratio(0.65);
    for (int n = 0; n < 200000; n++) {
        at_angle(random_in(&seed, 0, 65535));
        in.v_dc = (q15_t)random_in(&seed, 4000, 32767);
        in.v = (dq_q15_t){random_in(&seed, -32768, 32767), random_in(&seed, -22938, 22938)};
        if (n & 1) {
            in.v = (dq_q15_t){in.v.q, in.v.d};
        }
        compare_with_twin(&worst, &applied);
    }
    ASSERT_WORST(worst, 4.0);
    ASSERT_WORST(applied, 4.0);
}

void test_limited_is_set_exactly_if_a_pulse_was_changed(void)
{
    ratio(0.65); /* the side is at 0.8882 */
    at_angle(65536 / 12);
    in.v.d = (int32_t)(32768.0 / sqrt(3.0) / 0.65) - 10;
    TEST_ASSERT_FALSE(step().limited);
    in.v.d = (int32_t)(32768.0 / sqrt(3.0) / 0.65) + 10;
    TEST_ASSERT_TRUE(step().limited);
    in.v.d = 0;
    TEST_ASSERT_FALSE(step().limited);
}

/* modulate_applied() of duties that were not limited: only roundings, 1 LSB of duty and 1.5 LSB of voltage. */
void test_the_applied_voltage_is_the_commanded_one_while_nothing_is_limited(void)
{
    worst_t worst = {0};
    uint64_t seed = 64;
    fixture_dead_time(&f, 0.01);
    for (int n = 0; n < 50000; n++) {
        at_angle(random_in(&seed, 0, 65535));
        in.v = random_dq(&seed, 20000);
        in.i = random_dq(&seed, 20000);
        const modulated_t y = step();
        TEST_ASSERT_FALSE(y.limited);
        worst_note(&worst, y.applied.d - in.v.d * f.si.v_ratio * in.v_dc / 32768.0, "d of %d %d", in.v.d, in.v.q);
        worst_note(&worst, y.applied.q - in.v.q * f.si.v_ratio * in.v_dc / 32768.0, "q of %d %d", in.v.d, in.v.q);
    }
    ASSERT_WORST(worst, 4.0);
}

/* Currents above the knee: +c on the phase with positive current, -c on the other two, which have half each. */
void test_the_compensation_adds_the_dead_time_to_legs_with_positive_current(void)
{
    fixture_dead_time(&f, 0.02);
    in.i.d = 10000;
    const modulated_t y = step();
    TEST_ASSERT_INT_WITHIN(1, 16384 + 655, y.duty.a);
    TEST_ASSERT_INT_WITHIN(1, 16384 - 655, y.duty.b);
    TEST_ASSERT_INT_WITHIN(1, 16384 - 655, y.duty.c);
}

void test_the_compensation_is_odd_in_the_current_and_smooth_through_zero(void)
{
    fixture_dead_time(&f, 0.02);
    int last = -1;
    for (int count = -2000; count <= 2000; count++) {
        in.i.d = (q15_t)count;
        const int up = (int)step().duty.a - 16384;
        in.i.d = (q15_t)-count;
        const int down = (int)step().duty.a - 16384;
        TEST_ASSERT_INT_WITHIN(1, -up, down);
        if (count > -2000) { /* slope: 655 LSB per 328 counts of current, 2; with roundings 3 */
            TEST_ASSERT_INT_WITHIN(3, last, up);
            TEST_ASSERT_TRUE(up >= last);
        }
        last = up;
    }
    in.i.d = 0;
    TEST_ASSERT_EQUAL_INT(16384, step().duty.a);
    in.i.d = 164; /* half of the knee current: half of the dead time */
    TEST_ASSERT_INT_WITHIN(3, 16384 + 328, step().duty.a);
}

/* The shortest pulse is 3277 LSB. The sweep moves leg a from one half to its rail. */
void test_a_short_pulse_becomes_zero_or_the_shortest_one_whichever_is_nearer(void)
{
    fixture_min_pulse(&f, 0.1);
    ratio(2.0 / 3.0);
    for (int v = 0; v <= 32767; v += 3) {
        in.v.d = v;
        const modulated_t y = step();
        const int ideal = 16384 + (int)lround(0.75 * v * 2.0 / 3.0); /* v (1 - 1/4) on leg a */
        TEST_ASSERT_TRUE(y.duty.a == 32768 || y.duty.a <= 32768 - 3277);
        TEST_ASSERT_TRUE(y.duty.b == 0 || y.duty.b >= 3277);
        if (ideal < 32768 - 3277 - 3) { /* in the bands between, the roundings of v and duty decide */
            TEST_ASSERT_INT_WITHIN(3, ideal, y.duty.a);
            TEST_ASSERT_FALSE(y.limited);
        } else if (ideal > 32768 - 3277 + 3 && ideal < 32768 - 1638 - 3) {
            TEST_ASSERT_EQUAL_INT(32768 - 3277, y.duty.a);
            TEST_ASSERT_EQUAL_INT(3277, y.duty.b);
            TEST_ASSERT_TRUE(y.limited);
        } else if (ideal > 32768 - 1638 + 3) {
            TEST_ASSERT_EQUAL_INT(32768, y.duty.a);
            TEST_ASSERT_EQUAL_INT(0, y.duty.b);
        }
    }
}

/* A leg at its rail does not switch, so that no dead time acts: the applied voltage is by hand 2/3 v_dc. */
void test_the_dead_time_does_not_act_on_a_leg_at_its_rail(void)
{
    fixture_dead_time(&f, 0.02);
    fixture_min_pulse(&f, 0.05);
    ratio(2.0 / 3.0);
    in.v.d = 32767;
    in.i.d = 10000;
    const modulated_t y = step();
    TEST_ASSERT_EQUAL_INT(32768, y.duty.a);
    TEST_ASSERT_EQUAL_INT(0, y.duty.b);
    TEST_ASSERT_INT_WITHIN(3, 13333, y.applied.d);
    TEST_ASSERT_INT_WITHIN(2, 0, y.applied.q);
}

void test_the_applied_voltage_of_limited_pulses_follows_the_twin(void)
{
    worst_t worst = {0};
    int compared = 0;
    uint64_t seed = 65;
    fixture_dead_time(&f, 0.02);
    fixture_min_pulse(&f, 0.03);
    for (int n = 0; n < 300000; n++) {
        at_angle(random_in(&seed, 0, 65535));
        in.v_dc = (q15_t)random_in(&seed, 15000, 32767);
        in.v = random_dq(&seed, 23000);
        in.i = random_dq(&seed, 20000);
        const modulated_t y = step();
        const twin_modulate_t t = twin_step();
        const double jump =
            worse_of(fabs((double)y.duty.a - t.duty[0] * 32768),
                     worse_of(fabs((double)y.duty.b - t.duty[1] * 32768), fabs((double)y.duty.c - t.duty[2] * 32768)));
        if (jump < 4.0) {
            compared++;
            worst_note(&worst, y.applied.d - t.applied.d / f.v * 32768, "d, v %d %d v_dc %d i %d %d at %.4f", in.v.d,
                       in.v.q, in.v_dc, in.i.d, in.i.q, theta);
            worst_note(&worst, y.applied.q - t.applied.q / f.v * 32768, "q, v %d %d v_dc %d i %d %d at %.4f", in.v.d,
                       in.v.q, in.v_dc, in.i.d, in.i.q, theta);
        } else { /* rounding decided between zero and the shortest pulse */
            TEST_ASSERT_DOUBLE_WITHIN(4.0, 983.0, jump);
        }
    }
    ASSERT_WORST(worst, 4.0);
    TEST_ASSERT_GREATER_THAN_INT(299000, compared); /* rounding seldom decides so */
}

void test_every_duty_can_be_made_by_the_bridge_for_every_input(void)
{
    uint64_t seed = 66;
    fixture_dead_time(&f, 0.03);
    fixture_min_pulse(&f, 0.02);
    for (int n = 0; n < 300000; n++) {
        at_angle(random_in(&seed, 0, 65535));
        in.v_dc = (q15_t)random_in(&seed, 0, 32767);
        in.v = random_dq(&seed, 32767);
        in.i = random_dq(&seed, 32767);
        const modulated_t y = step();
        const int duty[3] = {(int)y.duty.a, (int)y.duty.b, (int)y.duty.c};
        for (int x = 0; x < 3; x++) {
            TEST_ASSERT_TRUE(duty[x] == 0 || duty[x] == 32768 || (duty[x] >= 655 && duty[x] <= 32768 - 655));
        }
    }
}
