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

/* A parabola's slopes at the nodes are exact, so a cubic through them is the parabola; the values
 * are below 1 Vs: 1e-14 is a few roundings. */
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

/* The edge value and the edge slope of the polynomial, straight on: beyond i_d = 50 A by x and
 * beyond i_q = 250 A by y, the corner term x y included. */
void test_outside_the_grid_every_section_runs_on_with_its_edge_slope(void)
{
    const double x = 70.0, y = 40.0;
    double d, q, psi[2];
    poly_flux(50.0, -120.0, psi);
    plant_map_flux(map, 50.0 + x, -120.0, &d, &q, NULL);
    TEST_ASSERT_DOUBLE_WITHIN(1e-14, psi[0] + x * (POLY_A - 2.0 * POLY_C * 50.0), d);
    TEST_ASSERT_DOUBLE_WITHIN(1e-14, psi[1] + x * (-2.0 * POLY_X * -120.0), q);
    poly_flux(50.0, 250.0, psi);
    plant_map_flux(map, 50.0 + x, 250.0 + y, &d, &q, NULL);
    TEST_ASSERT_DOUBLE_WITHIN(
        1e-14, psi[0] + x * (POLY_A - 2.0 * POLY_C * 50.0) + y * (-2.0 * POLY_X * 250.0), d);
    TEST_ASSERT_DOUBLE_WITHIN(1e-14,
                              psi[1] + x * (-2.0 * POLY_X * 250.0) +
                                  y * (POLY_B - 2.0 * POLY_X * 50.0) - x * y * 2.0 * POLY_X,
                              q);
}

/* An uneven, non-polynomial map: values and slopes either side of every grid line agree, the edges
 * included. 1e-9 A away the smooth functions move by < 1e-12 Vs and their slopes by < 1e-12 H. */
void test_value_and_slope_are_continuous_across_grid_lines_and_edges(void)
{
    const double id[] = {-200.0, -120.0, -50.0, 0.0, 20.0},
                 iq[] = {-200.0, -60.0, 0.0, 90.0, 200.0};
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

/* Central difference over 1 mA: truncation ~ f''' h^2 < 1e-12 H, rounding 1e-16/1e-3. The points
 * keep clear of the grid lines, where the second derivative jumps. */
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

void test_the_flux_on_the_q_axis_is_that_of_the_map(void)
{
    check_axis(map);
    plant_map_t *hsm1 = hsm1_map();
    TEST_ASSERT_NOT_NULL_MESSAGE(hsm1, "cannot read " HSM1_CSV);
    check_axis(hsm1);
    plant_map_destroy(hsm1);
}

/* Residual 1e-10 Vs over the smallest incremental inductance, 0.1 mH: 1e-6 A, doubled for the
 * coupling. Starts: the origin and all four corners. */
static void round_trip(const plant_map_t *m, double id_hi)
{
    const double start[5][2] = {
        {0.0, 0.0}, {-250.0, -250.0}, {-250.0, 250.0}, {0.0, 250.0}, {0.0, -250.0}};
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

void test_inversion_returns_every_current_of_the_plane_from_cold_starts(void)
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

void test_inversion_says_so_when_no_current_gives_the_flux(void)
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
    TEST_ASSERT_NULL(plant_map_create(x, 3, x, 3, d, d)); /* psi_q follows i_d only */
}

/* Both own inductances positive, yet 1 x 1 - 2 x 2 < 0: two currents would share one flux. */
void test_a_map_whose_axes_are_coupled_more_than_one_to_one_is_refused(void)
{
    const double x[] = {-1.0, 1.0};
    const double d[] = {-3, 1, -1, 3}, q[] = {-3, -1, 1, 3};
    TEST_ASSERT_NULL(plant_map_create(x, 2, x, 2, d, q));
}

/* Steep, flat, steep: the slopes at all four nodes are positive (1.495, 0.505, 0.505, 1.495), but
 * the cubic between the middle ones must fall. Along either axis. */
void test_a_dip_between_good_nodes_is_found(void)
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
