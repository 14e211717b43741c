/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/gain_jump.h"

#include <math.h>

#include "counted.h"
#include "unity.h"

/* 7 V = 0.013, 10 A = 0.025: about those of hsm1. */
static const torque_monitor_config_t hsm1 = {.v_0 = 425, .i_0 = 819, .lag_noise = 60};
static torque_monitor_config_t config;
static gain_jump_state_t state;
static gain_jump_in_t in;
static dq_q15_t residual, i_ref, i_mean, per_quarter; /* of this step */

enum { SETTLED = 33, DECIDED = 23 };

static int32_t q15(double x)
{
    return (int32_t)lround(x * 32768.0);
}

static dq_q15_t vector(double d, double q)
{
    return (dq_q15_t){q15(d), q15(q)};
}

/* A machine with r = 0.0137, l_d = 0.65, l_q = 1.6 in steady state, whose residual is that of tables and inverter. */
static void machine(double omega, double i_d, double i_q)
{
    residual = vector(0.01, -0.02);
    i_ref = vector(i_d, i_q);
    i_mean = i_ref;
    in.omega = (q15_t)q15(omega);
    in.current = (q15_t)q15(hypot(i_d, i_q));
    per_quarter = vector(0.25 * (0.0137 * i_d - omega * 1.6 * i_q), 0.25 * (0.0137 * i_q + omega * 0.65 * i_d));
}

static bool decide(const gain_jump_in_t *now)
{
    return gain_jump_step(&config, &state, now) && gain_jump_is_found(&config, &state, per_quarter);
}

/* The torque monitor makes the residual of a step after this monitor's step. */
static bool step(void)
{
    in.i_ref = fx_pair(i_ref.d, i_ref.q);
    in.i_excess = fx_pair_sub(fx_pair(i_mean.d, i_mean.q), in.i_ref);
    const gain_jump_in_t now = in;
    in.residual = (dq_q15_halfword_t){fx_sat_q15(residual.d), fx_sat_q15(residual.q)};
    return decide(&now);
}

static void drive(int steps)
{
    run_without_finding(step, steps);
}

static int found_in(int steps)
{
    return found_in_step(step, steps);
}

/* In one step the mean current is off its reference by this share of it. */
static int found_after_a_jump(double share)
{
    i_mean.d += (int32_t)lround(share * i_ref.d);
    i_mean.q += (int32_t)lround(share * i_ref.q);
    if (step()) {
        return 1;
    }
    i_mean = i_ref;
    const int n = found_in(3 * DECIDED);
    return (n == NEVER) ? NEVER : n + 1;
}

/* The voltage that so much more current needs, turned. */
static void change_residual(double share, double turned)
{
    const double d = 4.0 * share * per_quarter.d, q = 4.0 * share * per_quarter.q;
    residual.d += (int32_t)lround(cos(turned) * d - sin(turned) * q);
    residual.q += (int32_t)lround(sin(turned) * d + cos(turned) * q);
}

static int found_with_gain(double gain)
{
    drive(2 * SETTLED);
    change_residual(1.0 / gain - 1.0, 0.0);
    return found_after_a_jump(0.3 * (gain - 1.0));
}

static void begin(double omega, double i_d, double i_q)
{
    state = (gain_jump_state_t){0};
    in.residual = (dq_q15_halfword_t){0, 0}; /* not known yet */
    machine(omega, i_d, i_q);
}

void setUp(void)
{
    config = hsm1;
    begin(0.3, -0.2, 0.3);
}

void tearDown(void)
{
}

void test_a_gain_that_jumps_is_found_in_23_steps_in_any_quadrant(void)
{
    static const double gains[] = {0.7, 0.8, 0.9, 1.1, 1.2, 1.3};
    for (unsigned n = 0; n < 24; n++) {
        begin((n / 6U % 2U) ? 0.3 : -0.3, -0.2, (n / 12U) ? 0.3 : -0.3);
        TEST_ASSERT_EQUAL_INT(DECIDED, found_with_gain(gains[n % 6U]));
    }
}

void test_at_standstill_the_drop_of_the_resistance_shows_it(void)
{
    begin(0.0, -0.3, 0.4);
    TEST_ASSERT_EQUAL_INT(DECIDED, found_with_gain(0.7));
}

void test_a_gain_that_jumps_by_less_than_6_percent_is_not_examined(void)
{
    TEST_ASSERT_EQUAL_INT(NEVER, found_with_gain(1.06));
}

void test_currents_that_leave_their_reference_without_another_voltage_are_no_fault(void)
{
    drive(2 * SETTLED);
    TEST_ASSERT_EQUAL_INT(NEVER, found_after_a_jump(0.1));
}

void test_another_voltage_without_currents_that_leave_their_reference_is_no_fault(void)
{
    drive(2 * SETTLED);
    change_residual(0.2, 0.0);
    TEST_ASSERT_EQUAL_INT(NEVER, found_after_a_jump(0.0));
}

void test_a_change_of_the_voltage_that_more_current_would_not_make_is_no_fault(void)
{
    drive(2 * SETTLED);
    change_residual(0.2, 0.4);
    TEST_ASSERT_EQUAL_INT(NEVER, found_after_a_jump(0.1));
    begin(0.3, -0.2, 0.3);
    drive(2 * SETTLED);
    change_residual(0.2, 0.25);
    TEST_ASSERT_EQUAL_INT(DECIDED, found_after_a_jump(0.1));
    begin(0.3, -0.2, 0.3);
    drive(2 * SETTLED);
    change_residual(0.8, 0.0);
    TEST_ASSERT_EQUAL_INT(NEVER, found_after_a_jump(0.1));
}

void test_a_change_within_the_errors_of_the_inverter_and_of_the_noise_is_no_fault(void)
{
    begin(0.0, -0.3, 0.4); /* 0.0137 0.5 = 0.53 v_0 */
    drive(2 * SETTLED);
    change_residual(0.15, 0.0);
    TEST_ASSERT_EQUAL_INT(NEVER, found_after_a_jump(0.1));
    begin(0.0, -0.3, 0.4);
    config.v_noise = config.v_0;
    TEST_ASSERT_EQUAL_INT(DECIDED, found_with_gain(0.7));
    begin(0.0, -0.3, 0.4);
    config.v_noise = (q15_t)(2 * config.v_0);
    TEST_ASSERT_EQUAL_INT(NEVER, found_with_gain(0.7));
}

void test_with_little_current_nothing_is_compared(void)
{
    begin(0.3, 0.0, 0.099);
    TEST_ASSERT_EQUAL_INT(NEVER, found_with_gain(0.7));
    begin(0.3, 0.0, 0.11);
    TEST_ASSERT_EQUAL_INT(DECIDED, found_with_gain(0.7));
}

void test_a_reference_or_a_speed_that_moves_begins_anew(void)
{
    drive(2 * SETTLED);
    change_residual(0.2, 0.0);
    i_ref.q += i_ref.q / 6; /* beyond 1/16 of both */
    TEST_ASSERT_EQUAL_INT(NEVER, found_after_a_jump(0.1));
    begin(0.3, -0.2, 0.3);
    drive(2 * SETTLED);
    change_residual(0.2, 0.0);
    in.omega = (q15_t)(in.omega + in.omega / 32);
    TEST_ASSERT_EQUAL_INT(NEVER, found_after_a_jump(0.1));
}

/* A rotor that was thrown back and stands again: speed and reference are those of before, the residual was not. */
void test_what_disturbed_the_means_is_not_before_the_jump(void)
{
    static const int since[] = {SETTLED - 1, SETTLED};
    for (int n = 0; n < 2; n++) {
        begin(0.3, -0.2, 0.3);
        drive(2 * SETTLED);
        const q15_t omega = in.omega;
        in.omega = (q15_t)(omega + omega / 32);
        drive(1);
        in.omega = omega;
        drive(since[n]);
        change_residual(0.2, 0.0);
        TEST_ASSERT_EQUAL_INT((n == 0) ? NEVER : DECIDED, found_after_a_jump(0.1));
    }
}

/* Dead time can make the currents of a rotor at rest oscillate. Their reading is off again and again, and the mean of
 * the residual depends on where in such a wave it begins and ends. */
void test_a_reading_that_was_off_in_the_steps_before_is_no_jump(void)
{
    static const int since[] = {SETTLED - 2, SETTLED - 1};
    for (int n = 0; n < 2; n++) {
        begin(0.3, -0.2, 0.3);
        drive(SETTLED - 1);
        i_mean = vector(-0.22, 0.33);
        drive(1);
        i_mean = i_ref;
        drive(since[n]);
        change_residual(0.2, 0.0);
        TEST_ASSERT_EQUAL_INT((n == 0) ? NEVER : DECIDED, found_after_a_jump(0.1));
    }
}

/* One step that is off by d moves the mean of the 33 steps until a jump by d/16 at most, in whichever step it is. */
void test_no_step_weighs_much_in_the_mean_before_a_jump(void)
{
    for (int disturbed = 0; disturbed < SETTLED; disturbed++) {
        begin(0.3, -0.2, 0.3);
        drive(disturbed);
        const dq_q15_t before = residual;
        residual.d += 3200;
        drive(1);
        residual = before;
        drive(SETTLED - disturbed);
        TEST_ASSERT_INT_WITHIN(3200 / 15, before.d, state.change_x16.d >> 4);
    }
}

void test_a_reference_that_moves_and_returns_before_the_decision_begins_anew(void)
{
    drive(2 * SETTLED);
    change_residual(0.2, 0.0);
    i_mean.q += i_ref.q / 10;
    drive(3);
    i_ref = vector(-0.26, 0.39);
    i_mean = i_ref;
    drive(1);
    i_ref = vector(-0.2, 0.3);
    i_mean = i_ref;
    TEST_ASSERT_EQUAL_INT(NEVER, found_in(3 * DECIDED));
}

void test_the_reference_may_answer_by_a_quarter_until_the_decision(void)
{
    static const double moves[] = {0.2, 0.3};
    for (int n = 0; n < 2; n++) {
        begin(0.3, -0.2, 0.3);
        drive(2 * SETTLED);
        change_residual(0.2, 0.0);
        i_mean.q += i_ref.q / 10;
        drive(1);
        i_ref = vector(-0.2 * (1.0 + moves[n]), 0.3 * (1.0 + moves[n]));
        i_mean = i_ref;
        TEST_ASSERT_EQUAL_INT((n == 0) ? DECIDED - 1 : NEVER, found_in(DECIDED));
    }
}

void test_it_takes_33_steps_until_a_jump_can_be_found(void)
{
    drive(SETTLED - 1);
    i_mean = vector(-0.22, 0.33);
    drive(1);
    i_mean = i_ref;
    change_residual(0.2, 0.0);
    TEST_ASSERT_EQUAL_INT(NEVER, found_in(2 * DECIDED));
    begin(0.3, -0.2, 0.3);
    drive(SETTLED);
    change_residual(0.2, 0.0);
    TEST_ASSERT_EQUAL_INT(DECIDED, found_after_a_jump(0.1));
}

void test_a_residual_that_a_jump_disturbs_one_step_before_its_currents_does_not_count(void)
{
    drive(2 * SETTLED);
    const dq_q15_t before = residual;
    residual = vector(0.4, -0.4);
    drive(1);
    residual = before;
    change_residual(0.11, 0.0);
    TEST_ASSERT_EQUAL_INT(DECIDED, found_after_a_jump(0.03));
}

void test_noise_of_the_speed_at_standstill_does_not_matter(void)
{
    begin(0.0, -0.3, 0.4);
    drive(2 * SETTLED);
    change_residual(0.3, 0.0);
    in.omega = 60;
    TEST_ASSERT_EQUAL_INT(DECIDED, found_after_a_jump(-0.1));
    begin(0.0, -0.3, 0.4);
    drive(2 * SETTLED);
    change_residual(0.3, 0.0);
    in.omega = 62;
    TEST_ASSERT_EQUAL_INT(NEVER, found_after_a_jump(-0.1));
}

/* With D/4 = 400 along d. */
static bool is_found(int32_t u_d, int32_t u_q)
{
    const gain_jump_state_t decided = {.change_x16 = {16 * u_d, 16 * u_q}};
    return gain_jump_is_found(&config, &decided, (dq_q15_t){400, 0});
}

void test_the_limits_of_the_change_are_exact(void)
{
    config.v_0 = 0;
    config.v_noise = 0;
    TEST_ASSERT_FALSE(is_found(100, 0));
    TEST_ASSERT_TRUE(is_found(101, 0));
    TEST_ASSERT_TRUE(is_found(1199, 0));
    TEST_ASSERT_FALSE(is_found(1200, 0));
    TEST_ASSERT_FALSE(is_found(300, 100));
    TEST_ASSERT_TRUE(is_found(303, 100));
    config.v_0 = 1200;
    config.v_noise = 600;
    TEST_ASSERT_FALSE(is_found(152, 0)); /* 1800/12 + 2 */
    TEST_ASSERT_TRUE(is_found(153, 0));
}

static int found_after_an_excess_of(int32_t excess)
{
    drive(2 * SETTLED);
    change_residual(0.2, 0.0);
    i_mean.q += excess;
    drive(1);
    i_mean = i_ref;
    return found_in(DECIDED);
}

void test_the_limits_of_a_candidate_are_exact(void)
{
    for (int n = 0; n < 2; n++) {
        begin(0.3, 0.0, 0.25);
        config.i_0 = 1024;
        in.current = 8192;
        TEST_ASSERT_EQUAL_INT((n == 0) ? NEVER : DECIDED - 1, found_after_an_excess_of(256 + n));
        begin(0.3, 0.0, 0.25);
        in.current = (q15_t)(4096 + n);
        TEST_ASSERT_EQUAL_INT((n == 0) ? NEVER : DECIDED - 1, found_after_an_excess_of(2000));
    }
}

void test_the_limits_of_a_movement_are_exact(void)
{
    for (int n = 0; n < 2; n++) {
        begin(0.3, 0.0, 16000.0 / 32768.0);
        drive(2 * SETTLED);
        change_residual(0.2, 0.0);
        i_ref.q = 17000 - n;
        i_mean.q = 18500;
        drive(1);
        i_mean = i_ref;
        TEST_ASSERT_EQUAL_INT((n == 0) ? NEVER : DECIDED - 1, found_in(DECIDED));
        begin(6400.0 / 32768.0, -0.2, 0.3);
        drive(2 * SETTLED);
        change_residual(0.2, 0.0);
        in.omega = (q15_t)(6400 + 100 + config.lag_noise + 1 - n);
        TEST_ASSERT_EQUAL_INT((n == 0) ? NEVER : DECIDED, found_after_a_jump(0.1));
    }
}

void test_after_a_candidate_that_was_no_fault_it_begins_anew(void)
{
    static const int steps[] = {SETTLED - 1, SETTLED};
    for (int n = 0; n < 2; n++) {
        begin(0.3, -0.2, 0.3);
        drive(2 * SETTLED);
        i_mean.q += i_ref.q / 10;
        drive(1);
        i_mean = i_ref;
        drive(DECIDED - 1 + steps[n]);
        change_residual(0.2, 0.0);
        TEST_ASSERT_EQUAL_INT((n == 0) ? NEVER : DECIDED, found_after_a_jump(0.1));
    }
}

/* The same monitor in double precision, over the whole range of every argument. Cases within the rounding of a
 * threshold are left out. */
static uint32_t seed;

static double uniform(double low, double high)
{
    seed = seed * 1664525U + 1013904223U;
    return low + (high - low) * (double)(seed >> 8) / 16777216.0;
}

static double dot(dq_q15_t a, dq_q15_t b)
{
    return (double)a.d * b.d + (double)a.q * b.q;
}

typedef struct {
    double residual_d, residual_q, i_d, i_q, omega;
    int steps; /* since it began anew */
} twin_t;

static bool unclear;

static bool is_less(double a, double b, double rounding)
{
    unclear = unclear || fabs(a - b) <= rounding + 0.003 * fabs(b);
    return a < b;
}

static bool twin_is_steady(const twin_t *t, double share)
{
    const double moved = hypot(i_ref.d - t->i_d, i_ref.q - t->i_q);
    const bool slow = is_less(fabs(in.omega - t->omega) - config.lag_noise, fabs(t->omega) / 64.0, 17.0);
    return is_less(moved, share * hypot(t->i_d, t->i_q), 25.0) && slow;
}

static void twin_follow(twin_t *t, dq_q15_t of_last_step)
{
    const double rate = exp2(-fmin(floor(log2(fmax(t->steps, 1))), 4.0));
    t->steps++;
    t->residual_d += rate * (of_last_step.d - t->residual_d);
    t->residual_q += rate * (of_last_step.q - t->residual_q);
    t->i_d += rate * (i_ref.d - t->i_d);
    t->i_q += rate * (i_ref.q - t->i_q);
    t->omega += rate * (in.omega - t->omega);
}

static bool twin_is_candidate(const twin_t *t)
{
    const dq_q15_t excess = {i_mean.d - i_ref.d, i_mean.q - i_ref.q};
    const bool far = !is_less(fabs(dot(excess, i_ref)), 0.25 * in.current * config.i_0, 1.0);
    return far && t->steps >= SETTLED && in.current > 4 * config.i_0 && twin_is_steady(t, 1.0 / 16.0);
}

static bool twin_is_found(double u_d, double u_q)
{
    const double d = per_quarter.d, q = per_quarter.q;
    const double along = fabs(u_d * d + u_q * q), across = fabs(u_q * d - u_d * q), squared = d * d + q * q;
    const double rounding = 4.0 * (fabs(d) + fabs(q) + fabs(u_d) + fabs(u_q) + 4.0);
    const bool is_much = !is_less(along, squared / 4.0, rounding);
    const bool is_possible = is_less(along, 3.0 * squared, rounding);
    const bool is_along = is_less(3.0 * across, along, rounding);
    const bool is_known = !is_less(hypot(u_d, u_q), (config.v_0 + config.v_noise) / 12.0 + 2.0, 3.0);
    return is_much && is_possible && is_along && is_known;
}

static dq_q15_t disturbed(dq_q15_t x, double amount)
{
    return (dq_q15_t){fx_sat_q15(x.d + q15(uniform(-amount, amount))), fx_sat_q15(x.q + q15(uniform(-amount, amount)))};
}

static dq_q15_t any_vector(double largest)
{
    const double length = largest * pow(uniform(0.0, 1.0), 2.0), angle = uniform(0.0, 6.2832);
    return vector(length * cos(angle), length * sin(angle));
}

typedef struct {
    bool is_candidate, is_found, is_found_by_twin, unclear;
} outcome_t;

static twin_t any_drive_before(dq_q15_t *last)
{
    config = (torque_monitor_config_t){
        .v_0 = (q15_t)uniform(50.0, 2000.0),
        .v_noise = (q15_t)uniform(0.0, 1000.0),
        .i_0 = (q15_t)uniform(50.0, 2000.0),
        .lag_noise = (q15_t)uniform(0.0, 200.0),
    };
    state = (gain_jump_state_t){.steps = 0};
    const dq_q15_t steady = any_vector(0.99), voltage = any_vector(0.9);
    const double omega = uniform(-0.99, 0.99) * uniform(0.0, 1.0);
    const double unrest = pow(uniform(0.0, 1.0), 4.0) * 0.004;
    twin_t twin = {0};
    *last = any_vector(1.0); /* not known */
    for (int n = 0; n < SETTLED + 7; n++) {
        i_ref = disturbed(steady, unrest);
        i_mean = i_ref;
        in.omega = (q15_t)q15(omega + uniform(-unrest, unrest));
        in.current = (q15_t)q15(fmin(hypot(i_ref.d, i_ref.q) / 32768.0, 0.9999));
        in.residual = (dq_q15_halfword_t){(q15_t)last->d, (q15_t)last->q};
        residual = disturbed(voltage, 10.0 * unrest);
        if (twin.steps > 0 && !twin_is_steady(&twin, 1.0 / 16.0)) {
            twin.steps = 0;
        }
        twin_follow(&twin, *last);
        *last = residual;
        TEST_ASSERT_FALSE(step());
    }
    return twin;
}

/* What follows the jump: the voltage of so much more current, turned, or any. */
static void any_change_of_residual(void)
{
    per_quarter = any_vector(0.99);
    const double by = uniform(-1.0, 1.0);
    if (uniform(0.0, 1.0) < 0.8) {
        change_residual(by * fabs(by), uniform(-0.5, 0.5));
    } else {
        residual = any_vector(0.99);
    }
}

static outcome_t any_jump(void)
{
    dq_q15_t last;
    unclear = false;
    const twin_t before = any_drive_before(&last);
    const double excess = uniform(-0.2, 0.2);
    i_ref = disturbed(i_ref, uniform(0.0, 0.02));
    i_mean = (dq_q15_t){fx_sat_q15(i_ref.d + q15(excess * i_ref.d / 32768.0)),
                        fx_sat_q15(i_ref.q + q15(excess * i_ref.q / 32768.0))};
    in.omega = (q15_t)fx_sat_q15(in.omega + q15(uniform(-0.01, 0.01)));
    outcome_t outcome = {.is_candidate = twin_is_candidate(&before)};
    any_change_of_residual();
    const dq_q15_t voltage = {fx_sat_q15(residual.d), fx_sat_q15(residual.q)};
    TEST_ASSERT_FALSE(step());
    double sum_d = 0.0, sum_q = 0.0;
    for (int n = 2; n <= DECIDED; n++) {
        if (n == DECIDED) {
            i_ref = disturbed(i_ref, uniform(0.0, 0.2));
            in.omega = fx_sat_q15(in.omega + q15(uniform(-0.01, 0.01)));
        }
        i_mean = i_ref;
        residual = (n <= 6) ? any_vector(1.0) : disturbed(voltage, 0.002);
        if (n >= 7 && n < DECIDED) {
            sum_d += residual.d / 16.0;
            sum_q += residual.q / 16.0;
        }
        outcome.is_found = step();
        TEST_ASSERT_FALSE(outcome.is_found && n < DECIDED);
    }
    const double u_d = fmax(-32768.0, fmin(32767.0, sum_d - before.residual_d));
    const double u_q = fmax(-32768.0, fmin(32767.0, sum_q - before.residual_q));
    outcome.is_found_by_twin = outcome.is_candidate && twin_is_steady(&before, 0.25) && twin_is_found(u_d, u_q);
    outcome.unclear = unclear;
    return outcome;
}

void test_it_decides_as_its_equations_in_double_precision(void)
{
    int clear = 0, found = 0;
    seed = 20261130U;
    for (int n = 0; n < 40000; n++) {
        const outcome_t outcome = any_jump();
        if (!outcome.unclear) {
            TEST_ASSERT_EQUAL_INT(outcome.is_found_by_twin, outcome.is_found);
            clear++;
            found += outcome.is_found ? 1 : 0;
        }
    }

    TEST_ASSERT_GREATER_THAN_INT(20000, clear);
    TEST_ASSERT_GREATER_THAN_INT(500, found);
}
