/* SPDX-License-Identifier: Apache-2.0 */
#include "control/commission/commission.h"

#include <math.h>

#include "twin/twin_commission.h"
#include "unity.h"

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

/* A leg's error: an arc through zero that ends at the level. */
static double smooth(double i, double zone)
{
    return LEVEL * tanh(i / zone);
}

/* What ten levels at an angle measure, by the definition of the dq voltage (2/3 of the phases' projections). */
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

/* A few 2^-15 of the cosines, times the level, and the division's 2^-31. */
void test_a_smooth_curve_is_what_the_twin_finds(void)
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

/* The zone is half of the first knot. What lies below it counts as constant, which the first knots feel most. */
void test_the_curve_is_the_legs_own_within_a_few_percent(void)
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

/* A leg with output capacitance: the dead time is lost in full only if the current recharges it in time. Below the zone
 * the loss is linear, above it is 1 - zone/(2 i). Device and diode add a constant and a slope. */
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

/* Amplitude of the fundamental along the current, over the phase's quarter turn. */
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

/* The measurement of such a leg at an angle; the knee is not narrower than the one in effect, 0.002 (0.8 A). */
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

/* Largest share of the level by which the fundamental is missed, from the smallest current with identification
 * (3 %) to the largest; what the linear term holds is resistance to the drive. */
static double missed(const leg_t *leg)
{
    double worst = 0.0;
    for (double theta = 0.0; theta < 1.6; theta += 0.05) {
        double knee;
        const commission_curve_t curve = commissioned(leg, theta, &knee);
        for (double i = 0.018; i < 0.6; i *= 1.1) {
            const double left = fundamental(leg, &curve, knee, i) - (curve.r / ONE - R) * i;
            worst = fmax(worst, fabs(left) / (4.0 / 3.1415926535897932 * LEVEL));
        }
    }
    return worst;
}

/* The same for the ten points of the curve. */
static double missed_by_the_curve(const leg_t *leg)
{
    double worst = 0.0;
    for (double theta = 0.0; theta < 1.6; theta += 0.05) {
        double knee;
        const commission_curve_t curve = commissioned(leg, theta, &knee);
        for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
            const double i = curve.knot[k] / ONE;
            const double left = leg_error(leg, i) - (curve.r / ONE - R) * i - curve.v[k] / ONE;
            worst = fmax(worst, fabs(left) / LEVEL);
        }
    }
    return worst;
}

/* 0.4, 0.8 and 2 A recharge the leg within the dead time: 2, 5 and 12 nF at 350 V and 2 us. The level alone spreads by
 * 20 %; a quarter of that is what may be left of it. */
void test_level_and_knee_meet_the_fundamental_of_a_leg_with_capacitance_drop_and_slope(void)
{
    const struct {
        double zone, error_max, curve_error_max;
    } legs[] = {{0.001, 0.03, 0.02}, {0.002, 0.05, 0.03}, {0.005, 0.11, 0.06}};
    for (unsigned n = 0; n < sizeof legs / sizeof legs[0]; n++) {
        const leg_t leg = {0.875 * LEVEL, 0.125 * LEVEL, 0.3 * R, legs[n].zone};
        TEST_ASSERT_DOUBLE_WITHIN(legs[n].error_max, 0.0, missed(&leg));
        TEST_ASSERT_DOUBLE_WITHIN(legs[n].curve_error_max, 0.0, missed_by_the_curve(&leg));
    }
}

/* By hand: a line to 0.0625 that passes 0.0125, 0.025, 0.05 and the constant after it. */
void test_the_knee_of_a_straight_line_is_its_end(void)
{
    commission_curve_t curve = {.level = q30(LEVEL)};
    for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
        const double i = 0.0125 * (k + 1.0);
        curve.knot[k] = q30(i);
        curve.v[k] = q30(LEVEL * fmin(i / 0.0625, 1.0));
    }
    /* Half a knot's step is missing, the constant up to the first one: 0.0125^2/0.0625 of area, twice half of it. */
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.0625 - 0.0125 * 0.0125 / 0.0625, commission_knee(&curve) / ONE);
    curve.level = 0;
    TEST_ASSERT_EQUAL_INT32(0, commission_knee(&curve));
}

/* A curve that lies above its level has no area below it; one without voltage up to 0.9 would have its knee at 1.8. */
void test_a_knee_is_neither_negative_nor_beyond_one(void)
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

/* The resistance is below Z_b in every machine; a larger one would not fit its format. */
void test_a_slope_of_one_or_more_does_not_fit(void)
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

void test_currents_that_do_not_rise_and_a_falling_voltage_do_not_fit(void)
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
}

/* A machine at rest with offsets in both sensors; ten periods. */
static commission_in_t answer(void)
{
    const double i = state.i_ref.d, sign = (state.i_ref.d > 0) ? 1.0 : -1.0;
    const double u = R * (i - 40.0) + sign * 4.0 / 3.0 * LEVEL * 32768.0 + 25.0;
    return (commission_in_t){.sum_i = {10 * state.i_ref.d, 0}, .sum_u = {(int32_t)lround(10.0 * u), 0}, .acting = true};
}

static int run(void)
{
    int ms = 0;
    while (commission_runs(&state) && ms < 5000) {
        const commission_in_t in = answer();
        TEST_ASSERT_EQUAL_INT32(0, state.i_ref.q);
        commission_step(&config, &state, &in);
        ms++;
    }
    return ms;
}

void test_it_ends_after_two_seconds_with_no_current_and_offsets_cancelled(void)
{
    commission_curve_t curve;
    TEST_ASSERT_EQUAL_INT(20 * (40 + 64), run());
    TEST_ASSERT_EQUAL_INT(COMMISSION_DONE, state.phase);
    TEST_ASSERT_EQUAL_INT32(0, state.i_ref.d);
    TEST_ASSERT_TRUE(commission_fit(&state.data, &curve));
    TEST_ASSERT_DOUBLE_WITHIN(2e-4, R, curve.r / ONE); /* a tenth of a count of voltage in each level */
    TEST_ASSERT_DOUBLE_WITHIN(2e-5, LEVEL, curve.level / ONE);
}

void test_the_levels_double_every_second_time_and_both_polarities_are_used(void)
{
    TEST_ASSERT_INT_WITHIN(1, lround(0.6 * 512.0), state.i_ref.d);
    for (int k = 0; k < 104; k++) {
        const commission_in_t in = answer();
        commission_step(&config, &state, &in);
    }
    TEST_ASSERT_INT_WITHIN(1, -lround(0.6 * 512.0), state.i_ref.d);
    for (int k = 0; k < 3 * 104; k++) {
        const commission_in_t in = answer();
        commission_step(&config, &state, &in);
    }
    TEST_ASSERT_INT_WITHIN(1, lround(0.6 * 1024.0), state.i_ref.d);
}

static commission_failure_t after(int ms, commission_in_t wrong)
{
    commission_start(&config, &state);
    for (int k = 0; k < ms; k++) {
        const commission_in_t in = answer();
        commission_step(&config, &state, &in);
    }
    commission_step(&config, &state, &wrong);
    TEST_ASSERT_EQUAL_INT32(0, state.i_ref.d);
    TEST_ASSERT_FALSE(commission_runs(&state));
    return state.failure;
}

void test_it_fails_if_the_rotor_moves_switching_stops_the_voltage_is_limited_or_the_current_is_wrong(void)
{
    const commission_in_t good = answer();
    commission_in_t in = good;
    in.omega = -OMEGA_MAX - 1;
    TEST_ASSERT_EQUAL_INT(COMMISSION_MOVED, after(10, in));
    in = good;
    in.acting = false;
    TEST_ASSERT_EQUAL_INT(COMMISSION_STOPPED, after(10, in));
    in = good;
    in.limited = true;
    TEST_ASSERT_EQUAL_INT(COMMISSION_LIMITED, after(50, in));
    in = good;
    in.sum_i.d = good.sum_i.d + 6000;
    TEST_ASSERT_EQUAL_INT(COMMISSION_CURRENT, after(50, in));
    in = good;
    in.sum_i.q = -6000;
    TEST_ASSERT_EQUAL_INT(COMMISSION_CURRENT, after(50, in));
}

void test_while_a_current_settles_the_voltage_may_be_cut(void)
{
    commission_in_t in = answer();
    in.limited = true;
    commission_step(&config, &state, &in);
    TEST_ASSERT_TRUE(commission_runs(&state));
}
