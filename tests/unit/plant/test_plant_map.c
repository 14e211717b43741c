/* SPDX-License-Identifier: Apache-2.0 */
#include "plant_bench.h"

#include <math.h>

#include "unity.h"

static plant_map_t *map;

void setUp(void)
{
    map = poly_map();
    TEST_ASSERT_NOT_NULL(map);
}

void tearDown(void)
{
    plant_map_destroy(map);
}

/* The slopes of a parabola are exact at the nodes, so that the interpolating cubic is this parabola. The fluxes are
 * below 1 Vs: 1e-14 is a few roundings. */
void test_quadratic_fluxes_are_reproduced_between_the_nodes(void)
{
    for (double id = -250.0; id <= 50.0; id += 7.3) {
        for (double iq = -250.0; iq <= 250.0; iq += 6.7) {
            double psi[2], d, q, jac[4];
            poly_flux(id, iq, psi);
            plant_map_flux(map, id, iq, &d, &q, jac);
            TEST_ASSERT_DOUBLE_WITHIN(1e-14, psi[0], d);
            TEST_ASSERT_DOUBLE_WITHIN(1e-14, psi[1], q);
            TEST_ASSERT_DOUBLE_WITHIN(1e-16, POLY_A - 2.0 * POLY_C * id, jac[0]);
            TEST_ASSERT_DOUBLE_WITHIN(1e-16, -2.0 * POLY_X * iq, jac[1]);
            TEST_ASSERT_DOUBLE_WITHIN(1e-16, -2.0 * POLY_X * iq, jac[2]);
            TEST_ASSERT_DOUBLE_WITHIN(1e-16, POLY_B - 2.0 * POLY_X * id, jac[3]);
        }
    }
}

/* 1 A beyond the edge the own slope has changed by 3.96 % of its difference from the constant slope far outside
 * ((1 - s)(1 - 3 s) - 1 with s = 1/(0.4 x 250)), and the cross slope by the factor 1 - 2/250^2. The tangent of the edge
 * is therefore accurate within 5 % x 0.2 mH x 1 A / 2 = 5 uVs. */
void test_just_outside_the_grid_the_flux_continues_with_the_slope_of_the_edge(void)
{
    double d, q, psi[2];
    poly_flux(50.0, -120.0, psi);
    plant_map_flux(map, 51.0, -120.0, &d, &q, NULL);
    TEST_ASSERT_DOUBLE_WITHIN(5e-6, psi[0] + POLY_A - 2.0 * POLY_C * 50.0, d);
    TEST_ASSERT_DOUBLE_WITHIN(5e-6, psi[1] - 2.0 * POLY_X * -120.0, q);
    poly_flux(-100.0, -250.0, psi);
    plant_map_flux(map, -100.0, -251.0, &d, &q, NULL);
    TEST_ASSERT_DOUBLE_WITHIN(5e-6, psi[0] + 2.0 * POLY_X * -250.0, d);
    TEST_ASSERT_DOUBLE_WITHIN(5e-6, psi[1] - (POLY_B - 2.0 * POLY_X * -100.0), q);
}

/* The cross slopes of the polynomial are equal, so that they decrease to zero within 250 A. The own slope beyond the
 * upper d edge tends to the mean over this edge, A - 2 C x 50 A. psi_q changes by 125 A, the integral of c(x) in
 * (PL-2), times the cross slope. */
void test_far_outside_the_grid_the_axes_are_decoupled_and_the_slopes_constant(void)
{
    for (double iq = -250.0; iq <= 250.0; iq += 50.0) {
        double d, q, psi[2], jac[4];
        poly_flux(50.0, iq, psi);
        plant_map_flux(map, 1000.0, iq, &d, &q, jac);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, POLY_A - 2.0 * POLY_C * 50.0, jac[0]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, jac[1]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, jac[2]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, POLY_B - 2.0 * POLY_X * (50.0 + 125.0), jac[3]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, psi[1] - 2.0 * POLY_X * 125.0 * iq, q);
    }
}

/* A map with uneven grid and no polynomial: values and slopes on both sides of every grid line are equal, edges
 * included. Over 1e-9 A the functions themselves change by < 1e-12 Vs and their slopes by < 1e-12 H. */
void test_value_and_slope_are_continuous_across_grid_lines_and_edges(void)
{
    const double id[] = {-200.0, -120.0, -50.0, 0.0, 20.0}, iq[] = {-200.0, -60.0, 0.0, 90.0, 200.0};
    double psi_d[5][5], psi_q[5][5];
    for (int i = 0; i < 5; i++) {
        for (int j = 0; j < 5; j++) {
            psi_d[i][j] = 0.07 + 3e-4 * id[i] - 0.008 * (1.0 - exp(-iq[j] * iq[j] / 1e4));
            psi_q[i][j] = 0.1 * tanh(iq[j] / 120.0) + 1e-4 * iq[j];
        }
    }
    plant_map_t *uneven = plant_map_create(id, 5, iq, 5, &psi_d[0][0], &psi_q[0][0]);
    TEST_ASSERT_NOT_NULL(uneven);
    for (int k = 0; k < 25; k++) {
        const double at_d = id[k / 5], at_q = iq[k % 5];
        const double near[4][4] = {{at_d - 1e-9, -33.0, at_d + 1e-9, -33.0},
                                   {-77.0, at_q - 1e-9, -77.0, at_q + 1e-9},
                                   {at_d - 1e-9, 260.0, at_d + 1e-9, 260.0},
                                   {50.0, at_q - 1e-9, 50.0, at_q + 1e-9}};
        for (int n = 0; n < 4; n++) {
            double a[2], b[2], ja[4], jb[4];
            plant_map_flux(uneven, near[n][0], near[n][1], &a[0], &a[1], ja);
            plant_map_flux(uneven, near[n][2], near[n][3], &b[0], &b[1], jb);
            for (int m = 0; m < 4; m++) {
                TEST_ASSERT_DOUBLE_WITHIN(1e-11, ja[m], jb[m]);
                TEST_ASSERT_DOUBLE_WITHIN(1e-11, a[m / 2], b[m / 2]);
            }
        }
    }
    plant_map_destroy(uneven);
}

/* Central difference over 1 mA: truncation ~ f''' h^2 < 1e-12 H, rounding 1e-16/1e-3. The points are not near the grid
 * lines, where the second derivative jumps. */
static void check_jacobian(const plant_map_t *m)
{
    const double h = 1e-3;
    for (double id = -263.3; id <= 80.0; id += 10.1) {
        for (double iq = -283.1; iq <= 280.0; iq += 10.3) {
            double jac[4], d, q, hi[2], lo[2];
            plant_map_flux(m, id, iq, &d, &q, jac);
            plant_map_flux(m, id + h, iq, &hi[0], &hi[1], NULL);
            plant_map_flux(m, id - h, iq, &lo[0], &lo[1], NULL);
            TEST_ASSERT_DOUBLE_WITHIN(2e-12, (hi[0] - lo[0]) / (2.0 * h), jac[0]);
            TEST_ASSERT_DOUBLE_WITHIN(2e-12, (hi[1] - lo[1]) / (2.0 * h), jac[2]);
            plant_map_flux(m, id, iq + h, &hi[0], &hi[1], NULL);
            plant_map_flux(m, id, iq - h, &lo[0], &lo[1], NULL);
            TEST_ASSERT_DOUBLE_WITHIN(2e-12, (hi[0] - lo[0]) / (2.0 * h), jac[1]);
            TEST_ASSERT_DOUBLE_WITHIN(2e-12, (hi[1] - lo[1]) / (2.0 * h), jac[3]);
        }
    }
}

void test_the_jacobian_is_the_derivative_of_the_flux(void)
{
    check_jacobian(map);
    plant_map_t *hsm1 = hsm1_map();
    TEST_ASSERT_NOT_NULL_MESSAGE(hsm1, "cannot read " HSM1_CSV);
    check_jacobian(hsm1);
    plant_map_destroy(hsm1);
}

static void check_axis(const plant_map_t *m)
{
    for (double iq = -300.0; iq <= 300.0; iq += 3.7) {
        double d, q, jac[4], slope;
        plant_map_flux(m, 0.0, iq, &d, &q, jac);
        TEST_ASSERT_DOUBLE_WITHIN(1e-15, d, plant_map_axis_flux(m, iq, &slope));
        TEST_ASSERT_DOUBLE_WITHIN(1e-16, jac[1], slope);
    }
}

void test_the_flux_at_zero_i_d_is_that_of_the_map(void)
{
    check_axis(map);
    plant_map_t *hsm1 = hsm1_map();
    TEST_ASSERT_NOT_NULL_MESSAGE(hsm1, "cannot read " HSM1_CSV);
    check_axis(hsm1);
    plant_map_destroy(hsm1);
}

/* Tolerance: a residual of 1e-10 Vs divided by the smallest incremental inductance, 0.1 mH, is 1e-6 A; doubled because
 * of the coupling. Start values: the origin and the four corners. */
static void round_trip(const plant_map_t *m, double id_hi)
{
    const double start[5][2] = {{0.0, 0.0}, {-250.0, -250.0}, {-250.0, 250.0}, {0.0, 250.0}, {0.0, -250.0}};
    for (double id = -270.0; id <= id_hi; id += 10.7) {
        for (double iq = -270.0; iq <= 270.0; iq += 9.9) {
            double d, q;
            plant_map_flux(m, id, iq, &d, &q, NULL);
            for (int s = 0; s < 5; s++) {
                double found_d = start[s][0], found_q = start[s][1];
                TEST_ASSERT_EQUAL(0, plant_map_invert(m, d, q, &found_d, &found_q));
                TEST_ASSERT_DOUBLE_WITHIN(2e-6, id, found_d);
                TEST_ASSERT_DOUBLE_WITHIN(2e-6, iq, found_q);
            }
        }
    }
}

void test_inversion_returns_every_current_of_the_plane_from_distant_start_values(void)
{
    round_trip(map, 80.0);
}

void test_inversion_returns_every_current_of_the_measured_machine(void)
{
    plant_map_t *hsm1 = hsm1_map();
    TEST_ASSERT_NOT_NULL_MESSAGE(hsm1, "cannot read " HSM1_CSV);
    round_trip(hsm1, 60.0);
    plant_map_destroy(hsm1);
}

/* If x . J x > 0 for every x, the flux difference of two points has a positive component along their current
 * difference, so that no two currents have the same flux. Outside the grid the smallest eigenvalue of the symmetric
 * part of J must be at least half of that inside. */
static void check_monotonic(const plant_map_t *m, double id_lo, double id_hi)
{
    double inside = INFINITY, outside = INFINITY;
    for (double id = -750.0; id <= 750.0; id += 3.1) {
        for (double iq = -750.0; iq <= 750.0; iq += 2.9) {
            double d, q, jac[4];
            plant_map_flux(m, id, iq, &d, &q, jac);
            const double eigenvalue = 0.5 * (jac[0] + jac[3] - hypot(jac[0] - jac[3], jac[1] + jac[2]));
            if (id >= id_lo && id <= id_hi && fabs(iq) <= 250.0) {
                inside = fmin(inside, eigenvalue);
            } else {
                outside = fmin(outside, eigenvalue);
            }
        }
    }
    TEST_ASSERT_TRUE(inside > 0.0);
    TEST_ASSERT_TRUE(outside > 0.5 * inside);
}

void test_the_flux_increases_in_every_direction_up_to_three_times_the_map(void)
{
    check_monotonic(map, -250.0, 50.0);
    plant_map_t *hsm1 = hsm1_map();
    TEST_ASSERT_NOT_NULL_MESSAGE(hsm1, "cannot read " HSM1_CSV);
    check_monotonic(hsm1, -250.0, 0.0);
    plant_map_destroy(hsm1);
}

/* From the origin and from the opposite corner; tolerance as in round_trip(). */
void test_inversion_returns_every_current_up_to_three_times_the_map(void)
{
    plant_map_t *hsm1 = hsm1_map();
    TEST_ASSERT_NOT_NULL_MESSAGE(hsm1, "cannot read " HSM1_CSV);
    for (int k = 0; k < 2; k++) {
        const plant_map_t *m = k ? hsm1 : map;
        for (double id = -750.0; id <= 750.0; id += 13.7) {
            for (double iq = -750.0; iq <= 750.0; iq += 12.3) {
                double d, q, found[2][2] = {{0.0, 0.0}, {copysign(750.0, -id), copysign(750.0, -iq)}};
                plant_map_flux(m, id, iq, &d, &q, NULL);
                for (int n = 0; n < 2; n++) {
                    TEST_ASSERT_EQUAL(0, plant_map_invert(m, d, q, &found[n][0], &found[n][1]));
                    TEST_ASSERT_DOUBLE_WITHIN(2e-6, id, found[n][0]);
                    TEST_ASSERT_DOUBLE_WITHIN(2e-6, iq, found[n][1]);
                }
            }
        }
    }
    plant_map_destroy(hsm1);
}

/* The gradient of a convex co-energy that saturates steeply along both diagonals. An extrapolation along the tangents
 * of its edges would become ambiguous within 100 A. The smallest slope is some uH, hence the tolerance of 1e-4 A. */
void test_a_map_that_saturates_steeply_at_its_edge_stays_invertible_beyond_it(void)
{
    double x[9], d[9][9], q[9][9];
    for (int i = 0; i < 9; i++) {
        x[i] = 50.0 * i - 200.0;
    }
    for (int i = 0; i < 9; i++) {
        for (int j = 0; j < 9; j++) {
            const double sum = x[i] + x[j], difference = x[i] - x[j];
            d[i][j] = 0.08 * tanh(sum / 160.0) + 0.03 * tanh(difference / 130.0) + 1e-5 * x[i];
            q[i][j] = 0.08 * tanh(sum / 160.0) - 0.03 * tanh(difference / 130.0) + 1e-5 * x[j];
        }
    }
    plant_map_t *bent = plant_map_create(x, 9, x, 9, &d[0][0], &q[0][0]);
    TEST_ASSERT_NOT_NULL(bent);
    for (double id = -800.0; id <= 800.0; id += 11.3) {
        for (double iq = -800.0; iq <= 800.0; iq += 11.9) {
            double psi_d, psi_q, jac[4], found_d = 0.0, found_q = 0.0;
            plant_map_flux(bent, id, iq, &psi_d, &psi_q, jac);
            TEST_ASSERT_TRUE(jac[0] > 0.0 && jac[3] > 0.0);
            TEST_ASSERT_TRUE(jac[0] * jac[3] - jac[1] * jac[2] > 0.0);
            TEST_ASSERT_EQUAL(0, plant_map_invert(bent, psi_d, psi_q, &found_d, &found_q));
            TEST_ASSERT_DOUBLE_WITHIN(1e-4, id, found_d);
            TEST_ASSERT_DOUBLE_WITHIN(1e-4, iq, found_q);
        }
    }
    plant_map_destroy(bent);
}

/* The inversion finds the currents or reports a failure; it never returns NaN. It may fail above 1e5 Vs, where the
 * spacing of double-precision numbers exceeds the tolerance. */
void test_no_finite_flux_or_current_gives_nan(void)
{
    plant_map_t *hsm1 = hsm1_map();
    TEST_ASSERT_NOT_NULL_MESSAGE(hsm1, "cannot read " HSM1_CSV);
    for (int k = 0; k < 2 * 616 * 8; k++) {
        const double size = ldexp(1.0, k / 16 - 308), turn = TWO_PI * (k % 16) / 16.0;
        double id = size * cos(turn), iq = size * sin(turn), psi_d, psi_q, jac[4];
        if (size < 1e300) {
            plant_map_flux(hsm1, id, iq, &psi_d, &psi_q, jac);
            TEST_ASSERT_TRUE(isfinite(psi_d) && isfinite(psi_q) && isfinite(jac[0] + jac[1]) &&
                             isfinite(jac[2] + jac[3]));
        }
        psi_d = id, psi_q = iq;
        id = iq = 0.0;
        const int failed = plant_map_invert(hsm1, psi_d, psi_q, &id, &iq);
        TEST_ASSERT_TRUE(isfinite(id) && isfinite(iq));
        TEST_ASSERT_TRUE(failed == 0 || size > 1e5);
    }
    plant_map_destroy(hsm1);
}

void test_inversion_fails_if_no_current_gives_the_flux(void)
{
    double id = 0.0, iq = 0.0;
    TEST_ASSERT_NOT_EQUAL(0, plant_map_invert(map, (double)NAN, 0.0, &id, &iq));
    id = (double)INFINITY;
    TEST_ASSERT_NOT_EQUAL(0, plant_map_invert(map, 0.05, 0.0, &id, &iq));
}

void test_bad_grids_are_refused(void)
{
    const double x[] = {-1.0, 0.0, 1.0}, falling[] = {-1.0, 1.0, 0.5}, twice[] = {0.0, 0.0, 1.0};
    const double d[] = {-1, -1, -1, 0, 0, 0, 1, 1, 1}, q[] = {-1, 0, 1, -1, 0, 1, -1, 0, 1};
    const double hole[] = {-1, -1, -1, 0, (double)NAN, 0, 1, 1, 1};
    const double back[] = {-1, 0, 1, -1, 0, -0.5, -1, 0, 1}; /* psi_q falls with i_q */
    const double level[] = {0, 0, 0, 0, 0, 0, 0, 0, 0};
    plant_map_t *good = plant_map_create(x, 3, x, 3, d, q);
    TEST_ASSERT_NOT_NULL(good);
    plant_map_destroy(good);
    TEST_ASSERT_NULL(plant_map_create(x, 1, x, 3, d, q));
    TEST_ASSERT_NULL(plant_map_create(x, 3, x, 1, d, q));
    TEST_ASSERT_NULL(plant_map_create(falling, 3, x, 3, d, q));
    TEST_ASSERT_NULL(plant_map_create(x, 3, falling, 3, d, q));
    TEST_ASSERT_NULL(plant_map_create(x, 3, twice, 3, d, q));
    TEST_ASSERT_NULL(plant_map_create(x, 3, x, 3, hole, q));
    TEST_ASSERT_NULL(plant_map_create(x, 3, x, 3, d, hole));
    TEST_ASSERT_NULL(plant_map_create(x, 3, x, 3, d, back));
    TEST_ASSERT_NULL(plant_map_create(x, 3, x, 3, level, q));
    TEST_ASSERT_NULL(plant_map_create(x, 3, x, 3, d, d)); /* psi_q depends on i_d only */
}

/* Both own inductances are positive, but det J = 1 x 1 - 2 x 2 < 0: two currents would have the same flux. */
void test_a_map_whose_axes_are_coupled_more_than_one_to_one_is_refused(void)
{
    const double x[] = {-1.0, 1.0};
    const double d[] = {-3, 1, -1, 3}, q[] = {-3, -1, 1, 3};
    TEST_ASSERT_NULL(plant_map_create(x, 2, x, 2, d, q));
}

/* The slopes at all four nodes are positive (1.495, 0.505, 0.505, 1.495), but the cubic between the middle nodes must
 * fall, because their values are nearly equal. Along either axis. */
void test_a_negative_slope_between_nodes_with_positive_slopes_is_found(void)
{
    const double x[] = {0.0, 1.0, 2.0, 3.0}, dip[] = {0.0, 1.0, 1.01, 2.01};
    double along_d[16], along_q[16], even_d[16], even_q[16];
    for (int k = 0; k < 16; k++) {
        along_d[k] = dip[k / 4];
        along_q[k] = dip[k % 4];
        even_d[k] = x[k / 4];
        even_q[k] = x[k % 4];
    }
    TEST_ASSERT_NULL(plant_map_create(x, 4, x, 4, along_d, even_q));
    TEST_ASSERT_NULL(plant_map_create(x, 4, x, 4, even_d, along_q));
    plant_map_t *even = plant_map_create(x, 4, x, 4, even_d, even_q);
    TEST_ASSERT_NOT_NULL(even);
    plant_map_destroy(even);
}
