/* SPDX-License-Identifier: Apache-2.0 */
#include "fx/q.h"
#include "fx/vec.h"
#include "safety/launch_power.h"
#include "signal/mean.h"

#include <math.h>
#include <stdlib.h>

#include "types/faults.h"
#include "unity.h"

#define PERIODS 10
#define RAD_PER_STEP 3.3 /* at the speed base */

/* About those of hsm1: psi_f = 0.44, 0.875 V = 0.00162 in each period, 40 A = 0.1. */
static const launch_power_config_t config = {.turn_gain = 623900,
                                             .v_1 = 530,
                                             .psi_share = 2884,
                                             .i_0 = 205,
                                             .i_min = 819,
                                             .periods = PERIODS,
                                             .settle_steps = 10,
                                             .fault_steps = 5};
static launch_power_state_t state;
static launch_power_in_t in;

enum { SETTLED = 10, EARLY = 16, CONFIRMED = 5 };

/* The rotor behind the samples: l_d = 0.65, l_q = 1.6, its angle measured by delta too large; the legs' errors are a
 * voltage along the current. */
static struct {
    double omega, angle, torque, voltage[2], r, legs;
} rotor;

static int32_t q15(double x)
{
    return (int32_t)lround(x * 32768.0);
}

/* Voltages of the rotor at the present reference and speed, in the measured frame. */
static void turn(double i_d, double i_q, double delta)
{
    const double c = cos(delta), s = sin(delta);
    const double drop = rotor.r + rotor.legs / fmax(hypot(i_d, i_q), 1e-3);
    const double d = c * i_d - s * i_q, q = s * i_d + c * i_q; /* currents in the rotor's frame */
    const double psi_d = 0.44 + 0.65 * d, psi_q = 1.6 * q;
    const double u_d = -rotor.omega * psi_q, u_q = rotor.omega * psi_d;
    rotor.torque = psi_d * q - psi_q * d;
    rotor.voltage[0] = drop * i_d + c * u_d + s * u_q;
    rotor.voltage[1] = drop * i_q + c * u_q - s * u_d;
    rotor.angle += rotor.omega * RAD_PER_STEP;
    in.u_standing = (dq_q15_t){q15(PERIODS * rotor.voltage[0]), q15(PERIODS * rotor.voltage[1])};
    in.i_ref = (dq_q15_t){q15(i_d), q15(i_q)};
    in.psi_ref = (dq_q15_t){q15(0.44 + 0.65 * i_d), q15(1.6 * i_q)};
    in.theta_e = (uint32_t)(int64_t)floor(rotor.angle / 6.283185307179586 * 4294967296.0);
}

/* Steps until the fault while the rotor accelerates by its torque, 0.0002 of the speed base per step and unit of torque
 * (a vehicle behind hsm1); 0: none in so many steps. The currents rise within ramp steps. */
static int launch_slowly(double i_d, double i_q, double delta, int ramp, int steps)
{
    for (int n = 1; n <= steps; n++) {
        const double share = (n < ramp) ? (double)n / ramp : 1.0;
        turn(share * i_d, share * i_q, delta);
        rotor.omega += 0.0002 * rotor.torque;
        if (launch_power_step(&config, &state, &in) == FAULT_ANGLE_OFFSET) {
            return n;
        }
    }
    return 0;
}

static int launch(double i_d, double i_q, double delta, int steps)
{
    return launch_slowly(i_d, i_q, delta, 0, steps);
}

void setUp(void)
{
    state = (launch_power_state_t){0};
    in = (launch_power_in_t){.acting = true, .measured = true, .r = {.r = 1311, .error = 164}}; /* 0.02 and an eighth */
    rotor.omega = rotor.angle = rotor.legs = 0.0;
    rotor.r = 0.02;
}

void tearDown(void)
{
}

void test_a_rotor_that_accelerates_as_the_tables_say_is_no_fault(void)
{
    for (int n = 0; n < 4; n++) {
        setUp();
        rotor.omega = (n & 2) ? 0.03 : 0.0; /* it rolls back first, or coasts */
        TEST_ASSERT_EQUAL_INT(0, launch(-0.2, (n & 1) ? 0.35 : -0.35, 0.0, 1500));
        TEST_ASSERT_TRUE(fabs(rotor.omega) > 0.03);
    }
}

void test_a_blocked_rotor_may_warm_up_for_minutes(void)
{
    turn(-0.2, 0.35, 0.0);
    const int32_t start = in.u_standing.q;
    for (int n = 0; n < 180000; n++) {
        in.u_standing.q = start + n / 90; /* four times v_1 in three minutes */
        TEST_ASSERT_EQUAL_HEX32(0, launch_power_step(&config, &state, &in));
    }
}

/* 4.2 rad of the electrical angle are 5 cm: 1600 kg, wheels of 0.32 m behind 9:1, three pole pairs. */
void test_a_launch_with_a_wrong_angle_ends_within_5_cm(void)
{
    for (int n = 0; n < 8; n++) {
        const int sign = (n & 1) ? 1 : -1;
        setUp();
        const int found = launch(-0.2, 0.35 * sign, sign * (90.0 + 30.0 * (n >> 1)) * 0.017453292519943, 1000);
        TEST_ASSERT_GREATER_THAN_INT(SETTLED + CONFIRMED - 1, found);
        TEST_ASSERT_TRUE(fabs(rotor.angle) < 4.2);
    }
}

/* Without a comparison while the reference moves, the rotor turns by 10 rad and more. */
void test_a_launch_with_a_slowly_pressed_pedal_ends_within_5_cm(void)
{
    for (int n = 0; n < 12; n++) {
        const int sign = (n & 1) ? 1 : -1, ramp = 500 + 250 * (n / 6);
        setUp();
        TEST_ASSERT_NOT_EQUAL(
            0, launch_slowly(-0.2, 0.35 * sign, sign * (90.0 + 30.0 * (n % 6 >> 1)) * 0.017453292519943, ramp, 2000));
        TEST_ASSERT_TRUE(fabs(rotor.angle) < 4.2);
    }
}

/* The resistance is off by an eighth, and the legs by five times v_1. */
void test_a_healthy_rotor_may_start_as_slowly_as_it_likes(void)
{
    for (int n = 0; n < 48; n++) {
        setUp();
        rotor.r = (n & 1) ? 0.0225 : 0.0175;
        rotor.legs = (n & 2) ? 0.008 : -0.008;
        rotor.omega = (n & 4) ? -0.01 : 0.0;
        TEST_ASSERT_EQUAL_INT(0, launch_slowly(-0.2, (n & 8) ? 0.35 : -0.35, 0.0, 200 << (n >> 4), 1500));
    }
}

/* A step in the voltage along a current of 0.4, of so many counts; the mean lacks (3/4)^n of it after n steps. */
static int found_after_change(int32_t u_q)
{
    in.i_ref = (dq_q15_t){0, 13107};
    in.psi_ref = (dq_q15_t){14418, 20971};
    for (int n = 0; n < 40; n++) {
        TEST_ASSERT_EQUAL_HEX32(0, launch_power_step(&config, &state, &in));
    }
    in.u_standing.q += u_q;
    for (int n = 1; n <= 60; n++) {
        if (launch_power_step(&config, &state, &in) != 0U) {
            return n;
        }
    }
    return 0;
}

void test_the_voltage_along_the_current_may_change_by_v_1(void)
{
    TEST_ASSERT_EQUAL_INT(0, found_after_change(520));
    setUp();
    TEST_ASSERT_EQUAL_INT(0, found_after_change(-520));
    setUp();
    TEST_ASSERT_EQUAL_INT(3 + CONFIRMED - 1, found_after_change(1060));
    setUp();
    TEST_ASSERT_EQUAL_INT(3 + CONFIRMED - 1, found_after_change(-1060));
}

/* Noise of the sensors as the voltage answers it, the difference of two samples: uniform within +-limit each. */
static int32_t answered_noise(int32_t limit)
{
    static int32_t before;
    const int32_t now = (rand() % (2 * limit + 1)) - limit, answer = now - before;
    before = now;
    return answer;
}

/* Its mean over 4 steps and m_0 differ by up to 3 v_1. Without noise, and when m_0 has followed, a change of twice v_1
 * is found again. */
void test_noise_of_the_current_sensors_is_no_fault_and_hides_nothing_when_it_ends(void)
{
    in.i_ref = (dq_q15_t){0, 13107};
    in.psi_ref = (dq_q15_t){14418, 20971};
    for (int n = 0; n < 20000; n++) {
        in.u_standing.q = answered_noise(3000);
        in.i_ref.d = (n % 50 == 0) ? 300 : 0; /* begins again now and then */
        TEST_ASSERT_EQUAL_HEX32(0, launch_power_step(&config, &state, &in));
    }
    in.u_standing.q = 0;
    in.i_ref.d = 0;
    for (int n = 0; n < 20000; n++) {
        TEST_ASSERT_EQUAL_HEX32(0, launch_power_step(&config, &state, &in));
    }
    TEST_ASSERT_EQUAL_INT(3 + CONFIRMED - 1, found_after_change(1060));
}

/* As with a wrong angle: the currents oscillate about their reference until the rotor turns. Of an oscillation of twice
 * the threshold m_0 keeps less than half of what a mean over four steps does. */
void test_an_oscillation_that_ends_does_not_hide_a_change_of_twice_the_threshold(void)
{
    in.i_ref = (dq_q15_t){0, 13107};
    in.psi_ref = (dq_q15_t){14418, 20971};
    for (int n = 0; n < 4 + SETTLED + EARLY; n++) {
        in.u_standing.q = (n & 1) ? 1060 : -1060;
        TEST_ASSERT_EQUAL_HEX32(0, launch_power_step(&config, &state, &in));
    }
    TEST_ASSERT_GREATER_THAN_INT32(120 * 256, state.noise_q8);
    TEST_ASSERT_LESS_THAN_INT32(120 * 256, state.first_noise_q8);
    in.u_standing.q = 0;
    for (int n = 0; n < 60; n++) {
        TEST_ASSERT_EQUAL_HEX32(0, launch_power_step(&config, &state, &in));
    }
    int found = 0;
    in.u_standing.q = 1060;
    for (int n = 1; n <= 30 && found == 0; n++) {
        found = (launch_power_step(&config, &state, &in) != 0U) ? n : 0;
    }
    TEST_ASSERT_GREATER_THAN_INT(CONFIRMED, found);
}

/* r_0 follows the noise upwards, too: by 1 - exp(-1/2) of it in 2048 steps. */
void test_the_reference_of_the_noise_follows_it_in_4096_steps(void)
{
    in.i_ref = (dq_q15_t){0, 13107};
    state = (launch_power_state_t){.i_ref = {0, 13107}, .steady = SETTLED};
    double sum = 0.0;
    for (int n = 0; n < 2048; n++) {
        in.u_standing.q = answered_noise(600);
        (void)launch_power_step(&config, &state, &in);
        sum += state.noise_q8;
    }
    const double followed = (sum / 2048.0) * (1.0 - exp(-0.5));
    TEST_ASSERT_DOUBLE_WITHIN(0.15 * followed + 512.0, followed, state.first_noise_q8);
    TEST_ASSERT_GREATER_THAN_INT32(256, state.first_noise_q8);
}

/* Whether a change of m since m_0 counts in a step without power, in which r falls from 8000 to 7500 and r_0, 8000, and
 * the change are as good as constant. */
static bool counts(int32_t change)
{
    in.i_ref = (dq_q15_t){0, 13107};
    state = (launch_power_state_t){
        .i_ref = {0, 13107},
        .steady = SETTLED + EARLY,
        .noise_q8 = 8000 * 256,
        .first_noise_q8 = 8000 * 256,
        .first_power_q8 = -change * 256,
    };
    (void)launch_power_step(&config, &state, &in);
    return state.wrong != 0U;
}

/* sqrt(2) hypot(7500, 8000) = 15,508. */
void test_the_variances_of_both_means_add_up(void)
{
    TEST_ASSERT_FALSE(counts(15485));
    TEST_ASSERT_TRUE(counts(15530));
    TEST_ASSERT_FALSE(counts(-15485));
    TEST_ASSERT_TRUE(counts(-15530));
}

/* A power of one count above its mean is above it, and without any noise r ends at zero. */
void test_one_count_is_noise_and_none_is_none(void)
{
    in.i_ref = (dq_q15_t){0, 13107};
    in.u_standing.q = 6; /* 1.2 of the power */
    state = (launch_power_state_t){.i_ref = {0, 13107}, .steady = SETTLED};
    TEST_ASSERT_EQUAL_HEX32(0, launch_power_step(&config, &state, &in));
    TEST_ASSERT_TRUE(state.above);
    TEST_ASSERT_EQUAL_INT32(256 / 16, state.noise_q8);
    in.u_standing.q = 0;
    for (int n = 0; n < 300; n++) {
        TEST_ASSERT_EQUAL_HEX32(0, launch_power_step(&config, &state, &in));
    }
    TEST_ASSERT_EQUAL_INT32(0, state.noise_q8);
    TEST_ASSERT_FALSE(state.above);
    in.u_standing.q = 4000; /* 800 of the power */
    TEST_ASSERT_EQUAL_HEX32(0, launch_power_step(&config, &state, &in));
    TEST_ASSERT_EQUAL_INT32(800 * 256 / 16, state.noise_q8);
}

/* Three steps of prediction, and the step in which the angle's change is one of several steps. */
void test_the_comparison_waits_while_the_angle_is_predicted_and_for_one_step_more(void)
{
    in.i_ref = (dq_q15_t){0, 13107};
    for (int n = 0; n < 40; n++) {
        TEST_ASSERT_EQUAL_HEX32(0, launch_power_step(&config, &state, &in));
    }
    const launch_power_state_t before = state;
    for (int n = 0; n < 4; n++) {
        in.measured = n == 3;
        in.theta_e += 10000000U; /* of all four less than 1/64 of a turn */
        in.u_standing.q = 200000;
        TEST_ASSERT_EQUAL_HEX32(0, launch_power_step(&config, &state, &in));
        TEST_ASSERT_EQUAL_INT32(before.power_q8, state.power_q8);
        TEST_ASSERT_EQUAL_INT32(before.omega_q8, state.omega_q8);
        TEST_ASSERT_EQUAL_UINT8(before.steady, state.steady);
    }
    in.u_standing.q = 0;
    TEST_ASSERT_EQUAL_HEX32(0, launch_power_step(&config, &state, &in));
    TEST_ASSERT_EQUAL_INT32(0, state.omega_q8); /* of one step */
}

/* Current control follows the tracked speed: what changes until that is the rotor's is no comparison. */
void test_while_the_tracked_speed_is_behind_nothing_is_compared(void)
{
    for (int behind = 1; behind >= 0; behind--) {
        setUp();
        turn(-0.2, 0.2, 0.0);
        uint32_t faults = 0;
        for (int n = 0; n < 100; n++) {
            in.behind = behind != 0 && n >= 50;
            in.u_standing.q += (n == 50) ? 4000 : 0;
            faults |= launch_power_step(&config, &state, &in);
        }
        TEST_ASSERT_EQUAL_HEX32(behind != 0 ? 0U : FAULT_ANGLE_OFFSET, faults);
    }
    in.behind = true;
    (void)launch_power_step(&config, &state, &in);
    TEST_ASSERT_EQUAL_UINT8(1, state.steady);
    in.behind = false;
    for (int n = 0; n < 5; n++) {
        (void)launch_power_step(&config, &state, &in);
    }
    TEST_ASSERT_EQUAL_UINT8(6, state.steady);
    in.measured = false; /* also while the comparison waits */
    in.behind = true;
    (void)launch_power_step(&config, &state, &in);
    TEST_ASSERT_EQUAL_UINT8(0, state.steady);
}

void test_a_small_current_is_not_checked(void)
{
    in.i_ref = (dq_q15_t){0, 819};
    for (int n = 0; n < 200; n++) {
        in.u_standing.q = (n < 40) ? 0 : 200000;
        TEST_ASSERT_EQUAL_HEX32(0, launch_power_step(&config, &state, &in));
    }
}

void test_a_reference_or_an_angle_that_moves_starts_again(void)
{
    for (int k = 0; k < 6; k++) {
        setUp();
        in.i_ref = (dq_q15_t){0, 13107};
        for (int n = 0; n < 100; n++) {
            const int odd = n & 1;
            in.u_standing.q = 200 * n;
            in.i_ref.d = (k == 0) ? 206 * odd : (k == 1) ? -206 * odd : 0;
            in.i_ref.q = 13107 + ((k == 2) ? 206 * odd : (k == 3) ? -206 * odd : 0);
            in.theta_e += (k == 4) ? (1U << 28) + 1U : (k == 5) ? 0U - (1U << 28) - 1U : 0U;
            TEST_ASSERT_EQUAL_HEX32(0, launch_power_step(&config, &state, &in));
            TEST_ASSERT_LESS_THAN_UINT8(SETTLED, state.steady);
        }
    }
}

void test_a_bridge_that_is_off_is_not_checked_and_starts_again(void)
{
    TEST_ASSERT_NOT_EQUAL(0, found_after_change(4000));
    in.acting = false;
    TEST_ASSERT_EQUAL_HEX32(0, launch_power_step(&config, &state, &in));
    TEST_ASSERT_EQUAL_UINT8(0, state.steady);
    TEST_ASSERT_EQUAL_UINT8(0, state.wrong);
    in.theta_e = 60000000;
    in.i_ref = (dq_q15_t){0, 100};
    TEST_ASSERT_EQUAL_HEX32(0, launch_power_step(&config, &state, &in));
    in.acting = true;
    TEST_ASSERT_EQUAL_HEX32(0, launch_power_step(&config, &state, &in));
    TEST_ASSERT_EQUAL_INT32(0, state.omega_q8); /* from the angle of the last step */
}

/* (MN-28), (MN-29) and (MN-57) in double precision, written from the equations; counts of the sums. */
typedef struct {
    double p, p_0, w, w_0, i_d, i_q, theta; /* theta: turns 2^32 */
    double r, r_0;
    bool above;
    int steady, wrong, since;
} twin_t;

/* With much noise, m_0 is a mean over 8 steps at first. Near the bound, rounding decides as in the code. */
static double first_steps(const twin_t *t, double i)
{
    const double beyond = 2.0 * t->r - 530.0 * i / 65536.0;
    const double of_code = 2 * (state.noise_q8 >> 8) - fx_mulhi(530, (int32_t)lround(i) * 65536);
    return (t->steady < SETTLED + EARLY && ((fabs(beyond) > 20.0) ? beyond : of_code) > 0.0) ? 8.0 : 4096.0;
}

static void follow(const twin_t *t, double *mean, double *first, double x, double steps)
{
    *mean += (x - *mean) / ((t->steady < 4) ? 1.0 : 4.0);
    *first = (t->steady < SETTLED) ? *mean : *first + (*mean - *first) / steps;
}

/* (MN-39) */
static void follow_noise(twin_t *t, double p, double i)
{
    if (t->steady < 4) {
        return;
    }
    const bool above = (fabs(p - t->p) > 6.0) ? p > t->p : state.above; /* of less, rounding decides */
    const double x = (above != t->above) ? fmin(fabs(p - t->p), 8.0 * 530.0 * i / 65536.0) : 0.0;
    t->above = above;
    t->r += (x - t->r) / ((t->steady < SETTLED) ? 4.0 : 16.0);
    const double steps = first_steps(t, i);
    t->r_0 = (t->steady < SETTLED) ? t->r : t->r_0 + (t->r / ((steps < 10.0) ? 2.0 : 1.0) - t->r_0) / steps;
}

/* (MN-57) */
static void follow_current(twin_t *t, double before, double now)
{
    const double r = in.r.r / 65536.0, doubt = in.r.error / 65536.0,
                 of_loss = now * fabs(now - before) * PERIODS / 65536.0;
    const double legs = 530.0 * fabs(now - before) / 65536.0;
    t->p_0 += t->p_0 * (now - before) / before + ((now > before) ? r : -r) * of_loss;
    t->r_0 += t->r_0 * (now - before) / before + (doubt * of_loss + legs) / sqrt(2.0);
    t->r_0 = fmin(t->r_0, 65535.0);
}

/* Near the bound, rounding decides as in the code. */
static bool is_vague(const twin_t *t)
{
    const double beyond = t->r_0 - fmax(2.0 * t->r, 1.5 * 530.0 * hypot(t->i_d, t->i_q) / 65536.0);
    return t->since == 32 && ((fabs(beyond) < 25.0) ? state.steady == 1 : beyond > 0.0);
}

/* Whether the means begin anew. */
static bool begins_anew(twin_t *t, bool turned)
{
    const double i_d = in.i_ref.d, i_q = in.i_ref.q, before = hypot(t->i_d, t->i_q);
    const double change = fmax(fabs(i_d - t->i_d), fabs(i_q - t->i_q));
    const bool vague = is_vague(t), slow = t->since >= 4 && change <= 410.0 && before > 819.0;
    t->since = (change > 205.0 || vague) ? 1 : t->since + ((t->since < 32) ? 1 : 0);
    if (vague || turned || (change > 205.0 && !slow)) {
        t->i_d = i_d;
        t->i_q = i_q;
        t->steady = 0;
        return true;
    }
    if (change > 205.0) {
        follow_current(t, before, hypot(i_d, i_q));
        t->i_d = i_d;
        t->i_q = i_q;
    }
    return false;
}

/* Returns by how much the power has changed beyond its threshold; negative while nothing is compared. */
static double twin_step(twin_t *t)
{
    const double i_d = in.i_ref.d, i_q = in.i_ref.q, change = (double)(int32_t)(in.theta_e - (uint32_t)t->theta);
    const double before = hypot(t->i_d, t->i_q);
    const bool moved = begins_anew(t, fabs(change) > 67108864.0);
    const double i = moved ? hypot(i_d, i_q) : before; /* of the last movement before this step */
    const double w = moved ? 0.0 : change * 623900.0 / 4294967296.0;
    const double torque = (in.psi_ref.d * i_q - in.psi_ref.q * i_d) / 32768.0;
    const double p = (in.u_standing.d * i_d + in.u_standing.q * i_q - w * torque) / 65536.0;
    t->theta = in.theta_e;
    follow_noise(t, p, i);
    const double steps = first_steps(t, i);
    follow(t, &t->p, &t->p_0, p, steps);
    follow(t, &t->w, &t->w_0, w, steps);
    const double v_turning = 2.0 * fabs(t->w - t->w_0) * (2884.0 + abs(in.psi_ref.q) / 8.0) / 65536.0;
    const double loss_max = fmax(530.0 * hypot(i_d, i_q) / 65536.0, sqrt(2.0) * hypot(t->r, t->r_0));
    const double beyond = fabs(t->p - t->p_0) - loss_max - v_turning * hypot(i_d, i_q) / 65536.0;
    t->steady += (t->steady < SETTLED + EARLY) ? 1 : 0;
    return (t->steady <= SETTLED) ? -100.0 : beyond;
}

static int32_t uniform(int32_t lo, int32_t hi)
{
    static uint32_t x = 1;
    x = 1664525U * x + 1013904223U;
    const uint32_t values = (uint32_t)hi - (uint32_t)lo + 1U;
    return (int32_t)((uint32_t)lo + (uint32_t)(((uint64_t)x * values) >> 32));
}

/* A new operating point: voltages up to 15 per unit, or one about which the power stays near its threshold. */
static void new_point(dq_q15_t *u, uint32_t *turn, int point)
{
    static const int32_t turns[] = {67108864, -67108864, 67108865, -67108865, 0, 134217728};
    const int32_t u_max = (point & 1) ? 500000 : 2000;
    in.i_ref = (dq_q15_t){uniform(-20000, -2000), uniform(-20000, 20000)};
    in.psi_ref = (dq_q15_t){uniform(0, 15000), uniform(-15000, 15000)};
    *u = (dq_q15_t){uniform(-u_max, u_max), uniform(-u_max, u_max)};
    *turn = (uint32_t)((point % 5 == 0) ? turns[point / 5 % 6] : uniform(-60000000, 60000000));
}

/* The rounding of four products, always down, is below 3 counts of the power, that of the speed below 2. */
static void compare(const twin_t *twin, double beyond, int compared[2])
{
    TEST_ASSERT_EQUAL_INT(twin->steady, state.steady);
    if (twin->steady > 1) { /* the step that begins anew leaves the means to the next one */
        TEST_ASSERT_DOUBLE_WITHIN(3.0, twin->p, state.power_q8 / 256.0);
        TEST_ASSERT_DOUBLE_WITHIN(3.0 + 5e-5 * fabs(twin->p_0), twin->p_0, state.first_power_q8 / 256.0);
        TEST_ASSERT_DOUBLE_WITHIN(1.5, twin->w, state.omega_q8 / 256.0);
        TEST_ASSERT_DOUBLE_WITHIN(1.5, twin->w_0, state.first_omega_q8 / 256.0);
    }
    TEST_ASSERT_DOUBLE_WITHIN(3.0, twin->r, state.noise_q8 / 256.0);
    TEST_ASSERT_DOUBLE_WITHIN(19.0, twin->r_0, state.first_noise_q8 / 256.0);
    if (fabs(beyond) > 40.0) {
        TEST_ASSERT_EQUAL_INT(beyond > 0.0, state.wrong > 0);
        compared[beyond > 0.0]++;
    }
}

void test_means_and_decisions_are_those_of_the_twin(void)
{
    dq_q15_t u = {0, 0};
    uint32_t turn = 0;
    int compared[2] = {0, 0};
    twin_t twin = {0};
    for (int n = 0; n < 60000; n++) {
        if (n % 60 == 0) {
            new_point(&u, &turn, n / 60);
        }
        in.acting = n % 600 != 0;
        in.u_standing = (dq_q15_t){u.d + uniform(-2000, 2000), u.q + uniform(-2000, 2000)};
        in.i_ref.q += (n % 60 == 20) ? ((in.i_ref.q < 0) ? 205 : -205) : 0;      /* no movement, and one */
        in.i_ref.d += (n % 60 == 40) ? ((in.i_ref.d < -10000) ? 206 : -206) : 0; /* slowly; then too fast */
        in.i_ref.q += (n % 240 == 52 || n % 240 == 55) ? ((in.i_ref.q < 0) ? 300 : -300) : 0;
        if (n / 60 % 5 != 0) { /* elsewhere the angle moves as far as it may */
            turn = (n % 60 == 30) ? (uint32_t)uniform(-60000000, 60000000) : turn + (uint32_t)uniform(-1000, 1000);
        }
        in.theta_e += turn;
        (void)launch_power_step(&config, &state, &in);
        if (!in.acting) {
            twin = (twin_t){.theta = in.theta_e};
            continue;
        }
        compare(&twin, twin_step(&twin), compared);
    }
    TEST_ASSERT_TRUE(compared[0] > 10000 && compared[1] > 10000);
}

/* One step with a current of 13107 on the q axis from this state; the threshold is exceeded or just not. */
static void expect_wrong(bool beyond, launch_power_state_t from)
{
    in.i_ref = (dq_q15_t){0, 13107};
    state = from;
    state.i_ref = (dq_q15_halfword_t){0, 13107};
    TEST_ASSERT_EQUAL_HEX32(0, launch_power_step(&config, &state, &in));
    TEST_ASSERT_EQUAL_UINT8(beyond, state.wrong);
}

/* The threshold is 530/65536 of a current of 13107, 106 counts, and one for the rounding. The reference of the mean
 * follows by 6/256 in the step: 27398/4096. */
void test_a_change_of_just_the_threshold_is_none(void)
{
    for (int beyond = 0; beyond <= 1; beyond++) {
        expect_wrong(beyond, (launch_power_state_t){.steady = SETTLED, .first_power_q8 = -27398 - 256 * beyond});
    }
}

/* r = 150 and r_0 = 200 after the step: 362/128 of hypot(75, 100) are 353 counts. */
void test_a_change_of_just_the_noise_is_none(void)
{
    for (int beyond = 0; beyond <= 1; beyond++) {
        expect_wrong(beyond, (launch_power_state_t){.steady = SETTLED + EARLY,
                                                    .noise_q8 = 160 * 256,
                                                    .first_noise_q8 = 200 * 256 + 10,
                                                    .first_power_q8 = -(353 + beyond) * 256 - 100});
    }
}

/* A change of the speed by 2309 counts: the tables' flux may be wrong by 0.088, which is 41 counts of the power more
 * than the 107 without it. */
void test_the_error_of_the_tables_is_added_to_the_threshold(void)
{
    for (int beyond = 0; beyond <= 1; beyond++) {
        expect_wrong(beyond, (launch_power_state_t){.steady = SETTLED + EARLY,
                                                    .first_omega_q8 = -2310 * 256,
                                                    .first_power_q8 = -(148 + beyond) * 256 - 50});
    }
}

/* A state in which nothing but the reference has moved since so many steps. */
static launch_power_state_t standing(int32_t i_q, uint8_t since)
{
    return (launch_power_state_t){.steady = SETTLED + EARLY, .i_ref = {0, (q15_t)i_q}, .since = since};
}

/* (MN-57) in integers, products half up. */
static int64_t product_of(int64_t a, int64_t b, int shift)
{
    return (a * b + (1LL << (shift - 1))) >> shift;
}

static int64_t loss_q8(q16_t r, int64_t product)
{
    return (product_of((int64_t)r * 16384, product, 32) >> 6) * PERIODS;
}

void test_a_slow_movement_takes_both_references_with_it(void)
{
    static const int32_t to[] = {20354, 19701};
    for (int k = 0; k < 2; k++) {
        const int64_t change = to[k] - 20000, share = change * 32768 / 20000;
        const int64_t doubt = (loss_q8(1993, to[k] * llabs(change)) >> 8) + product_of(530, llabs(change), 16);
        launch_power_state_t expected = standing(to[k], 1);
        state = standing(20000, 4);
        state.first_power_q8 = 150000000;
        state.first_noise_q8 = 4000000;
        in.i_ref = (dq_q15_t){0, to[k]};
        in.r = (winding_resistance_t){.r = 15943, .error = 1993};
        TEST_ASSERT_EQUAL_HEX32(0, launch_power_step(&config, &state, &in));
        expected.first_power_q8 =
            (int32_t)(150000000 + 2 * product_of(150000000, share, 16) + loss_q8(15943, to[k] * change));
        expected.first_noise_q8 = (int32_t)(4000000 + 2 * product_of(4000000, share, 16) + 181 * doubt);
        TEST_ASSERT_EQUAL_INT32(mean_step(expected.first_power_q8, state.power_q8, 12), state.first_power_q8);
        TEST_ASSERT_EQUAL_INT32(mean_step(expected.first_noise_q8, state.noise_q8, 12), state.first_noise_q8);
        TEST_ASSERT_EQUAL_UINT8(expected.since, state.since);
        TEST_ASSERT_EQUAL_INT16(to[k], state.i_ref.q);
    }
}

void test_the_doubt_of_a_movement_is_limited(void)
{
    state = standing(20000, 4);
    state.first_noise_q8 = 65535 * 256 - 100;
    in.i_ref = (dq_q15_t){0, 20300};
    TEST_ASSERT_EQUAL_HEX32(0, launch_power_step(&config, &state, &in));
    TEST_ASSERT_EQUAL_INT32(mean_step(65535 * 256, 0, 12), state.first_noise_q8);
}

/* i_0 = 205, i_min = 819. */
void test_only_a_slow_movement_of_enough_current_is_followed(void)
{
    static const struct {
        int32_t from, way;
        uint8_t since;
        bool followed;
    } cases[] = {{13107, 206, 4, true}, {13107, 206, 3, false}, {13107, 410, 32, true}, {13107, 411, 32, false},
                 {820, 206, 4, true},   {819, 206, 4, false},   {13107, -410, 9, true}, {13107, -411, 9, false}};
    for (unsigned k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        state = standing(cases[k].from, cases[k].since);
        in.i_ref = (dq_q15_t){0, cases[k].from + cases[k].way};
        TEST_ASSERT_EQUAL_HEX32(0, launch_power_step(&config, &state, &in));
        TEST_ASSERT_EQUAL_INT(cases[k].followed, state.steady != 1);
        TEST_ASSERT_EQUAL_UINT8(1, state.since);
    }
}

/* The threshold of a current of 13107 is 106 counts: r_0 may be 384/256 of it, or twice r. */
void test_where_the_reference_stands_a_vague_comparison_begins_anew(void)
{
    static const struct {
        int32_t noise_q8, first_noise_q8;
        uint8_t since;
        bool anew;
    } cases[] = {{0, 384 * 106, 32, false},        {0, 384 * 106 + 1, 32, true}, {0, 384 * 106 + 1, 31, false},
                 {30000, 60000, 32, false},        {30000, 60001, 32, true},     {0, 400000, 1, false},
                 {20000, 384 * 106 + 1, 32, true}, {25000, 50000, 32, false}};
    for (unsigned k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        state = standing(13107, cases[k].since);
        state.noise_q8 = cases[k].noise_q8;
        state.first_noise_q8 = cases[k].first_noise_q8;
        in.i_ref = (dq_q15_t){0, 13107};
        TEST_ASSERT_EQUAL_HEX32(0, launch_power_step(&config, &state, &in));
        TEST_ASSERT_EQUAL_INT(cases[k].anew, state.steady == 1);
        TEST_ASSERT_EQUAL_UINT8(cases[k].anew ? 1 : fmin(32, cases[k].since + 1), state.since);
    }
}

void test_no_argument_wraps(void)
{
    static const int32_t ends[] = {-43 * 32768, 43 * 32767};
    for (unsigned n = 0; n < 4096; n++) {
        const int32_t d = (n >> 2 & 1U) ? 32767 : -32768, q = (n >> 3 & 1U) ? 32767 : -32768;
        const int32_t psi_d = (n >> 4 & 1U) ? 32767 : -32768, psi_q = (n >> 5 & 1U) ? 32767 : -32768;
        in = (launch_power_in_t){.acting = true,
                                 .measured = true,
                                 .u_standing = {ends[n & 1U], ends[n >> 1 & 1U]},
                                 .i_ref = {d, q},
                                 .psi_ref = {psi_d, psi_q},
                                 .theta_e = n << 28};
        (void)launch_power_step(&config, &state, &in);
        TEST_ASSERT_TRUE(abs(state.power_q8) <= (43 * 32768 + 20000) * 256);
    }
}

/* (MN-57) at the ends of every range, with 40 periods in a step. m_0 moves by 1/4096 of its way to m, too. */
void test_no_followed_movement_wraps(void)
{
    const int32_t end = (43 * 32768 + 20000) * 256, moved = 2 * config.i_0;
    launch_power_config_t longest = config;
    longest.periods = 40;
    for (unsigned n = 0; n < 32; n++) {
        const int32_t q = (int32_t)(n >> 3 & 1U); /* 1: both axes, a vector of full length, too */
        const int32_t from = (n & 1U) ? 820 : ((q != 0) ? 22700 : 32357), to = from + ((n >> 4 & 1U) ? moved : -moved);
        const int32_t first = (n >> 2 & 1U) ? end : -end, sign = (n >> 1 & 1U) ? 1 : -1;
        state = (launch_power_state_t){.power_q8 = first,
                                       .first_power_q8 = first,
                                       .i_ref = {(q15_t)(sign * from), (q15_t)(q * from)},
                                       .steady = SETTLED + EARLY,
                                       .since = 4};
        in = (launch_power_in_t){.acting = true,
                                 .measured = true,
                                 .u_standing = {sign * 43 * 32767, 43 * 32767},
                                 .i_ref = {sign * to, q * to},
                                 .r = {16383, 16383}};
        const double before = hypot(from, q * from), now = hypot(to, q * to);
        const double loss_q8 = 16383.0 * now * (now - before) / 16777216.0 * 40.0;
        (void)launch_power_step(&longest, &state, &in);
        TEST_ASSERT_INT32_WITHIN(400000, (int32_t)lround(first * (now / before) + loss_q8), state.first_power_q8);
        TEST_ASSERT_TRUE(state.first_noise_q8 >= 0);
        TEST_ASSERT_TRUE(state.first_noise_q8 <= UINT16_MAX * 256);
    }
}
