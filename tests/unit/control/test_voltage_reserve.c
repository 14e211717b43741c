/* SPDX-License-Identifier: Apache-2.0 */
#include "control/torque/voltage_reserve.h"

#include <math.h>

#include "fixture.h"
#include "fx/vec.h"
#include "unity.h"

static fixture_t f;
static voltage_reserve_state_t state;
static voltage_reserve_in_t in;

/* v_ratio v_dc = 0.55 * 0.6667 = 0.36667, 12015 counts; the voltage is 0.3, and the references use the planned flux. */
void setUp(void)
{
    f = fixture();
    state = (voltage_reserve_state_t){0};
    in = (voltage_reserve_in_t){.u = 9830, .v_dc = 21845, .psi = {8000, 6000}, .psi_plan = 10000, .acting = true};
}

void tearDown(void)
{
}

static voltage_reserve_t step(void)
{
    return voltage_reserve_step(&f.voltage_reserve, &state, &in);
}

static int32_t trim(void)
{
    return state.trim / 65536;
}

void test_at_the_flux_limit_a_twentieth_of_the_voltage_error_is_added_each_step(void)
{
    (void)step();
    TEST_ASSERT_INT32_WITHIN(1, (12015 - 9830) / 20, trim());
    in.u = 13000; /* above the planned voltage */
    state.trim = 0;
    (void)step();
    TEST_ASSERT_INT32_WITHIN(1, (12015 - 13000) / 20, trim());
}

void test_unused_voltage_away_from_the_flux_limit_does_not_change_the_trim(void)
{
    in.psi = (dq_q15_t){4800, 3600};
    for (int n = 0; n < 100; n++) {
        (void)step();
    }
    TEST_ASSERT_EQUAL_INT32(0, state.trim);
}

void test_excess_voltage_lowers_the_trim_also_away_from_the_flux_limit(void)
{
    in.psi = (dq_q15_t){4800, 3600};
    in.u = 13000;
    (void)step();
    TEST_ASSERT_INT32_WITHIN(1, (12015 - 13000) / 20, trim());
}

/* 0.95^100 = 0.0059 */
void test_away_from_the_flux_limit_and_with_switching_disabled_the_trim_returns_to_zero(void)
{
    for (int off = 0; off < 2; off++) {
        in.psi = off ? (dq_q15_t){8000, 6000} : (dq_q15_t){4800, 3600};
        in.acting = !off;
        state.trim = -1000 * 65536;
        for (int n = 0; n < 100; n++) {
            (void)step();
        }
        TEST_ASSERT_INT32_WITHIN(10, -6, trim());
    }
}

void test_the_trim_stays_within_its_limits(void)
{
    for (int n = 0; n < 1000; n++) {
        (void)step();
    }
    TEST_ASSERT_EQUAL_INT32(f.voltage_reserve.trim_max * in.v_dc / 32768, trim());
    in.u = Q15_MAX;
    for (int n = 0; n < 1000; n++) {
        (void)step();
    }
    TEST_ASSERT_EQUAL_INT32(f.voltage_reserve.trim_min, trim());
}

/* 0.075 of the dc voltage. What the trim makes up for may be gone a moment later: planned voltage and trim together
 * must exist at the present dc voltage, not at the nominal one. */
void test_the_trim_follows_a_falling_dc_voltage_at_once(void)
{
    for (int n = 0; n < 1000; n++) {
        (void)step();
    }
    TEST_ASSERT_INT32_WITHIN(1, 1638, trim());
    in.v_dc = 10922;
    in.u = 4915;
    (void)step();
    TEST_ASSERT_INT32_WITHIN(1, 819, trim());
}

/* In units of 10000: |(0.8, 0.6) + (0.1, 0)| = 1.0817. */
void test_the_shift_is_the_change_of_the_flux_magnitude_by_the_identified_error(void)
{
    TEST_ASSERT_EQUAL_INT(0, step().shift);
    in.psi_d_error = 1000;
    TEST_ASSERT_INT_WITHIN(2, 817, step().shift);
    in.psi_d_error = -1000;
    TEST_ASSERT_INT_WITHIN(2, (int)(sqrt(49e6 + 36e6) - 10000), step().shift);
}

/* Tolerance: three magnitudes with an error of 0.7 LSB each; the gain reduces their effect on the trim. */
void test_the_reserve_follows_the_twin(void)
{
    worst_t worst = {0};
    uint64_t seed = 7;
    double si_trim = 0.0;
    for (int n = 0; n < 100000; n++) {
        const dq_q15_t u = {random_in(&seed, -12000, 12000), random_in(&seed, -12000, 12000)};
        in.u = fx_magnitude(u.d, u.q);
        in.v_dc = (q15_t)random_in(&seed, 15000, 30000);
        in.psi = (dq_q15_t){random_in(&seed, 0, 20000), random_in(&seed, -20000, 20000)};
        in.psi_d_error = (q15_t)random_in(&seed, -4000, 2000);
        in.psi_plan = (q15_t)((n & 1) ? hypot(in.psi.d, in.psi.q) : 32767);
        in.acting = (n % 7) != 0;
        if (fabs(0.55 * in.v_dc - hypot(u.d, u.q)) < 4.0) {
            continue; /* rounding decides on which side of the limit the voltage is */
        }
        const twin_reserve_in_t t = {
            .u = {u.d / 32768.0 * f.v, u.q / 32768.0 * f.v},
            .psi = {in.psi.d / 32768.0 * f.psi, in.psi.q / 32768.0 * f.psi},
            .v_dc = in.v_dc / 32768.0 * f.v,
            .psi_plan = in.psi_plan / 32768.0 * f.psi,
            .psi_delta = in.psi_d_error / 32768.0 * f.psi,
            .acting = in.acting,
        };
        const voltage_reserve_t y = step();
        const double shift = twin_voltage_reserve(&f.si, &si_trim, &t);
        worst_note(&worst, y.shift - shift / f.psi * 32768.0, "shift of step %d", n);
        const double v_plan = f.si.ref_v_ratio * t.v_dc + si_trim;
        worst_note(&worst, y.v_plan - v_plan / f.v * 32768.0, "planned voltage of step %d", n);
    }
    ASSERT_WORST(worst, 3.0);
}
