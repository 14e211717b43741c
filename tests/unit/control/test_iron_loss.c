/* SPDX-License-Identifier: Apache-2.0 */
#include "control/torque/iron_loss.h"

#include <math.h>

#include "fixture.h"
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

/* The other direction of the rotor: by hand -0.3 - 0.03 and 0.5 - 0.02. */
void test_the_current_of_the_loss_has_the_sign_of_the_speed(void)
{
    in.admittance = -in.admittance;
    const dq_q15_t i = add(-0.3, 0.5);
    TEST_ASSERT_INT_WITHIN(1, lround(-0.33 * 32768.0), i.d);
    TEST_ASSERT_INT_WITHIN(1, lround(0.48 * 32768.0), i.q);
}

/* i_max is 0.9: full from |i_d| + |i_q| = 0.05625 on, by hand half of it at 0.028125. */
void test_near_zero_current_the_current_of_the_loss_fades_out(void)
{
    dq_q15_t i = add(0.0, 0.0);
    TEST_ASSERT_EQUAL_INT(0, i.d);
    TEST_ASSERT_EQUAL_INT(0, i.q);
    i = add(-0.014, 0.014125);
    TEST_ASSERT_INT_WITHIN(1, lround(0.001 * 32768.0), i.d);
    TEST_ASSERT_INT_WITHIN(1, lround(0.024125 * 32768.0), i.q);
    i = add(0.0, -0.057);
    TEST_ASSERT_INT_WITHIN(1, lround(0.03 * 32768.0), i.d);
    TEST_ASSERT_INT_WITHIN(1, lround(-0.037 * 32768.0), i.q);
}

void test_without_a_loss_the_references_stay_as_they_are(void)
{
    in.admittance = 0;
    const dq_q15_t i = add(-0.3, -0.5);
    TEST_ASSERT_EQUAL_INT(lround(-0.3 * 32768.0), i.d);
    TEST_ASSERT_EQUAL_INT(lround(-0.5 * 32768.0), i.q);
}

/* By hand: |i_m|^2 = 0.6^2 + 0.65^2 = 0.7825, |i_m + i_fe|^2 = 0.57^2 + 0.67^2 = 0.7738: a shorter current. */
void test_a_current_that_becomes_shorter_is_not_reduced(void)
{
    in.i_max = 29000;
    const dq_q15_t i = add(-0.6, 0.65);
    TEST_ASSERT_INT_WITHIN(1, lround(-0.57 * 32768.0), i.d);
    TEST_ASSERT_INT_WITHIN(1, lround(0.67 * 32768.0), i.q);
}

/* By hand, with the other sign of the speed: (-0.63, 0.63) has a square of 0.7938, (-0.6, 0.65) one of 0.7825, and
 * 0.9^2 = 0.81 allows it whole; 0.79 allows (0.79 - 0.7825)/(0.7938 - 0.7825) = 0.664 of it. */
void test_on_the_current_circle_a_part_of_the_current_of_the_loss_is_left(void)
{
    in.admittance = -in.admittance;
    dq_q15_t i = add(-0.6, 0.65);
    TEST_ASSERT_INT_WITHIN(1, lround(-0.63 * 32768.0), i.d);
    TEST_ASSERT_INT_WITHIN(1, lround(0.63 * 32768.0), i.q);
    in.i_max = (q15_t)lround(sqrt(0.79) * 32768.0);
    i = add(-0.6, 0.65);
    TEST_ASSERT_INT_WITHIN(4, lround(-0.6199 * 32768.0), i.d);
    TEST_ASSERT_INT_WITHIN(4, lround(0.6367 * 32768.0), i.q);
    in.i_max = 25000; /* the references themselves are on the circle */
    i = add(-0.6, 0.65);
    TEST_ASSERT_INT_WITHIN(1, lround(-0.6 * 32768.0), i.d);
    TEST_ASSERT_INT_WITHIN(1, lround(0.65 * 32768.0), i.q);
}

/* The largest errors are on the circle where both currents are nearly perpendicular: half a count of the iron's then
 * changes the share of it by 1 %. */
void test_the_current_of_the_loss_follows_the_twin(void)
{
    const fixture_t f = fixture();
    worst_t worst = {0};
    uint64_t seed = 7;
    in.i_max = (q15_t)lround(f.si.i_max_A / f.i * 32768.0);
    for (int n = 0; n < 300000; n++) {
        in.admittance = random_in(&seed, -200000000, 200000000);
        in.psi = (dq_q15_t){random_in(&seed, -20000, 32767), random_in(&seed, -32767, 32767)};
        const double length = random_in(&seed, 0, in.i_max), angle = random_in(&seed, 0, 62832) / 10000.0;
        const dq_q15_t i_m = {(int32_t)(length * cos(angle)), (int32_t)(length * sin(angle))};
        const dq_q15_t y = iron_loss_add(&in, i_m);
        const twin_dq_t s = twin_iron_loss(&f.si, (twin_dq_t){from_q15(i_m.d) * f.i, from_q15(i_m.q) * f.i},
                                           in.admittance / 2147483648.0 * f.i / f.psi,
                                           (twin_dq_t){from_q15(in.psi.d) * f.psi, from_q15(in.psi.q) * f.psi});
        worst_note(&worst, y.d - s.d / f.i * 32768, "i_d of a %d i %d %d", in.admittance, i_m.d, i_m.q);
        worst_note(&worst, y.q - s.q / f.i * 32768, "i_q of a %d i %d %d", in.admittance, i_m.d, i_m.q);
    }
    ASSERT_WORST(worst, 12.0);
}

/* Never longer than the circle, for admittances and flux linkages at the ends of their formats and every current inside
 * the circle. */
void test_no_argument_gives_a_current_beyond_the_circle(void)
{
    const int32_t ends[] = {INT16_MIN, 0, INT16_MAX};
    for (unsigned k = 0; k < 3 * 3 * 3 * 360; k++) {
        in.admittance = (k % 3 == 0) ? INT32_MIN : (k % 3 == 1) ? 0 : INT32_MAX;
        in.psi = (dq_q15_t){2 * ends[k / 3 % 3], ends[k / 9 % 3]};
        const double angle = (double)(k / 27) * 0.01745;
        const double length = 0.9 * (k % 5) / 4.0;
        const dq_q15_t i = add(length * cos(angle), length * sin(angle));
        TEST_ASSERT_LESS_OR_EQUAL_INT(in.i_max + 3, lround(hypot(i.d, i.q)));
    }
}
