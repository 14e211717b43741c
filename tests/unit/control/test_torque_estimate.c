/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "control/torque_estimate.h"
#include "fixture.h"
#include "unity.h"

static torque_estimate_state_t state;

void setUp(void)
{
    state = (torque_estimate_state_t){0};
}

void tearDown(void)
{
}

/* By hand: (0.5 + 0.1) 0.25 - 0.2 (-0.5) = 0.25. */
void test_the_torque_is_psi_d_i_q_minus_psi_q_i_d_with_the_identified_flux(void)
{
    const flux_point_t flux = {.psi_d = 16384, .psi_q = 6554};
    const q15_t t = torque_estimate_step(&state, (dq_t){-16384, 8192}, &flux, (q31_t)(0.1 * 2147483648.0));
    TEST_ASSERT_INT_WITHIN(1, 8192, t);
}

void test_motor_and_generator_mirror_each_other(void)
{
    const flux_point_t forward = {.psi_d = 16000, .psi_q = 9000};
    const flux_point_t backward = {.psi_d = 16000, .psi_q = -9000};
    const q15_t a = torque_estimate_step(&state, (dq_t){-7000, 11000}, &forward, -12345678);
    const q15_t b = torque_estimate_step(&state, (dq_t){-7000, -11000}, &backward, -12345678);
    TEST_ASSERT_INT_WITHIN(1, -a, b);
}

/* psi_d + dpsi rounded once (0.5 |i_q|), the product once (0.5). */
void test_every_operating_point_follows_the_twin(void)
{
    const fixture_t f = fixture();
    worst_t worst = {0};
    uint64_t seed = 91;
    for (int n = 0; n < 200000; n++) {
        const dq_t i = {(q15_t)random_in(&seed, -32768, 32767), (q15_t)random_in(&seed, -32768, 32767)};
        const flux_point_t flux = {.psi_d = (q15_t)random_in(&seed, -20000, 20000),
                                   .psi_q = (q15_t)random_in(&seed, -32768, 32767)};
        const q31_t delta = random_in(&seed, -500000000, 500000000);
        const twin_flux_t si = {.psi_d = from_q15(flux.psi_d) * f.psi, .psi_q = from_q15(flux.psi_q) * f.psi};
        const double t =
            twin_torque(&f.si, (twin_dq_t){from_q15(i.d) * f.i, from_q15(i.q) * f.i}, &si, from_q31(delta) * f.psi);
        const q15_t y = torque_estimate_step(&state, i, &flux, delta);
        worst_note(&worst, y - twin_clamp(t / f.t * 32768.0, -32768, 32767), "i %d %d psi %d %d", i.d, i.q, flux.psi_d,
                   flux.psi_q);
    }
    ASSERT_WORST(worst, 1.0);
}

void test_the_mean_appears_with_the_tenth_value_and_stays_for_ten(void)
{
    const flux_point_t flux = {.psi_d = 16384};
    for (int n = 0; n < 40; n++) {
        (void)torque_estimate_step(&state, (dq_t){0, (q15_t)(500 * n)}, &flux, 0);
        const int block = (n + 1) / 10; /* psi = 1/2: mean of 250 (10 (block - 1) ... 10 block - 1) */
        TEST_ASSERT_EQUAL_INT(block ? 2500 * (block - 1) + 1125 : 0, state.mean);
    }
}

/* The mean rounds half up, of either sign, as the exact quotient does. */
void test_the_mean_is_rounded_to_half_an_lsb_for_every_sum(void)
{
    worst_t worst = {0};
    for (int total = -327680; total <= 327670; total += 7) {
        state = (torque_estimate_state_t){.sum = total, .count = 9};
        (void)torque_estimate_step(&state, (dq_t){0, 0}, &(flux_point_t){0}, 0);
        worst_note(&worst, state.mean - total / 10.0, "sum %d", total);
    }
    ASSERT_WORST(worst, 0.5);
}

void test_ten_thousand_blocks_of_alternating_torque_have_no_bias(void)
{
    const flux_point_t flux = {.psi_d = 32767};
    int64_t sum = 0;
    for (int n = 0; n < 200000; n++) {
        (void)torque_estimate_step(&state, (dq_t){0, (q15_t)((n & 1) ? 1001 : -1001)}, &flux, 0);
        sum += (state.count == 0) ? state.mean : 0;
    }
    TEST_ASSERT_EQUAL_INT(0, sum);
}

void test_torque_beyond_the_base_saturates(void)
{
    const flux_point_t flux = {.psi_d = 32767, .psi_q = 32767};
    TEST_ASSERT_EQUAL_INT(32767, torque_estimate_step(&state, (dq_t){-32768, 32767}, &flux, INT32_MAX));
    TEST_ASSERT_EQUAL_INT(-32768, torque_estimate_step(&state, (dq_t){32767, -32768}, &flux, INT32_MAX));
    const flux_point_t negative = {.psi_d = -32768, .psi_q = -32768};
    TEST_ASSERT_EQUAL_INT(0, torque_estimate_step(&state, (dq_t){-32768, -32768}, &negative, INT32_MIN));
}
