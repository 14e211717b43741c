/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "identify_fixture.h"
#include "unity.h"

/* The parts of the identification one by one: window, operating point, model, Kalman filter. */

static fixture_t f;
static identify_config_t c;
static const double one_q60 = 1152921504606846976.0;

void setUp(void)
{
    f = fixture();
    identify_fixture(&f, &c);
}

void tearDown(void)
{
}

/* The sample k of a window of n. */
static void sum_up(identify_window_t *window, const identify_sample_t *s, int k, int n)
{
    identify_window_add(window, s);
    if (k == n) {
        identify_window_end(window, s);
    }
}

void test_a_window_sums_its_samples_and_their_voltages_are_those_that_began_its_periods(void)
{
    identify_window_t window = {.sum_i = {3, 4}, .limited = 9, .last = {.u = {7, -7}, .i = {100, 0}}};
    identify_window_restart(&window);
    const flux_point_t flux = {.psi_d = 11, .psi_q = 22};
    for (int k = 1; k <= 10; k++) {
        const identify_sample_t s = {{100 + k, -k}, {10 * k, k}, &flux, 1000U * (uint32_t)k};
        if (k == 3) {
            identify_window_count_limited(&window);
        }
        sum_up(&window, &s, k, 10);
    }
    TEST_ASSERT_EQUAL_INT(1055, window.sum_i.d); /* 10 * 100 + 55 */
    TEST_ASSERT_EQUAL_INT(-55, window.sum_i.q);
    TEST_ASSERT_EQUAL_INT(550, window.sum_u.d);
    TEST_ASSERT_EQUAL_INT(7, window.first.u.d); /* sample 0 is the last one of the window before */
    TEST_ASSERT_EQUAL_INT(100, window.last.u.d);
    TEST_ASSERT_EQUAL_INT(22, window.last.psi.q);
    TEST_ASSERT_EQUAL_UINT32(10000U, window.last.theta);
    TEST_ASSERT_EQUAL_INT(1, window.limited);
    TEST_ASSERT_TRUE(window.acting);
}

void test_one_period_without_switching_invalidates_its_window_only(void)
{
    identify_window_t window = {0};
    identify_window_restart(&window);
    identify_window_invalidate(&window);
    sum_up(&window, &(identify_sample_t){.flux = &(flux_point_t){0}}, 1, 1);
    TEST_ASSERT_FALSE(window.acting);
    identify_window_restart(&window);
    TEST_ASSERT_TRUE(window.acting);
}

/* The mean of a current ramp is the mean of its ends. The voltage of a sample acts until the next one: a ramp from 0 by
 * 20 per sample acts in the ten periods as 0, 20, ... 180, with a mean of 90. */
void test_the_mean_is_trapezoidal_for_currents_and_that_of_constant_periods_for_voltages(void)
{
    identify_window_t window = {0};
    identify_window_restart(&window);
    const flux_point_t flux = {0};
    for (int k = 1; k <= 10; k++) {
        const identify_sample_t s = {{-200 * k, 100 * k}, {20 * k, -2000 * k}, &flux, 0};
        sum_up(&window, &s, k, 10);
    }
    const identify_point_t point = identify_point(&c, &window, 0);
    TEST_ASSERT_INT32_WITHIN(40, -1000 * 65536, point.i.d); /* rounding of mean_gain_q32: 4e-10 */
    TEST_ASSERT_INT32_WITHIN(40, 500 * 65536, point.i.q);
    TEST_ASSERT_INT32_WITHIN(40, 90 * 32768, point.u.d);
    TEST_ASSERT_INT32_WITHIN(40, -9000 * 32768, point.u.q);
    TEST_ASSERT_FALSE(point.valid); /* standstill */
}

/* At 0.9 pu the rotor of the fixture turns 0.563 times in a window, so that the angle alone would be ambiguous. */
void test_the_mean_speed_has_its_whole_turns_from_the_tracked_speed_and_the_rest_from_the_angle(void)
{
    const double true_pu = 0.9, tracked_pu = 0.87;
    const window_pair_t pair = steady_window(&f, (dq_q15_t){-2000, 4000}, true_pu, (dq_q15_t){0, 0});
    const identify_point_t point = identify_point(&c, &pair.fixed, (q31_t)(tracked_pu * 2147483648.0));
    TEST_ASSERT_DOUBLE_WITHIN(2e-5, true_pu, from_q31(point.omega)); /* turn_to_pu has 17 bits, applied to 0.03 */
    const identify_point_t above = identify_point(&c, &pair.fixed, (q31_t)(0.93 * 2147483648.0));
    TEST_ASSERT_DOUBLE_WITHIN(2e-5, true_pu, from_q31(above.omega));
}

/* Random and extreme samples, with the numbers of periods of PWM frequencies from 4 to 40 kHz: the sums are exact, the
 * means have the relative error of mean_gain_q32, below 1e-8. */
void test_the_mean_of_a_window_is_exact_for_any_number_of_periods(void)
{
    static const int counts[] = {4, 5, 8, 10, 22, 39, 40};
    uint64_t seed = 5;
    for (unsigned k = 0; k < sizeof counts / sizeof counts[0]; k++) {
        identify_fixture_of(&f, &c, counts[k]);
        for (int n = 0; n < 300; n++) {
            identify_window_t window = {0};
            identify_window_restart(&window);
            const flux_point_t flux = {0};
            double sum_i = 0.0, sum_u = 0.0, u_before = 0.0;
            int32_t i = 0, u = 0;
            for (int p = 1; p <= counts[k]; p++) {
                i = (n < 2) ? (n == 0 ? 32767 : -32768) : random_in(&seed, -32768, 32767);
                u = (n < 2) ? i : random_in(&seed, -32768, 32767);
                const identify_sample_t s = {{i, -i - 1}, {u, -u - 1}, &flux, 0};
                sum_up(&window, &s, p, counts[k]);
                sum_i += i;
                sum_u += u_before;
                u_before = u;
            }
            const identify_point_t point = identify_point(&c, &window, 0);
            const double mean_i = (sum_i - 0.5 * i) / counts[k], mean_u = sum_u / counts[k];
            TEST_ASSERT_DOUBLE_WITHIN(1e-8 + 2.0 / 2147483648.0, mean_i / 32768.0, from_q31(point.i.d));
            TEST_ASSERT_DOUBLE_WITHIN(1e-8 + 4.0 / 2147483648.0, mean_u / 32768.0, 2.0 * from_q31(point.u.d));
        }
    }
}

static void compare_points(int periods)
{
    worst_t u = {0}, i_m = {0}, w = {0};
    uint64_t seed = 7;
    identify_fixture_of(&f, &c, periods);
    for (int n = 0; n < 3000; n++) {
        const dq_q15_t i = {random_in(&seed, -26000, 2000), random_in(&seed, -18000, 18000)};
        const double omega = random_in(&seed, -95, 95) / 100.0;
        const window_pair_t pair = steady_window(&f, i, omega, (dq_q15_t){random_in(&seed, -300, 300), 0});
        const identify_point_t a = identify_point(&c, &pair.fixed, (q31_t)(omega * 2147483647.0));
        const twin_point_t b = twin_point(&f.si, &pair.twin, omega * f.w);
        worst_note(&u, from_q31(a.u.q) * 2.0 - b.u.q / f.v, "%d: %d %d", n, i.d, i.q);
        worst_note(&i_m, from_q15(a.i_m.q) - b.i_m.q / f.i, "%d: %d %d at %g", n, i.d, i.q, omega);
        worst_note(&w, from_q31(a.omega) - b.omega / f.w, "%g", omega);
        TEST_ASSERT_EQUAL(b.valid, a.valid);
    }
    ASSERT_WORST(u, 2e-6);
    ASSERT_WORST(i_m, 1.0 / 32768.0); /* rounded to q15 */
    ASSERT_WORST(w, 1e-6);
}

void test_points_agree_with_the_twin_over_the_range_and_for_any_number_of_periods(void)
{
    compare_points(4);
    compare_points(10);
    compare_points(17);
    compare_points(40);
}

void test_residuals_and_jacobian_rows_agree_with_the_twin_over_the_range(void)
{
    worst_t y = {0}, h = {0}, t = {0};
    uint64_t seed = 9;
    for (int n = 0; n < 3000; n++) {
        /* Currents for which flux and voltage are below 1. */
        const dq_q15_t i = {random_in(&seed, -14000, 1000), random_in(&seed, -7000, 7000)};
        const double omega = random_in(&seed, -95, 95) / 100.0;
        const window_pair_t pair = steady_window(&f, i, omega, (dq_q15_t){random_in(&seed, -300, 300), 100});
        const identify_point_t a = identify_point(&c, &pair.fixed, (q31_t)(omega * 2147483647.0));
        const identify_tables_t tables = tables_at(&f, a.i_m);
        identify_model_t m;
        identify_model(&c, &a, &tables, c.r0, &m);
        jacobian_row_t row;
        identify_torque_row(&c, &m, &row);
        const twin_model_t b =
            twin_model(&f.si,
                       &(twin_point_t){{from_q31(a.i.d) * f.i, from_q31(a.i.q) * f.i},
                                       {from_q31(a.u.d) * 2.0 * f.v, from_q31(a.u.q) * 2.0 * f.v},
                                       {from_q31(a.rate.d) * 2.0 * f.v, from_q31(a.rate.q) * 2.0 * f.v},
                                       {from_q15(a.i_m.d) * f.i, from_q15(a.i_m.q) * f.i},
                                       from_q31(a.omega) * f.w,
                                       from_q31(a.iron) * f.i / f.psi,
                                       0,
                                       true},
                       from_q31(c.r0) * f.z);
        worst_note(&y, from_q31(m.now.e.d) * 2.0 - b.y.d / f.v, "%d: d %d %d at %g", n, i.d, i.q, omega);
        worst_note(&y, from_q31(m.now.e.q) * 2.0 - b.y.q / f.v, "%d: q %d %d at %g", n, i.d, i.q, omega);
        for (int j = 0; j < IDENTIFY_STATES; j++) {
            worst_note(&h, from_q31(m.now.d.h_q30[j]) * 2.0 - b.d[j] / f.v, "%d: d, state %d", n, j);
            worst_note(&h, from_q31(m.now.q.h_q30[j]) * 2.0 - b.q[j] / f.v, "%d: q, state %d", n, j);
            worst_note(&t, from_q31(row.h_q30[j]) * 2.0 - b.torque[j] / (f.psi * f.i), "%d: torque, state %d", n, j);
        }
    }
    ASSERT_WORST(y, 1.5e-4); /* errors of q15: flux of the tables (2 LSB in both axes), quotient and products */
    ASSERT_WORST(h, 1e-5);
    ASSERT_WORST(t, 1e-5);
}

/* psi = (0.4, 0.2), i = (-0.1, 0.3), theta^2/12 = 0.02, l_d = 0.25, l_qq = 0.5:
 * 0.14 - 0.02 (0.14 + 0.4 0.2 (1/0.5 - 1/0.25)) = 0.14 - 0.02 (0.14 - 0.16) = 0.1404; with l_d = l_qq 0.1372. */
void test_the_mean_torque_of_a_period_by_hand(void)
{
    const double one = IDENTIFY_ONE_Q30;
    const identify_flux_t at = {{(int32_t)(0.4 * one), (int32_t)(0.2 * one)},
                                {(int32_t)(-0.1 * one), (int32_t)(0.3 * one)}};
    const int32_t chord = (int32_t)(0.02 * one);
    const double scale = ldexp(32768.0, -c.l_shift);
    const flux_inductances_t salient = {(int32_t)(0.25 * scale), (int32_t)(0.5 * scale)};
    const flux_inductances_t round = {(int32_t)(0.25 * scale), (int32_t)(0.25 * scale)};
    TEST_ASSERT_DOUBLE_WITHIN(2e-5, 0.1404, identify_mean_torque(&c, &salient, chord, &at) / one);
    TEST_ASSERT_DOUBLE_WITHIN(2e-5, 0.1372, identify_mean_torque(&c, &round, chord, &at) / one);
    TEST_ASSERT_DOUBLE_WITHIN(1e-8, 0.14, identify_mean_torque(&c, &salient, 0, &at) / one);
}

/* Against a sum over a thousand pieces of the chord, up to 0.37 rad per period. Tolerances: the rounding of the two
 * quotients, and at the highest speed the terms from theta^4 on, which the expansion omits. */
void test_the_mean_torque_agrees_with_a_sum_along_the_chord_of_the_flux(void)
{
    static const double omega[3] = {0.1, -0.47, 0.95}, tolerance[3] = {2e-5, 2e-5, 1e-4};
    for (int k = 0; k < 3; k++) {
        worst_t t = {0};
        uint64_t seed = 11;
        for (int n = 0; n < 1000; n++) {
            const dq_q15_t i = {random_in(&seed, -14000, 1000), random_in(&seed, -7000, 7000)};
            const window_pair_t pair = steady_window(&f, i, omega[k], (dq_q15_t){0, 0});
            const identify_point_t p = identify_point(&c, &pair.fixed, (q31_t)(omega[k] * 2147483647.0));
            const identify_tables_t tables = tables_at(&f, i);
            const identify_flux_t at = {{tables.flux.psi_d * 32768, tables.flux.psi_q * 32768},
                                        {i.d * 32768, i.q * 32768}};
            const int32_t mean = identify_mean_torque(&c, &tables.inductances, p.chord_q30, &at);
            const double expected = mean_on_the_chord(&f, i, from_q15(tables.flux.psi_d), from_q15(tables.flux.psi_q),
                                                      omega[k]);
            worst_note(&t, mean / (double)IDENTIFY_ONE_Q30 - expected, "%d %d at %g", i.d, i.q, omega[k]);
        }
        ASSERT_WORST(t, tolerance[k]);
    }
}

/* One state: h = 0.1, P = 1, r = 0.01 gives s = 0.02, k = 5; e = 0.02 changes x by 0.1, and P becomes 1 - 5 * 0.1. */
void test_an_update_of_one_state_by_hand(void)
{
    kalman_t kalman;
    kalman_reset(&kalman);
    const jacobian_row_t row = {{[IDENTIFY_FLUX] = (int32_t)(0.1 * IDENTIFY_ONE_Q30)}};
    const uint32_t report = kalman_update(&kalman, &row, (int32_t)(0.02 * IDENTIFY_ONE_Q30),
                                          (int32_t)(0.1 * IDENTIFY_ONE_Q30));
    TEST_ASSERT_DOUBLE_WITHIN(1e-5, 0.1, kalman.x_q27[IDENTIFY_FLUX] / (double)IDENTIFY_ONE_Q27);
    identify_state_t state = {.kalman = kalman};
    identify_record_t record;
    identify_record_get(&state, &record);
    TEST_ASSERT_DOUBLE_WITHIN(2e-5, 0.5, record.variance_q30[IDENTIFY_FLUX] / (double)IDENTIFY_ONE_Q30);
    TEST_ASSERT_EQUAL_INT32(IDENTIFY_ONE_Q30, record.variance_q30[IDENTIFY_LQ]);
    TEST_ASSERT_EQUAL_HEX32(0, report);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.01, kalman_output(&kalman, &row) / (double)IDENTIFY_ONE_Q30);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.005, (double)kalman_output_variance(&kalman, &row) / one_q60);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.01, (double)kalman_output_variance_prior(&row) / one_q60);
}

void test_an_innovation_beyond_the_gate_is_reported_and_the_state_is_clamped(void)
{
    kalman_t kalman;
    kalman_reset(&kalman);
    const jacobian_row_t row = {{[IDENTIFY_DROP] = (int32_t)(0.01 * IDENTIFY_ONE_Q30)}};
    const int32_t noise =
        (int32_t)(0.01 * IDENTIFY_ONE_Q30); /* the gate: e^2 > 8 h P h' + r = 8 * 1e-4 + 1e-4 = 0.03^2 */
    TEST_ASSERT_EQUAL_HEX32(0, kalman_update(&kalman, &row, (int32_t)(0.0296 * IDENTIFY_ONE_Q30), noise));
    kalman_reset(&kalman);
    TEST_ASSERT_EQUAL_HEX32(KALMAN_GATE_EXCEEDED,
                            kalman_update(&kalman, &row, (int32_t)(0.0304 * IDENTIFY_ONE_Q30), noise));
    uint32_t report = 0;
    for (int n = 0; n < 10; n++) {
        report |= kalman_update(&kalman, &row, IDENTIFY_ONE_Q30, noise / 10);
    }
    TEST_ASSERT_EQUAL_HEX32(KALMAN_CLAMPED | KALMAN_GATE_EXCEEDED, report);
    TEST_ASSERT_EQUAL_INT32(4 * IDENTIFY_ONE_Q27, kalman.x_q27[IDENTIFY_DROP]);
}

/* In 1/lambda updates x decreases by the factor e; P returns to the prior twice as fast. */
void test_without_measurements_the_parameters_return_to_their_priors(void)
{
    kalman_t kalman;
    kalman_reset(&kalman);
    kalman.x_q27[IDENTIFY_DROP] = IDENTIFY_ONE_Q27;
    kalman.p_q30[kalman_p_index(IDENTIFY_R, IDENTIFY_R)] = 0;
    kalman.p_q30[kalman_p_index(IDENTIFY_R, IDENTIFY_DROP)] = IDENTIFY_ONE_Q30 / 2;
    for (int n = 0; n < 5000; n++) { /* 5000 * 2e-4 = 1 */
        kalman_predict(&c, &kalman, false);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, exp(-1.0), kalman.x_q27[IDENTIFY_DROP] / (double)IDENTIFY_ONE_Q27);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 1.0 - exp(-2.0), kalman.p_q30[0] / (double)IDENTIFY_ONE_Q30);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.5 * exp(-2.0),
                              kalman.p_q30[kalman_p_index(IDENTIFY_R, IDENTIFY_DROP)] / (double)IDENTIFY_ONE_Q30);
    for (int n = 0; n < 60000; n++) {
        kalman_predict(&c, &kalman, true); /* with a winding sensor the prior of the resistance is sqrt(0.03) sigma */
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.03, kalman.p_q30[0] / (double)IDENTIFY_ONE_Q30);
}

static double smallest_pivot(const kalman_t *kalman)
{
    double a[IDENTIFY_STATES][IDENTIFY_STATES], least = 1.0;
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        for (unsigned l = 0; l < IDENTIFY_STATES; l++) {
            a[j][l] = kalman->p_q30[(j < l) ? kalman_p_index(j, l) : kalman_p_index(l, j)] / (double)IDENTIFY_ONE_Q30;
        }
    }
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        least = fmin(least, a[j][j]);
        for (unsigned l = j + 1U; l < IDENTIFY_STATES; l++) {
            for (unsigned m = j + 1U; m < IDENTIFY_STATES; m++) {
                a[l][m] -= a[l][j] * a[j][m] / a[j][j];
            }
        }
    }
    return least;
}

/* Rows of up to 2^-4 with small noise for an hour of updates: the pivots of an elimination stay positive. */
void test_the_covariance_stays_positive_and_agrees_with_the_twin(void)
{
    kalman_t kalman;
    twin_kalman_t twin;
    worst_t p = {0}, x = {0};
    uint64_t seed = 11;
    kalman_reset(&kalman);
    twin_kalman_reset(&twin);
    for (int n = 0; n < 360000; n++) {
        jacobian_row_t row = {{0}};
        double h[TWIN_STATES] = {0.0};
        for (int j = 0; j < IDENTIFY_STATES; j++) {
            row.h_q30[j] = random_in(&seed, -(1 << 26), 1 << 26);
            h[j] = row.h_q30[j] / (double)IDENTIFY_ONE_Q30;
        }
        const int32_t e = random_in(&seed, -(1 << 22), 1 << 22);
        const double noise_pu = (n % 2 == 0) ? 0.008 : 0.04;
        (void)kalman_update(&kalman, &row, e, (int32_t)(noise_pu * IDENTIFY_ONE_Q30));
        (void)twin_kalman_update(&twin, h, e / (double)IDENTIFY_ONE_Q30, noise_pu * noise_pu);
        kalman_predict(&c, &kalman, n % 3 == 0);
        twin_kalman_predict(&f.si, &twin, n % 3 == 0);
        if (n % 1000 == 0) {
            TEST_ASSERT_TRUE(smallest_pivot(&kalman) > 1e-5);
            worst_note(&p, kalman.p_q30[0] / (double)IDENTIFY_ONE_Q30 - twin.p[0][0], "update %d", n);
            for (int j = 0; j < IDENTIFY_STATES; j++) {
                worst_note(&x, kalman.x_q27[j] / (double)IDENTIFY_ONE_Q27 - twin.x[j], "update %d, state %d", n, j);
            }
        }
    }
    ASSERT_WORST(p, 1e-5);
    ASSERT_WORST(x, 1e-3); /* of the prior's standard deviation */
}
