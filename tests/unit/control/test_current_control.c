/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "control/current/current_control.h"
#include "fixture.h"
#include "fx/circle.h"
#include "unity.h"

static fixture_t f;
static current_control_state_t state;
static current_target_t target;
static flux_point_t flux;
static current_control_in_t in;
static current_control_out_t out; /* of the last step() */
static bool limited;

static dq_q30_t q30(dq_q15_t x)
{
    return (dq_q30_t){x.d * 32768, x.q * 32768};
}

void setUp(void)
{
    f = fixture();
    current_control_reset(&state);
    flux = flux_table_step(&f.flux_table, (dq_q15_t){-4000, 6000});
    const dq_q15_t psi = {flux.psi_d, flux.psi_q};
    /* No flux error, no rotation. */
    target = (current_target_t){.psi = {(q15_t)psi.d, (q15_t)psi.q}, .weighted = q30(psi)};
    target.integral_gain = f.current_control.integral_gain;
    in = (current_control_in_t){.target = &target, .flux = &flux, .v_dc = 21845 /* 350 V */};
}

void tearDown(void)
{
}

/* |v| = 1 in LSB of q15. */
static double v_max(void)
{
    return f.si.v_ratio * in.v_dc;
}

/* One axis of v in LSB of q15; half 0 is d, half 1 is q. */
static double of_v(int half)
{
    return (int16_t)(out.v >> (16 * half)) / 32768.0 * v_max();
}

/* The voltage after the limit, in LSB of q15. */
static dq_q15_t step(void)
{
    out = current_control_step(&f.current_control, &state, &in);
    limited = out.limited != 0U;
    TEST_ASSERT_FALSE(limited && out.clear);
    if (limited) {
        return (dq_q15_t){(int32_t)lround(of_v(0)), (int32_t)lround(of_v(1))};
    }
    TEST_ASSERT_DOUBLE_WITHIN(1.01, of_v(0), out.u.d); /* half an LSB of u and of v, whose LSB is smaller */
    TEST_ASSERT_DOUBLE_WITHIN(1.01, of_v(1), out.u.q);
    return out.u;
}

static dq_q15_t words(dq_q15_halfword_t x)
{
    return (dq_q15_t){x.d, x.q};
}

static dq_q15_halfword_t halfwords(dq_q15_t x)
{
    return (dq_q15_halfword_t){(q15_t)x.d, (q15_t)x.q};
}

/* omega: q15. */
static current_target_t target_at(dq_q15_t i, const flux_point_t *at, int omega, int psi_d_error)
{
    const operating_point_t point = {.i = i, .flux = *at, .omega = (q31_t)((uint32_t)omega << 16)};
    rotating_flux_t reached = {.psi = {(q15_t)at->psi_d, (q15_t)at->psi_q}};
    return current_control_target(&f.current_control, &point, psi_d_error, &reached);
}

static twin_dq_t si_psi(dq_q15_t psi)
{
    return (twin_dq_t){from_q15(psi.d) * f.psi, from_q15(psi.q) * f.psi};
}

/* The twin with the inputs of the stage, that is with the rounded fluxes. Returns the voltage in LSB of q15. */
static twin_dq_t twin_step(twin_current_state_t *twin)
{
    const twin_dq_t psi = si_psi((dq_q15_t){flux.psi_d, flux.psi_q});
    const twin_flux_t si = {.psi_d = psi.d, .psi_q = psi.q};
    const dq_q15_t weighted = {target.weighted.d / 32768, target.weighted.q / 32768};
    const double integral_w = f.si.integral_ratio * f.si.sigma_rad_s * target.integral_turn / target.integral_gain;
    const twin_current_in_t t = {{si_psi(words(target.psi)), si_psi(weighted), target.turn / 32768.0 * f.w, integral_w},
                                 &si,
                                 (double)target.turn,
                                 from_q15(in.v_dc) * f.v};
    const twin_dq_t u = twin_current_control(&f.si, twin, &t);
    return (twin_dq_t){u.d / f.v * 32768.0, u.q / f.v * 32768.0};
}

static dq_q15_t random_dq(uint64_t *seed, int largest)
{
    return (dq_q15_t){(q15_t)random_in(seed, -largest, largest), (q15_t)random_in(seed, -largest, largest)};
}

/* --- the target ------------------------------------------------------------------------------ */

/* psi* has the error of the tables (4 LSB, see test_flux_table.c); the weighted one adds three roundings and (1 - b) of
 * that error. A reference that saturates is not compared. */
void test_the_target_of_every_reference_follows_the_twin(void)
{
    worst_t worst = {0};
    uint64_t seed = 50;
    for (int d = -32768; d <= 0; d += 311) {
        for (int q = -32768; q <= 32767; q += 313) {
            const dq_q15_t i = {(q15_t)d, (q15_t)q};
            const flux_point_t at = flux_table_step(&f.flux_table, i);
            const q15_t w = (q15_t)random_in(&seed, -32767, 32767);
            const q15_t delta = (q15_t)random_in(&seed, -3000, 3000);
            const current_target_t y = target_at(i, &at, w, delta * 32 / 21);
            const twin_dq_t si = {from_q15(d) * f.i, from_q15(q) * f.i};
            const twin_flux_t table = twin_flux_table(&f.si, si);
            twin_rotating_t reached = {.psi = {table.psi_d, table.psi_q}};
            const twin_target_t t = twin_current_target(&f.si, si, from_q15(w) * f.w, from_q15(delta) * f.psi,
                                                        &reached);
            const double lsb = 32768.0 / f.psi;
            worst_note(&worst, y.psi.d - t.psi.d * lsb, "psi_d of %d %d", d, q);
            worst_note(&worst, y.psi.q - twin_clamp(t.psi.q * lsb, -32768, 32767), "psi_q of %d %d", d, q);
            worst_note(&worst, y.turn - t.turn / f.w * 32768.0, "m w of %d", w);
            worst_note(&worst, y.integral_turn - t.integral_turn / f.w * 32768.0, "a_i w' of %d", w);
            if (fabs(t.psi.q * lsb) < 32760.0 && fabs(t.weighted.d * lsb) < 32760.0) {
                worst_note(&worst, y.weighted.d / 32768.0 - t.weighted.d * lsb, "f_d of %d %d %d", d, q, w);
            }
            if (fabs(t.psi.q * lsb) < 32760.0 && fabs(t.weighted.q * lsb) < 32760.0) {
                worst_note(&worst, y.weighted.q / 32768.0 - t.weighted.q * lsb, "f_q of %d %d %d", d, q, w);
            }
        }
    }
    ASSERT_WORST(worst, 6.0);
}

/* Flux and rotational part are together almost two per unit, with the sign of the speed. */
void test_the_reference_of_the_proportional_part_is_limited_to_one(void)
{
    const flux_point_t at = {.psi_d = 32000, .psi_q = 32000, .psi_f0 = 32000};
    const flux_point_t opposite = {.psi_d = 32000, .psi_q = -32000, .psi_f0 = 32000};
    TEST_ASSERT_EQUAL_INT32((1 << 30) - 1, target_at((dq_q15_t){0, 0}, &at, 32767, 0).weighted.q);
    TEST_ASSERT_EQUAL_INT32(-(1 << 30), target_at((dq_q15_t){0, 0}, &opposite, -32767, 0).weighted.q);
}

void test_the_target_of_zero_current_is_the_magnets_flux(void)
{
    const flux_point_t at = flux_table_step(&f.flux_table, (dq_q15_t){0, 0});
    const current_target_t y = target_at((dq_q15_t){0, 0}, &at, 0, 0);
    TEST_ASSERT_EQUAL_INT(f.flux_table.psi_f0[0], y.psi.d);
    TEST_ASSERT_EQUAL_INT(f.flux_table.psi_f0[0] * 32768, y.weighted.d);
    TEST_ASSERT_EQUAL_INT(0, y.psi.q);
    TEST_ASSERT_EQUAL_INT(0, y.weighted.q);
}

/* By hand: psi* = 10000 with a magnet of 17000 contains -7000 of the current; b = 1/2 keeps half of it; the resistive
 * drop adds 1/8 of i*. */
void test_the_set_point_weight_reduces_only_the_flux_of_the_current(void)
{
    const flux_point_t at = {.psi_d = 10000, .psi_q = 8000, .psi_f0 = 17000};
    f.current_control.setpoint_weight = 16384;
    f.current_control.drop_gain = 8192;
    const current_target_t y = target_at((dq_q15_t){-4000, 2000}, &at, 0, 0);
    TEST_ASSERT_EQUAL_INT((10000 + 3500 - 500) * 32768, y.weighted.d);
    TEST_ASSERT_EQUAL_INT((8000 - 4000 + 250) * 32768, y.weighted.q);
    TEST_ASSERT_EQUAL_INT(10000, y.psi.d);
    TEST_ASSERT_EQUAL_INT(8000, y.psi.q);
}

/* --- the step -------------------------------------------------------------------------------- */

/* Near a boundary of the 256 table steps, stage and twin may use different steps. error: of v. */
static bool between_steps(double v, double error)
{
    const double cells = fabs(v) * 256.0;
    return fabs(v) < 1.0 && fabs(cells - round(cells)) < 0.05 + 256.0 * error;
}

/* By hand: w = 1/2 and sigma/omega_b = 0.8488. Of u_q = w (psi_d + dpsi) = 5500 the measured flux makes
 * 11/32 w 10000 = 1719; f_q has the rest over sigma, and so has f_d that of u_d = -3000. psi_d_error is
 * 32/21 1000. */
void test_the_target_contains_what_the_measured_flux_does_not_make_of_the_rotational_voltage(void)
{
    f.current_control.setpoint_weight = INT16_MAX;
    f.current_control.drop_gain = 0;
    const flux_point_t at = {.psi_d = 10000, .psi_q = 6000, .psi_f0 = 10000};
    for (int sign = -1; sign <= 1; sign += 2) {
        const current_target_t y = target_at((dq_q15_t){0, 0}, &at, sign * 16384, 1524);
        TEST_ASSERT_INT_WITHIN(1, sign * 5632, y.turn);
        TEST_ASSERT_INT_WITHIN(2, 10000 - sign * (3000 - 1031) / 0.8488, y.weighted.d / 32768);
        TEST_ASSERT_INT_WITHIN(2, 6000 + sign * (5500 - 1719) / 0.8488, y.weighted.q / 32768);
        TEST_ASSERT_INT_WITHIN(1,
                               sign * 0.5 * 21.0 / 32.0 * 32768.0 / 0.8488 * from_q15(f.current_control.integral_gain),
                               y.integral_turn);
    }
}

/* By hand: of a change of 15000, more than 3/4 of the magnet's 16000, one half is made, then 3/4 of the rest each time
 * until 1/16 of the magnet's flux is left. f_d is 16000 - 0.5 * 21/32 r_q/0.8488. */
void test_a_large_change_of_the_target_is_followed_as_the_machines_flux_follows_it(void)
{
    static const int32_t expected[] = {7500, 13125, 14531, 15000, 15000};
    f.current_control.setpoint_weight = INT16_MAX;
    f.current_control.drop_gain = 0;
    const operating_point_t to = {.flux = {.psi_d = 16000, .psi_q = 15000, .psi_f0 = 16000}, .omega = 1 << 30};
    for (int d = 0; d <= 1; d++) { /* either axis may be what is large */
        rotating_flux_t rotating = {.psi = {(q15_t)(d ? 1000 : 16000), (q15_t)(d ? 15000 : 0)}};
        for (unsigned k = 0; k < sizeof expected / sizeof *expected; k++) {
            const current_target_t y = current_control_target(&f.current_control, &to, 0, &rotating);
            const int32_t made = d ? rotating.psi.d - 1000 : rotating.psi.q;
            TEST_ASSERT_INT_WITHIN(1, expected[k], made);
            TEST_ASSERT_EQUAL(k < 3, rotating.behind);
            TEST_ASSERT_EQUAL_INT(15000, y.psi.q);
            TEST_ASSERT_INT_WITHIN(2, 16000 - 0.5 * 21.0 / 32.0 * rotating.psi.q / 0.8488, y.weighted.d / 32768);
            TEST_ASSERT_INT_WITHIN(2, 15000 + 0.5 * 21.0 / 32.0 * rotating.psi.d / 0.8488, y.weighted.q / 32768);
        }
    }
}

void test_a_small_change_of_the_target_is_made_at_once(void)
{
    operating_point_t to = {.flux = {.psi_d = 16000, .psi_f0 = 16000}};
    f.current_control.setpoint_weight = INT16_MAX;
    for (int sign = -1; sign <= 1; sign += 2) {
        rotating_flux_t rotating = {.psi = {16000, 0}};
        to.flux.psi_q = sign * 12000; /* 3/4 of the magnet's flux */
        (void)current_control_target(&f.current_control, &to, 0, &rotating);
        TEST_ASSERT_FALSE(rotating.behind);
        TEST_ASSERT_INT_WITHIN(1, sign * 12000, rotating.psi.q);
    }
}

/* Jumps between points whose flux the tables hold, up to the limit of current. */
void test_the_followed_flux_is_that_of_the_twin(void)
{
    uint64_t seed = 58;
    rotating_flux_t rotating = {.psi = {f.flux_table.psi_f0[0], 0}};
    twin_rotating_t twin = {.psi = {from_q15(rotating.psi.d) * f.psi, 0.0}};
    dq_q15_t i = {0, 0};
    int behind = 0;
    for (int n = 0; n < 20000; n++) {
        if (random_in(&seed, 0, 3) == 0) {
            i = (dq_q15_t){random_in(&seed, -20000, 0), random_in(&seed, -10000, 10000)};
        }
        const operating_point_t to = {.i = i, .flux = flux_table_step(&f.flux_table, i)};
        (void)current_control_target(&f.current_control, &to, 0, &rotating);
        (void)twin_current_target(&f.si, (twin_dq_t){from_q15(i.d) * f.i, from_q15(i.q) * f.i}, 0.0, 0.0, &twin);
        behind += rotating.behind ? 1 : 0;
        if (rotating.behind != twin.behind) { /* a bound lies within the error of the tables */
            twin = (twin_rotating_t){si_psi(rotating.psi), rotating.behind};
        }
        TEST_ASSERT_DOUBLE_WITHIN(6.0, twin.psi.d / f.psi * 32768.0, rotating.psi.d);
        TEST_ASSERT_DOUBLE_WITHIN(6.0, twin.psi.q / f.psi * 32768.0, rotating.psi.q);
    }
    TEST_ASSERT_GREATER_THAN_INT(2000, behind);
}

/* current_control_turning.h has a rotational voltage of its own. */
void test_without_proportional_part_nothing_turns(void)
{
    f.current_control.sigma_q24 = 0;
    const flux_point_t at = {.psi_d = 10000, .psi_q = 6000, .psi_f0 = 10000};
    const current_target_t y = target_at((dq_q15_t){0, 0}, &at, -16384, 1524);
    TEST_ASSERT_EQUAL_INT(-1, y.turn);
    TEST_ASSERT_EQUAL_INT(0, y.integral_turn);
    TEST_ASSERT_EQUAL_INT32(10000 * 32768, y.weighted.d);
}

/* |psi* - psi| stays below 1, above which the stage saturates it.
 * Errors of v: 0.5 LSB of the product, relative 1e-5 of the quotient, 0.5 LSB at the end of the saturation; those of d
 * also enter q. */
void test_a_single_step_follows_the_twin_over_the_whole_plane(void)
{
    worst_t worst = {0};
    worst_t integrator = {0};
    uint64_t seed = 51;
    int limited_steps = 0;
    for (int n = 0; n < 400000; n++) {
        const int largest = (n % 2) ? 11000 : 4000;
        const dq_q15_t psi = random_dq(&seed, largest);
        flux.psi_d = psi.d;
        flux.psi_q = psi.q;
        target = (current_target_t){.psi = halfwords(random_dq(&seed, largest)),
                                    .weighted = q30(random_dq(&seed, largest)),
                                    .turn = random_in(&seed, -32767, 32767),
                                    .integral_gain = f.current_control.integral_gain,
                                    .integral_turn = (q15_t)random_in(&seed, -1100, 1100)};
        in.v_dc = (q15_t)random_in(&seed, 900, 32767);
        state = (current_control_state_t){random_in(&seed, -450000000, 450000000),
                                          random_in(&seed, -450000000, 450000000)};
        twin_current_state_t twin = {{2.0 * from_q31(state.s_d_q30) * f.v, 2.0 * from_q31(state.s_q_q30) * f.v}, false};
        const dq_q15_t u = step();
        const twin_dq_t t = twin_step(&twin);
        const double v_q = out.u.q / v_max();
        const bool between = between_steps(v_q, 0.5 / v_max()) || fabs(fabs(v_q) - 1.5) < 1.0 / v_max();
        const bool q_chooses_step = (target.psi.d >= psi.d || t.d > 0.0) && between;
        if ((limited || twin.limited) && (q_chooses_step || between_steps(t.d / v_max(), 0.0))) {
            continue;
        }
        limited_steps += twin.limited ? 1 : 0;
        worst_note(&worst, u.d - t.d, "u_d %d, psi %d %d w %d v %d", u.d, psi.d, psi.q, target.turn, in.v_dc);
        worst_note(&worst, u.q - t.q, "u_q %d not %.1f (u_d %d), psi %d %d w %d v %d", u.q, t.q, u.d, psi.d, psi.q,
                   target.turn, in.v_dc);
        worst_note(&integrator, 2.0 * from_q31(state.s_d_q30) - twin.s.d / f.v, "s_d, psi %d %d", psi.d, psi.q);
        worst_note(&integrator, 2.0 * from_q31(state.s_q_q30) - twin.s.q / f.v, "s_q, psi %d %d", psi.d, psi.q);
    }
    TEST_ASSERT_GREATER_THAN_INT(200000, limited_steps);
    ASSERT_WORST(worst, 3.0);
    ASSERT_WORST(integrator, 8e-6); /* 1/14 of the error of u_limited - u, 4 + 2 LSB of v */
}

/* While nothing limits, the integrators are exact. */
void test_after_ten_thousand_periods_the_integrators_equal_those_of_the_twin(void)
{
    worst_t worst = {0};
    uint64_t seed = 52;
    twin_current_state_t twin = {0};
    in.v_dc = 32767;
    for (int n = 0; n < 10000; n++) {
        target.psi = (dq_q15_halfword_t){(q15_t)(flux.psi_d + random_in(&seed, -300, 300)),
                                         (q15_t)(flux.psi_q + random_in(&seed, -300, 300))};
        target.integral_turn = (q15_t)random_in(&seed, -1100, 1100);
        (void)step();
        (void)twin_step(&twin);
        worst_note(&worst, 2.0 * from_q31(state.s_d_q30) - twin.s.d / f.v, "s_d of period %d", n);
        worst_note(&worst, 2.0 * from_q31(state.s_q_q30) - twin.s.q / f.v, "s_q of period %d", n);
        TEST_ASSERT_FALSE(limited);
    }
    ASSERT_WORST(worst, 1e-9);
}

/* An error that alternates between +-1 LSB has a mean of 0; with truncation the integrator would drift by 1e6/2 of its
 * LSB. */
void test_a_million_periods_of_one_lsb_ripple_do_not_bias_the_integrators(void)
{
    const dq_q15_halfword_t initial = target.psi;
    for (int n = 0; n < 1000000; n++) {
        const int e = (n & 1) ? 1 : -1;
        target.psi = (dq_q15_halfword_t){(q15_t)(initial.d + e), (q15_t)(initial.q + e)};
        (void)step();
    }
    TEST_ASSERT_EQUAL_INT32(0, state.s_d_q30);
    TEST_ASSERT_EQUAL_INT32(0, state.s_q_q30);
}

/* One LSB of flux for 10^4 periods: exactly N sigma a_i 2^-15. */
void test_the_smallest_constant_error_integrates_to_the_exact_ramp(void)
{
    target.psi.q = (q15_t)(target.psi.q + 1);
    for (int n = 0; n < 10000; n++) {
        (void)step();
    }
    TEST_ASSERT_EQUAL_INT32(10000 * f.current_control.integral_gain, state.s_q_q30);
    TEST_ASSERT_EQUAL_INT32(0, state.s_d_q30);
}

void test_at_standstill_without_error_the_voltage_is_that_of_the_integrators(void)
{
    state.s_d_q30 = 1000 * 32768;
    state.s_q_q30 = -2000 * 32768;
    const dq_q15_t u = step();
    TEST_ASSERT_EQUAL_INT(1000, u.d);
    TEST_ASSERT_EQUAL_INT(-2000, u.q);
    TEST_ASSERT_EQUAL_INT32(1000 * 32768, state.s_d_q30);
}

/* By hand: u_d = -m w psi_q, u_q = m w psi_d with m w = 1/2. */
void test_a_share_of_the_rotational_voltage_follows_the_measured_flux(void)
{
    target.turn = 16384;
    in.v_dc = 32767;
    flux.psi_d = target.psi.d = 10000;
    flux.psi_q = target.psi.q = 6000;
    target.weighted = q30(words(target.psi));
    dq_q15_t u = step();
    TEST_ASSERT_INT_WITHIN(1, -3000, u.d);
    TEST_ASSERT_INT_WITHIN(1, 5000, u.q);
    target.turn = -16384;
    u = step();
    TEST_ASSERT_INT_WITHIN(1, 3000, u.d);
    TEST_ASSERT_INT_WITHIN(1, -5000, u.q);
}

/* By hand: s_d -= a_i w' e_q and s_q += a_i w' e_d, beside what a_i sigma integrates of the axis's own error. */
void test_the_integral_part_integrates_along_the_voltage_that_holds_a_deviation(void)
{
    target.integral_gain = 1000;
    target.integral_turn = 300;
    target.psi.d = (q15_t)(flux.psi_d + 100);
    target.psi.q = (q15_t)(flux.psi_q - 40);
    (void)step();
    TEST_ASSERT_EQUAL_INT32(1000 * 100 + 300 * 40, state.s_d_q30);
    TEST_ASSERT_EQUAL_INT32(1000 * -40 + 300 * 100, state.s_q_q30);
}

/* The proportional part takes the voltage back to zero, so that nothing is limited. */
void test_the_integrators_are_limited_to_one(void)
{
    target.integral_gain = 1000;
    for (int sign = -1; sign <= 1; sign += 2) {
        const int32_t end = (sign > 0) ? (1 << 30) - 1 : -(1 << 30);
        const int32_t back = (int32_t)(sign * 1073741824.0 / 0.8488);
        state = (current_control_state_t){end, end};
        flux.psi_d = flux.psi_q = sign * 20000;
        target.weighted = (dq_q30_t){flux.psi_d * 32768 - back, flux.psi_q * 32768 - back};
        target.psi = (dq_q15_halfword_t){(q15_t)(sign * 20100), (q15_t)(sign * 20100)};
        (void)step();
        TEST_ASSERT_TRUE(out.clear);
        TEST_ASSERT_EQUAL_INT32(end, state.s_d_q30);
        TEST_ASSERT_EQUAL_INT32(end, state.s_q_q30);
    }
}

/* sigma/omega_b = 1/(3 T_s omega_b) = 0.8488; the proportional part follows f, the integral part psi*. */
void test_the_proportional_part_follows_the_weighted_target_and_the_integral_part_the_target(void)
{
    target.weighted.d = (flux.psi_d + 1000) * 32768;
    TEST_ASSERT_INT_WITHIN(1, 849, step().d);
    TEST_ASSERT_EQUAL_INT32(0, state.s_d_q30);
    target.weighted.d = flux.psi_d * 32768;
    target.psi.d = (q15_t)(flux.psi_d + 1000);
    TEST_ASSERT_EQUAL_INT(0, step().d);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 1000.0 / 32768.0 * from_q15(f.current_control.integral_gain),
                              2.0 * from_q31(state.s_d_q30));
}

/* psi_d* is one LSB below psi_d, so that the d flux is to fall, and v_d is negative. By hand: v_d = -3/5. The table
 * step that contains 0.6 ends at 154/256 and leaves 0.7988 for v_q, instead of 4/5. */
void test_the_d_axis_has_priority_and_the_q_axis_gets_the_rest_of_the_circle(void)
{
    target.psi.d = (q15_t)(target.psi.d - 1);
    for (int sign = -1; sign <= 1; sign += 2) {
        state.s_d_q30 = -(int32_t)(v_max() * 3 / 5) * 32768;
        state.s_q_q30 = (sign > 0) ? (1 << 30) - 1 : -(1 << 30);
        dq_q15_t u = step();
        TEST_ASSERT_INT_WITHIN(1, -v_max() * 3 / 5, u.d);
        TEST_ASSERT_INT_WITHIN(2, sign * 0.7988 * v_max(), u.q);
        TEST_ASSERT_TRUE(limited);
        state.s_d_q30 = -32767 * 32768;
        u = step(); /* the q axis always keeps a quarter, so that its current can change */
        TEST_ASSERT_INT_WITHIN(1, -v_max(), u.d);
        TEST_ASSERT_INT_WITHIN(1, sign * 0.25 * v_max(), u.q);
    }
}

/* As above with v_d positive: what is cut lets the d flux fall, as it is to, and |v_q| = 1 leaves 0.7. */
void test_while_the_d_flux_is_to_fall_a_positive_d_voltage_gives_way(void)
{
    target.psi.d = (q15_t)(target.psi.d - 1);
    target.turn = 1;
    state.s_d_q30 = (int32_t)(v_max() * 9 / 10) * 32768;
    state.s_q_q30 = (int32_t)v_max() * 32768;
    const dq_q15_t u = step();
    TEST_ASSERT_INT_WITHIN(1, 0.7 * v_max(), u.d);
    TEST_ASSERT_INT_WITHIN(2, 0.7111 * v_max(), u.q);
}

/* By hand: u_d exceeds the circle by 200 LSB and u_q is 0: q gets these 200 LSB, which reduce psi_q and with it the
 * rotational voltage -w psi_q of the d axis. */
void test_the_excess_of_the_d_voltage_is_subtracted_from_the_q_voltage_in_the_direction_of_rotation(void)
{
    target.psi.d = (q15_t)(target.psi.d - 1);
    for (int sign = -1; sign <= 1; sign += 2) {
        target.turn = sign; /* too small for a rotational voltage: only its sign acts */
        state = (current_control_state_t){.s_d_q30 = -(int32_t)(v_max() + 200.0) * 32768};
        const dq_q15_t u = step();
        TEST_ASSERT_INT_WITHIN(1, -v_max(), u.d);
        TEST_ASSERT_INT_WITHIN(2, -sign * 200, u.q);
    }
}

/* psi_d* is one LSB above psi_d, so that the d flux is to rise. By hand: v_q = 3/5, whose table step ends at 154/256
 * and leaves 0.7988 for v_d. With |v_q| = 1 the d axis keeps 0.7, whose table step ends at 180/256 and leaves 0.7111
 * for v_q. The excess of v_d, 0.05, moves v_q away from -1, but not inside these 0.7111. */
void test_while_the_d_flux_is_to_rise_the_q_axis_has_priority(void)
{
    target.turn = 1;
    state.s_d_q30 = -(int32_t)(v_max() * 4 / 5) * 32768;
    state.s_q_q30 = (int32_t)(v_max() * 3 / 5) * 32768;
    target.psi.d = (q15_t)(target.psi.d + 1);
    dq_q15_t u = step();
    TEST_ASSERT_INT_WITHIN(2, -0.7988 * v_max(), u.d);
    TEST_ASSERT_INT_WITHIN(3, (0.6 - 0.0012) * v_max(), u.q);
    TEST_ASSERT_TRUE(limited);
    state.s_d_q30 = (int32_t)(v_max() * 3 / 4) * 32768;
    state.s_q_q30 = -(int32_t)(v_max() * 5 / 4) * 32768;
    u = step();
    TEST_ASSERT_INT_WITHIN(1, 0.7 * v_max(), u.d);
    TEST_ASSERT_INT_WITHIN(2, -0.7111 * v_max(), u.q);
}

/* By hand: 1.5 of the circle for q and 0.75 for d. Just below, d keeps 0.7; from there on 127.5/256 = 0.498, whose
 * cell of the circle leaves sqrt(1 - (128/256)^2) = 0.866. */
void test_a_q_axis_far_from_its_flux_leaves_the_d_axis_half_of_the_circle(void)
{
    target.psi.d = (q15_t)(target.psi.d + 1);
    for (int sign = -1; sign <= 1; sign += 2) {
        for (int far = 0; far <= 1; far++) {
            const double q = (far != 0) ? 1.5 * v_max() + 2.0 : 1.5 * v_max() - 2.0;
            state = (current_control_state_t){(int32_t)(v_max() * 3 / 4) * 32768, sign * (int32_t)(q * 32768.0)};
            const dq_q15_t u = step();
            TEST_ASSERT_INT_WITHIN(1, ((far != 0) ? 127.5 / 256.0 : 0.7) * v_max(), u.d);
            TEST_ASSERT_INT_WITHIN(2, sign * ((far != 0) ? 0.866 : 0.7111) * v_max(), u.q);
        }
    }
}

/* By hand: the d flux is to rise, and v_d exceeds by 200 LSB the circle, all of which v_q = 0 leaves it: q gets these
 * 200 LSB in the direction of rotation. */
void test_also_while_the_d_flux_is_to_rise_the_excess_of_the_d_voltage_changes_the_q_voltage(void)
{
    target.psi.d = (q15_t)(target.psi.d + 1);
    for (int sign = -1; sign <= 1; sign += 2) {
        target.turn = sign;
        state = (current_control_state_t){.s_d_q30 = (int32_t)(v_max() + 200.0) * 32768};
        const dq_q15_t u = step();
        TEST_ASSERT_INT_WITHIN(1, v_max(), u.d);
        TEST_ASSERT_INT_WITHIN(2, sign * 200, u.q);
    }
}

/* |v| between the circle of `clear` and where the first cell of the circle's table limits it, in all directions. */
void test_inside_the_circle_nothing_is_limited_in_either_direction_of_rotation(void)
{
    uint64_t seed = 55;
    int not_clear = 0;
    for (int n = 0; n < 100000; n++) {
        const double phi = random_in(&seed, 0, 65535) * (2.0 * 3.14159265358979323846 / 65536.0);
        const double length = random_in(&seed, 880, 995) * 1e-3 * v_max();
        state = (current_control_state_t){(int32_t)(length * cos(phi)) * 32768, (int32_t)(length * sin(phi)) * 32768};
        const current_control_state_t before = state;
        target.turn = (n & 1) ? -1 : 1;
        (void)step();
        TEST_ASSERT_FALSE(limited);
        TEST_ASSERT_EQUAL_INT32(before.s_d_q30, state.s_d_q30);
        TEST_ASSERT_EQUAL_INT32(before.s_q_q30, state.s_q_q30);
        not_clear += out.clear ? 0 : 1;
    }
    TEST_ASSERT_GREATER_THAN_INT(80000, not_clear);
}

/* With the d axis first, at the beginning of each of the table's cells, and a q voltage four LSB above what the cell
 * leaves: the shortest voltages that are limited. None of them may take the shortcut for those inside the circle. */
void test_every_cell_of_the_circle_limits_a_voltage_just_above_it(void)
{
    target.psi.d = (q15_t)(target.psi.d - 1);
    for (int cell = 0; cell < 256; cell++) {
        const double d = -(cell * 128 + 2), q = fx_circle_table[cell] + 4;
        for (int sign = -1; sign <= 1; sign += 2) {
            state = (current_control_state_t){(int32_t)(d * v_max()), (int32_t)(sign * q * v_max())};
            (void)step();
            TEST_ASSERT_TRUE(limited);
        }
    }
}

/* The voltage v in LSB of q15 of the circle's radius, by one integrator alone. */
static int32_t integrator_for(int32_t v)
{
    int32_t s = (int32_t)((v - 2) / 32768.0 * v_max() * 32768.0);
    do {
        s += 256;
        state = (current_control_state_t){.s_q_q30 = s};
        (void)step();
        TEST_ASSERT_TRUE(out.clear);
    } while ((int16_t)(out.v >> 16) < v);
    TEST_ASSERT_EQUAL_INT(v, (int16_t)(out.v >> 16));
    return s;
}

/* 182/256 of q is the first voltage that leaves the d axis less than its 0.7, 22,938: it keeps them, and 22,930 are not
 * limited. The cell from 182/256 on leaves 22,913. */
void test_the_d_axis_keeps_its_share_of_the_circle_from_the_first_q_voltage_that_leaves_less(void)
{
    const int32_t s_d = integrator_for(22930), s_q = integrator_for(182 * 128);
    state = (current_control_state_t){s_d, s_q};
    target.psi.d = (q15_t)(target.psi.d + 1);
    (void)step();
    TEST_ASSERT_FALSE(limited);
    TEST_ASSERT_FALSE(out.clear);
    TEST_ASSERT_EQUAL_INT(22930, (int16_t)out.v);
    TEST_ASSERT_EQUAL_INT(182 * 128, (int16_t)(out.v >> 16));
}

/* With v_q = 0 the d axis may use the whole circle although the q axis has priority. */
void test_a_d_voltage_inside_the_circle_is_not_limited_while_the_d_flux_is_to_rise(void)
{
    state.s_d_q30 = (int32_t)(0.99 * v_max()) * 32768;
    target.psi.d = (q15_t)(target.psi.d + 1);
    (void)step();
    TEST_ASSERT_FALSE(limited);
    TEST_ASSERT_FALSE(out.clear);
}

/* A machine at high speed has the largest flux that the voltage can hold (|psi| = v_max/|w|, any angle), and the
 * reference is then set to zero current. The flux follows dpsi/dt = u - j w psi. If the d axis always had priority, the
 * machine would stay at u = (0.97, -0.25) v_max with this flux. From every angle the target must be reached. */
void test_from_every_flux_at_the_voltage_limit_the_target_is_reached(void)
{
    const double w = -1885.0; /* 6000 rpm, three pole pairs */
    const twin_flux_t magnet = twin_flux_table(&f.si, (twin_dq_t){0.0, 0.0});
    for (int n = 0; n < 24; n++) {
        const double phi = n * (2.0 * 3.14159265358979323846 / 24.0);
        const double psi_max = f.si.v_ratio * 350.0 / 1885.0;
        double psi_d = psi_max * cos(phi);
        double psi_q = psi_max * sin(phi);
        twin_dq_t acting = {-w * psi_q, w * psi_d};
        current_control_reset(&state);
        target.psi = (dq_q15_halfword_t){(q15_t)lround(magnet.psi_d / f.psi * 32768.0), 0};
        const flux_point_t at = {.psi_d = target.psi.d, .psi_q = 0, .psi_f0 = target.psi.d};
        target = target_at((dq_q15_t){0, 0}, &at, (int)lround(w / f.w * 32768.0), 0);
        for (int k = 0; k < 400; k++) { /* 40 ms, one period of delay */
            flux.psi_d = (q15_t)lround(psi_d / f.psi * 32768.0);
            flux.psi_q = (q15_t)lround(psi_q / f.psi * 32768.0);
            const dq_q15_t u = step();
            for (int sub = 0; sub < 10; sub++) {
                const double d = acting.d + w * psi_q;
                const double q = acting.q - w * psi_d;
                psi_d += 1e-5 * d;
                psi_q += 1e-5 * q;
            }
            acting = (twin_dq_t){from_q15(u.d) * f.v, from_q15(u.q) * f.v};
        }
        TEST_ASSERT_DOUBLE_WITHIN(0.02 * psi_max, magnet.psi_d, psi_d);
        TEST_ASSERT_DOUBLE_WITHIN(0.02 * psi_max, 0.0, psi_q);
    }
}

/* With u_d = 0 the first of the 256 table steps leaves sqrt(1 - 1/256^2). */
void test_a_voltage_inside_the_circle_is_not_reported_as_limited(void)
{
    state.s_q_q30 = (int32_t)(0.9999 * v_max()) * 32768;
    TEST_ASSERT_INT_WITHIN(1, 0.9999 * v_max(), step().q);
    TEST_ASSERT_FALSE(limited);
    state.s_q_q30 = (int32_t)(v_max() + 1.0) * 32768;
    TEST_ASSERT_INT_WITHIN(1, v_max(), step().q);
    TEST_ASSERT_TRUE(limited);
    for (int sign = -1; sign <= 1; sign++) { /* d is inside the circle: nothing is subtracted from q in any direction */
        target.turn = sign;
        state = (current_control_state_t){.s_d_q30 = (int32_t)(0.98 * v_max()) * 32768};
        TEST_ASSERT_INT_WITHIN(1, 0, step().q);
        TEST_ASSERT_FALSE(limited);
        TEST_ASSERT_FALSE(out.clear);
    }
}

/* The modulation relies on it: `clear` means that |v| is below this bound, where no pulse can be limited (MO-11). A
 * limited voltage was beyond the unit circle. */
void test_clear_is_set_exactly_inside_its_circle(void)
{
    uint64_t seed = 54;
    const double bound = f.current_control.clear_q30 / 1073741824.0;
    for (int n = 0; n < 100000; n++) {
        state = (current_control_state_t){random_in(&seed, -500000000, 500000000),
                                          random_in(&seed, -500000000, 500000000)};
        (void)step();
        const double square = (of_v(0) * of_v(0) + of_v(1) * of_v(1)) / v_max() / v_max();
        TEST_ASSERT_TRUE(out.clear ? square < bound + 1e-9 : limited || square > bound - 1e-9);
        TEST_ASSERT_FALSE(out.clear && limited);
    }
}

void test_a_voltage_on_the_circle_of_clear_itself_is_not_clear(void)
{
    const int32_t s = integrator_for(10000);
    for (int inside = 0; inside < 2; inside++) {
        f.current_control.clear_q30 = (uint32_t)(10000 * 10000 + inside);
        state = (current_control_state_t){.s_q_q30 = s};
        (void)step();
        TEST_ASSERT_EQUAL(inside, out.clear);
    }
}

/* Ten seconds at the limit: the integrator settles where the anti-windup balances the integrated error; the voltage
 * before the limit is then v_max + sigma b e. When the error reverses with the same magnitude, the voltage leaves the
 * limit in the same period. */
void test_the_integrator_settles_at_the_limit_and_leaves_it_immediately(void)
{
    in.v_dc = 4000;
    const int32_t initial = target.psi.q;
    target.psi.q = (q15_t)(initial + 200);
    target.weighted = q30(words(target.psi));
    for (int n = 0; n < 5000; n++) {
        (void)step();
    }
    const q31_t settled = state.s_q_q30;
    for (int n = 0; n < 100000; n++) {
        (void)step();
    }
    TEST_ASSERT_TRUE(limited);
    TEST_ASSERT_INT_WITHIN(32768, settled, state.s_q_q30);
    TEST_ASSERT_INT_WITHIN(2, v_max() + 0.8488 * 200 * (0.7 - 1.0), settled >> 15);
    target.psi.q = (q15_t)(initial - 200);
    target.weighted = q30(words(target.psi));
    TEST_ASSERT_LESS_THAN_INT((int)v_max(), step().q);
    TEST_ASSERT_LESS_THAN_INT32(settled, state.s_q_q30);
}

/* By hand: v_max = 2280. With s = 8000 the limit removes 5720, and s is reduced by a_i/b = 1/14 of that per period.
 * With s = 20000 the reduction is computed from four times the circle at most. */
void test_an_integrator_far_beyond_the_limit_returns_to_it_with_either_sign(void)
{
    in.v_dc = 4000;
    for (int sign = -1; sign <= 1; sign += 2) {
        state.s_q_q30 = sign * 20000 * 32768;
        (void)step();
        TEST_ASSERT_INT_WITHIN(3, sign * (20000 - 4 * 2280 / 14), state.s_q_q30 >> 15);
        state.s_q_q30 = sign * 8000 * 32768;
        (void)step();
        TEST_ASSERT_INT_WITHIN(3, sign * (8000 - 5720 / 14), state.s_q_q30 >> 15);
        for (int n = 0; n < 200; n++) { /* (13/14)^200 */
            (void)step();
        }
        TEST_ASSERT_INT_WITHIN(15, sign * 2280, state.s_q_q30 >> 15);
    }
}

/* The proportional part exceeds the limit in the other direction: what it lacks raises an integrator that is at its end
 * already. */
void test_the_anti_windup_does_not_leave_the_range_of_the_integrators(void)
{
    in.v_dc = 4000;
    for (int sign = -1; sign <= 1; sign += 2) {
        const int32_t end = (sign > 0) ? (1 << 30) - 1 : -(1 << 30);
        state = (current_control_state_t){0, end};
        flux.psi_q = sign * 20000;
        target.psi.q = (q15_t)flux.psi_q;
        target.weighted.q = -sign * (1 << 30);
        (void)step();
        TEST_ASSERT_TRUE(limited);
        TEST_ASSERT_EQUAL_INT32(end, state.s_q_q30);
    }
}

/* The anti-windup of each axis uses the limit of this axis only. */
void test_an_axis_at_its_limit_does_not_affect_the_integrator_of_the_other(void)
{
    in.v_dc = 4000;
    state.s_d_q30 = 1000 * 32768;
    state.s_q_q30 = 20000 * 32768;
    target.psi.d = (q15_t)(target.psi.d - 10);
    (void)step();
    TEST_ASSERT_EQUAL_INT32(1000 * 32768 - 10 * f.current_control.integral_gain, state.s_d_q30);
    TEST_ASSERT_LESS_THAN_INT32(20000 * 32768, state.s_q_q30);
}

/* A v_dc below 1/(64 v_ratio), 898 LSB, is replaced by that value; at 0 and 1 LSB the output is 0. */
void test_without_dc_voltage_the_output_is_zero(void)
{
    state.s_d_q30 = -100 * 32768;
    in.v_dc = 898;
    TEST_ASSERT_INT_WITHIN(1, -100, step().d);
    const fx_pair_t at_898 = out.v;
    in.v_dc = 200;
    out = current_control_step(&f.current_control, &state, &in);
    TEST_ASSERT_INT_WITHIN(64, (int16_t)at_898, (int16_t)out.v);
    for (in.v_dc = 0; in.v_dc < 2; in.v_dc++) {
        target.weighted = q30((dq_q15_t){-20000, 20000});
        out = current_control_step(&f.current_control, &state, &in);
        TEST_ASSERT_EQUAL_UINT32(0, out.v);
    }
}

void test_the_worst_corner_of_every_input_neither_wraps_nor_leaves_the_circle(void)
{
    for (int n = 0; n < 512; n++) {
        const q15_t end[2] = {INT16_MAX, INT16_MIN};
        flux.psi_d = end[n & 1];
        flux.psi_q = end[(n >> 1) & 1];
        target.psi = (dq_q15_halfword_t){end[(n >> 2) & 1], end[(n >> 3) & 1]};
        target.weighted = q30((dq_q15_t){end[(n >> 4) & 1], end[(n >> 5) & 1]});
        target.turn = end[(n >> 6) & 1] / 32 * 11;
        target.integral_turn = (q15_t)(((n >> 7) & 1) ? 1100 : -1100);
        state.s_d_q30 = state.s_q_q30 = (n & 256) ? -(1 << 30) : (1 << 30) - 1;
        in.v_dc = (n & 1) ? 32767 : 900;
        const dq_q15_t u = step(); /* at most |v_q| = 1 and the 0.7 that the d axis always keeps */
        TEST_ASSERT_TRUE(hypot(u.d, u.q) <= v_max() * hypot(1.0, 0.7) + 1.5);
    }
}

void test_reset_clears_everything(void)
{
    state = (current_control_state_t){1, 2};
    current_control_reset(&state);
    TEST_ASSERT_EQUAL_INT32(0, state.s_d_q30);
    TEST_ASSERT_EQUAL_INT32(0, state.s_q_q30);
}
