/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "control/mrai/schedule.h"
#include "fixture.h"
#include "unity.h"

static fixture_t f;
static mrai_quality_t quality;
static mrai_state_t identifier;
static operating_point_t sample;

void setUp(void)
{
    f = fixture();
    quality = (mrai_quality_t){0};
    identifier = (mrai_state_t){0};
    sample = (operating_point_t){.i = {-9000, 12000}, .omega = 0x20000000};
    sample.flux = flux_table_step(&f.flux_table, sample.i);
}

void tearDown(void)
{
}

static mrai_schedule_t step(bool enabled)
{
    const mrai_schedule_in_t in = {&sample, &sample, &identifier, enabled};
    return mrai_schedule_step(&f.mrai, &quality, &in);
}

static void at(int id, int iq, int omega)
{
    sample.i = (dq_q15_t){(q15_t)id, (q15_t)iq};
    sample.flux = flux_table_step(&f.flux_table, sample.i);
    sample.omega = omega * 65536;
}

/* Relative errors: the quotient flux_gain/w is truncated to an integer of 2000 or more; resistance_gain/256 has 17
 * bits. A resistance gain of 32 or more saturates. */
void test_the_gains_follow_the_twin_over_speed_and_current(void)
{
    worst_t flux = {0};
    worst_t resistance = {0};
    worst_t voltage = {0};
    uint64_t seed = 81;
    for (int n = 0; n < 200000; n++) {
        at(random_in(&seed, -28000, 0), random_in(&seed, -28000, 28000), random_in(&seed, -32768, 32767));
        twin_mrai_quality_t q = {0};
        const twin_mrai_state_t idle = {0};
        twin_mrai_in_t t = {.i = {from_q15(sample.i.d) * f.i, from_q15(sample.i.q) * f.i},
                            .omega = from_q31(sample.omega) * f.w};
        const mrai_schedule_t y = step(true);
        const twin_mrai_schedule_t s = twin_mrai_schedule(&f.si, &q, &t, &t, &idle, true);
        const double flux_now = y.flux_step_q28 / 268435456.0;
        const double r_now = y.resistance_step_q26 / 67108864.0 * f.w / (f.i * f.i);
        const double magnitude = hypot(sample.i.d, sample.i.q);
        worst_note(&voltage, -y.minus_voltage_q28 / 268435456.0 / (f.w * f.si.period_s) - s.voltage_scale, "w %d",
                   sample.omega);
        if (fabs(magnitude - f.mrai.i_min) < 1.5) {
            continue; /* rounding of the magnitude decides */
        }
        TEST_ASSERT_EQUAL(s.flux_gain != 0.0, y.flux_step_q28 != 0);
        if (s.flux_gain != 0.0) {
            worst_note(&flux, flux_now / s.flux_gain - 1.0, "w %d", sample.omega);
        }
        TEST_ASSERT_EQUAL(s.resistance_gain != 0.0, y.resistance_step_q26 != 0);
        if (y.resistance_step_q26 != 0 && y.resistance_step_q26 != INT32_MAX) {
            worst_note(&resistance, r_now / s.resistance_gain - 1.0, "i %d %d", sample.i.d, sample.i.q);
        }
    }
    ASSERT_WORST(flux, 6e-4);
    ASSERT_WORST(resistance, 1e-4);
    ASSERT_WORST(voltage, 3e-5); /* 7/360 (w T_s/2)^4 of the series at omega_b */
}

void test_disabled_identification_stops_both_laws_but_keeps_the_voltage_correction(void)
{
    at(-9000, 12000, 16000);
    const mrai_schedule_t on = step(true);
    const mrai_schedule_t off = step(false);
    TEST_ASSERT_NOT_EQUAL(0, on.flux_step_q28);
    TEST_ASSERT_NOT_EQUAL(0, on.resistance_step_q26);
    TEST_ASSERT_EQUAL_INT32(0, off.flux_step_q28);
    TEST_ASSERT_EQUAL_INT32(0, off.resistance_step_q26);
    TEST_ASSERT_EQUAL_INT32(on.minus_voltage_q28, off.minus_voltage_q28);
    TEST_ASSERT_LESS_THAN_INT32(-(f.mrai.period / 8), on.minus_voltage_q28);
    TEST_ASSERT_EQUAL_INT32(2 * on.minus_voltage_q28, on.minus_voltage_d_q28);
}

void test_the_flux_adapts_above_its_lowest_speed_in_both_directions(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        at(-9000, 12000, sign * f.mrai.omega_min);
        TEST_ASSERT_TRUE(sign * step(true).flux_step_q28 > 0);
        at(-9000, 12000, sign * (f.mrai.omega_min - 1));
        TEST_ASSERT_EQUAL_INT32(0, step(true).flux_step_q28);
        TEST_ASSERT_EQUAL_INT32(0, step(true).resistance_step_q26);
    }
}

void test_both_laws_need_current_and_the_resistance_law_a_speed_below_its_limit(void)
{
    at(0, f.mrai.i_min, 5000);
    TEST_ASSERT_TRUE(step(true).resistance_step_q26 > 0);
    TEST_ASSERT_TRUE(step(true).flux_step_q28 > 0);
    at(0, f.mrai.i_min - 1, 5000);
    TEST_ASSERT_EQUAL_INT32(0, step(true).resistance_step_q26);
    TEST_ASSERT_EQUAL_INT32(0, step(true).flux_step_q28);
    for (int sign = -1; sign <= 1; sign += 2) {
        at(-9000, 12000, sign * f.mrai.omega_r_max);
        TEST_ASSERT_TRUE(step(true).resistance_step_q26 > 0);
        at(-9000, 12000, sign * (f.mrai.omega_r_max + 1));
        TEST_ASSERT_EQUAL_INT32(0, step(true).resistance_step_q26);
        TEST_ASSERT_NOT_EQUAL(0, step(true).flux_step_q28);
    }
}

/* With i_min = 0 the norm of the current may be 0: the quotient saturates, without a division by zero. */
void test_at_zero_current_without_a_lower_limit_the_gains_saturate(void)
{
    f.mrai.i_min = 0;
    at(0, 0, 2000);
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, step(true).resistance_step_q26);
    f.mrai.flux_gain = INT32_MAX;
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, step(true).flux_step_q28);
    at(0, 0, -2000);
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, step(true).flux_step_q28);
}

/* 1 - 0.98^n: one half after 35 steps; the rounding to q15 ends the rise 1/2 LSB/0.02 = 25 LSB below 1. */
void test_the_quality_of_a_constant_parameter_rises_at_the_rate_of_the_filter(void)
{
    at(-9000, 12000, 16000);
    for (int n = 0; n < 35; n++) {
        (void)step(true);
    }
    TEST_ASSERT_INT_WITHIN(200, 16600, quality.psi_quality); /* 1 - 0.98^35 = 0.507 */
    TEST_ASSERT_INT_WITHIN(200, 16600, quality.r_quality);
    for (int n = 0; n < 800; n++) {
        (void)step(true);
    }
    TEST_ASSERT_INT_WITHIN(40, 32767, quality.psi_quality);
    TEST_ASSERT_INT_WITHIN(40, 32767, quality.r_quality);
}

void test_the_quality_is_zero_at_full_drift_and_three_quarters_at_a_quarter_of_it(void)
{
    at(-9000, 12000, 16000);
    f.mrai.psi_delta_max = Q31(0.5);
    f.mrai.r_delta_min = Q31(-0.5);
    for (int n = 0; n < 1000; n++) {
        identifier.psi_delta += f.mrai.psi_drift_full / 4; /* 1000 such steps do not wrap */
        identifier.r_delta -= 2 * f.mrai.r_drift_full / 2;
        (void)step(true);
    }
    TEST_ASSERT_INT_WITHIN(60, 24575, quality.psi_quality);
    TEST_ASSERT_INT_WITHIN(60, 0, quality.r_quality);
}

/* i_q steps between 1000 and 12000 counts: the gain for the small current is 144 times too high for the large one. */
void test_the_resistance_gain_is_the_smaller_one_of_the_present_and_the_commanded_current(void)
{
    f.mrai.i_min = 0;
    at(0, 1000, 16000);
    const operating_point_t small = sample;
    const int32_t gain_at_small = step(true).resistance_step_q26;
    at(0, 12000, 16000);
    const int32_t gain_at_large = step(true).resistance_step_q26;
    TEST_ASSERT_TRUE(gain_at_small / 20 > gain_at_large); /* 144 times, but the larger one is saturated */
    const mrai_schedule_in_t up = {&small, &sample, &identifier, true};
    TEST_ASSERT_EQUAL_INT32(gain_at_large, mrai_schedule_step(&f.mrai, &quality, &up).resistance_step_q26);
    const mrai_schedule_in_t down = {&sample, &small, &identifier, true};
    TEST_ASSERT_EQUAL_INT32(gain_at_large, mrai_schedule_step(&f.mrai, &quality, &down).resistance_step_q26);
}

/* A flux error would falsify the identified resistance. */
void test_the_resistance_law_waits_until_the_flux_has_settled(void)
{
    at(-9000, 12000, 16000);
    identifier.psi_delta = f.mrai.psi_drift_full / 4;
    const mrai_schedule_t drifting = step(true);
    TEST_ASSERT_NOT_EQUAL(0, drifting.flux_step_q28);
    TEST_ASSERT_EQUAL_INT32(0, drifting.resistance_step_q26);
    identifier.psi_delta += f.mrai.psi_drift_full / 6;
    TEST_ASSERT_TRUE(step(true).resistance_step_q26 > 0);
    identifier.psi_delta -= f.mrai.psi_drift_full / 4; /* a negative drift */
    TEST_ASSERT_EQUAL_INT32(0, step(true).resistance_step_q26);
}

void test_parameters_that_do_not_adapt_or_are_clamped_lose_their_quality(void)
{
    at(-9000, 12000, 16000);
    quality.psi_quality = quality.r_quality = 32767;
    identifier.psi_delta = quality.psi_last = f.mrai.psi_delta_min;
    for (int n = 0; n < 1000; n++) {
        (void)step(true);
    }
    TEST_ASSERT_INT_WITHIN(40, 0, quality.psi_quality);
    TEST_ASSERT_INT_WITHIN(40, 32767, quality.r_quality);
    identifier.psi_delta = quality.psi_last = 0;
    identifier.r_delta = quality.r_last = f.mrai.r_delta_max;
    for (int n = 0; n < 1000; n++) {
        (void)step(true);
    }
    TEST_ASSERT_INT_WITHIN(40, 32767, quality.psi_quality);
    TEST_ASSERT_INT_WITHIN(40, 0, quality.r_quality);
    identifier.r_delta = quality.r_last = 0;
    quality.r_quality = 32767;
    for (int n = 0; n < 1000; n++) {
        (void)step(false);
    }
    TEST_ASSERT_INT_WITHIN(40, 0, quality.psi_quality);
    TEST_ASSERT_INT_WITHIN(40, 0, quality.r_quality);
}

void test_the_quality_follows_the_twin_over_changing_operating_points(void)
{
    twin_mrai_quality_t twin = {0};
    worst_t worst = {0};
    uint64_t seed = 82;
    f.mrai.r_delta_min = Q31(-0.5);
    f.mrai.r_delta_max = Q31(0.5);
    for (int n = 0; n < 20000; n++) {
        if (n % 500 == 0) {
            at(random_in(&seed, -20000, 0), random_in(&seed, -20000, 20000), random_in(&seed, -32000, 32000));
        }
        /* Shares of the full drift, none of them near 0.2, below which the resistance adapts. */
        static const double share[8] = {0.0, 0.05, 0.1, -0.15, 0.3, -0.6, 0.9, 1.7};
        identifier.psi_delta +=
            (q31_t)(share[random_in(&seed, 0, 7)] * (random_in(&seed, 0, 1) ? 1 : -1) * f.mrai.psi_drift_full);
        identifier.r_delta += random_in(&seed, -f.mrai.r_drift_full, f.mrai.r_drift_full);
        identifier.psi_delta = fx_clamp_q31(identifier.psi_delta, -400000000, 200000000);
        const twin_mrai_in_t t = {.i = {from_q15(sample.i.d) * f.i, from_q15(sample.i.q) * f.i},
                                  .omega = from_q31(sample.omega) * f.w};
        const twin_mrai_state_t state = {.psi_delta = from_q31(identifier.psi_delta) * f.psi,
                                         .r_delta = from_q31(identifier.r_delta) * f.z};
        (void)step(true);
        (void)twin_mrai_schedule(&f.si, &twin, &t, &t, &state, true);
        worst_note(&worst, quality.psi_quality - twin.psi_quality * 32768.0, "psi, step %d", n);
        worst_note(&worst, quality.r_quality - twin.r_quality * 32768.0, "r, step %d", n);
    }
    ASSERT_WORST(worst, 60.0); /* the filter's dead band of 25 LSB, and a relative error of 1e-3 of drift_full in q31 */
}
