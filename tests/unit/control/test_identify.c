/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "identify_fixture.h"
#include "unity.h"

/* The whole identification on the invented machine: what it identifies, when it does not, and its confidence. */

static fixture_t f;
static identify_config_t c;
static identify_state_t state;
static twin_identify_t twin;
static identify_out_t out;
static bool enabled;
static int16_t winding_dC;

/* steady_window() makes the voltages of a machine without iron loss. */
static void iron_free(void)
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
    iron_free();
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

/* (ID-14): five times more if every period of the window has them, whatever their number; rounding of a tenth. */
void test_pulses_that_the_bridge_cannot_make_add_noise_by_their_share_of_the_window(void)
{
    static const int counts[] = {4, 10, 40};
    for (unsigned k = 0; k < sizeof counts / sizeof counts[0]; k++) {
        identify_fixture_of(&f, &c, counts[k]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-4, 6.0, noise_with(counts[k]) / (double)noise_with(0));
        TEST_ASSERT_DOUBLE_WITHIN(1e-4, 3.5, noise_with(counts[k] / 2) / (double)noise_with(0));
    }
}

/* The machine's flux and drop differ from the tables: what the voltage shows of it. */
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

/* A drive through speeds and torques of both signs, as many seconds. */
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

static const truth_t nothing = {0.0, 1.0, 0.0};
static const truth_t wrong = {-0.06, 1.05, 0.002};

static void assert_untouched(void)
{
    for (int j = 0; j < IDENTIFY_STATES; j++) {
        TEST_ASSERT_EQUAL_INT32(0, state.kalman.x_q27[j]);
    }
    TEST_ASSERT_EQUAL_INT32(0, state.local.d);
    TEST_ASSERT_EQUAL_INT32(0, state.local.q);
}

void test_magnet_inductance_and_drop_are_told_apart_in_a_drive(void)
{
    drive(wrong, 30);
    TEST_ASSERT_DOUBLE_WITHIN(0.003, -0.06, value(IDENTIFY_FLUX)); /* half a per cent of the magnet's 0.53 */
    TEST_ASSERT_DOUBLE_WITHIN(0.005, 0.05, value(IDENTIFY_LQ));
    TEST_ASSERT_DOUBLE_WITHIN(0.0007, 0.002, value(IDENTIFY_DROP)); /* a third of its prior */
}

/* 0.5 % of the rated torque of the invented machine, 0.6 T_b, where the tables alone are 10 % wrong. */
void test_after_a_drive_the_torque_is_that_of_the_true_flux_everywhere(void)
{
    drive(wrong, 30);
    for (int n = 0; n < 4; n++) {
        const dq_q15_t i = {-3000 - 1500 * n, (n % 2 == 0) ? 9000 : -6000};
        run(i, 0.05 + 0.2 * n, wrong, 300);
        const flux_point_t flux = flux_table_step(&f.flux_table, i);
        const double psi_d = from_q15(flux.psi_d) - 0.06, psi_q = 1.05 * from_q15(flux.psi_q);
        const double expected = mean_on_the_chord(&f, i, psi_d, psi_q, 0.05 + 0.2 * n);
        TEST_ASSERT_DOUBLE_WITHIN(0.003, expected, from_q15(out.torque));
    }
}

void test_near_standstill_nothing_is_identified(void)
{
    run((dq_q15_t){-4000, 8000}, 0.019, wrong, 5000);
    assert_untouched();
}

void test_without_current_no_parameter_is_identified(void)
{
    run((dq_q15_t){-900, 300}, 0.3, (truth_t){-0.06, 1.0, 0.0}, 2000); /* 949 of 983 counts */
    for (int j = 0; j < IDENTIFY_STATES; j++) {
        TEST_ASSERT_EQUAL_INT32(0, state.kalman.x_q27[j]);
    }
}

void test_switched_off_nothing_is_identified(void)
{
    enabled = false;
    drive(wrong, 2);
    assert_untouched();
}

void test_a_period_without_the_bridge_is_not_used_for_identification(void)
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

/* One invalid step among ten excludes the ten from identification. */
void test_an_update_needs_all_of_its_steps(void)
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

/* 0.39 % per kelvin: 120 C is 39 % more; a lost sensor keeps the last temperature. */
void test_the_winding_temperature_is_the_priors_mean_and_a_lost_sensor_keeps_it(void)
{
    winding_dC = 1200;
    run((dq_q15_t){0, 0}, 0.0, nothing, 10);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 1.39, (double)state.r_prior / (double)c.r0);
    TEST_ASSERT_TRUE(state.r_known);
    winding_dC = TEMPERATURE_UNKNOWN;
    run((dq_q15_t){0, 0}, 0.0, nothing, 10);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 1.39, (double)state.r_prior / (double)c.r0);
    TEST_ASSERT_FALSE(state.r_known);
}

/* T^ with nothing identified is the tables' torque at the magnetising current. */
void test_with_nothing_identified_the_torque_is_the_tables_less_the_iron_loss(void)
{
    const dq_q15_t i = {-4000, 8000};
    enabled = false;
    identify_fixture(&f, &c);
    run(i, 0.5, nothing, 1);
    const flux_point_t at_i = flux_table_step(&f.flux_table, i);
    /* (13 + 0.01 w)/1.5 A/Vs at half of w_b = 3927 rad/s: i_m = i + a (psi_q, -psi_d), counts of q15. */
    const double a = (13.0 + 0.01 * 0.5 * f.w) / 1.5 * f.psi / f.i;
    const dq_q15_t i_m = {(int32_t)lround(i.d + a * at_i.psi_q), (int32_t)lround(i.q - a * at_i.psi_d)};
    const flux_point_t flux = flux_table_step(&f.flux_table, i_m);
    const double expected = mean_on_the_chord(&f, i_m, from_q15(flux.psi_d), from_q15(flux.psi_q), 0.5);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, expected, from_q15(out.torque)); /* q15 of current, flux and torque */
}

void test_confidence_starts_at_nothing_and_comes_with_knowledge_in_half_a_second(void)
{
    run((dq_q15_t){-4000, 8000}, 0.01, nothing, 1000);
    TEST_ASSERT_EQUAL_INT(0, state.confidence);
    drive(nothing, 1);
    TEST_ASSERT_TRUE(state.torque_certain);
    const q15_t before = state.confidence;
    run((dq_q15_t){-4000, 8000}, 0.5, nothing, 10);
    TEST_ASSERT_INT_WITHIN(655, before, state.confidence); /* 2 % per update: 10 ms of half a second */
    drive(nothing, 1);
    TEST_ASSERT_EQUAL_INT(Q15_MAX, state.confidence);
}

/* Share of the tables' torque variance that is left here, from the twin's covariance. */
static double left_of_variance(dq_q15_t i, double omega)
{
    const window_pair_t pair = steady_window(&f, i, omega, (dq_q15_t){0, 0});
    const twin_point_t point = twin_point(&f.si, &pair.twin, omega * f.w);
    const twin_model_t m = twin_model(&f.si, &point, f.si.r_ohm_20);
    double posterior = 0.0, prior = 0.0;
    for (int j = 0; j < TWIN_STATES; j++) {
        prior += m.torque[j] * m.torque[j];
        for (int l = 0; l < TWIN_STATES; l++) {
            posterior += m.torque[j] * twin.kalman.p[j][l] * m.torque[l];
        }
    }
    return posterior / prior;
}

/* No torque is certain to be no torque, whatever is known; it must not open the loop for the torque that follows. */
void test_without_torque_no_confidence_comes_at_any_speed(void)
{
    static const double speed[4] = {0.0, 0.015, 0.3, -0.8};
    for (int n = 0; n < 4; n++) {
        run((dq_q15_t){0, 0}, speed[n], nothing, 2000);
        run((dq_q15_t){-100, 300}, speed[n], nothing, 2000); /* too little to identify anything */
        TEST_ASSERT_FALSE(state.torque_certain);
        TEST_ASSERT_EQUAL_INT(0, state.confidence);
    }
}

/* Three eighths of the tables' variance must be left at most, approached from above at one point and speed by speed. */
void test_confidence_comes_when_a_point_has_told_five_eighths_and_not_before(void)
{
    const dq_q15_t i = {-4000, 8000};
    bool below = false, above = false;
    for (double omega = 0.022; omega < 0.3; omega *= 1.1) {
        identify_reset(&c, &state);
        twin_identify_reset(&f.si, &twin);
        run(i, omega, nothing, 20000);
        const double left = left_of_variance(i, omega);
        TEST_ASSERT_EQUAL_INT((left < 0.375) ? Q15_MAX : 0, state.confidence);
        below = below || (left < 0.375 && left > 0.3);
        above = above || (left > 0.375 && left < 0.45);
    }
    TEST_ASSERT_TRUE(below && above);
}

/* A long stop: the leak returns the parameters to their priors. Half a second after the upper level nothing is left,
 * before it all. */
void test_confidence_goes_when_three_quarters_of_the_information_are_lost_and_not_before(void)
{
    const dq_q15_t i = {-4000, 8000};
    const double slow = 0.01; /* nothing is identified */
    drive(nothing, 3);
    double left = left_of_variance(i, slow);
    TEST_ASSERT_TRUE(left < 0.375);
    for (int n = 0; n < 1000 && left < 0.745; n++) {
        TEST_ASSERT_EQUAL_INT(Q15_MAX, state.confidence);
        run(i, slow, nothing, 100);
        left = left_of_variance(i, slow);
    }
    TEST_ASSERT_TRUE(left < 0.75);
    run(i, slow, nothing, 3000);
    TEST_ASSERT_TRUE(left_of_variance(i, slow) < 0.78);
    TEST_ASSERT_EQUAL_INT(0, state.confidence);
}

/* A resolver that is 30 degrees off: no parameter explains it. */
void test_a_persistent_mismatch_takes_the_confidence_away(void)
{
    drive(nothing, 3);
    TEST_ASSERT_EQUAL_INT(Q15_MAX, state.confidence);
    const dq_q15_t i = {-4000, 8000};
    const flux_point_t flux = flux_table_step(&f.flux_table, i);
    const dq_q15_t turned = {(int32_t)(0.5 * 0.5 * flux.psi_d), (int32_t)(0.5 * 0.5 * flux.psi_q)};
    const window_pair_t pair = steady_window(&f, i, 0.5, turned);
    const identify_point_t point = identify_point(&c, &pair.fixed, (q31_t)(0.5 * 2147483647.0));
    const identify_tables_t tables = tables_at(&f, point.i_m);
    const identify_in_t in = {&point, &tables, TEMPERATURE_UNKNOWN, true};
    for (int n = 0; n < 1500; n++) {
        (void)identify_step(&c, &state, &in);
    }
    TEST_ASSERT_EQUAL_INT(0, state.confidence);
}

/* 0.15 of the base voltage in one axis alone, ten times the noise: the gate of that axis must see it. */
void test_a_mismatch_in_either_axis_alone_takes_the_confidence_away(void)
{
    const dq_q15_t i = {-4000, 8000};
    for (int axis = 0; axis < 2; axis++) {
        setUp();
        drive(nothing, 3);
        TEST_ASSERT_EQUAL_INT(Q15_MAX, state.confidence);
        const dq_q15_t more = {(axis == 0) ? 5000 : 0, (axis == 1) ? 5000 : 0};
        const window_pair_t pair = steady_window(&f, i, 0.5, more);
        const identify_point_t point = identify_point(&c, &pair.fixed, (q31_t)(0.5 * 2147483647.0));
        const identify_tables_t tables = tables_at(&f, point.i_m);
        const identify_in_t in = {&point, &tables, TEMPERATURE_UNKNOWN, true};
        for (int n = 0; n < 300; n++) {
            (void)identify_step(&c, &state, &in);
        }
        /* The voltage along d contradicts the current; one along q is a magnet that has changed. */
        TEST_ASSERT_EQUAL_UINT8((axis == 0) ? 25 : 0, state.contradicted_updates);
        TEST_ASSERT_GREATER_THAN_INT(16384, state.mismatch_share);
        TEST_ASSERT_FALSE(state.torque_certain);
    }
}

void test_a_mismatch_ends_with_the_updates(void)
{
    state.contradicted_updates = 7;
    drive(nothing, 3);
    TEST_ASSERT_EQUAL_UINT8(0, state.contradicted_updates);
    state.contradicted_updates = 7;
    run((dq_q15_t){0, 0}, 0.5, nothing, 20); /* too little current for an update */
    TEST_ASSERT_EQUAL_UINT8(0, state.contradicted_updates);
}

/* A magnet 7 standard deviations weaker than assumed, which so large a noise does not contradict: the estimate creeps
 * to its limit of 4 and what is left is in no parameter. */
void test_a_parameter_at_its_limit_takes_the_confidence_away(void)
{
    c.noise_voltage_q30 = (int32_t)(0.2 * 1073741824.0);
    run((dq_q15_t){-4000, 8000}, 0.5, (truth_t){-0.42, 1.0, 0.0}, 20000);
    TEST_ASSERT_TRUE(state.clamped);
    TEST_ASSERT_GREATER_THAN_INT(16384, state.mismatch_share);
    TEST_ASSERT_FALSE(state.torque_certain);
}

/* With nothing identified the torque is uncertain by about a tenth: enough where half of it may be wrong, but never at
 * no torque. */
void test_an_uncertainty_that_is_small_against_the_torque_is_confidence_enough(void)
{
    enabled = false;
    run((dq_q15_t){-4000, 8000}, 0.5, nothing, 1000);
    TEST_ASSERT_EQUAL_INT(0, state.confidence);
    c.confidence_full = Q15(0.5);
    c.confidence_none = Q15(0.6);
    run((dq_q15_t){0, 0}, 0.5, nothing, 1000);
    TEST_ASSERT_EQUAL_INT(0, state.confidence);
    run((dq_q15_t){-4000, 8000}, 0.5, nothing, 1000);
    TEST_ASSERT_EQUAL_INT(Q15_MAX, state.confidence);
}

/* At the corner speed half of an unexplained flux is taken, far above it all: with 20 steps the filter has 1 - 0.95^20
 * of it. Parameters are frozen by a huge noise. */
void test_the_local_flux_error_takes_over_with_speed(void)
{
    const double corner = from_q15(c.local_corner), settled = 1.0 - pow(0.95, 200.0);
    static const double factor[3] = {0.25, 1.0, 3.0};
    c.noise_voltage_q30 = INT32_MAX;
    for (int n = 0; n < 3; n++) {
        identify_reset(&c, &state);
        const double w = factor[n] * corner;
        run((dq_q15_t){-4000, 8000}, w, (truth_t){-0.02, 1.0, 0.0}, 200);
        const double share = w * w / (w * w + corner * corner);
        TEST_ASSERT_DOUBLE_WITHIN(5e-4, -0.02 * share * settled, from_q31(state.local.d) * 2.0);
    }
}

/* Knowledge of one operating point serves at once at another: no transient of the flux beyond 1 % of the magnet's. */
void test_a_torque_step_does_not_move_the_flux(void)
{
    drive(wrong, 20);
    run((dq_q15_t){-300, 1500}, 0.4, wrong, 500);
    const double before = value(IDENTIFY_FLUX);
    run((dq_q15_t){-9000, 13000}, 0.4, wrong, 100);
    TEST_ASSERT_DOUBLE_WITHIN(0.0053, before, value(IDENTIFY_FLUX));
}

void test_the_whole_agrees_with_the_twin_after_a_minute(void)
{
    worst_t x = {0}, t = {0}, p = {0};
    winding_dC = 800;
    for (int n = 0; n < 60; n++) {
        drive(wrong, 1);
        for (int j = 0; j < IDENTIFY_STATES; j++) {
            const double sigmas = state.kalman.x_q27[j] / (double)IDENTIFY_ONE_Q27;
            worst_note(&x, sigmas - twin.kalman.x[j], "second %d, state %d", n, j);
        }
        worst_note(&p, state.kalman.p_q30[0] / (double)IDENTIFY_ONE_Q30 - twin.kalman.p[0][0], "second %d", n);
        worst_note(&t, from_q15(out.torque) - twin.torque / f.t, "second %d", n);
        TEST_ASSERT_EQUAL(twin.torque_certain, state.torque_certain);
    }
    /* The residual is 1.5e-4 off (q15 of the table's flux); a state answers with sigma/h of it, 1/0.05 at most. */
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

void test_what_was_identified_survives_a_power_cycle_with_less_certainty(void)
{
    drive(wrong, 20);
    const identify_record_t record = identify_record_get(&state);
    const double magnet = value(IDENTIFY_FLUX);
    identify_state_t restored;
    identify_reset(&c, &restored);
    TEST_ASSERT_TRUE(identify_record_restore(&restored, &record));
    const identify_record_t again = identify_record_get(&restored);
    for (int j = 0; j < IDENTIFY_STATES; j++) {
        TEST_ASSERT_EQUAL_INT32(record.x_q27[j], again.x_q27[j]);
        TEST_ASSERT_TRUE(again.variance_q30[j] > record.variance_q30[j] || record.variance_q30[j] == IDENTIFY_ONE_Q30);
        TEST_ASSERT_TRUE(again.variance_q30[j] <= IDENTIFY_ONE_Q30);
    }
    TEST_ASSERT_EQUAL_INT32(IDENTIFY_ONE_Q30, again.variance_q30[IDENTIFY_R]); /* the winding has cooled */
    TEST_ASSERT_EQUAL_INT32(record.variance_q30[IDENTIFY_FLUX] + IDENTIFY_ONE_Q30 / 4,
                            again.variance_q30[IDENTIFY_FLUX]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, magnet, from_q31(identify_value(&c, &restored, IDENTIFY_FLUX)));
    TEST_ASSERT_EQUAL_INT(Q15_MAX, restored.confidence);
}

/* The magnet's quarter on top of an eighth is the level; the q axis has hardly changed. */
void test_a_record_that_knows_too_little_of_magnet_or_q_axis_is_not_trusted_at_once(void)
{
    identify_record_t record = identify_record_get(&state);
    for (int n = 0; n < 4; n++) {
        record.variance_q30[IDENTIFY_FLUX] = IDENTIFY_ONE_Q30 / 8 - (n & 1);
        record.variance_q30[IDENTIFY_LQ] = (n & 2) ? IDENTIFY_ONE_Q30 / 3 : IDENTIFY_ONE_Q30 / 2;
        TEST_ASSERT_TRUE(identify_record_restore(&state, &record));
        TEST_ASSERT_EQUAL_INT((n == 3) ? Q15_MAX : 0, state.confidence);
    }
}

void test_a_foreign_record_is_refused_and_changes_nothing(void)
{
    drive(wrong, 1);
    const identify_record_t good = identify_record_get(&state);
    identify_record_t bad[5] = {good, good, good, good, good};
    bad[0].version++;
    bad[1].x_q27[0] = 4 * IDENTIFY_ONE_Q27 + 1;
    bad[2].x_q27[6] = -4 * IDENTIFY_ONE_Q27 - 1;
    bad[3].variance_q30[2] = 0;
    bad[4].variance_q30[3] = IDENTIFY_ONE_Q30 + 1;
    for (int n = 0; n < 5; n++) {
        TEST_ASSERT_FALSE(identify_record_restore(&state, &bad[n]));
        const identify_record_t still = identify_record_get(&state);
        TEST_ASSERT_EQUAL_MEMORY(&good, &still, sizeof good);
    }
}
