/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "control/current/flux_table.h"
#include "fixture.h"
#include "unity.h"
#include "worst.h"

static fixture_t f;

void setUp(void)
{
    f = fixture();
}

void tearDown(void)
{
}

static twin_dq_t amperes(dq_q15_t i)
{
    return (twin_dq_t){from_q15(i.d) * f.i, from_q15(i.q) * f.i};
}

/* Tolerances in LSB. Table values: one rounding (0.5), and 2^-15 of the mixed difference of the four nodes (below 0.1)
 * from the interpolation weights. psi = psi_f0 + l i with unrounded l: 0.6 + 0.5, and the error of l times |i| < 1 and
 * 2^l_shift = 4. */
static void compare_with_twin(worst_t *value, worst_t *flux, dq_q15_t i)
{
    const flux_point_t y = flux_table_step(&f.flux_table, i);
    const flux_inductances_t x = flux_table_inductances(&f.flux_table, i);
    const twin_flux_t t = twin_flux_table(&f.si, amperes(i));
    const double l = 32768.0 / f.l / (1 << f.flux_table.l_shift);
    const double g = 32768.0 * f.z;
    const double psi = 32768.0 / f.psi;
    worst_note(value, x.l_d - t.l_d * l, "l_d of %d %d", i.d, i.q);
    worst_note(value, x.l_qq - t.l_qq * l, "l_qq of %d %d", i.d, i.q);
    worst_note(value, y.psi_f0 - t.psi_f0 * psi, "psi_f0 of %d %d", i.d, i.q);
    /* The nodes of g are themselves rounded by up to 0.5. */
    worst_note(value, worse_of(0.0, fabs(y.g - 0.5 * (t.g_d + t.g_q) * g) - 0.5), "g of %d %d", i.d, i.q);
    worst_note(flux, y.psi_d - twin_clamp(t.psi_d * psi, -32768, 32767), "psi_d of %d %d", i.d, i.q);
    worst_note(flux, y.psi_q - twin_clamp(t.psi_q * psi, -32768, 32767), "psi_q of %d %d", i.d, i.q);
    TEST_ASSERT_EQUAL(t.clamped, flux_table_outside(&f.flux_table, i));
}

void test_the_whole_current_plane_follows_the_twin(void)
{
    worst_t value = {0};
    worst_t flux = {0};
    uint64_t seed = 41;
    for (int d = -32768; d <= 32767; d += 257) {
        for (int q = -32768; q <= 32767; q += 255) {
            compare_with_twin(&value, &flux, (dq_q15_t){(q15_t)d, (q15_t)q});
        }
    }
    for (int n = 0; n < 100000; n++) {
        compare_with_twin(&value, &flux,
                          (dq_q15_t){(q15_t)random_in(&seed, -32768, 32767), (q15_t)random_in(&seed, -32768, 32767)});
    }
    compare_with_twin(&value, &flux, (dq_q15_t){INT16_MIN, INT16_MIN});
    compare_with_twin(&value, &flux, (dq_q15_t){INT16_MAX, INT16_MIN});
    ASSERT_WORST(value, 0.6);
    ASSERT_WORST(flux, 3.6);
}

void test_at_a_node_the_result_is_exactly_the_tabulated_value(void)
{
    const int nx = (int)(f.flux_table.mesh.x_last >> 14) + 2;
    const int ny = (int)f.flux_table.mesh.ny;
    for (int ix = 0; ix < nx; ix++) {
        for (int iy = 0; iy < ny; iy++) {
            const int n = ix * ny + iy;
            const dq_q15_t i = {(q15_t)(f.flux_table.mesh.x0 + ix * 2048), (q15_t)(iy * 2048)};
            const flux_point_t y = flux_table_step(&f.flux_table, i);
            const flux_inductances_t x = flux_table_inductances(&f.flux_table, i);
            TEST_ASSERT_EQUAL_INT(f.flux_table.l_d[n], x.l_d);
            TEST_ASSERT_EQUAL_INT(f.flux_table.l_qq[n], x.l_qq);
            TEST_ASSERT_EQUAL_INT(f.flux_table.g[n], y.g);
            TEST_ASSERT_EQUAL_INT(f.flux_table.psi_f0[n], y.psi_f0);
            TEST_ASSERT_FALSE(flux_table_outside(&f.flux_table, i));
        }
    }
}

/* psi_d is even in i_q; psi_q is odd up to one LSB, by which rounding half up differs between x and -x. */
void test_the_half_planes_of_i_q_are_symmetrical(void)
{
    uint64_t seed = 42;
    for (int n = 0; n < 50000; n++) {
        const dq_q15_t i = {(q15_t)random_in(&seed, -32768, 32767), (q15_t)random_in(&seed, -32767, 32767)};
        const flux_point_t a = flux_table_step(&f.flux_table, i);
        const flux_point_t b = flux_table_step(&f.flux_table, (dq_q15_t){i.d, (q15_t)-i.q});
        TEST_ASSERT_EQUAL_INT(a.psi_d, b.psi_d);
        TEST_ASSERT_EQUAL_INT(a.g, b.g);
        TEST_ASSERT_INT_WITHIN(1, -a.psi_q, b.psi_q);
    }
}

void test_one_count_outside_each_edge_is_flagged_and_keeps_the_edges_inductance(void)
{
    const int edge_d = f.flux_table.mesh.x0;
    const int edge_q = 14 * 2048;
    const dq_q15_t inside[4] = {{(q15_t)edge_d, 0}, {0, 0}, {-1000, (q15_t)edge_q}, {-1000, (q15_t)-edge_q}};
    const dq_q15_t outside[4] = {
        {(q15_t)(edge_d - 1), 0}, {1, 0}, {-1000, (q15_t)(edge_q + 1)}, {-1000, (q15_t)(-edge_q - 1)}};
    for (int n = 0; n < 4; n++) {
        const flux_point_t a = flux_table_step(&f.flux_table, inside[n]);
        const flux_point_t b = flux_table_step(&f.flux_table, outside[n]);
        TEST_ASSERT_FALSE(flux_table_outside(&f.flux_table, inside[n]));
        TEST_ASSERT_TRUE(flux_table_outside(&f.flux_table, outside[n]));
        TEST_ASSERT_EQUAL_INT(a.g, b.g);
        const flux_inductances_t at = flux_table_inductances(&f.flux_table, inside[n]);
        const flux_inductances_t beyond = flux_table_inductances(&f.flux_table, outside[n]);
        TEST_ASSERT_EQUAL_INT(at.l_d, beyond.l_d);
        TEST_ASSERT_EQUAL_INT(at.l_qq, beyond.l_qq);
    }
}

/* At a distance of one count the results differ by the slope only. */
void test_there_is_no_step_at_a_cell_boundary(void)
{
    for (int q = -20000; q < 20000; q++) {
        const flux_point_t a = flux_table_step(&f.flux_table, (dq_q15_t){-8192, (q15_t)q});
        const flux_point_t b = flux_table_step(&f.flux_table, (dq_q15_t){-8192, (q15_t)(q + 1)});
        TEST_ASSERT_INT_WITHIN(2, a.g, b.g);
        TEST_ASSERT_INT_WITHIN(8, a.psi_q, b.psi_q); /* l_q below 4, twice that with the slope of l_q, and roundings */
    }
}

void test_a_table_that_is_complete_and_positive_is_accepted(void)
{
    TEST_ASSERT_EQUAL_INT(MOTOR_CHECK_OK, flux_table_check(&f.flux_table));
}

void test_a_table_that_would_break_a_later_stage_is_rejected(void)
{
    static int16_t bad[256];
    const int16_t **const pointers[5] = {&f.flux_table.l_d, &f.flux_table.l_q, &f.flux_table.l_qq, &f.flux_table.g,
                                         &f.flux_table.psi_f0};
    for (int n = 0; n < 5; n++) {
        const int16_t *good = *pointers[n];
        *pointers[n] = 0;
        TEST_ASSERT_NOT_EQUAL_INT(MOTOR_CHECK_OK, flux_table_check(&f.flux_table));
        *pointers[n] = good;
    }
    for (int n = 1; n < 4; n++) { /* l_q, l_qq and g must be positive; l_d may change its sign near i_d = 0 */
        const int16_t *good = *pointers[n];
        for (int k = 0; k < 225; k++) {
            bad[k] = good[k];
        }
        bad[224] = 0;
        *pointers[n] = bad;
        TEST_ASSERT_NOT_EQUAL_INT(MOTOR_CHECK_OK, flux_table_check(&f.flux_table));
        bad[224] = -1;
        TEST_ASSERT_NOT_EQUAL_INT(MOTOR_CHECK_OK, flux_table_check(&f.flux_table));
        *pointers[n] = good;
    }
}

void test_a_grid_without_a_cell_or_with_an_impossible_shift_is_rejected(void)
{
    flux_table_config_t c = f.flux_table;
    c.mesh.x_last = UINT32_MAX; /* one column: (1 << 14) - 0x4001 */
    TEST_ASSERT_NOT_EQUAL_INT(MOTOR_CHECK_OK, flux_table_check(&c));
    c = f.flux_table;
    c.mesh.ny = 1;
    c.mesh.y_last = UINT32_MAX;
    TEST_ASSERT_NOT_EQUAL_INT(MOTOR_CHECK_OK, flux_table_check(&c));
    c = f.flux_table;
    c.mesh.x_last++;
    TEST_ASSERT_NOT_EQUAL_INT(MOTOR_CHECK_OK, flux_table_check(&c));
    c = f.flux_table;
    c.mesh.y_last--;
    TEST_ASSERT_NOT_EQUAL_INT(MOTOR_CHECK_OK, flux_table_check(&c));
    c = f.flux_table;
    c.mesh.up = 15;
    TEST_ASSERT_NOT_EQUAL_INT(MOTOR_CHECK_OK, flux_table_check(&c));
    c = f.flux_table;
    c.mesh.up = UINT32_MAX; /* a spacing of 2^15 */
    TEST_ASSERT_NOT_EQUAL_INT(MOTOR_CHECK_OK, flux_table_check(&c));
    c = f.flux_table;
    c.l_shift = 15;
    c.i_scale = 8 << 15;
    TEST_ASSERT_NOT_EQUAL_INT(MOTOR_CHECK_OK, flux_table_check(&c));
    c = f.flux_table;
    c.i_scale++;
    TEST_ASSERT_NOT_EQUAL_INT(MOTOR_CHECK_OK, flux_table_check(&c));
}

void test_flux_beyond_the_base_saturates(void)
{
    static int16_t large[225];
    for (int k = 0; k < 225; k++) {
        large[k] = 32767;
    }
    f.flux_table.l_q = f.flux_table.psi_f0 = f.flux_table.l_d = large;
    TEST_ASSERT_EQUAL_INT(32767, flux_table_step(&f.flux_table, (dq_q15_t){0, 20000}).psi_q);
    TEST_ASSERT_EQUAL_INT(-32768, flux_table_step(&f.flux_table, (dq_q15_t){0, -20000}).psi_q);
    TEST_ASSERT_EQUAL_INT(32767, flux_table_step(&f.flux_table, (dq_q15_t){1000, 0}).psi_d);
    TEST_ASSERT_EQUAL_INT(-32768, flux_table_step(&f.flux_table, (dq_q15_t){-28672, 0}).psi_d);
}
