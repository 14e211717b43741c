/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "control/torque/loop.h"
#include "fixture.h"
#include "unity.h"

static fixture_t f;
static torque_loop_state_t state;
static torque_loop_in_t in;

void setUp(void)
{
    f = fixture();
    state = (torque_loop_state_t){0};
    in = (torque_loop_in_t){.enabled = true, .confidence = Q15_MAX};
}

void tearDown(void)
{
}

static q15_t step(void)
{
    return torque_loop_step(&f.torque_loop, &state, &in);
}

/* A machine whose torque is a fixed share of the corrected torque, one step later. Returns the corrected torque. */
static q15_t run(double share, int steps)
{
    q15_t corrected = 0;
    for (int n = 0; n < steps; n++) {
        corrected = step();
        in.torque_estimated = (q15_t)lround(share * corrected);
    }
    return corrected;
}

void test_while_the_loop_is_disabled_the_commanded_torque_is_not_changed(void)
{
    in.enabled = false;
    for (int c = -32768; c <= 32767; c += 111) {
        in.torque_commanded = (q15_t)c;
        in.torque_estimated = (q15_t)(c / 2);
        TEST_ASSERT_EQUAL_INT(c, step());
    }
}

/* With a machine that makes 8.75 % too little, the corrected torque is 1/(1 - 0.0875) of the commanded one. */
void test_the_correction_makes_the_estimated_torque_equal_to_the_commanded(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        state = (torque_loop_state_t){0};
        in.torque_estimated = 0;
        in.torque_commanded = (q15_t)(sign * 10000);
        (void)run(0.9125, 2000);
        TEST_ASSERT_INT_WITHIN(2, in.torque_commanded, in.torque_estimated);
        TEST_ASSERT_DOUBLE_WITHIN(3e-4, 1.0 / 0.9125 - 1.0, from_q31(state.correction));
        TEST_ASSERT_FALSE(state.saturated);
    }
}

/* x is a ratio: found at 10000, it is valid at -3000. */
void test_a_correction_found_at_one_torque_is_valid_at_another_and_in_the_other_direction(void)
{
    in.torque_commanded = 10000;
    (void)run(0.9125, 2000);
    in.enabled = true;
    in.torque_commanded = in.torque_estimated = -3000;
    state.model = -3000 * 65536; /* no error: only x acts */
    TEST_ASSERT_INT_WITHIN(2, -3288, step());
}

/* The integral part ki e/|T*| has the same time constant at every torque, here without kp and with a settled model. */
void test_the_loop_has_the_same_time_constant_at_every_torque(void)
{
    f.torque_loop.kp = 0;
    for (int c = 1000; c <= 16000; c *= 2) {
        state = (torque_loop_state_t){.model = c * 65536};
        in.torque_commanded = (q15_t)c;
        in.torque_estimated = (q15_t)lround(0.8 * c);
        (void)run(0.8, 42); /* 1/(0.8 ki) */
        TEST_ASSERT_DOUBLE_WITHIN(0.012, 0.25 * 0.632, from_q31(state.correction));
    }
}

void test_a_step_of_a_perfect_machine_excites_no_integrator(void)
{
    /* T^ has the first-order response of the model and is the torque of the step before. */
    double torque = 0.0;
    in.torque_commanded = 12000;
    for (int n = 0; n < 200; n++) {
        in.torque_estimated = (q15_t)lround(torque);
        TEST_ASSERT_INT_WITHIN(1, 12000, step());
        torque += from_q15(f.torque_loop.model_rate) * (12000.0 - torque);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.0, from_q31(state.correction));
}

void test_switching_on_and_off_is_bumpless(void)
{
    in.torque_commanded = 10000;
    in.enabled = false;
    (void)run(0.95, 100);
    in.enabled = true;
    /* kp e of a settled 5 % error and one step of the integrator: 0.1 * 500 + 0.03 * 500 */
    const q15_t first = step();
    TEST_ASSERT_INT_WITHIN(66, 10000, first);
    (void)run(0.95, 2000);
    const q15_t before = step();
    in.enabled = false;
    const q15_t after = step();
    TEST_ASSERT_INT_WITHIN(20, before, after); /* ki x T* = 0.03 * 526 */
    (void)run(0.95, 2000);
    TEST_ASSERT_INT_WITHIN(1, 10000, step());
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.0, from_q31(state.correction));
}

/* The correction is at most 0.4 of the commanded torque for any estimate; the integrator is limited too and leaves the
 * limit immediately. */
void test_the_authority_limits_the_corrected_torque_and_the_integrator(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        state = (torque_loop_state_t){0};
        in.torque_commanded = (q15_t)(sign * 10000);
        in.torque_estimated = 0;
        for (int n = 0; n < 3000; n++) {
            TEST_ASSERT_INT_WITHIN(4001, in.torque_commanded, step());
        }
        TEST_ASSERT_INT_WITHIN(1, sign * 14000, step());
        TEST_ASSERT_TRUE(state.saturated);
        TEST_ASSERT_INT_WITHIN(1, f.torque_loop.authority, state.correction >> 16);
        in.torque_estimated = (q15_t)(sign * 15000);
        (void)step();
        (void)step();
        TEST_ASSERT_FALSE(state.saturated);
        TEST_ASSERT_LESS_THAN_INT(f.torque_loop.authority * 65536, state.correction);
    }
}

void test_the_lower_bound_of_the_authority_holds_as_well(void)
{
    in.torque_commanded = 10000;
    in.torque_estimated = 32767;
    for (int n = 0; n < 3000; n++) {
        TEST_ASSERT_TRUE(step() >= 5999);
    }
    TEST_ASSERT_INT_WITHIN(1, 6000, step());
    TEST_ASSERT_TRUE(state.saturated);
}

/* While voltage or current are at their limit, a correction above 0 has no effect: it decays at a quarter of the loop's
 * rate, so that it is not too much torque after the limit. A smaller one that is asked for is taken at once. */
void test_while_limited_the_correction_decays_and_may_fall_faster(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        state = (torque_loop_state_t){.correction = 100000000, .model = (sign > 0) ? 655360000 : -655360000};
        in.torque_commanded = (q15_t)(sign * 10000);
        in.limited = true;
        in.torque_estimated = (q15_t)(sign * 8000);
        const int steps = (int)lround(4.0 * 32768.0 / f.torque_loop.ki);
        for (int n = 0; n < steps; n++) {
            const q31_t before = state.correction;
            (void)step();
            TEST_ASSERT_LESS_THAN_INT32(before, state.correction);
        }
        TEST_ASSERT_DOUBLE_WITHIN(0.02, exp(-1.0), state.correction / 1e8);
        const q31_t before = state.correction;
        in.torque_estimated = (q15_t)(sign * 12000);
        (void)step();
        TEST_ASSERT_LESS_THAN_INT32(before - (q31_t)(before * from_q15(f.torque_loop.ki)), state.correction);
    }
}

/* An offset of the torque estimate must not enter the correction while no torque is commanded. */
void test_a_commanded_torque_of_zero_stays_zero_and_keeps_the_correction(void)
{
    state.correction = 123456789;
    in.torque_commanded = 0;
    in.torque_estimated = 900;
    for (int n = 0; n < 1000; n++) {
        TEST_ASSERT_EQUAL_INT(0, step());
    }
    TEST_ASSERT_EQUAL_INT32(123456789, state.correction);
}

/* Dividing by a small torque would amplify the noise of the estimate. */
void test_below_t_min_the_error_is_divided_by_t_min(void)
{
    f.torque_loop.kp = 0;
    in.torque_commanded = 400; /* T_min = 655 */
    in.torque_estimated = 0;
    state.model = 400 * 65536;
    (void)step();
    TEST_ASSERT_DOUBLE_WITHIN(2e-5, 0.03 * 400.0 / 655.0, from_q31(state.correction));
}

/* A commanded torque below T_min/2 = 327 and an offset of the estimate: as a ratio the offset would use the whole
 * authority in either direction and falsify the next torque. There the correction is kept, whatever its sign. */
void test_an_offset_at_a_small_torque_does_not_change_the_correction(void)
{
    static const int torques[] = {1, 6, 326};
    for (int n = 0; n < 3 * 8; n++) {
        const int sign = (n & 1) ? 1 : -1;
        const int offset = (n & 2) ? 20 : -20;
        const double correction = (n & 4) ? 0.1 : -0.1;
        state = (torque_loop_state_t){.correction = Q31(correction), .model = sign * torques[n / 8] * 65536};
        in.torque_commanded = (q15_t)(sign * torques[n / 8]);
        in.torque_estimated = (q15_t)(in.torque_commanded + offset);
        for (int k = 0; k < 10000; k++) {
            (void)step();
        }
        TEST_ASSERT_EQUAL_INT32(Q31(correction), state.correction);
        in.torque_commanded = in.torque_estimated = (q15_t)(sign * 10000);
        state.model = sign * 10000 * 65536;
        TEST_ASSERT_INT_WITHIN(2, sign * lround(10000.0 * (1.0 + correction)), step());
    }
}

/* From T_min/2 on the loop corrects, upwards and downwards. */
void test_from_half_of_t_min_on_the_correction_follows_the_error(void)
{
    for (int n = 0; n < 4; n++) {
        const int sign = (n & 1) ? 1 : -1;
        const int offset = (n & 2) ? 20 : -20; /* positive: more torque than commanded, if the sign is positive */
        state = (torque_loop_state_t){.correction = Q31(0.1), .model = sign * 327 * 65536};
        in.torque_commanded = (q15_t)(sign * 327);
        in.torque_estimated = (q15_t)(in.torque_commanded + offset);
        (void)step();
        TEST_ASSERT_DOUBLE_WITHIN(2e-5, 0.1 - 0.03 * sign * offset / 655.0, from_q31(state.correction));
    }
}

void test_an_alternating_error_of_one_lsb_does_not_accumulate_in_a_million_steps(void)
{
    in.torque_commanded = 10000;
    state.model = 10000 * 65536;
    for (int n = 0; n < 1000000; n++) {
        in.torque_estimated = (q15_t)(10000 + ((n & 1) ? 1 : -1));
        (void)step();
    }
    /* 1/10000 in q15 rounds to 3 either way */
    TEST_ASSERT_INT_WITHIN((unsigned)(2 * 3 * f.torque_loop.ki), 0, state.correction);
}

void test_random_commands_and_estimates_follow_the_twin(void)
{
    twin_torque_state_t twin = {0};
    worst_t corrected = {0};
    worst_t correction = {0};
    uint64_t seed = 101;
    for (int n = 0; n < 50000; n++) {
        if (n % 100 == 0) {
            in.torque_commanded = (q15_t)random_in(&seed, -18000, 18000);
            in.enabled = random_in(&seed, 0, 5) != 0;
            in.limited = random_in(&seed, 0, 3) == 0;
            in.torque_commanded = (random_in(&seed, 0, 9) == 0) ? 0 : in.torque_commanded;
        }
        in.torque_estimated = (q15_t)(0.93 * in.torque_commanded + random_in(&seed, -200, 200));
        const twin_torque_in_t t = {from_q15(in.torque_commanded) * f.t, from_q15(in.torque_estimated) * f.t,
                                    from_q15(in.confidence), in.enabled, in.limited};
        const q15_t r = step();
        const double expected = twin_torque_loop(&f.si, &twin, &t);
        worst_note(&corrected, r - expected / f.t * 32768.0, "step %d, commanded %d", n, in.torque_commanded);
        worst_note(&correction, from_q31(state.correction) - twin.correction, "step %d, commanded %d", n,
                   in.torque_commanded);
    }
    /* T_m and the quotient are rounded to q15: at worst 1 LSB of T_min = 655 LSB, 1.5e-3, which the loop averages. */
    ASSERT_WORST(correction, 1.5e-3);
    ASSERT_WORST(corrected, 30.0); /* 1.5e-3 of 18000 */
}

/* The correction is -10 % from another operating point, while at the limit the torque is 0.97 of the corrected one. The
 * correction may rise to 0, but not above it. */
void test_at_a_limit_a_negative_correction_rises_to_zero_and_not_beyond(void)
{
    in.torque_commanded = 10000;
    in.limited = true;
    state.correction = Q31(-0.1);
    state.model = 10000 * 65536;
    (void)run(0.97, 3000);
    TEST_ASSERT_EQUAL_INT32(0, state.correction);
    in.limited = false;
    (void)run(0.97, 3000);
    TEST_ASSERT_DOUBLE_WITHIN(2e-3, 1.0 / 0.97 - 1.0, from_q31(state.correction));
}

/* The authority of 0.4 is scaled by the confidence: 0.2 at one half. */
void test_without_confidence_the_corrected_torque_is_the_commanded_one(void)
{
    in.torque_commanded = 10000;
    in.confidence = 16384;
    TEST_ASSERT_INT_WITHIN(3, 12000, run(0.5, 3000));
    in.confidence = 0;
    TEST_ASSERT_EQUAL_INT(10000, step());
    TEST_ASSERT_EQUAL_INT32(0, state.correction);
    in.torque_commanded = -10000;
    TEST_ASSERT_EQUAL_INT(-10000, step());
}

void test_no_extreme_input_wraps_or_exceeds_the_authority(void)
{
    static const int16_t extreme[5] = {INT16_MIN, -1, 0, 1, INT16_MAX};
    for (int n = 0; n < 5 * 5 * 4 * 3; n++) {
        in = (torque_loop_in_t){extreme[n % 5], extreme[n / 5 % 5], Q15_MAX, (n / 25) & 1, (n / 50) & 1};
        state.correction = (n / 100 == 0) ? INT32_MIN : (n / 100 == 1) ? 0 : INT32_MAX;
        state.model = (n & 1) ? INT32_MIN : INT32_MAX;
        const int r = step();
        const int tolerance = (int)(0.4 * fabs((double)in.torque_commanded)) + 2;
        TEST_ASSERT_INT_WITHIN((unsigned)tolerance, in.torque_commanded, r);
    }
}
