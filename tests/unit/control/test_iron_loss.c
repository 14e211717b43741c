/* SPDX-License-Identifier: Apache-2.0 */
#include "control/torque/iron_loss.h"

#include <math.h>

#include "unity.h"

static iron_loss_in_t in;

void setUp(void)
{
    /* a = 0.05, psi = (0.4, -0.6) */
    in = (iron_loss_in_t){.admittance = 107374182, .psi = {13107, -19661}, .i_max = 29491};
}

void tearDown(void)
{
}

static dq_q15_t add(double d, double q)
{
    return iron_loss_add(&in, (dq_q15_t){(int32_t)lround(d * 32768.0), (int32_t)lround(q * 32768.0)});
}

/* By hand: i_d - a psi_q = -0.3 + 0.03, i_q + a psi_d = 0.5 + 0.02. */
void test_the_current_of_the_loss_leads_the_flux_by_a_quarter_turn(void)
{
    const dq_q15_t i = add(-0.3, 0.5);
    TEST_ASSERT_INT_WITHIN(1, lround(-0.27 * 32768.0), i.d);
    TEST_ASSERT_INT_WITHIN(1, lround(0.52 * 32768.0), i.q);
}

/* The torque of psi x i grows by a |psi|^2, whatever the currents are: a request of zero gets it, too. */
void test_a_request_of_zero_gets_the_current_of_the_loss_in_the_direction_of_motion(void)
{
    dq_q15_t i = add(0.0, 0.0);
    TEST_ASSERT_INT_WITHIN(1, lround(0.03 * 32768.0), i.d);
    TEST_ASSERT_INT_WITHIN(1, lround(0.02 * 32768.0), i.q);
    in.admittance = -in.admittance;
    i = add(0.0, 0.0);
    TEST_ASSERT_INT_WITHIN(1, lround(-0.03 * 32768.0), i.d);
    TEST_ASSERT_INT_WITHIN(1, lround(-0.02 * 32768.0), i.q);
}

void test_without_a_loss_the_references_stay_as_they_are(void)
{
    in.admittance = 0;
    const dq_q15_t i = add(-0.3, -0.5);
    TEST_ASSERT_EQUAL_INT(lround(-0.3 * 32768.0), i.d);
    TEST_ASSERT_EQUAL_INT(lround(-0.5 * 32768.0), i.q);
}

/* By hand: i_d = -0.57 leaves sqrt(0.9^2 - 0.57^2) = 0.6965 of 0.7 + 0.02. */
void test_the_sum_stays_within_the_current_circle_with_either_sign_of_the_torque(void)
{
    dq_q15_t i = add(-0.6, 0.7);
    TEST_ASSERT_INT_WITHIN(1, lround(-0.57 * 32768.0), i.d);
    TEST_ASSERT_INT_WITHIN(2, lround(0.6965 * 32768.0), i.q);
    i = add(-0.6, -0.75);
    TEST_ASSERT_INT_WITHIN(1, lround(-0.57 * 32768.0), i.d);
    TEST_ASSERT_INT_WITHIN(2, lround(-0.6965 * 32768.0), i.q);
}

/* Never longer than the circle and of no other sign, for arguments at the ends of their formats. */
void test_every_argument_gives_a_current_inside_the_circle(void)
{
    const int32_t ends[] = {INT16_MIN, 0, INT16_MAX};
    for (unsigned k = 0; k < 3 * 3 * 3 * 3 * 3; k++) {
        in.admittance = (k % 3 == 0) ? INT32_MIN : (k % 3 == 1) ? 0 : INT32_MAX;
        in.psi = (dq_q15_t){2 * ends[k / 3 % 3], ends[k / 9 % 3]};
        const dq_q15_t i = iron_loss_add(&in, (dq_q15_t){ends[k / 27 % 3], ends[k / 81]});
        TEST_ASSERT_LESS_OR_EQUAL_INT(in.i_max + 1, lround(hypot(i.d, i.q)));
    }
}
