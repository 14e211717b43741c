/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "control/modulate.h"
#include "fixture.h"
#include "unity.h"

static fixture_t f;
static modulate_in_t in;
static dq_t i;

typedef struct {
    duty_t duty;
    dq_t acted;
    bool limited;
} made_t;

static const double pi = 3.14159265358979323846;
static double theta;

void setUp(void)
{
    f = fixture();
    f.modulate.dead_time = 0;
    f.modulate.min_pulse = 0;
    f.si.dead_time_duty = 0.0;
    f.si.min_pulse_duty = 0.0;
    in = (modulate_in_t){.v_dc = 20000, .advanced = fx_rotation(0)};
    i = (dq_t){0, 0};
    theta = 0.0;
}

void tearDown(void)
{
}

static void at_angle(int32_t fraction)
{
    in.advanced = fx_rotation((uint32_t)fraction << 16);
    theta = fraction * (2.0 * pi / 65536.0);
}

static made_t step(void)
{
    /* Current control's promise: within half of v_dc here, with the pulse and the dead time that a test sets. */
    const double reach = (1.0 - 2.0 * (f.modulate.min_pulse + f.modulate.dead_time) / 32768.0) / sqrt(3.0) * in.v_dc;
    const bool clear = in.v_dc >= 2 && hypot(in.u.d, in.u.q) < 0.999 * reach;
    in.i = fx_pair((q15_t)i.d, (q15_t)i.q);
    modulate_out_t made = modulate_step(&f.modulate, &in);
    if (clear) { /* the short way must say the same, but for the floor that it does not need */
        const fx_pair_t u = fx_pair((q15_t)in.u.d, (q15_t)in.u.q);
        const duty_t duty = modulate_clear(&f.modulate, u, in.i, in.advanced, in.v_dc);
        if (in.v_dc >= f.modulate.v_dc_min) {
            TEST_ASSERT_EQUAL_UINT32(duty.a, made.duty.a);
            TEST_ASSERT_EQUAL_UINT32(duty.b, made.duty.b);
            TEST_ASSERT_EQUAL_UINT32(duty.c, made.duty.c);
            TEST_ASSERT_FALSE(made.limited);
        }
        made = (modulate_out_t){duty, false};
    }
    const dq_t acted = made.limited ? modulate_acted(&f.modulate, &in, made.duty) : in.u;
    return (made_t){made.duty, acted, made.limited};
}

static twin_modulate_t twin_step(void)
{
    const twin_modulate_in_t t = {{from_q15(in.u.d) * f.v, from_q15(in.u.q) * f.v},
                                  {from_q15(i.d) * f.i, from_q15(i.q) * f.i}, theta, from_q15(in.v_dc) * f.v};
    return twin_modulate(&f.si, &t);
}

static void dead_time(double duty)
{
    f.modulate.dead_time = (q15_t)lround(duty * 32768.0);
    f.si.dead_time_duty = from_q15(f.modulate.dead_time);
}

static void min_pulse(double duty)
{
    f.modulate.min_pulse = (q15_t)lround(duty * 32768.0);
    f.si.min_pulse_duty = from_q15(f.modulate.min_pulse);
}

void test_no_voltage_is_half_duty_on_every_phase(void)
{
    const made_t y = step();
    TEST_ASSERT_EQUAL_INT(16384, y.duty.a);
    TEST_ASSERT_EQUAL_INT(16384, y.duty.b);
    TEST_ASSERT_EQUAL_INT(16384, y.duty.c);
    TEST_ASSERT_FALSE(y.limited);
}

/* The six corners: 2/3 v_dc along a phase axis. There each leg is at a rail: 100 110 010 011 001 101. */
void test_the_corners_of_the_hexagon_put_every_leg_on_its_rail(void)
{
    static const int pattern[6][3] = {{1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}, {1, 0, 1}};
    for (int n = 0; n < 6; n++) {
        at_angle((n * 65536 + 3) / 6);
        in.u.d = 13333;
        const made_t y = step();
        TEST_ASSERT_INT_WITHIN(5, 32768 * pattern[n][0], y.duty.a);
        TEST_ASSERT_INT_WITHIN(5, 32768 * pattern[n][1], y.duty.b);
        TEST_ASSERT_INT_WITHIN(5, 32768 * pattern[n][2], y.duty.c);
    }
}

/* In the middle of a side the longest vector is v_dc/sqrt(3); by hand at 30 degrees: v = (1/2, 0, -1/2). */
void test_the_middle_of_a_side_has_one_leg_at_each_rail_and_one_in_the_middle(void)
{
    at_angle(65536 / 12);
    in.u.d = (q15_t)lround(20000.0 / sqrt(3.0)) - 3;
    const made_t y = step();
    TEST_ASSERT_INT_WITHIN(12, 32768, y.duty.a);
    TEST_ASSERT_INT_WITHIN(6, 16384, y.duty.b);
    TEST_ASSERT_INT_WITHIN(12, 0, y.duty.c);
    TEST_ASSERT_FALSE(y.limited);
}

/* Min-max: the highest and the lowest duty are always equally far from their rails. */
void test_the_zero_sequence_centres_the_outer_legs(void)
{
    uint64_t seed = 61;
    for (int n = 0; n < 200000; n++) {
        at_angle(random_in(&seed, 0, 65535));
        in.u = (dq_t){(q15_t)random_in(&seed, -8000, 8000), (q15_t)random_in(&seed, -8000, 8000)};
        const made_t y = step();
        const int a = (int)y.duty.a, b = (int)y.duty.b, c = (int)y.duty.c;
        const int hi = fx_max_s32(a, fx_max_s32(b, c));
        const int lo = fx_min_s32(a, fx_min_s32(b, c));
        TEST_ASSERT_INT_WITHIN(1, 32768, hi + lo);
    }
}

/* Rounding per phase: u rotated (0.5 + 1.5 of sine and cosine) times V_b/v_dc, 0.5 each of the scaling, the phases
 * and the centring. Near |u| = v_dc/sqrt(3), v_dc = 20000: 2 * 1.64 + 2. */
void test_inside_the_hexagon_every_duty_follows_the_twin(void)
{
    worst_t worst = {0};
    worst_t acted = {0};
    uint64_t seed = 62;
    dead_time(0.02);
    for (int n = 0; n < 300000; n++) {
        at_angle(random_in(&seed, 0, 65535));
        in.v_dc = (q15_t)random_in(&seed, 12000, 32767);
        const double phi = random_in(&seed, 0, 65535) * (2.0 * pi / 65536.0);
        const double length = random_in(&seed, 0, 1000) * 1e-3 * (in.v_dc * 0.95 / sqrt(3.0) - 1.0);
        in.u = (dq_t){(q15_t)lround(length * cos(phi)), (q15_t)lround(length * sin(phi))};
        i = (dq_t){(q15_t)random_in(&seed, -20000, 20000), (q15_t)random_in(&seed, -20000, 20000)};
        const made_t y = step();
        const twin_modulate_t t = twin_step();
        /* The straight line of the compensation is steep: 1 LSB of current is 0.07 LSB of duty. */
        worst_note(&worst, (double)y.duty.a - t.duty[0] * 32768, "a, u %d %d v %d i %d %d at %.4f", in.u.d, in.u.q,
                   in.v_dc, i.d, i.q, theta);
        worst_note(&worst, (double)y.duty.b - t.duty[1] * 32768, "b, u %d %d v %d i %d %d at %.4f", in.u.d, in.u.q,
                   in.v_dc, i.d, i.q, theta);
        worst_note(&worst, (double)y.duty.c - t.duty[2] * 32768, "c, u %d %d v %d i %d %d at %.4f", in.u.d, in.u.q,
                   in.v_dc, i.d, i.q, theta);
        worst_note(&acted, y.acted.d - t.acted.d / f.v * 32768, "acted d, u %d %d v %d i %d %d at %.4f", in.u.d, in.u.q,
                   in.v_dc, i.d, i.q, theta);
        worst_note(&acted, y.acted.q - t.acted.q / f.v * 32768, "acted q, u %d %d v %d i %d %d at %.4f", in.u.d, in.u.q,
                   in.v_dc, i.d, i.q, theta);
    }
    ASSERT_WORST(worst, 7.0);
    ASSERT_WORST(acted, 4.0);
}

/* Up to the range |u| <= v_dc: half as long again as the hexagon's corner, twice the linear range. */
void test_beyond_the_hexagon_the_vector_is_shortened_and_keeps_its_direction(void)
{
    worst_t length = {0};
    worst_t direction = {0};
    uint64_t seed = 63;
    for (int n = 0; n < 200000; n++) {
        at_angle(random_in(&seed, 0, 65535));
        in.v_dc = (q15_t)random_in(&seed, 4000, 32767);
        const double phi = random_in(&seed, 0, 65535) * (2.0 * pi / 65536.0);
        const double ratio = random_in(&seed, 500, 999) * 1e-3;
        in.u = (dq_t){(q15_t)lround(in.v_dc * ratio * cos(phi)), (q15_t)lround(in.v_dc * ratio * sin(phi))};
        const made_t y = step();
        const twin_modulate_t t = twin_step();
        const double want = hypot(t.acted.d, t.acted.q) / f.v * 32768;
        const double is = hypot(y.acted.d, y.acted.q);
        worst_note(&length, is - want, "u %d %d v %d at %.4f", in.u.d, in.u.q, in.v_dc, theta);
        worst_note(&direction, (y.acted.d * (double)in.u.q - y.acted.q * (double)in.u.d) / hypot(in.u.d, in.u.q),
                   "u %d %d v %d at %.4f", in.u.d, in.u.q, in.v_dc, theta);
    }
    /* As inside, and 1.5 LSB more of shortening twice; seen in volts, so times v_dc/V_b <= 1. */
    ASSERT_WORST(length, 8.0);
    ASSERT_WORST(direction, 8.0);
}

void test_limited_is_said_exactly_when_the_command_was_cut(void)
{
    at_angle(65536 / 12);
    in.u.d = (q15_t)(20000.0 / sqrt(3.0)) - 10;
    TEST_ASSERT_FALSE(step().limited);
    in.u.d = (q15_t)(20000.0 / sqrt(3.0)) + 10;
    TEST_ASSERT_TRUE(step().limited);
    in.u.d = 0;
    in.v_dc = f.modulate.v_dc_min;
    TEST_ASSERT_FALSE(step().limited);
}

/* The middle of a sector's leg needs 0.5: so every voltage is averaged to its own at 12 angles by hand (acted = u). */
void test_the_acted_voltage_is_the_command_while_nothing_limits(void)
{
    uint64_t seed = 64;
    dead_time(0.01);
    for (int n = 0; n < 50000; n++) {
        at_angle(random_in(&seed, 0, 65535));
        in.u = (dq_t){(q15_t)random_in(&seed, -7000, 7000), (q15_t)random_in(&seed, -7000, 7000)};
        i = (dq_t){(q15_t)random_in(&seed, -20000, 20000), (q15_t)random_in(&seed, -20000, 20000)};
        const made_t y = step();
        TEST_ASSERT_FALSE(y.limited);
        TEST_ASSERT_EQUAL_INT(in.u.d, y.acted.d);
        TEST_ASSERT_EQUAL_INT(in.u.q, y.acted.q);
    }
}

/* Full current: +c on the phase that delivers it, -c on the others that take half each (beyond the knee). */
void test_the_compensation_adds_the_dead_time_to_legs_that_deliver_current(void)
{
    dead_time(0.02);
    i.d = 10000;
    const made_t y = step();
    TEST_ASSERT_INT_WITHIN(1, 16384 + 655, y.duty.a);
    TEST_ASSERT_INT_WITHIN(1, 16384 - 655, y.duty.b);
    TEST_ASSERT_INT_WITHIN(1, 16384 - 655, y.duty.c);
}

void test_the_compensation_is_odd_in_the_current_and_smooth_through_zero(void)
{
    dead_time(0.02);
    int last = -1;
    for (int count = -2000; count <= 2000; count++) {
        i.d = (q15_t)count;
        const int up = (int)step().duty.a - 16384;
        i.d = (q15_t)-count;
        const int down = (int)step().duty.a - 16384;
        TEST_ASSERT_INT_WITHIN(1, -up, down);
        if (count > -2000) { /* 655 LSB over 2 * 328 counts of current: at most 2, rounded up to 3 */
            TEST_ASSERT_INT_WITHIN(3, last, up);
            TEST_ASSERT_TRUE(up >= last);
        }
        last = up;
    }
    i.d = 0;
    TEST_ASSERT_EQUAL_INT(16384, step().duty.a);
    i.d = 164; /* half of the knee: half of the dead time */
    TEST_ASSERT_INT_WITHIN(3, 16384 + 328, step().duty.a);
}

/* 2 * 3277 counts is the shortest pulse here; the sweep drives leg a from rail to rail. */
void test_short_pulses_snap_to_the_nearer_of_nothing_and_the_shortest(void)
{
    min_pulse(0.1);
    for (int u = 0; u <= 13333; u += 3) {
        in.u.d = (q15_t)u;
        const made_t y = step();
        const int ideal = 16384 + (int)lround(0.75 * u * 32768.0 / 20000.0); /* v (1 - 1/4) on leg a */
        TEST_ASSERT_TRUE(y.duty.a == 32768 || y.duty.a <= 32768 - 3277);
        TEST_ASSERT_TRUE(y.duty.b == 0 || y.duty.b >= 3277);
        if (ideal < 32768 - 3277 - 4) { /* the bands between are the rounding of u, v_dc and duty */
            TEST_ASSERT_INT_WITHIN(4, ideal, y.duty.a);
            TEST_ASSERT_FALSE(y.limited);
        } else if (ideal > 32768 - 3277 + 4 && ideal < 32768 - 1638 - 4) {
            TEST_ASSERT_EQUAL_INT(32768 - 3277, y.duty.a);
        } else if (ideal > 32768 - 1638 + 4) {
            TEST_ASSERT_EQUAL_INT(32768, y.duty.a);
            TEST_ASSERT_EQUAL_INT(0, y.duty.b);
        }
    }
}

/* On the rail nothing switches and no dead time is lost: acted is what the duties make, by hand 2/3 v_dc. */
void test_a_leg_on_its_rail_loses_nothing_to_the_dead_time(void)
{
    dead_time(0.02);
    min_pulse(0.05);
    in.u.d = 13333;
    i.d = 10000;
    const made_t y = step();
    TEST_ASSERT_EQUAL_INT(32768, y.duty.a);
    TEST_ASSERT_EQUAL_INT(0, y.duty.b);
    TEST_ASSERT_INT_WITHIN(3, 13333, y.acted.d);
    TEST_ASSERT_INT_WITHIN(2, 0, y.acted.q);
}

void test_the_acted_voltage_of_clipped_pulses_follows_the_twin(void)
{
    worst_t worst = {0};
    uint64_t seed = 65;
    dead_time(0.02);
    min_pulse(0.03);
    for (int n = 0; n < 300000; n++) {
        at_angle(random_in(&seed, 0, 65535));
        in.v_dc = (q15_t)random_in(&seed, 15000, 32767);
        in.u = (dq_t){(q15_t)random_in(&seed, -10600, 10600), (q15_t)random_in(&seed, -10600, 10600)};
        i = (dq_t){(q15_t)random_in(&seed, -20000, 20000), (q15_t)random_in(&seed, -20000, 20000)};
        const made_t y = step();
        const twin_modulate_t t = twin_step();
        const double jump = fmax(fabs((double)y.duty.a - t.duty[0] * 32768),
                                 fmax(fabs((double)y.duty.b - t.duty[1] * 32768),
                                      fabs((double)y.duty.c - t.duty[2] * 32768)));
        if (!y.limited && (y.duty.a % 32768 == 0 || y.duty.b % 32768 == 0 || y.duty.c % 32768 == 0)) {
            continue; /* a duty that meets its rail by coincidence, one in 2^15, passes for a switching one */
        }
        if (jump < 12.0) { /* else the two stand on different sides of a snap, the shortest pulse of 983 LSB apart */
            worst_note(&worst, y.acted.d - t.acted.d / f.v * 32768, "d, u %d %d v %d i %d %d at %.4f", in.u.d, in.u.q,
                       in.v_dc, i.d, i.q, theta);
            worst_note(&worst, y.acted.q - t.acted.q / f.v * 32768, "q, u %d %d v %d i %d %d at %.4f", in.u.d, in.u.q,
                       in.v_dc, i.d, i.q, theta);
        } else {
            TEST_ASSERT_DOUBLE_WITHIN(12.0, 983.0, jump);
        }
    }
    ASSERT_WORST(worst, 12.0);
}

/* Below the floor a vector that the voltage still makes is made; any other is divided by the floor, and acted tells the
 * real voltage, which is smaller. */
void test_below_the_voltage_floor_the_floor_normalises_and_acted_uses_the_real_voltage(void)
{
    in.v_dc = f.modulate.v_dc_min / 2;
    in.u.d = 500;
    made_t y = step();
    TEST_ASSERT_FALSE(y.limited);
    TEST_ASSERT_INT_WITHIN(12, 16384 + lround(0.75 * 500.0 / in.v_dc * 32768.0), y.duty.a);
    in.u.d = 1500;
    y = step();
    TEST_ASSERT_TRUE(y.limited);
    TEST_ASSERT_INT_WITHIN(12, 16384 + lround(0.75 * 1500.0 / f.modulate.v_dc_min * 32768.0), y.duty.a);
    TEST_ASSERT_INT_WITHIN(3, 750, y.acted.d);
    in.u.d = 500;
    in.v_dc = -5; /* an offset of the converter can make it negative */
    TEST_ASSERT_INT_WITHIN(1, 0, step().acted.d);
}

void test_every_duty_is_realisable_for_every_input(void)
{
    uint64_t seed = 66;
    dead_time(0.03);
    min_pulse(0.02);
    for (int n = 0; n < 300000; n++) {
        at_angle(random_in(&seed, 0, 65535));
        in.v_dc = (q15_t)random_in(&seed, -32768, 32767);
        in.u = (dq_t){(q15_t)random_in(&seed, -32768, 32767), (q15_t)random_in(&seed, -32768, 32767)};
        i = (dq_t){(q15_t)random_in(&seed, -32768, 32767), (q15_t)random_in(&seed, -32768, 32767)};
        const made_t y = step();
        const int duty[3] = {(int)y.duty.a, (int)y.duty.b, (int)y.duty.c};
        for (int x = 0; x < 3; x++) {
            TEST_ASSERT_TRUE(duty[x] == 0 || duty[x] == 32768 || (duty[x] >= 655 && duty[x] <= 32768 - 655));
        }
    }
}
