/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <string.h>

#include "identify_fixture.h"
#include "unity.h"

/* The complete identification on the machine of fixture.h: parameters, conditions of an update, confidence. */

static fixture_t f;
static identify_config_t c;
static identify_state_t state;
static twin_identify_t twin;
static identify_out_t out;
static bool enabled;
static int16_t winding_dC;

/* steady_window() computes the voltages of a machine without iron loss. */
static void remove_iron_loss(void)
{
    c.iron_hysteresis = 0;
    c.iron_eddy = 0;
    f.si.iron_hysteresis = 0.0;
    f.si.iron_eddy = 0.0;
}

void setUp(void)
{
    f = fixture();
    identify_fixture(&f, &c);
    remove_iron_loss();
    identify_reset(&c, &state);
    twin_identify_reset(&f.si, &twin);
    enabled = true;
    winding_dC = TEMPERATURE_UNKNOWN;
}

void tearDown(void)
{
}

static int32_t noise_with(int limited)
{
    const window_pair_t pair = steady_window(&f, (dq_q15_t){-4000, 8000}, 0.3, (dq_q15_t){0, 0});
    identify_point_t point = identify_point(&c, &pair.fixed, (q31_t)(0.3 * 2147483647.0));
    const identify_tables_t tables = tables_at(&f, point.i_m);
    const identify_in_t in = {&point, &tables, winding_dC, enabled};
    point.limited = (uint8_t)limited;
    identify_reset(&c, &state);
    (void)identify_step(&c, &state, &in);
    return state.mean.noise_q30;
}

/* (ID-14): six times the noise if every period of the window has limited pulses, for any number of periods. */
void test_limited_pulses_increase_the_noise_by_their_share_of_the_window(void)
{
    static const int counts[] = {4, 10, 40};
    for (unsigned k = 0; k < sizeof counts / sizeof counts[0]; k++) {
        identify_fixture_of(&f, &c, counts[k]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-4, 6.0, noise_with(counts[k]) / (double)noise_with(0));
        TEST_ASSERT_DOUBLE_WITHIN(1e-4, 3.5, noise_with(counts[k] / 2) / (double)noise_with(0));
    }
}

/* Deviations of the true machine from the tables; extra() is their voltage. */
typedef struct {
    double magnet_pu, lq_scale, drop_pu;
} truth_t;

static dq_q15_t extra(dq_q15_t i, double omega, truth_t truth)
{
    const flux_point_t flux = flux_table_step(&f.flux_table, i);
    const double n = 1.0 / hypot(i.d, i.q);
    return (dq_q15_t){(int32_t)lround(-omega * (truth.lq_scale - 1.0) * flux.psi_q + truth.drop_pu * 32768.0 * i.d * n),
                      (int32_t)lround(omega * truth.magnet_pu * 32768.0 + truth.drop_pu * 32768.0 * i.q * n)};
}

static void run(dq_q15_t i, double omega, truth_t truth, int steps)
{
    const window_pair_t pair = steady_window(&f, i, omega, extra(i, omega, truth));
    const identify_point_t point = identify_point(&c, &pair.fixed, (q31_t)(omega * 2147483647.0));
    const twin_point_t si = twin_point(&f.si, &pair.twin, omega * f.w);
    const identify_tables_t tables = tables_at(&f, point.i_m);
    const identify_in_t in = {&point, &tables, winding_dC, enabled};
    const double winding_C = (winding_dC == TEMPERATURE_UNKNOWN) ? (double)NAN : winding_dC / 10.0;
    for (int n = 0; n < steps; n++) {
        out = identify_step(&c, &state, &in);
        twin_identify(&f.si, &twin, &si, winding_C, enabled);
    }
}

/* The given number of seconds with changing speeds and torques of both signs. */
static void drive(truth_t truth, int seconds)
{
    static const double speed[5] = {0.1, 0.25, 0.5, 0.8, 0.35};
    static const dq_q15_t current[4] = {{-4000, 8000}, {-8000, -9000}, {-2000, 4000}, {-9000, 2000}};
    for (int n = 0; n < 10 * seconds; n++) {
        run(current[n % 4], speed[n % 5], truth, 100);
    }
}

static double value(identify_index_t index)
{
    return from_q31(identify_value(&c, &state, index));
}

static const truth_t nominal = {0.0, 1.0, 0.0};
static const truth_t deviating = {-0.06, 1.05, 0.002};

static void assert_untouched(void)
{
    for (int j = 0; j < IDENTIFY_STATES; j++) {
        TEST_ASSERT_EQUAL_INT32(0, state.kalman.x_q27[j]);
    }
    TEST_ASSERT_EQUAL_INT32(0, state.kept.local.d);
    TEST_ASSERT_EQUAL_INT32(0, state.kept.local.q);
}

void test_magnet_flux_inductance_and_drop_are_identified_separately(void)
{
    drive(deviating, 30);
    TEST_ASSERT_DOUBLE_WITHIN(0.003, -0.06, value(IDENTIFY_FLUX)); /* half a per cent of the magnet flux of 0.53 */
    TEST_ASSERT_DOUBLE_WITHIN(0.005, 0.05, value(IDENTIFY_LQ));
    TEST_ASSERT_DOUBLE_WITHIN(0.0007, 0.002, value(IDENTIFY_DROP)); /* a third of its prior */
}

/* Tolerance: 0.5 % of the rated torque of 0.6 T_b. The magnet flux of the tables is 11 % wrong. */
void test_after_identification_the_torque_is_that_of_the_true_flux_at_other_operating_points(void)
{
    drive(deviating, 30);
    for (int n = 0; n < 4; n++) {
        const dq_q15_t i = {-3000 - 1500 * n, (n % 2 == 0) ? 9000 : -6000};
        run(i, 0.05 + 0.2 * n, deviating, 300);
        const flux_point_t flux = flux_table_step(&f.flux_table, i);
        const double psi_d = from_q15(flux.psi_d) - 0.06, psi_q = 1.05 * from_q15(flux.psi_q);
        const double expected = mean_on_the_chord(&f, i, psi_d, psi_q, 0.05 + 0.2 * n);
        TEST_ASSERT_DOUBLE_WITHIN(0.003, expected, from_q15(out.torque));
    }
}

void test_near_standstill_nothing_is_identified(void)
{
    run((dq_q15_t){-4000, 8000}, 0.019, deviating, 5000);
    assert_untouched();
}

void test_without_current_no_parameter_is_identified(void)
{
    run((dq_q15_t){-900, 300}, 0.3, (truth_t){-0.06, 1.0, 0.0}, 2000); /* 949 of 983 counts */
    for (int j = 0; j < IDENTIFY_STATES; j++) {
        TEST_ASSERT_EQUAL_INT32(0, state.kalman.x_q27[j]);
    }
}

void test_while_disabled_nothing_is_identified(void)
{
    enabled = false;
    drive(deviating, 2);
    assert_untouched();
}

void test_a_window_with_a_period_without_switching_is_not_used_for_identification(void)
{
    window_pair_t pair = steady_window(&f, (dq_q15_t){-4000, 8000}, 0.4, (dq_q15_t){0, 900});
    pair.fixed.acting = false;
    const identify_point_t point = identify_point(&c, &pair.fixed, (q31_t)(0.4 * 2147483647.0));
    const identify_tables_t tables = tables_at(&f, point.i_m);
    const identify_in_t in = {&point, &tables, TEMPERATURE_UNKNOWN, true};
    for (int n = 0; n < 500; n++) {
        (void)identify_step(&c, &state, &in);
    }
    assert_untouched();
}

/* One invalid step excludes all ten steps of an update. */
void test_an_update_needs_ten_valid_steps(void)
{
    const dq_q15_t i = {-4000, 8000};
    const window_pair_t pair = steady_window(&f, i, 0.4, (dq_q15_t){0, 900});
    identify_point_t point = identify_point(&c, &pair.fixed, (q31_t)(0.4 * 2147483647.0));
    const identify_tables_t tables = tables_at(&f, point.i_m);
    const identify_in_t in = {&point, &tables, TEMPERATURE_UNKNOWN, true};
    for (int n = 0; n < 100; n++) {
        point.valid = n % 10 != 4;
        (void)identify_step(&c, &state, &in);
    }
    TEST_ASSERT_EQUAL_INT32(0, state.kalman.x_q27[IDENTIFY_FLUX]);
}

/* The d axis in the tenth step, the q axis in the next one, the time update in the one after that, and nothing in any
 * other step; with a valid seal after each. */
void test_an_update_is_spread_over_three_steps(void)
{
    for (int n = 1; n <= 40; n++) {
        const kalman_t before = state.kalman;
        run((dq_q15_t){-4000, 8000}, 0.4, deviating, 1);
        const int step = n % 10;
        const bool is_due = n >= 10 && (step == 0 || step == 1 || step == 2);
        TEST_ASSERT_EQUAL_INT_MESSAGE(is_due, memcmp(&before, &state.kalman, sizeof before) != 0, "step");
        identify_check_parameters(&state);
        TEST_ASSERT_FALSE(state.damaged);
    }
}

/* An update seals what it has computed: damage that came before must be seen first, or it is sealed with the rest. */
void test_damaged_parameters_are_seen_before_each_part_of_an_update(void)
{
    for (int step = 10; step <= 12; step++) {
        identify_reset(&c, &state);
        run((dq_q15_t){-4000, 8000}, 0.4, nominal, step - 1);
        TEST_ASSERT_FALSE(state.damaged);
        state.kalman.x_q27[IDENTIFY_LQ] ^= 1 << 20;
        run((dq_q15_t){-4000, 8000}, 0.4, nominal, 1);
        TEST_ASSERT_TRUE(state.damaged);
    }
}

/* Without current and speed the noise is that of the voltage alone. Each step's tenth is rounded by half a count. */
void test_the_mean_of_ten_equal_steps_is_their_value_within_half_a_count_each(void)
{
    c.noise_voltage_q30 = IDENTIFY_ONE_Q30 - 10;
    run((dq_q15_t){0, 0}, 0.0, nominal, 10);
    TEST_ASSERT_INT32_WITHIN(5, c.noise_voltage_q30, state.mean.noise_q30);
}

/* Four standard deviations of a half. */
void test_the_value_of_a_parameter_is_limited_to_the_range_of_the_format(void)
{
    c.sigma[IDENTIFY_DROP] = 1 << 30;
    identify_set(&state, IDENTIFY_DROP, 4 * IDENTIFY_ONE_Q27);
    TEST_ASSERT_DOUBLE_WITHIN(1e-7, 1.0, value(IDENTIFY_DROP));
    identify_set(&state, IDENTIFY_DROP, -4 * IDENTIFY_ONE_Q27);
    TEST_ASSERT_DOUBLE_WITHIN(1e-7, -1.0, value(IDENTIFY_DROP));
}

/* 0.39 % per kelvin: 39 % more at 120 C. */
void test_the_winding_temperature_sets_the_prior_resistance_and_a_lost_sensor_keeps_it(void)
{
    winding_dC = 1200;
    run((dq_q15_t){0, 0}, 0.0, nominal, 10);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 1.39, (double)state.kept.r_prior / (double)c.r0);
    TEST_ASSERT_TRUE(state.kept.r_known);
    winding_dC = TEMPERATURE_UNKNOWN;
    run((dq_q15_t){0, 0}, 0.0, nominal, 10);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 1.39, (double)state.kept.r_prior / (double)c.r0);
    TEST_ASSERT_FALSE(state.kept.r_known);
}

/* Without identification T^ is the torque of the tables at the magnetising current. */
void test_with_nothing_identified_the_torque_is_that_of_the_tables_minus_the_iron_loss(void)
{
    const dq_q15_t i = {-4000, 8000};
    enabled = false;
    identify_fixture(&f, &c);
    run(i, 0.5, nominal, 1);
    const flux_point_t at_i = flux_table_step(&f.flux_table, i);
    /* (13 + 0.01 w)/1.5 A/Vs at half of w_b = 3927 rad/s: i_m = i + a (psi_q, -psi_d), counts of q15. */
    const double a = (13.0 + 0.01 * 0.5 * f.w) / 1.5 * f.psi / f.i;
    const dq_q15_t i_m = {(int32_t)lround(i.d + a * at_i.psi_q), (int32_t)lround(i.q - a * at_i.psi_d)};
    const flux_point_t flux = flux_table_step(&f.flux_table, i_m);
    const double expected = mean_on_the_chord(&f, i_m, from_q15(flux.psi_d), from_q15(flux.psi_q), 0.5);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, expected, from_q15(out.torque)); /* q15 of current, flux and torque */
}

void test_the_confidence_starts_at_zero_and_rises_within_half_a_second_after_identification(void)
{
    run((dq_q15_t){-4000, 8000}, 0.01, nominal, 1000);
    TEST_ASSERT_EQUAL_INT(0, state.kept.confidence);
    drive(nominal, 1);
    TEST_ASSERT_TRUE(state.kept.torque_certain);
    const q15_t before = state.kept.confidence;
    run((dq_q15_t){-4000, 8000}, 0.5, nominal, 10);
    TEST_ASSERT_INT_WITHIN(655, before, state.kept.confidence); /* 2 % per update: half a second for the full range */
    drive(nominal, 1);
    TEST_ASSERT_EQUAL_INT(Q15_MAX, state.kept.confidence);
}

typedef struct {
    double posterior, prior; /* (Vs A)^2 */
} variances_t;

/* Variance of the torque at this operating point, and with the tables alone, from the twin's covariance. */
static variances_t torque_variances(dq_q15_t i, double omega)
{
    const window_pair_t pair = steady_window(&f, i, omega, (dq_q15_t){0, 0});
    const twin_point_t point = twin_point(&f.si, &pair.twin, omega * f.w);
    const twin_model_t m = twin_model(&f.si, &point, f.si.r_ohm_20);
    variances_t v = {0.0, 0.0};
    for (int j = 0; j < TWIN_STATES; j++) {
        v.prior += m.torque[j] * m.torque[j];
        for (int l = 0; l < TWIN_STATES; l++) {
            v.posterior += m.torque[j] * twin.kalman.p[j][l] * m.torque[l];
        }
    }
    return v;
}

static double relative_variance(dq_q15_t i, double omega)
{
    const variances_t v = torque_variances(i, omega);
    return v.posterior / v.prior;
}

/* Compared in the third step of an update, in which it is computed. */
void test_the_variance_of_the_torque_is_stated_after_the_first_update(void)
{
    const dq_q15_t i = {-4000, 8000};
    TEST_ASSERT_EQUAL_INT32(Q31_MAX, state.torque_variance_q30); /* unknown */
    run(i, 0.3, nominal, 3012);
    const double expected = torque_variances(i, 0.3).posterior / (f.psi * f.i * f.psi * f.i);
    TEST_ASSERT_DOUBLE_WITHIN(0.01 * expected, expected, state.torque_variance_q30 / (double)IDENTIFY_ONE_Q30);
}

/* A torque of zero is certain whatever the parameters are; this must not raise the confidence for the torque that
 * follows. */
void test_without_torque_the_confidence_stays_zero_at_any_speed(void)
{
    static const double speed[4] = {0.0, 0.015, 0.3, -0.8};
    for (int n = 0; n < 4; n++) {
        run((dq_q15_t){0, 0}, speed[n], nominal, 2000);
        run((dq_q15_t){-100, 300}, speed[n], nominal, 2000); /* too little to identify anything */
        TEST_ASSERT_FALSE(state.kept.torque_certain);
        TEST_ASSERT_EQUAL_INT(0, state.kept.confidence);
    }
}

/* The confidence rises if the variance is below three eighths of that with the tables alone. One operating point at
 * increasing speeds reaches lower variances, on both sides of this level. */
void test_the_confidence_rises_below_three_eighths_of_the_prior_variance_and_not_above(void)
{
    const dq_q15_t i = {-4000, 8000};
    bool below = false, above = false;
    for (double omega = 0.022; omega < 0.3; omega *= 1.1) {
        identify_reset(&c, &state);
        twin_identify_reset(&f.si, &twin);
        run(i, omega, nominal, 20000);
        const double variance = relative_variance(i, omega);
        TEST_ASSERT_EQUAL_INT((variance < 0.375) ? Q15_MAX : 0, state.kept.confidence);
        below = below || (variance < 0.375 && variance > 0.3);
        above = above || (variance > 0.375 && variance < 0.45);
    }
    TEST_ASSERT_TRUE(below && above);
}

/* During a long stop the leak returns the variance to the prior. Below three quarters of it the confidence stays 1;
 * half a second after this level it is 0. */
void test_the_confidence_falls_above_three_quarters_of_the_prior_variance_and_not_before(void)
{
    const dq_q15_t i = {-4000, 8000};
    const double slow = 0.01; /* below the lowest speed of identification */
    drive(nominal, 3);
    double variance = relative_variance(i, slow);
    TEST_ASSERT_TRUE(variance < 0.375);
    for (int n = 0; n < 1000 && variance < 0.745; n++) {
        TEST_ASSERT_EQUAL_INT(Q15_MAX, state.kept.confidence);
        run(i, slow, nominal, 100);
        variance = relative_variance(i, slow);
    }
    TEST_ASSERT_TRUE(variance < 0.75);
    run(i, slow, nominal, 3000);
    TEST_ASSERT_TRUE(relative_variance(i, slow) < 0.78);
    TEST_ASSERT_EQUAL_INT(0, state.kept.confidence);
}

/* The voltage of a resolver that is 27 degrees off: half of the rotational voltage, perpendicular to it. No parameter
 * describes it. */
void test_a_persistent_mismatch_removes_the_confidence(void)
{
    drive(nominal, 3);
    TEST_ASSERT_EQUAL_INT(Q15_MAX, state.kept.confidence);
    const dq_q15_t i = {-4000, 8000};
    const flux_point_t flux = flux_table_step(&f.flux_table, i);
    const dq_q15_t extra_u = {(int32_t)(0.5 * 0.5 * flux.psi_d), (int32_t)(0.5 * 0.5 * flux.psi_q)};
    const window_pair_t pair = steady_window(&f, i, 0.5, extra_u);
    const identify_point_t point = identify_point(&c, &pair.fixed, (q31_t)(0.5 * 2147483647.0));
    const identify_tables_t tables = tables_at(&f, point.i_m);
    const identify_in_t in = {&point, &tables, TEMPERATURE_UNKNOWN, true};
    for (int n = 0; n < 1500; n++) {
        (void)identify_step(&c, &state, &in);
    }
    TEST_ASSERT_EQUAL_INT(0, state.kept.confidence);
}

/* 0.15 of the base voltage in one axis alone, more than six times the measurement noise of 0.008 + 0.5 * 0.03: the
 * innovation gate of that axis must be exceeded. */
void test_a_mismatch_in_either_axis_alone_removes_the_confidence(void)
{
    const dq_q15_t i = {-4000, 8000};
    for (int axis = 0; axis < 2; axis++) {
        setUp();
        drive(nominal, 3);
        TEST_ASSERT_EQUAL_INT(Q15_MAX, state.kept.confidence);
        const dq_q15_t extra_u = {(axis == 0) ? 5000 : 0, (axis == 1) ? 5000 : 0};
        const window_pair_t pair = steady_window(&f, i, 0.5, extra_u);
        const identify_point_t point = identify_point(&c, &pair.fixed, (q31_t)(0.5 * 2147483647.0));
        const identify_tables_t tables = tables_at(&f, point.i_m);
        const identify_in_t in = {&point, &tables, TEMPERATURE_UNKNOWN, true};
        for (int n = 0; n < 300; n++) {
            (void)identify_step(&c, &state, &in);
        }
        /* Only the gate of the d axis counts: a voltage along q may be caused by a changed magnet. */
        TEST_ASSERT_EQUAL_UINT8((axis == 0) ? 25 : 0, state.gate_exceeded_updates);
        TEST_ASSERT_GREATER_THAN_INT(16384, state.kept.mismatch_share);
        TEST_ASSERT_FALSE(state.kept.torque_certain);
    }
}

void test_the_count_of_updates_beyond_the_gate_is_cleared_by_a_good_update_and_without_one(void)
{
    state.gate_exceeded_updates = 7;
    drive(nominal, 3);
    TEST_ASSERT_EQUAL_UINT8(0, state.gate_exceeded_updates);
    state.gate_exceeded_updates = 7;
    run((dq_q15_t){0, 0}, 0.5, nominal, 20); /* too little current for an update */
    TEST_ASSERT_EQUAL_UINT8(0, state.gate_exceeded_updates);
}

/* The magnet is 7 standard deviations of its prior weaker than assumed. With so large a noise the innovation stays
 * within the gate; the parameter slowly reaches its limit of 4, and no parameter describes the rest. */
void test_a_parameter_at_its_limit_removes_the_confidence(void)
{
    c.noise_voltage_q30 = (int32_t)(0.2 * 1073741824.0);
    run((dq_q15_t){-4000, 8000}, 0.5, (truth_t){-0.42, 1.0, 0.0}, 20001); /* the q axis is applied in the next step */
    TEST_ASSERT_TRUE(state.kept.clamped);
    TEST_ASSERT_GREATER_THAN_INT(16384, state.kept.mismatch_share);
    TEST_ASSERT_FALSE(state.kept.torque_certain);
}

void test_a_limit_that_the_d_axis_alone_has_reached_counts_as_a_mismatch(void)
{
    const dq_q15_t i = {-4000, 8000};
    run(i, 0.5, nominal, 3000);
    while (state.steps != 0U) {
        run(i, 0.5, nominal, 1);
    }
    TEST_ASSERT_EQUAL_INT(0, state.kept.mismatch_share);
    state.kept.clamped = true; /* as the d axis leaves it to the q axis, which follows in the next step */
    identify_seal_kept(&state);
    run(i, 0.5, nominal, 1);
    TEST_ASSERT_GREATER_THAN_INT(0, state.kept.mismatch_share);
}

void test_a_limit_that_no_axis_reaches_any_more_is_cleared_by_the_next_update(void)
{
    run((dq_q15_t){-4000, 8000}, 0.5, nominal, 3005);
    state.kept.clamped = true;
    identify_seal_kept(&state);
    run((dq_q15_t){-4000, 8000}, 0.5, nominal, 5);
    TEST_ASSERT_FALSE(state.kept.clamped); /* by the d axis */
    run((dq_q15_t){-4000, 8000}, 0.5, nominal, 1);
    TEST_ASSERT_FALSE(state.kept.clamped); /* by the q axis */
}

/* 0.1 of it in each update: 16385 - 3277 * 16385 / 32768 = 16385 - 1638.6. */
void test_a_good_update_reduces_the_share_of_mismatches_by_its_rate(void)
{
    run((dq_q15_t){-4000, 8000}, 0.5, nominal, 3010);
    state.kept.mismatch_share = 16385;
    identify_seal_kept(&state);
    run((dq_q15_t){-4000, 8000}, 0.5, nominal, 1);
    TEST_ASSERT_EQUAL_INT(14746, state.kept.mismatch_share);
}

/* The share is set before the third step of an update, which compares it. */
void test_up_to_half_of_the_updates_may_be_mismatches(void)
{
    run((dq_q15_t){-4000, 8000}, 0.5, nominal, 3011);
    for (int beyond = 0; beyond < 2; beyond++) {
        TEST_ASSERT_TRUE(state.kept.torque_certain);
        state.kept.mismatch_share = (q15_t)(Q15(0.5) + beyond);
        identify_seal_kept(&state);
        run((dq_q15_t){-4000, 8000}, 0.5, nominal, 1);
        TEST_ASSERT_EQUAL(beyond == 0, state.kept.torque_certain);
        run((dq_q15_t){-4000, 8000}, 0.5, nominal, 9);
    }
}

/* The torque's change with the scale of the q axis' inductance, Q30: the only uncertain parameter. */
static int32_t torque_by_lq_alone(const identify_in_t *in)
{
    identify_model_t model;
    jacobian_row_t row;
    identify_model(&c, in->point, in->tables, state.kept.r_prior, &model);
    identify_torque_row(&c, &model, &row);
    return fx_abs_q31(row.h_q30[IDENTIFY_LQ]);
}

/* Whether the torque stays certain with this variance of the q axis' inductance, relative to its prior. */
static bool stays_certain(const identify_in_t *in, int32_t variance_q30)
{
    identify_reset(&c, &state);
    state.kalman = (kalman_t){{0}, {0}};
    state.kalman.p_q30[kalman_p_index(IDENTIFY_LQ, IDENTIFY_LQ)] = variance_q30;
    state.kept.torque_certain = true;
    identify_seal(&state);
    (void)identify_step(&c, &state, in);
    (void)identify_step(&c, &state, in);
    TEST_ASSERT_FALSE(state.damaged);
    return state.kept.torque_certain;
}

/* Three quarters of the prior's variance, and the deviation that is large against the torque: at either bound itself
 * the last decision holds. With a multiple of 4096 and without leak both are exact. */
void test_the_torque_becomes_uncertain_above_both_bounds_of_its_variance_and_not_at_them(void)
{
    const window_pair_t pair = steady_window(&f, (dq_q15_t){-4000, 4000}, 0.3, (dq_q15_t){0, 0});
    const identify_point_t point = identify_point(&c, &pair.fixed, (q31_t)(0.3 * 2147483647.0));
    const identify_tables_t tables = tables_at(&f, point.i_m);
    const identify_in_t in = {&point, &tables, TEMPERATURE_UNKNOWN, false};
    const q31_t sigma = c.sigma[IDENTIFY_LQ];
    memset(c.sigma, 0, sizeof c.sigma);
    memset(c.leak, 0, sizeof c.leak);
    c.sigma[IDENTIFY_LQ] = sigma;
    while (torque_by_lq_alone(&in) % 4096 != 0) {
        c.sigma[IDENTIFY_LQ]++;
    }
    c.confidence_full = c.confidence_none = c.torque_min = 1;
    TEST_ASSERT_TRUE(stays_certain(&in, IDENTIFY_ONE_Q30 / 4 * 3));
    TEST_ASSERT_FALSE(stays_certain(&in, IDENTIFY_ONE_Q30 / 4 * 3 + 4096));
    c.torque_min = 4096;
    c.confidence_none = (q15_t)(torque_by_lq_alone(&in) / 4096);
    TEST_ASSERT_TRUE(stays_certain(&in, IDENTIFY_ONE_Q30));
    c.confidence_none--;
    TEST_ASSERT_FALSE(stays_certain(&in, IDENTIFY_ONE_Q30));
}

/* With nothing identified the standard deviation of the torque is about a tenth of it. This is below a level of one
 * half, except without torque. */
void test_the_confidence_also_rises_if_the_uncertainty_is_small_relative_to_the_torque(void)
{
    enabled = false;
    run((dq_q15_t){-4000, 8000}, 0.5, nominal, 1000);
    TEST_ASSERT_EQUAL_INT(0, state.kept.confidence);
    c.confidence_full = Q15(0.5);
    c.confidence_none = Q15(0.6);
    run((dq_q15_t){0, 0}, 0.5, nominal, 1000);
    TEST_ASSERT_EQUAL_INT(0, state.kept.confidence);
    run((dq_q15_t){-4000, 8000}, 0.5, nominal, 1000);
    TEST_ASSERT_EQUAL_INT(Q15_MAX, state.kept.confidence);
}

/* At the corner speed the local flux error is half of a flux error that no parameter describes, far above it nearly
 * all. After 200 steps the filter has 1 - 0.95^200 of it. The large noise keeps the parameters constant. */
void test_the_weight_of_the_local_flux_error_rises_with_speed(void)
{
    const double corner = from_q15(c.local_corner), settled = 1.0 - pow(0.95, 200.0);
    static const double factor[3] = {0.25, 1.0, 3.0};
    c.noise_voltage_q30 = INT32_MAX;
    for (int n = 0; n < 3; n++) {
        identify_reset(&c, &state);
        const double w = factor[n] * corner;
        run((dq_q15_t){-4000, 8000}, w, (truth_t){-0.02, 1.0, 0.0}, 200);
        const double share = w * w / (w * w + corner * corner);
        TEST_ASSERT_DOUBLE_WITHIN(5e-4, -0.02 * share * settled, from_q31(state.kept.local.d) * 2.0);
    }
}

/* w/(w^2 + w_x^2) of 98 counts of q15 would be 334: the square is at least one count, which limits it to 98. */
void test_the_gain_of_the_local_flux_error_is_limited_at_very_low_speed(void)
{
    const double w = 98.0 / 32768.0;
    c.noise_voltage_q30 = INT32_MAX;
    c.omega_min = c.local_corner = 1;
    run((dq_q15_t){-4000, 8000}, w, (truth_t){-0.5, 1.0, 0.0}, 200);
    const double settled = 1.0 - pow(0.95, 200.0);
    TEST_ASSERT_DOUBLE_WITHIN(5e-3, 98.0 * w * -0.5 * settled, from_q31(state.kept.local.d) * 2.0);
}

/* Rounding of half a count stops the filter of 0.05 ten counts from its end. */
void test_without_a_valid_window_the_local_flux_error_returns_to_zero(void)
{
    enabled = false;
    for (int sign = -1; sign <= 1; sign += 2) {
        state.kept.local = (dq_q30_t){sign * (1 << 20), sign * (1 << 20)};
        identify_seal_kept(&state);
        run((dq_q15_t){-4000, 8000}, 0.5, nominal, 1000);
        TEST_ASSERT_INT32_WITHIN(10, 0, state.kept.local.d);
        TEST_ASSERT_INT32_WITHIN(10, 0, state.kept.local.q);
    }
}

/* The parameters are valid at every operating point: the flux changes by less than 1 % of the magnet flux. */
void test_a_torque_step_does_not_change_the_identified_flux(void)
{
    drive(deviating, 20);
    run((dq_q15_t){-300, 1500}, 0.4, deviating, 500);
    const double before = value(IDENTIFY_FLUX);
    run((dq_q15_t){-9000, 13000}, 0.4, deviating, 100);
    TEST_ASSERT_DOUBLE_WITHIN(0.0053, before, value(IDENTIFY_FLUX));
}

void test_the_identification_agrees_with_the_twin_for_a_minute(void)
{
    worst_t x = {0}, t = {0}, p = {0};
    winding_dC = 800;
    for (int n = 0; n < 60; n++) {
        drive(deviating, 1);
        for (int j = 0; j < IDENTIFY_STATES; j++) {
            const double sigmas = state.kalman.x_q27[j] / (double)IDENTIFY_ONE_Q27;
            worst_note(&x, sigmas - twin.kalman.x[j], "second %d, state %d", n, j);
        }
        worst_note(&p, state.kalman.p_q30[0] / (double)IDENTIFY_ONE_Q30 - twin.kalman.p[0][0], "second %d", n);
        worst_note(&t, from_q15(out.torque) - twin.torque / f.t, "second %d", n);
        TEST_ASSERT_EQUAL(twin.torque_certain, state.kept.torque_certain);
    }
    /* The residual has an error of 1.5e-4 (q15 of the tables' flux), which changes a state by at most 20 times that. */
    ASSERT_WORST(x, 0.02);
    ASSERT_WORST(p, 1e-4);
    ASSERT_WORST(t, 3e-4);
}

void test_bad_configurations_are_rejected(void)
{
    TEST_ASSERT_EQUAL_INT(MOTOR_CHECK_OK, identify_check(&c));
#define BAD(change) \
    do { \
        identify_config_t bad = c; \
        bad.change; \
        TEST_ASSERT_NOT_EQUAL_INT_MESSAGE(MOTOR_CHECK_OK, identify_check(&bad), #change); \
    } while (0)
    BAD(r0 = 0);
    BAD(rate_gain_q28 = 0);
    BAD(window_turns_q29 = 0);
    BAD(turn_to_pu = 0);
    BAD(noise_voltage_q30 = 1000);
    BAD(noise_flux_q30 = -1);
    BAD(noise_rate_q30 = -1);
    BAD(r_known_q30 = 0);
    BAD(r_known_q30 = IDENTIFY_ONE_Q30 + 1);
    BAD(l_shift = 15);
    BAD(omega_min = 0);
    BAD(i_min = 0);
    BAD(i_smooth = 0);
    BAD(i_smooth = 984);
    BAD(local_corner = 0);
    BAD(local_rate = 0);
    BAD(torque_min = 0);
    BAD(confidence_rate = 0);
    BAD(confidence_full = 0);
    BAD(confidence_full = 1966);
    BAD(sigma[IDENTIFY_LQ] = 0);
    BAD(leak[IDENTIFY_IRON] = 0);
    BAD(leak[IDENTIFY_R] = Q31(0.3));
}

static identify_record_t record_of(const identify_state_t *from)
{
    identify_record_t record;
    identify_record_get(from, &record);
    return record;
}

void test_the_parameters_survive_a_power_cycle_with_a_larger_variance(void)
{
    drive(deviating, 20);
    const identify_record_t record = record_of(&state);
    const double magnet = value(IDENTIFY_FLUX);
    identify_state_t restored;
    identify_reset(&c, &restored);
    TEST_ASSERT_TRUE(identify_record_restore(&restored, &record));
    const identify_record_t again = record_of(&restored);
    for (int j = 0; j < IDENTIFY_STATES; j++) {
        TEST_ASSERT_EQUAL_INT32(record.x_q27[j], again.x_q27[j]);
        TEST_ASSERT_TRUE(again.variance_q30[j] > record.variance_q30[j] || record.variance_q30[j] == IDENTIFY_ONE_Q30);
        TEST_ASSERT_TRUE(again.variance_q30[j] <= IDENTIFY_ONE_Q30);
    }
    TEST_ASSERT_EQUAL_INT32(IDENTIFY_ONE_Q30, again.variance_q30[IDENTIFY_R]); /* the winding may have cooled */
    TEST_ASSERT_EQUAL_INT32(record.variance_q30[IDENTIFY_FLUX] + IDENTIFY_ONE_Q30 / 4,
                            again.variance_q30[IDENTIFY_FLUX]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, magnet, from_q31(identify_value(&c, &restored, IDENTIFY_FLUX)));
    TEST_ASSERT_EQUAL_INT(Q15_MAX, restored.kept.confidence);
}

/* A restored magnet flux gets a quarter of its prior variance on top: an eighth is just too much for the level of three
 * eighths. The q axis gets hardly any. */
void test_a_record_with_a_large_variance_of_magnet_or_q_axis_starts_without_confidence(void)
{
    identify_record_t record = record_of(&state);
    for (int n = 0; n < 4; n++) {
        record.variance_q30[IDENTIFY_FLUX] = IDENTIFY_ONE_Q30 / 8 - (n & 1);
        record.variance_q30[IDENTIFY_LQ] = (n & 2) ? IDENTIFY_ONE_Q30 / 3 : IDENTIFY_ONE_Q30 / 2;
        TEST_ASSERT_TRUE(identify_record_restore(&state, &record));
        TEST_ASSERT_EQUAL_INT((n == 3) ? Q15_MAX : 0, state.kept.confidence);
    }
}

void test_a_record_of_another_version_or_out_of_range_is_refused_and_changes_nothing(void)
{
    drive(deviating, 1);
    const identify_record_t good = record_of(&state);
    identify_record_t bad[5] = {good, good, good, good, good};
    bad[0].version++;
    bad[1].x_q27[0] = 4 * IDENTIFY_ONE_Q27 + 1;
    bad[2].x_q27[6] = -4 * IDENTIFY_ONE_Q27 - 1;
    bad[3].variance_q30[2] = 0;
    bad[4].variance_q30[3] = IDENTIFY_ONE_Q30 + 1;
    for (int n = 0; n < 5; n++) {
        TEST_ASSERT_FALSE(identify_record_restore(&state, &bad[n]));
        const identify_record_t after = record_of(&state);
        TEST_ASSERT_EQUAL_MEMORY(&good, &after, sizeof good);
    }
}
