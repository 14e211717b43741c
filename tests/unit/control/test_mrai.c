/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <stdlib.h>

#include "control/mrai/mrai.h"
#include "fixture.h"
#include "unity.h"

static fixture_t f;
static mrai_state_t state;
static twin_mrai_state_t twin;
static mrai_schedule_t schedule;
static twin_mrai_schedule_t twin_schedule;

static const double q27 = 134217728.0;

/* Schedule without adaptation. */
static mrai_schedule_t voltage(int32_t minus_q28)
{
    return (mrai_schedule_t){.minus_voltage_d_q28 = 2 * minus_q28, .minus_voltage_q28 = minus_q28};
}

void setUp(void)
{
    f = fixture();
    state = (mrai_state_t){0};
    twin = (twin_mrai_state_t){0};
    schedule = voltage(-(f.mrai.period / 8));
    twin_schedule = (twin_mrai_schedule_t){.voltage_scale = 1.0};
}

void tearDown(void)
{
}

static operating_point_t at(int id, int iq, double omega)
{
    const dq_q15_t i = {(q15_t)id, (q15_t)iq};
    const q31_t speed = (q31_t)(omega * 2147483647.0);
    return (operating_point_t){.i = i, .flux = flux_table_step(&f.flux_table, i), .omega = speed};
}

/* The inputs of the stage in SI units. */
static twin_mrai_in_t to_si(const operating_point_t *in)
{
    twin_mrai_in_t t = {{from_q15(in->i.d) * f.i, from_q15(in->i.q) * f.i},
                        {from_q15(in->u.d) * f.v, from_q15(in->u.q) * f.v},
                        {.clamped = false},
                        from_q31(in->omega) * f.w};
    t.flux.g_d = t.flux.g_q = from_q15(in->flux.g) / f.z;
    t.flux.psi_d = from_q15(in->flux.psi_d) * f.psi;
    t.flux.psi_q = from_q15(in->flux.psi_q) * f.psi;
    return t;
}

static void start_at(const operating_point_t *in)
{
    mrai_start_before_step(&state);
    mrai_step(&f.mrai, &schedule, &state, in);
    mrai_start_after_step(&state);
}

/* Resets both observers at `in`; the parameters are kept. */
static void reset_both(const operating_point_t *in)
{
    const twin_mrai_in_t t = to_si(in);
    start_at(in);
    twin_mrai_reset(&twin, &t);
}

static void set_error(double e_d, double e_q)
{
    const int32_t d = (int32_t)lround(e_d * q27);
    const int32_t q = (int32_t)lround(e_q * q27);
    state.predicted_d_q27 += d - state.e_d_q27; /* weighted, as e is */
    state.predicted_q_q27 += q - state.e_q_q27;
    state.e_d_q27 = d;
    state.e_q_q27 = q;
    twin.e = (twin_dq_t){d / q27 * f.psi, q / q27 * f.psi};
}

static void step_both(const operating_point_t *in)
{
    const twin_mrai_in_t t = to_si(in);
    mrai_step(&f.mrai, &schedule, &state, in);
    twin_mrai(&f.si, &twin_schedule, &twin, &t);
}

/* Steady-state voltage at in->i of a machine with the deviations dpsi and dR: u = R i + j w psi. */
static void steady_voltage(operating_point_t *in, double psi_delta, double r_delta)
{
    const double w = from_q31(in->omega);
    const double r = 674.0 / 65536.0 + r_delta;
    in->u.d = (q15_t)lround(r * in->i.d - w * in->flux.psi_q);
    in->u.q = (q15_t)lround(r * in->i.q + w * (in->flux.psi_d + psi_delta * 32768.0));
}

static void enable_flux_law(const operating_point_t *in)
{
    const double w = from_q31(in->omega);
    twin_schedule.flux_gain = 2.0 * f.si.flux_bandwidth_rad_s / (w * f.w);
    schedule.flux_step_q28 = (int32_t)lround(2.0 * f.si.flux_bandwidth_rad_s / (w * f.w) * 268435456.0);
}

static void enable_resistance_law(const operating_point_t *in)
{
    const double a = 2.0 * from_q15(in->i.d);
    const double b = from_q15(in->i.q);
    /* Q26 ends at 32 */
    const double gain = fmin(2.0 * f.si.resistance_bandwidth_rad_s / f.w / (a * a + b * b), 31.99);
    schedule.resistance_step_q26 = (int32_t)lround(gain * 67108864.0);
    twin_schedule.resistance_gain = gain * f.w / (f.i * f.i);
}

/* --- pole placement -------------------------------------------------------------------------- */

/* d(e[k+1])/d(e[k]) by central differences of the step itself. */
static void jacobian(bool fixed, const operating_point_t *in, double j[2][2])
{
    const double h = 0.0625; /* exact in q27 */
    for (int column = 0; column < 2; column++) {
        double out[2][2];
        for (int side = 0; side < 2; side++) {
            const double shift = (side == 0) ? -h : h;
            state = (mrai_state_t){0};
            twin = (twin_mrai_state_t){0};
            reset_both(in);
            set_error((column == 0) ? shift : 0.0, (column == 1) ? shift : 0.0);
            step_both(in);
            out[side][0] = fixed ? state.e_d_q27 / q27 : twin.e.d / f.psi;
            out[side][1] = fixed ? state.e_q_q27 / q27 : twin.e.q / f.psi;
        }
        j[0][column] = (out[1][0] - out[0][0]) / (2.0 * h);
        j[1][column] = (out[1][1] - out[0][1]) / (2.0 * h);
    }
}

/* Expected: I + (A + K) T_s with A + K = (S/2) [-1 1; -1 -1] at every speed; S as defined in the header, in SI. */
static void check_pole_placement(bool fixed, double tolerance)
{
    worst_t worst = {0};
    for (int w = -10; w <= 10; w++) {
        for (int id = -28000; id <= 0; id += 4000) {
            for (int iq = -28000; iq <= 28000; iq += 4000) {
                operating_point_t in = at(id, iq, w / 10.0);
                double j[2][2];
                in.u = (dq_q15_t){5000, -3000};
                jacobian(fixed, &in, j);
                const double inverse = 2.0 * from_q15(in.flux.g) / (f.si.period_s * f.z); /* 1/L_d + 1/L_q */
                const double s = 3.0 * f.si.r_ohm_20 * inverse;
                const double s2 = 0.5 * s * f.si.period_s;
                worst_note(&worst, j[0][0] - (1.0 - s2), "dd, i %d %d w %d", id, iq, w);
                worst_note(&worst, j[0][1] - s2, "dq, i %d %d w %d", id, iq, w);
                worst_note(&worst, j[1][0] + s2, "qd, i %d %d w %d", id, iq, w);
                worst_note(&worst, j[1][1] - (1.0 - s2), "qq, i %d %d w %d", id, iq, w);
            }
        }
    }
    ASSERT_WORST(worst, tolerance);
}

void test_the_twins_error_dynamics_are_s_half_times_minus1_1_minus1_minus1_at_every_speed(void)
{
    check_pole_placement(false, 1e-9);
}

/* Tolerance: two steps with 2 LSB of rounding in q27 over 2 h = 1.7e7 LSB: 2e-7; s2 in Q29 adds 1e-8. */
void test_the_fixed_point_error_dynamics_are_the_same_at_every_speed(void)
{
    check_pole_placement(true, 1e-6);
}

/* The paper prints k2 + w L_q/L_d = k3 + w L_d/L_q = sqrt(m^2/2 R^2/(L_d L_q) + (m^2+m)/4 (R^2/L_d^2 + R^2/L_q^2)).
 * With it the paper's condition (11) has a residual of m R^2 (L_d^2 + L_q^2)/(4 L_d^2 L_q^2); with
 * m/2 (R/L_d + R/L_q) the condition holds. */
void test_the_printed_gains_violate_the_papers_pole_condition_and_the_corrected_ones_satisfy_it(void)
{
    for (int m = 2; m <= 4; m++) {
        for (double l_q = 0.3e-3; l_q < 2e-3; l_q *= 1.3) {
            const double r = 0.02, l_d = 0.25e-3;
            const double a = r / l_d, b = r / l_q, s = m * (a + b);
            const double k1 = 0.5 * (m - 2) * a + 0.5 * m * b;
            const double k4 = 0.5 * (m - 2) * b + 0.5 * m * a;
            const double printed = sqrt(0.5 * m * m * a * b + 0.25 * (m * m + m) * (a * a + b * b));
            const double corrected = 0.5 * m * (a + b);
            const double diagonal = (a + k1) * (b + k4);
            const double residual = m * r * r * (l_d * l_d + l_q * l_q) / (4.0 * l_d * l_d * l_q * l_q);
            TEST_ASSERT_DOUBLE_WITHIN(1e-9 * s * s, residual, diagonal + printed * printed - 0.5 * s * s);
            TEST_ASSERT_DOUBLE_WITHIN(1e-9 * s * s, 0.0, diagonal + corrected * corrected - 0.5 * s * s);
        }
    }
}

/* |1 - s2 + j s2| < 1 requires s2 < 1; the stage allows 1/4. At a steady operating point an error of 0.1 pu must
 * decrease by this factor per period at every speed, from standstill to omega_b T_s = 0.39 rad. */
void test_the_explicit_step_is_stable_with_the_same_poles_over_the_whole_speed_range(void)
{
    for (int w = -20; w <= 20; w++) {
        operating_point_t in = at(-12000, 9000, w / 20.0 * 0.99);
        steady_voltage(&in, 0.0, 0.0);
        state = (mrai_state_t){0};
        reset_both(&in);
        set_error(0.1, -0.1);
        const double s2 = 3.0 * 674.0 / 65536.0 * from_q15(in.flux.g);
        const double start = 0.1 * sqrt(2.0);
        const int steps = 100;
        for (int n = 0; n < steps; n++) {
            mrai_step(&f.mrai, &schedule, &state, &in);
        }
        const double remaining = hypot(state.e_d_q27 / q27, state.e_q_q27 / q27);
        const double expected = start * pow((1.0 - s2) * (1.0 - s2) + s2 * s2, 0.5 * steps);
        /* The voltage is rounded to q15, which leaves an error of w_b T_s 2^-16/s2 < 1e-3. */
        TEST_ASSERT_DOUBLE_WITHIN(1.5e-3, expected, remaining);
    }
}

void test_the_fastest_poles_the_stage_accepts_are_still_stable(void)
{
    f.mrai.pole_gain = INT32_MAX;
    operating_point_t in = at(-8000, 8000, 0.9);
    in.flux.g = 32767; /* s2 = 1/4: |3/4 + j/4| = 0.79 per period */
    steady_voltage(&in, 0.0, 0.0);
    reset_both(&in);
    set_error(0.1, -0.1);
    for (int n = 0; n < 60; n++) {
        mrai_step(&f.mrai, &schedule, &state, &in);
    }
    TEST_ASSERT_INT_WITHIN(4 * 4096, 0, state.e_d_q27);
    TEST_ASSERT_INT_WITHIN(4 * 4096, 0, state.e_q_q27);
}

/* --- against the twin ------------------------------------------------------------------------ */

/* One step from random states. Errors of e: seven roundings in Q27, and the errors of the parameters times w_b T_s/2.
 * Errors of psi and R: s2 e in Q27, with s2 rounded to 2^-29, times gains of 0.5 and more. */
void test_a_single_step_follows_the_twin_over_the_whole_range(void)
{
    worst_t current = {0};
    worst_t psi = {0};
    worst_t r = {0};
    uint64_t seed = 71;
    for (int n = 0; n < 300000; n++) {
        const double w = (random_in(&seed, 0, 1) ? 1 : -1) * random_in(&seed, 50, 990) * 1e-3;
        operating_point_t last = at(random_in(&seed, -28000, 0), random_in(&seed, -28000, 28000), w);
        operating_point_t in = at(last.i.d + random_in(&seed, -500, 500), last.i.q + random_in(&seed, -500, 500), w);
        last.u = (dq_q15_t){(q15_t)random_in(&seed, -14000, 14000), (q15_t)random_in(&seed, -14000, 14000)};
        in.u = (dq_q15_t){(q15_t)random_in(&seed, -14000, 14000), (q15_t)random_in(&seed, -14000, 14000)};
        enable_flux_law(&in);
        if (abs(in.i.d) + abs(in.i.q) > 1700) {
            enable_resistance_law(&in);
        }
        const int32_t minus_q28 = -(f.mrai.period / 8 + random_in(&seed, 0, f.mrai.period / 512));
        schedule.minus_voltage_d_q28 = 2 * minus_q28;
        schedule.minus_voltage_q28 = minus_q28;
        twin_schedule.voltage_scale = -schedule.minus_voltage_q28 / 268435456.0 / (f.w * f.si.period_s);
        state = (mrai_state_t){.psi_delta = random_in(&seed, f.mrai.psi_delta_min / 2, f.mrai.psi_delta_max / 2),
                               .r_delta = random_in(&seed, f.mrai.r_delta_min / 2, f.mrai.r_delta_max / 2)};
        twin = (twin_mrai_state_t){.psi_delta = from_q31(state.psi_delta) * f.psi,
                                   .r_delta = from_q31(state.r_delta) * f.z};
        reset_both(&last);
        set_error(random_in(&seed, -200, 200) * 1e-3, random_in(&seed, -200, 200) * 1e-3);
        step_both(&in);
        if (fabs(twin.e.d) < 3.9 * f.psi && fabs(twin.e.q) < 3.9 * f.psi) { /* the stage limits e to 4 */
            worst_note(&current, state.e_d_q27 - twin.e.d / f.psi * q27, "e_d of i %d %d u %d %d w %.3f", in.i.d,
                       in.i.q, last.u.d, last.u.q, w);
            worst_note(&current, state.e_q_q27 - twin.e.q / f.psi * q27, "e_q of i %d %d u %d %d w %.3f", in.i.d,
                       in.i.q, last.u.d, last.u.q, w);
        }
        worst_note(&psi, from_q31(state.psi_delta) - twin.psi_delta / f.psi, "psi of i %d %d w %.3f", in.i.d, in.i.q,
                   w);
        worst_note(&r, from_q31(state.r_delta) - twin.r_delta / f.z, "r of i %d %d w %.3f", in.i.d, in.i.q, w);
        TEST_ASSERT_EQUAL(twin.psi_clamped, mrai_flux_clamped(&f.mrai, &state));
        TEST_ASSERT_EQUAL(twin.r_clamped, mrai_resistance_clamped(&f.mrai, &state));
    }
    ASSERT_WORST(psi, 2e-6);
    ASSERT_WORST(r, 2e-6);
    ASSERT_WORST(current, 100.0); /* an error of dpsi of 1e-6 times w_b T_s/2: 30 LSB of q27 */
}

/* The observer uses the change of the tables' flux, so that a changing current causes no error in spite of
 * saturation. */
void test_a_current_ramp_through_saturation_with_the_matching_voltage_causes_no_error(void)
{
    const double rate = 1.0 / (f.w * f.si.period_s);
    const double r = 674.0 / 65536.0;
    operating_point_t in = at(-2000, 1000, 0.3);
    for (int n = 0; n < 101; n++) {
        const operating_point_t next = at(in.i.d - 150, in.i.q + 200, 0.3);
        in.u.d = (q15_t)lround((next.flux.psi_d - in.flux.psi_d) * rate + r * 0.5 * (next.i.d + in.i.d) -
                               0.3 * 0.5 * (next.flux.psi_q + in.flux.psi_q));
        in.u.q = (q15_t)lround((next.flux.psi_q - in.flux.psi_q) * rate + r * 0.5 * (next.i.q + in.i.q) +
                               0.3 * 0.5 * (next.flux.psi_d + in.flux.psi_d));
        if (n == 0) {
            reset_both(&in);
        } else {
            mrai_step(&f.mrai, &schedule, &state, &in);
        }
        in = next;
    }
    /* 100 random roundings of u in q15, each w_b T_s 2^-16: 0.4 * 1.5e-5 * 10 */
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.0, state.e_d_q27 / q27);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.0, state.e_q_q27 / q27);
}

/* One second with noise: twin and stage must identify the same flux and resistance. */
void test_ten_thousand_noisy_periods_give_the_twins_parameters(void)
{
    uint64_t seed = 72;
    worst_t psi = {0};
    worst_t r = {0};
    operating_point_t base = at(-9000, 12000, 0.3);
    enable_flux_law(&base);
    enable_resistance_law(&base);
    reset_both(&base);
    for (int n = 0; n < 10000; n++) {
        operating_point_t in = at(-9000 + random_in(&seed, -60, 60), 12000 + random_in(&seed, -60, 60), 0.3);
        steady_voltage(&in, -0.08, 0.004);
        in.u.d = (q15_t)(in.u.d + random_in(&seed, -20, 20));
        in.u.q = (q15_t)(in.u.q + random_in(&seed, -20, 20));
        step_both(&in);
        worst_note(&psi, from_q31(state.psi_delta) - twin.psi_delta / f.psi, "period %d", n);
        worst_note(&r, from_q31(state.r_delta) - twin.r_delta / f.z, "period %d", n);
    }
    ASSERT_WORST(psi, 5e-6);
    ASSERT_WORST(r, 5e-6);
    /* and these must be those of the machine; the noise of single samples moves them by about 1e-3 */
    TEST_ASSERT_DOUBLE_WITHIN(3e-3, -0.08, from_q31(state.psi_delta));
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.004, from_q31(state.r_delta));
}

/* --- adaptation ------------------------------------------------------------------------------ */

/* With the integral part alone the flux has a first-order response of bandwidth k_psi: 63 % after 1/k_psi, at every
 * speed and in both directions. The observer (S/2 = 95 rad/s) is 16 times faster and adds 6 % of that time. */
void test_the_flux_bandwidth_is_the_same_at_every_speed(void)
{
    f.mrai.flux_proportional_q24 = 0;
    f.si.flux_bandwidth_rad_s = 6.0;
    for (int w = -9; w <= 9; w += 2) {
        if (w == -1 || w == 1) {
            continue;
        }
        operating_point_t in = at(-6000, 8000, w / 10.0);
        steady_voltage(&in, -0.1, 0.0);
        enable_flux_law(&in);
        state = (mrai_state_t){0};
        reset_both(&in);
        for (int n = 0; n < 1667; n++) {
            mrai_step(&f.mrai, &schedule, &state, &in);
        }
        TEST_ASSERT_DOUBLE_WITHIN(0.004, -0.0632, from_q31(state.psi_delta));
        for (int n = 0; n < 15000; n++) {
            mrai_step(&f.mrai, &schedule, &state, &in);
        }
        /* Rounding of u to q15: 2^-16/w of flux from u_q and, by the coupled poles, L_q/L_d times that from u_d. */
        TEST_ASSERT_DOUBLE_WITHIN(3e-4, -0.1, from_q31(state.psi_delta));
    }
}

void test_the_resistance_bandwidth_is_the_same_at_every_current(void)
{
    f.mrai.resistance_proportional_q24 = 0;
    for (int i = 6000; i <= 20000; i += 3500) {
        operating_point_t in = at(-i, i, 0.2);
        steady_voltage(&in, 0.0, 0.005);
        enable_resistance_law(&in);
        state = (mrai_state_t){0};
        reset_both(&in);
        for (int n = 0; n < 500; n++) { /* 1/k_r */
            mrai_step(&f.mrai, &schedule, &state, &in);
        }
        TEST_ASSERT_DOUBLE_WITHIN(0.0005, 0.00316, from_q31(state.r_delta));
        for (int n = 0; n < 6000; n++) {
            mrai_step(&f.mrai, &schedule, &state, &in);
        }
        TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.005, from_q31(state.r_delta));
    }
}

/* Identification starts at full speed with a magnet that is 19 % weak: the observer error reaches 0.7 pu before the
 * flux has changed. A limit of the error below that would make the flux overshoot by half. */
void test_a_large_deviation_at_high_speed_is_identified_without_overshoot(void)
{
    for (int w = -9; w <= 9; w += 3) {
        if (w == 0) {
            continue;
        }
        operating_point_t in = at(-6000, 8000, w / 10.0);
        steady_voltage(&in, -0.1, 0.0);
        enable_flux_law(&in);
        state = (mrai_state_t){0};
        reset_both(&in);
        q31_t lowest = 0;
        for (int n = 0; n < 2000; n++) {
            mrai_step(&f.mrai, &schedule, &state, &in);
            lowest = (state.psi_delta < lowest) ? state.psi_delta : lowest;
        }
        TEST_ASSERT_TRUE(from_q31(lowest) > -0.101);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, -0.1, from_q31(state.psi_delta));
    }
}

void test_the_flux_changes_towards_the_machines_for_both_signs_of_speed_and_of_deviation(void)
{
    for (int w = -1; w <= 1; w += 2) {
        for (int sign = -1; sign <= 1; sign += 2) {
            operating_point_t in = at(-6000, 8000, 0.4 * w);
            steady_voltage(&in, 0.05 * sign, 0.0);
            enable_flux_law(&in);
            state = (mrai_state_t){0};
            reset_both(&in);
            for (int n = 0; n < 50; n++) {
                mrai_step(&f.mrai, &schedule, &state, &in);
            }
            TEST_ASSERT_TRUE(sign * state.psi_delta > 0);
        }
    }
}

void test_without_adaptation_the_parameters_are_kept_to_the_bit_while_the_observer_continues(void)
{
    operating_point_t in = at(-6000, 8000, 0.4);
    steady_voltage(&in, -0.1, 0.005);
    state.psi_delta = 12345;
    state.r_delta = -6789;
    reset_both(&in);
    for (int n = 0; n < 10000; n++) {
        mrai_step(&f.mrai, &schedule, &state, &in);
    }
    TEST_ASSERT_EQUAL_INT32(12345, state.psi_delta);
    TEST_ASSERT_EQUAL_INT32(-6789, state.r_delta);
    TEST_ASSERT_TRUE(fabs(state.e_q_q27 / q27) > 0.01);
    TEST_ASSERT_FALSE(mrai_flux_clamped(&f.mrai, &state));
}

void test_adaptation_of_the_flux_does_not_change_the_resistance(void)
{
    operating_point_t in = at(-6000, 8000, 0.4);
    steady_voltage(&in, -0.1, 0.005);
    reset_both(&in);
    enable_flux_law(&in);
    for (int n = 0; n < 100; n++) {
        mrai_step(&f.mrai, &schedule, &state, &in);
    }
    TEST_ASSERT_EQUAL_INT32(0, state.r_delta);
    TEST_ASSERT_NOT_EQUAL(0, state.psi_delta);
}

/* A magnet beyond the limits: the parameter stays at its limit, is reported as clamped, and leaves the limit when the
 * deviation reverses. */
void test_the_flux_is_clamped_at_its_limits_reported_and_released(void)
{
    operating_point_t in = at(-6000, 8000, 0.5);
    enable_flux_law(&in);
    reset_both(&in);
    steady_voltage(&in, -0.3, 0.0);
    for (int n = 0; n < 3000; n++) {
        mrai_step(&f.mrai, &schedule, &state, &in);
    }
    TEST_ASSERT_EQUAL_INT32(f.mrai.psi_delta_min, state.psi_delta);
    TEST_ASSERT_TRUE(mrai_flux_clamped(&f.mrai, &state));
    steady_voltage(&in, 0.2, 0.0);
    for (int n = 0; n < 200; n++) { /* two time constants of the observer */
        mrai_step(&f.mrai, &schedule, &state, &in);
    }
    TEST_ASSERT_FALSE(mrai_flux_clamped(&f.mrai, &state)); /* no windup beyond the limit */
    for (int n = 0; n < 3000; n++) {
        mrai_step(&f.mrai, &schedule, &state, &in);
    }
    TEST_ASSERT_EQUAL_INT32(f.mrai.psi_delta_max, state.psi_delta);
    TEST_ASSERT_TRUE(mrai_flux_clamped(&f.mrai, &state));
}

void test_the_resistance_is_clamped_at_its_limits_and_reported(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        operating_point_t in = at(-12000, 12000, 0.2);
        enable_resistance_law(&in);
        state = (mrai_state_t){0};
        reset_both(&in);
        steady_voltage(&in, 0.0, (sign > 0) ? 0.03 : -0.0102);
        for (int n = 0; n < 6000; n++) {
            mrai_step(&f.mrai, &schedule, &state, &in);
        }
        TEST_ASSERT_EQUAL_INT32((sign > 0) ? f.mrai.r_delta_max : f.mrai.r_delta_min, state.r_delta);
        TEST_ASSERT_TRUE(mrai_resistance_clamped(&f.mrai, &state));
    }
}

/* The observer uses dpsi - k_P step. From the same state, with and without the proportional part, the integral is the
 * same and the error differs by half a period's rotational voltage of 20 steps; by hand: w w_b T_s/2 * 20 dpsi. */
void test_the_proportional_part_adds_its_multiple_of_the_step_in_this_period_only(void)
{
    operating_point_t in = at(-6000, 8000, 0.5);
    enable_flux_law(&in);
    steady_voltage(&in, 0.0, 0.0);
    reset_both(&in);
    set_error(0.0, -0.005);
    mrai_state_t without = state;
    mrai_step(&f.mrai, &schedule, &state, &in);
    f.mrai.flux_proportional_q24 = 0;
    mrai_step(&f.mrai, &schedule, &without, &in);
    TEST_ASSERT_NOT_EQUAL(0, state.psi_delta);
    TEST_ASSERT_EQUAL_INT32(without.psi_delta, state.psi_delta);
    const double difference = 0.5 * 0.5 * f.w * f.si.period_s * 20.0 * from_q31(state.psi_delta);
    /* k_P step in Q23: half an LSB is 6e-8, times w_b T_s/4 0.8 LSB of q27. */
    TEST_ASSERT_DOUBLE_WITHIN(3.0, difference * q27, state.e_q_q27 - without.e_q_q27);
    TEST_ASSERT_EQUAL_INT32(without.e_d_q27, state.e_d_q27);
}

/* --- rounding -------------------------------------------------------------------------------- */

/* Mean difference to the twin over 10^6 periods (100 s) of noise with zero mean. Unbiased rounding leaves a random
 * difference of 2000 LSB that is correlated over 100 periods: 20 LSB in the mean. Truncation would leave a constant
 * difference where half an LSB of q29 per period balances k_psi T_s: 2/(6e-3) LSB and more. */
void test_a_million_periods_of_zero_mean_noise_leave_no_bias(void)
{
    operating_point_t base = at(-9000, 12000, 0.3);
    uint64_t seed = 73;
    enable_flux_law(&base);
    enable_resistance_law(&base);
    reset_both(&base);
    /* the voltage of the nominal machine; its rounding acts on stage and twin alike */
    steady_voltage(&base, 0.0, 0.0);
    double psi = 0.0;
    double r = 0.0;
    for (int n = 0; n < 1000000; n++) {
        operating_point_t in = base;
        in.u.d = (q15_t)(in.u.d + random_in(&seed, -8, 8));
        in.u.q = (q15_t)(in.u.q + random_in(&seed, -8, 8));
        step_both(&in);
        psi += from_q31(state.psi_delta) - twin.psi_delta / f.psi;
        r += from_q31(state.r_delta) - twin.r_delta / f.z;
    }
    TEST_ASSERT_DOUBLE_WITHIN(100.0, 0.0, psi / 1e6 * 2147483648.0); /* 5e-8 of psi_b */
    TEST_ASSERT_DOUBLE_WITHIN(100.0, 0.0, r / 1e6 * 2147483648.0);
}

/* With a constant observer error of 1 LSB of q15 the integral is N 2 k_psi s2 e/w, with either sign. */
void test_the_smallest_constant_error_integrates_to_the_exact_ramp(void)
{
    const operating_point_t in = at(-6000, 8000, 0.3);
    enable_flux_law(&in);
    f.mrai.flux_proportional_q24 = 0;
    const double s2 = 3.0 * 674.0 / 65536.0 * from_q15(in.flux.g);
    const double step = 2.0 * 60.0 / (0.3 * f.w) * s2 / 32768.0;
    for (int sign = -1; sign <= 1; sign += 2) {
        state = (mrai_state_t){0};
        for (int n = 0; n < 100000; n++) {
            set_error(0.0, sign / 32768.0);
            mrai_step(&f.mrai, &schedule, &state, &in);
        }
        /* 2 LSB of rounding in each step; without noise it has the same sign in every step. */
        TEST_ASSERT_DOUBLE_WITHIN(1e5 * 3.0 / 2147483648.0, -sign * 1e5 * step, from_q31(state.psi_delta));
    }
}

/* The steps of errors +x and -x cancel: rounding half up differs between them only in a tie. */
void test_an_alternating_error_does_not_accumulate(void)
{
    const operating_point_t in = at(-6000, 8000, 0.3);
    enable_flux_law(&in);
    enable_resistance_law(&in);
    reset_both(&in);
    for (int n = 0; n < 1000000; n++) {
        const int sign = (n & 1) ? 1 : -1;
        state.e_d_q27 = sign * 1000003;
        state.e_q_q27 = sign * 777777;
        mrai_step(&f.mrai, &schedule, &state, &in);
    }
    TEST_ASSERT_INT_WITHIN(8, 0, state.psi_delta);
}

/* --- ends of the range ----------------------------------------------------------------------- */

void test_no_extreme_input_wraps_a_state(void)
{
    uint64_t seed = 74;
    for (int n = 0; n < 200000; n++) {
        static const int16_t extreme[4] = {INT16_MIN, -1, 0, INT16_MAX};
        operating_point_t in = {.i = {extreme[random_in(&seed, 0, 3)], extreme[random_in(&seed, 0, 3)]},
                                .u = {extreme[random_in(&seed, 0, 3)], extreme[random_in(&seed, 0, 3)]},
                                .omega = random_in(&seed, 0, 1) ? INT32_MIN : INT32_MAX};
        in.flux = (flux_point_t){
            .g = 32767, .psi_d = extreme[random_in(&seed, 0, 3)], .psi_q = extreme[random_in(&seed, 0, 3)]};
        schedule = (mrai_schedule_t){random_in(&seed, 0, 1) ? INT32_MIN : INT32_MAX,
                                     random_in(&seed, 0, 1) ? 0 : INT32_MAX, 0,
                                     random_in(&seed, 0, 1) ? 0 : -209000000};
        schedule.minus_voltage_d_q28 = 2 * schedule.minus_voltage_q28;
        f.mrai.pole_gain = INT32_MAX;
        f.mrai.flux_proportional_q24 = f.mrai.resistance_proportional_q24 = INT32_MAX;
        f.mrai.period = Q31(0.78);
        mrai_step(&f.mrai, &schedule, &state, &in);
        TEST_ASSERT_TRUE(state.psi_delta >= f.mrai.psi_delta_min && state.psi_delta <= f.mrai.psi_delta_max);
        TEST_ASSERT_TRUE(state.r_delta >= f.mrai.r_delta_min && state.r_delta <= f.mrai.r_delta_max);
    }
}

/* After a reset the steady-state voltage of the sample keeps the error at 0. */
void test_reset_clears_the_error_and_keeps_the_identified_parameters(void)
{
    operating_point_t in = at(-3000, 4000, 0.2);
    steady_voltage(&in, 300.0 / 32768.0, 0.001);
    state = (mrai_state_t){.e_d_q27 = 1, .e_q_q27 = 2, .psi_delta = 300 * 65536, .r_delta = Q31(0.001)};
    start_at(&in);
    TEST_ASSERT_EQUAL_INT32(0, state.e_d_q27);
    TEST_ASSERT_EQUAL_INT32(0, state.e_q_q27);
    TEST_ASSERT_EQUAL_INT32(300 * 65536, state.psi_delta);
    TEST_ASSERT_EQUAL_INT32(Q31(0.001), state.r_delta);
    mrai_step(&f.mrai, &schedule, &state, &in);
    TEST_ASSERT_INT_WITHIN(850, 0, state.e_d_q27); /* 1/2 LSB of u in q15, times w_b T_s = 0.39 */
    TEST_ASSERT_INT_WITHIN(850, 0, state.e_q_q27);
}

#define REJECTED(field, value) \
    do { \
        mrai_config_t c = f.mrai; \
        c.field = (value); \
        TEST_ASSERT_NOT_EQUAL_INT_MESSAGE(MOTOR_CHECK_OK, mrai_check(&c), #field " = " #value); \
    } while (0)

void test_a_configuration_outside_its_range_is_rejected(void)
{
    TEST_ASSERT_EQUAL_INT(MOTOR_CHECK_OK, mrai_check(&f.mrai));
    REJECTED(r0, 0);
    REJECTED(pole_gain, 0);
    REJECTED(flux_gain, -1);
    REJECTED(resistance_gain, -1);
    REJECTED(flux_proportional_q24, -1);
    REJECTED(resistance_proportional_q24, -1);
    REJECTED(psi_delta_min, c.psi_delta_max);
    REJECTED(psi_delta_min, Q31(-0.5) - 1);
    REJECTED(psi_delta_max, Q31(0.5) + 1);
    REJECTED(r_delta_min, c.r_delta_max);
    REJECTED(r_delta_min, Q31(-0.5) - 1);
    REJECTED(r_delta_max, Q31(0.5) + 1);
    REJECTED(omega_min, 0);
    REJECTED(period, 0);
    REJECTED(period, Q31(0.79));
    REJECTED(psi_drift_full, 0);
    REJECTED(r_drift_full, 0);
}
