/* SPDX-License-Identifier: Apache-2.0 */
#include "control/commission/commission.h"

#include <math.h>

#include "twin/twin_commission.h"
#include "unity.h"
#include "worst.h"

#define ONE 1073741824.0
#define R 0.0133
#define LEVEL 0.022
#define OMEGA_MAX Q31(0.002)

static const commission_config_t config = {Q15(0.6), OMEGA_MAX, 40, 64, 10, 3355443};
static commission_state_t state;

void setUp(void)
{
    commission_start(&config, &state);
}

void tearDown(void)
{
}

static int32_t q30(double x)
{
    return (int32_t)lround(x * ONE);
}

/* Voltage error of a leg: rises smoothly through zero to the level. */
static double smooth(double i, double zone)
{
    return LEVEL * tanh(i / zone);
}

/* The measurement of ten levels at an angle; the d voltage is 2/3 of the phases' projections. */
static commission_data_t measured(double theta, double zone, twin_curve_t *twin)
{
    commission_data_t data;
    double c[3], i[COMMISSION_LEVELS], u[COMMISSION_LEVELS];
    twin_cosines(theta, c);
    for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
        i[k] = 0.6 * pow(2.0, -6.0 + 0.5 * k);
        u[k] = R * i[k];
        for (int x = 0; x < 3; x++) {
            u[k] += c[x] * smooth(c[x] * i[k], zone) / 1.5;
        }
        data.i[k] = q30(i[k]);
        data.u[k] = q30(u[k]);
    }
    for (int x = 0; x < 3; x++) {
        data.cosine[x] = fx_sat_q15((int32_t)lround(c[x] * 32768.0));
    }
    *twin = twin_commission(i, u, c);
    return data;
}

void test_resistance_and_a_constant_error_are_found_at_every_angle_of_the_rotor(void)
{
    for (double theta = 0.0; theta < 6.3; theta += 0.05) {
        twin_curve_t twin;
        commission_curve_t curve;
        const commission_data_t data = measured(theta, 1e-6, &twin);
        TEST_ASSERT_TRUE(commission_fit(&data, &curve));
        TEST_ASSERT_DOUBLE_WITHIN(1e-5, R, curve.r / ONE);
        TEST_ASSERT_DOUBLE_WITHIN(1e-5, LEVEL, curve.level / ONE);
        for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
            TEST_ASSERT_DOUBLE_WITHIN(1e-5, LEVEL, curve.v[k] / ONE);
        }
    }
}

/* Tolerance: a few 2^-15 of the cosines times the level, and 2^-31 of the division. */
void test_the_result_for_a_smooth_curve_is_that_of_the_twin(void)
{
    for (double theta = 0.0; theta < 6.3; theta += 0.05) {
        twin_curve_t twin;
        commission_curve_t curve;
        const commission_data_t data = measured(theta, 0.02, &twin);
        TEST_ASSERT_TRUE(commission_fit(&data, &curve));
        TEST_ASSERT_DOUBLE_WITHIN(2e-6, twin.r, curve.r / ONE);
        TEST_ASSERT_DOUBLE_WITHIN(3e-6, twin.level, curve.level / ONE);
        TEST_ASSERT_DOUBLE_WITHIN(2e-4, twin_knee(&twin), commission_knee(&curve) / ONE);
        for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
            TEST_ASSERT_DOUBLE_WITHIN(6e-6, twin.v[k], curve.v[k] / ONE);
        }
    }
}

/* With cosines, currents and voltages that their formats hold exactly, only the fit's own rounding is left: a few times
 * 2^-30. */
void test_the_result_differs_from_that_of_the_twin_by_the_rounding_of_the_fit_only(void)
{
    double r = 0.0, level = 0.0, v = 0.0, knee = 0.0;
    for (double theta = 0.0; theta < 6.3; theta += 0.05) {
        twin_curve_t unused;
        commission_curve_t curve;
        double c[3], i[COMMISSION_LEVELS], u[COMMISSION_LEVELS];
        const commission_data_t data = measured(theta, 0.02, &unused);
        for (int x = 0; x < 3; x++) {
            c[x] = data.cosine[x] / 32768.0;
        }
        for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
            i[k] = data.i[k] / ONE;
            u[k] = data.u[k] / ONE;
        }
        const twin_curve_t twin = twin_commission(i, u, c);
        TEST_ASSERT_TRUE(commission_fit(&data, &curve));
        r = worse_of(r, fabs(twin.r - curve.r / ONE));
        level = worse_of(level, fabs(twin.level - curve.level / ONE));
        knee = worse_of(knee, fabs(twin_knee(&twin) - commission_knee(&curve) / ONE));
        for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
            v = worse_of(v, fabs(twin.v[k] - curve.v[k] / ONE));
        }
    }
    TEST_ASSERT_DOUBLE_WITHIN(2.0 / ONE, 0.0, r);
    TEST_ASSERT_DOUBLE_WITHIN(4.0 / ONE, 0.0, level);
    TEST_ASSERT_DOUBLE_WITHIN(15.0 / ONE, 0.0, v);
    TEST_ASSERT_DOUBLE_WITHIN(60.0 / ONE, 0.0, knee); /* divided by the level */
}

/* The current at which tanh() bends is half of the first knot. Below that knot the fit takes the curve as constant,
 * which affects the first knots most. */
void test_the_curve_is_that_of_the_leg_within_a_few_percent(void)
{
    for (double theta = 0.0; theta < 6.3; theta += 0.05) {
        twin_curve_t twin;
        commission_curve_t curve;
        const commission_data_t data = measured(theta, 0.005, &twin);
        TEST_ASSERT_TRUE(commission_fit(&data, &curve));
        for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
            TEST_ASSERT_DOUBLE_WITHIN(((k < 5) ? 0.06 : 0.02) * LEVEL, smooth(curve.knot[k] / ONE, 0.005),
                                      curve.v[k] / ONE);
        }
        TEST_ASSERT_DOUBLE_WITHIN(0.02 * LEVEL, LEVEL, curve.level / ONE);
    }
}

/* A leg with output capacitance loses the whole dead time only if the current recharges the capacitance in time (CM-8).
 * Below `zone` the loss is proportional to the current, above it is 1 - zone/(2 i). Switches and diodes add a constant
 * and a slope. */
typedef struct {
    double dead, drop, slope, zone;
} leg_t;

static double leg_error(const leg_t *leg, double i)
{
    const double x = i / leg->zone;
    return leg->dead * ((x < 1.0) ? 0.5 * x : 1.0 - 0.5 / x) + leg->drop * fmin(x, 1.0) + leg->slope * i;
}

static double compensated(const commission_curve_t *curve, double knee, double i)
{
    return curve->level / ONE * fmin(i / knee, 1.0);
}

/* Amplitude of the fundamental of the remaining error along the current, from a quarter of a turn. */
static double fundamental(const leg_t *leg, const commission_curve_t *curve, double knee, double i)
{
    double sum = 0.0;
    for (int n = 0; n < 500; n++) {
        const double s = sin((n + 0.5) * 1.5707963267948966 / 500.0);
        const double e = leg_error(leg, i * s) - compensated(curve, knee, i * s);
        sum += s * e;
    }
    return 4.0 / 3.1415926535897932 * sum * 1.5707963267948966 / 500.0;
}

/* The result of commissioning such a leg at an angle; the knee is at least the previous one, 0.002 (0.8 A). */
static commission_curve_t commissioned(const leg_t *leg, double theta, double *knee)
{
    commission_data_t data;
    commission_curve_t curve;
    double c[3];
    twin_cosines(theta, c);
    for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
        const double i = 0.6 * pow(2.0, -6.0 + 0.5 * k);
        double u = R * i;
        for (int x = 0; x < 3; x++) {
            u += c[x] * leg_error(leg, c[x] * i) / 1.5;
            data.cosine[x] = fx_sat_q15((int32_t)lround(c[x] * 32768.0));
        }
        data.i[k] = q30(i);
        data.u[k] = q30(u);
    }
    TEST_ASSERT_TRUE(commission_fit(&data, &curve));
    *knee = fmax(0.002, commission_knee(&curve) / ONE);
    return curve;
}

/* Largest error of the fundamental as a share of the level, from the smallest current with identification (3 %) to the
 * largest. The linear part of the error counts as resistance. */
static double fundamental_error(const leg_t *leg)
{
    double worst = 0.0;
    for (double theta = 0.0; theta < 1.6; theta += 0.05) {
        double knee;
        const commission_curve_t curve = commissioned(leg, theta, &knee);
        for (double i = 0.018; i < 0.6; i *= 1.1) {
            const double remaining = fundamental(leg, &curve, knee, i) - (curve.r / ONE - R) * i;
            worst = worse_of(worst, fabs(remaining) / (4.0 / 3.1415926535897932 * LEVEL));
        }
    }
    return worst;
}

/* The same for the ten points of the curve. */
static double curve_error(const leg_t *leg)
{
    double worst = 0.0;
    for (double theta = 0.0; theta < 1.6; theta += 0.05) {
        double knee;
        const commission_curve_t curve = commissioned(leg, theta, &knee);
        for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
            const double i = curve.knot[k] / ONE;
            const double remaining = leg_error(leg, i) - (curve.r / ONE - R) * i - curve.v[k] / ONE;
            worst = worse_of(worst, fabs(remaining) / LEVEL);
        }
    }
    return worst;
}

/* 0.4, 0.8 and 2 A recharge the leg within the dead time: 2, 5 and 11 nF at 350 V and 2 us. The bounds are those of the
 * table in docs/theory/commissioning.md, section 3, rounded up. */
void test_level_and_knee_match_the_fundamental_of_a_leg_with_capacitance_drop_and_slope(void)
{
    const struct {
        double zone, error_max, curve_error_max;
    } legs[] = {{0.001, 0.03, 0.02}, {0.002, 0.05, 0.03}, {0.005, 0.11, 0.06}};
    for (unsigned n = 0; n < sizeof legs / sizeof legs[0]; n++) {
        const leg_t leg = {0.875 * LEVEL, 0.125 * LEVEL, 0.3 * R, legs[n].zone};
        TEST_ASSERT_DOUBLE_WITHIN(legs[n].error_max, 0.0, fundamental_error(&leg));
        TEST_ASSERT_DOUBLE_WITHIN(legs[n].curve_error_max, 0.0, curve_error(&leg));
    }
}

/* By hand: a straight line up to 0.0625 and a constant above it, with a knot every 0.0125. */
void test_the_knee_of_a_straight_line_is_its_end(void)
{
    commission_curve_t curve = {.level = q30(LEVEL)};
    for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
        const double i = 0.0125 * (k + 1.0);
        curve.knot[k] = q30(i);
        curve.v[k] = q30(LEVEL * fmin(i / 0.0625, 1.0));
    }
    /* Below the first knot the curve is taken as constant; a triangle of the area, 0.0125^2/0.0625 of the knee, is
     * missing. */
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.0625 - 0.0125 * 0.0125 / 0.0625, commission_knee(&curve) / ONE);
    curve.level = 0;
    TEST_ASSERT_EQUAL_INT32(0, commission_knee(&curve));
}

/* For a curve above its level the area is negative; for one that is 0 up to 0.9 the knee would be 1.8. */
void test_the_knee_is_limited_to_between_zero_and_one(void)
{
    commission_curve_t curve = {.level = q30(LEVEL)};
    for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
        curve.knot[k] = q30(0.18 * (k + 1.0));
        curve.v[k] = q30(1.5 * LEVEL);
    }
    TEST_ASSERT_EQUAL_INT32(0, commission_knee(&curve));
    for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
        curve.v[k] = 0;
    }
    TEST_ASSERT_EQUAL_INT32(q30(1.0) - 1, commission_knee(&curve));
}

/* A knot is the current of the phase with the largest cosine, rounded to nearest: for both a remainder above and one
 * below a half. */
void test_the_knots_are_the_currents_of_the_first_phase_to_half_a_count(void)
{
    for (int cosine = 28378; cosine <= 32767; cosine += 133) {
        twin_curve_t twin;
        commission_curve_t curve;
        commission_data_t data = measured(0.3, 1e-6, &twin);
        data.cosine[0] = (q15_t)cosine;
        TEST_ASSERT_TRUE(commission_fit(&data, &curve));
        for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
            TEST_ASSERT_DOUBLE_WITHIN(0.5, cosine / 32768.0 * data.i[k], curve.knot[k]);
        }
    }
}

/* The resistance is below Z_b in every machine; its format cannot represent more. */
void test_a_slope_of_one_or_more_is_refused(void)
{
    commission_curve_t curve;
    twin_curve_t twin;
    commission_data_t data = measured(0.3, 1e-6, &twin);
    for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
        data.u[k] = data.i[k] / 100 * 99;
    }
    TEST_ASSERT_TRUE(commission_fit(&data, &curve));
    TEST_ASSERT_DOUBLE_WITHIN(1e-5, 0.99, curve.r / ONE);
    for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
        data.u[k] = data.i[k];
    }
    TEST_ASSERT_FALSE(commission_fit(&data, &curve));
}

void test_currents_that_do_not_rise_and_a_falling_voltage_are_refused(void)
{
    twin_curve_t twin;
    commission_curve_t curve;
    commission_data_t data = measured(0.3, 0.02, &twin);
    data.i[4] = data.i[3];
    TEST_ASSERT_FALSE(commission_fit(&data, &curve));
    data = measured(0.3, 0.02, &twin);
    data.i[0] = 0;
    TEST_ASSERT_FALSE(commission_fit(&data, &curve));
    data = measured(0.3, 0.02, &twin);
    for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
        data.u[k] = -data.u[k];
    }
    TEST_ASSERT_FALSE(commission_fit(&data, &curve));
    TEST_ASSERT_EQUAL_INT32(0, curve.r);
}

/* A step of ten periods of a machine at standstill, with offsets of current and voltage. */
static commission_in_t response(void)
{
    const double i = state.i_ref.d, sign = (state.i_ref.d > 0) ? 1.0 : -1.0;
    const double u = R * (i - 40.0) + sign * 4.0 / 3.0 * LEVEL * 32768.0 + 25.0;
    return (commission_in_t){.sum_i = {10 * state.i_ref.d, 0}, .sum_u = {(int32_t)lround(10.0 * u), 0}, .acting = true};
}

static int run(void)
{
    int ms = 0;
    while (commission_runs(&state) && ms < 5000) {
        const commission_in_t in = response();
        TEST_ASSERT_EQUAL_INT32(0, state.i_ref.q);
        commission_step(&config, &state, &in);
        ms++;
    }
    return ms;
}

void test_commissioning_ends_after_two_seconds_without_current_and_the_offsets_cancel(void)
{
    commission_curve_t curve;
    TEST_ASSERT_EQUAL_INT(20 * (40 + 64), run());
    TEST_ASSERT_EQUAL_INT(COMMISSION_DONE, state.phase);
    TEST_ASSERT_EQUAL_INT32(0, state.i_ref.d);
    TEST_ASSERT_TRUE(commission_fit(&state.data, &curve));
    TEST_ASSERT_DOUBLE_WITHIN(2e-4, R, curve.r / ONE); /* rounding: a tenth of a count of voltage in each level */
    TEST_ASSERT_DOUBLE_WITHIN(2e-5, LEVEL, curve.level / ONE);
}

void test_every_second_level_is_doubled_and_each_level_is_used_with_both_polarities(void)
{
    TEST_ASSERT_INT_WITHIN(1, lround(0.6 * 512.0), state.i_ref.d);
    for (int k = 0; k < 104; k++) {
        const commission_in_t in = response();
        commission_step(&config, &state, &in);
    }
    TEST_ASSERT_INT_WITHIN(1, -lround(0.6 * 512.0), state.i_ref.d);
    for (int k = 0; k < 3 * 104; k++) {
        const commission_in_t in = response();
        commission_step(&config, &state, &in);
    }
    TEST_ASSERT_INT_WITHIN(1, lround(0.6 * 1024.0), state.i_ref.d);
}

/* Good steps for ms milliseconds, then a bad one. */
static commission_failure_t failure_after(int ms, commission_in_t bad)
{
    commission_start(&config, &state);
    for (int k = 0; k < ms; k++) {
        const commission_in_t in = response();
        commission_step(&config, &state, &in);
    }
    commission_step(&config, &state, &bad);
    TEST_ASSERT_EQUAL_INT32(0, state.i_ref.d);
    TEST_ASSERT_EQUAL_INT32(0, state.i_ref.q);
    TEST_ASSERT_FALSE(commission_runs(&state));
    return state.failure;
}

void test_commissioning_fails_if_the_rotor_moves_switching_stops_the_voltage_is_limited_or_the_current_is_wrong(void)
{
    const commission_in_t good = response();
    commission_in_t in = good;
    in.omega = -OMEGA_MAX - 1;
    TEST_ASSERT_EQUAL_INT(COMMISSION_MOVED, failure_after(10, in));
    in = good;
    in.acting = false;
    TEST_ASSERT_EQUAL_INT(COMMISSION_STOPPED, failure_after(10, in));
    in = good;
    in.limited = true;
    TEST_ASSERT_EQUAL_INT(COMMISSION_LIMITED, failure_after(50, in));
    in = good;
    in.sum_i.d = good.sum_i.d + 6000;
    TEST_ASSERT_EQUAL_INT(COMMISSION_CURRENT, failure_after(50, in));
    in = good;
    in.sum_i.q = -6000;
    TEST_ASSERT_EQUAL_INT(COMMISSION_CURRENT, failure_after(50, in));
}

/* The first current is measured with an error. 0.6 * 512 counts are 307; an eighth of it and 256 counts are allowed,
 * here as sums of ten periods. */
static bool accepts(int32_t error_d, int32_t error_q)
{
    commission_start(&config, &state);
    for (int k = 0; k < 50; k++) {
        const commission_in_t in = response();
        commission_step(&config, &state, &in);
    }
    commission_in_t in = response();
    in.sum_i.d += error_d;
    in.sum_i.q = error_q;
    commission_step(&config, &state, &in);
    return commission_runs(&state);
}

void test_the_current_may_differ_from_its_reference_by_an_eighth_and_256_counts(void)
{
    static const int32_t allowed = 10 * (307 / 8 + 256);
    for (int sign = -1; sign <= 1; sign += 2) {
        TEST_ASSERT_TRUE(accepts(sign * allowed, 0));
        TEST_ASSERT_FALSE(accepts(sign * (allowed + 1), 0));
        TEST_ASSERT_TRUE(accepts(0, sign * allowed));
        TEST_ASSERT_FALSE(accepts(0, sign * (allowed + 1)));
    }
}

void test_the_rotor_may_turn_as_fast_as_the_limit_in_either_direction(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        commission_in_t in = response();
        in.omega = sign * OMEGA_MAX;
        commission_step(&config, &state, &in);
        TEST_ASSERT_TRUE(commission_runs(&state));
    }
}

/* Of the whole range, so that every level is exact: 2^(-6 + k/2). 40 steps settle, 64 are measured. */
void test_ten_levels_in_both_polarities_last_104_steps_each(void)
{
    commission_config_t full = config;
    full.i_max = Q15_MAX;
    commission_start(&full, &state);
    for (int index = 0; index < 20; index++) {
        const int32_t level = (int32_t)lround(32768.0 * pow(2.0, -6.0 + 0.5 * (index / 2)));
        for (int k = 0; k < 104; k++) {
            TEST_ASSERT_EQUAL_INT32((index % 2 == 0) ? level : -level, state.i_ref.d);
            TEST_ASSERT_EQUAL_INT(0, state.i_ref.q);
            TEST_ASSERT_EQUAL_INT((k < 40) ? COMMISSION_SETTLE : COMMISSION_MEASURE, state.phase);
            const commission_in_t in = response();
            commission_step(&full, &state, &in);
        }
    }
    TEST_ASSERT_EQUAL_INT(COMMISSION_DONE, state.phase);
    TEST_ASSERT_EQUAL_INT(COMMISSION_GOOD, state.failure);
}

/* Only the measured steps count: while a current settles it may be another one. 640 periods are averaged; the gain and
 * the rounding of the sums make less than a tenth of a count. */
void test_the_data_are_the_means_of_current_and_voltage_over_the_measured_steps(void)
{
    while (commission_runs(&state)) {
        commission_in_t in = response();
        if (state.phase == COMMISSION_SETTLE) {
            in.sum_i.d += 1000;
            in.sum_u.d += 1000;
        }
        commission_step(&config, &state, &in);
    }
    for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
        const double i = round(0.6 * round(32768.0 * pow(2.0, -6.0 + 0.5 * k)));
        TEST_ASSERT_DOUBLE_WITHIN(0.1, i, state.data.i[k] / 32768.0);
        TEST_ASSERT_DOUBLE_WITHIN(0.1, R * i + 4.0 / 3.0 * LEVEL * 32768.0, state.data.u[k] / 32768.0);
    }
}

/* In all sectors, to a few counts. */
void test_the_angle_of_the_last_step_gives_the_cosines_of_the_phases(void)
{
    for (double theta = 0.0; theta < 6.3; theta += 0.1) {
        double c[3];
        twin_cosines(theta, c);
        commission_start(&config, &state);
        while (commission_runs(&state)) {
            commission_in_t in = response();
            in.theta = (uint32_t)(int64_t)llround(theta / 6.283185307179586 * 4294967296.0);
            commission_step(&config, &state, &in);
        }
        const q15_t *found = state.data.cosine; /* the largest first, the others in any order */
        TEST_ASSERT_DOUBLE_WITHIN(4.0, c[0] * 32768.0, found[0]);
        TEST_ASSERT_DOUBLE_WITHIN(4.0, c[1] * 32768.0, fmax(found[1], found[2]));
        TEST_ASSERT_DOUBLE_WITHIN(4.0, c[2] * 32768.0, fmin(found[1], found[2]));
    }
}

void test_after_the_end_nothing_changes_any_more(void)
{
    commission_in_t in = response();
    in.acting = false;
    commission_step(&config, &state, &in);
    const commission_state_t failed = state;
    in = response();
    for (int k = 0; k < 200; k++) {
        commission_step(&config, &state, &in);
    }
    TEST_ASSERT_EQUAL_MEMORY(&failed, &state, sizeof state);
    TEST_ASSERT_EQUAL_INT(COMMISSION_STOPPED, state.failure);
}

void test_while_a_current_settles_the_voltage_may_be_limited(void)
{
    commission_in_t in = response();
    in.limited = true;
    commission_step(&config, &state, &in);
    TEST_ASSERT_TRUE(commission_runs(&state));
}
