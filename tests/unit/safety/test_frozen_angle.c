/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/frozen_angle.h"

#include <math.h>
#include <stdlib.h>

#include "types/faults.h"
#include "unity.h"

/* Ten periods per step, in each a threshold of 0.00325 per unit: 1.75 V on hsm1. */
static const frozen_angle_config_t config = {
    .v_0 = 1060, .rate_gain = 3 * 65536, .answer_rate = Q15_MAX, .i_0 = 819, .settle_steps = 10, .fault_steps = 5};
static frozen_angle_state_t state;
static frozen_angle_in_t in;

enum { SETTLED = 10, CONFIRMED = 5 };

void setUp(void)
{
    state = (frozen_angle_state_t){0};
    in = (frozen_angle_in_t){
        .acting = true, .u_sum = {-3000, 2500}, .i_ref = {-9000, 12000}, .i_phase_min = 4000, .theta_e = 0x30000000u};
}

void tearDown(void)
{
}

static uint32_t step(void)
{
    return frozen_angle_step(&config, &state, &in);
}

static void steps(int n)
{
    for (int k = 0; k < n; k++) {
        TEST_ASSERT_EQUAL_HEX32(0, step());
    }
}

/* Number of steps until the fault; 0: none in 200 steps. */
static int found(void)
{
    for (int n = 1; n <= 200; n++) {
        if (step() == FAULT_ANGLE_OFFSET) {
            return n;
        }
    }
    return 0;
}

static void settle(void)
{
    steps(40);
}

void test_a_blocked_rotor_is_no_fault_for_minutes_and_may_warm_up(void)
{
    settle();
    const int32_t start = in.u_sum.d;
    for (int n = 0; n < 180000; n++) {
        in.u_sum.d = start - n / 90; /* a change of 2000, twice the threshold, in three minutes */
        TEST_ASSERT_EQUAL_HEX32(0, step());
    }
}

/* The voltage of 15,000 that reverses the torque must not enter the mean: 845 of it would be left after ten steps. */
void test_the_voltage_that_moves_the_currents_is_no_change_afterwards(void)
{
    settle();
    for (int n = 0; n < 4; n++) {
        in.i_ref.q -= 6000;
        in.u_sum.q -= 15000;
        (void)step();
        in.u_sum.q += 15000;
    }
    TEST_ASSERT_EQUAL_INT(0, found());
}

/* After n steps the mean lacks (3/4)^n of a change of twice the threshold: it is beyond the threshold from the third
 * step on, and 5 steps confirm. */
void test_a_voltage_that_changes_although_nothing_moves_is_a_turning_rotor(void)
{
    static const dq_q15_t directions[] = {{2120, 0}, {-2120, 0}, {0, 2120}, {0, -2120}};
    for (int k = 0; k < 4; k++) {
        setUp();
        settle();
        in.u_sum.d += directions[k].d;
        in.u_sum.q += directions[k].q;
        TEST_ASSERT_EQUAL_INT(3 + CONFIRMED - 1, found());
    }
}

void test_a_smaller_or_shorter_change_is_no_fault(void)
{
    settle();
    in.u_sum.d += 1050;
    TEST_ASSERT_EQUAL_INT(0, found());
    setUp();
    settle();
    in.u_sum.d += 2120;
    steps(3 + CONFIRMED - 2);
    in.u_sum.d -= 2 * 2120;
    (void)step();
    in.u_sum.d += 2120;
    TEST_ASSERT_EQUAL_INT(0, found());
}

/* The torque is slewed slowly at a blocked rotor: i_q moves by 70 per step, which is no movement within the ten steps
 * of settling, and the flux by 700. The voltage of 2100 that this needs ends when the torque is reached. */
void test_the_voltage_of_a_reference_that_creeps_is_no_change_when_it_ends(void)
{
    in.u_sum.q += 3 * 700;
    for (int n = 0; n < 41; n++) { /* after the 12th, 24th, 36th step it begins again: the 41st is the 5th of a count */
        in.i_ref.q += 70;
        in.psi_ref.q += 700;
        TEST_ASSERT_EQUAL_HEX32(0, step());
    }
    for (int n = 0; n < 6; n++) {
        in.i_ref.q += 70;
        in.psi_ref.q += 700;
        TEST_ASSERT_EQUAL_HEX32(0, step());
    }
    TEST_ASSERT_EQUAL_UINT8(SETTLED, state.standing);
    in.u_sum.q -= 3 * 700;
    TEST_ASSERT_EQUAL_INT(0, found());
}

/* Up to full torque and back as limits allow, with a law that follows a third of the way in each step: the voltage is
 * that of the flux which follows, and comes and goes later than the reference's. */
static int steps_while_the_torque_comes_and_goes(q15_t answer_rate)
{
    frozen_angle_config_t slow = config;
    slow.answer_rate = answer_rate;
    dq_q15_t followed = in.psi_ref;
    setUp();
    for (int n = 1; n <= 200; n++) {
        const int32_t before = followed.q;
        in.psi_ref.q += (n % 60 < 15) ? 500 : ((n % 60 >= 30 && n % 60 < 45) ? -500 : 0);
        followed.q += (in.psi_ref.q - followed.q) / 3;
        in.u_sum.q = 2500 + 3 * (followed.q - before);
        if (frozen_angle_step(&slow, &state, &in) != 0U) {
            return n;
        }
    }
    return 0;
}

void test_the_flux_of_a_law_that_answers_slowly_changes_later_than_its_reference(void)
{
    TEST_ASSERT_EQUAL_INT(0, steps_while_the_torque_comes_and_goes(Q15(1.0 / 3.0)));
    TEST_ASSERT_NOT_EQUAL_INT(0, steps_while_the_torque_comes_and_goes(Q15_MAX));
}

/* A new compensation of the dead time begins the comparison anew, and the flux of the references is there already. */
void test_a_comparison_that_begins_anew_takes_the_flux_as_it_is(void)
{
    frozen_angle_config_t slow = config;
    slow.answer_rate = Q15(0.25);
    in.psi_ref = (dq_q15_t){3000, -9000};
    in.acting = false;
    (void)frozen_angle_step(&slow, &state, &in);
    in.acting = true;
    (void)frozen_angle_step(&slow, &state, &in);
    TEST_ASSERT_EQUAL_INT32(in.u_sum.d, state.u_standing.d);
    TEST_ASSERT_EQUAL_INT32(in.u_sum.q, state.u_standing.q);
}

/* Current control follows the tracked speed: what changes until that is the rotor's is no comparison. */
void test_while_the_tracked_speed_is_behind_nothing_is_compared(void)
{
    settle();
    in.behind = true;
    in.u_sum.d += 5000;
    steps(50);
    in.behind = false;
    TEST_ASSERT_EQUAL_INT(0, found());
    in.u_sum.d -= 5000;
    TEST_ASSERT_NOT_EQUAL_INT(0, found());
}

/* What is measured without the creeping reference is a turning rotor. */
void test_a_rotor_that_turns_while_the_reference_creeps_is_found(void)
{
    steps(1);
    in.u_sum.q += 3 * 700;
    int last = 0;
    for (int n = 1; n <= 23 && last == 0; n++) {
        in.i_ref.q += 35;
        in.psi_ref.q += 700;
        in.u_sum.d += (n > 13) ? 400 : 0;
        last = (step() != 0U) ? n : 0;
    }
    TEST_ASSERT_GREATER_THAN(13 + CONFIRMED - 1, last);
}

/* The voltage of a leg without current may change by its whole dead time in both directions: the threshold is eight
 * times as large. */
void test_a_leg_without_current_may_change_its_voltage(void)
{
    settle();
    in.i_phase_min = 2 * 819;
    in.u_sum.q += 8000;
    TEST_ASSERT_EQUAL_INT(0, found());
    setUp();
    settle();
    in.i_phase_min = 2 * 819;
    in.u_sum.q += 9000;
    TEST_ASSERT_GREATER_THAN(0, found());
}

/* Two phase currents may both be below 2 i_0 while the current vector is up to 4 i_0 long. */
void test_without_current_nothing_is_checked(void)
{
    in.i_ref = (dq_q15_t){-3276, 0};
    settle();
    in.u_sum.d += 20000;
    TEST_ASSERT_EQUAL_INT(0, found());
    in.i_ref = (dq_q15_t){-3278, 0};
    in.u_sum.d -= 20000;
    TEST_ASSERT_GREATER_THAN(0, found());
}

void test_an_angle_or_a_reference_that_moves_starts_again(void)
{
    for (int k = 0; k < 6; k++) {
        setUp();
        settle();
        in.u_sum.d += 2120;
        in.theta_e += (k == 0) ? (1U << 24) + 1U : (k == 1) ? 0U - (1U << 24) - 1U : 0U;
        in.i_ref.d += (k == 2) ? 820 : (k == 3) ? -820 : 0;
        in.i_ref.q += (k == 4) ? 820 : (k == 5) ? -820 : 0;
        TEST_ASSERT_EQUAL_INT(0, found());
    }
    setUp();
    settle();
    in.u_sum.d += 2120;
    in.theta_e += 1U << 24;
    in.i_ref.d += 819;
    in.i_ref.q -= 819;
    TEST_ASSERT_GREATER_THAN(0, found());
}

/* A rotor that rolls at a few revolutions per minute: the angle moves by 1/256 of a turn, and the check starts again,
 * before the settling ends. */
void test_a_slow_rotor_is_no_fault(void)
{
    for (int n = 0; n < 20000; n++) {
        in.theta_e += 1U << 22;
        in.u_sum.d = (int32_t)lround(3000.0 * sin(n * 0.1));
        in.u_sum.q = (int32_t)lround(3000.0 * cos(n * 0.1));
        TEST_ASSERT_EQUAL_HEX32(0, step());
    }
}

/* Rotors that are turned back, at 200 to 12,800 rad/s^2: at a the angle stays within 1/256 of a turn for up to
 * 0.53/sqrt(a), in which the speed changes by at most 7.1 rad/s after the wait of 10 ms. That is 140 counts of voltage
 * per rad/s: the threshold is 1060. */
void test_a_rotor_that_is_turned_back_is_no_fault(void)
{
    for (int k = 0; k < 64; k++) {
        setUp();
        const double a = 200.0 * pow(2.0, k / 10.5);
        for (int n = -200; n < 200; n++) {
            const double t = 1e-3 * n + 1e-4 * (k % 10);
            in.theta_e = (uint32_t)(int64_t)(0.5 * a * t * t / 6.283185307179586 * 4294967296.0);
            in.u_sum.q = (int32_t)lround(140.0 * fmax(fmin(a * t, 100.0), -100.0));
            TEST_ASSERT_EQUAL_HEX32(0, step());
        }
    }
}

void test_a_bridge_that_is_off_is_not_checked_and_starts_again(void)
{
    settle();
    in.acting = false;
    TEST_ASSERT_EQUAL_HEX32(0, step());
    TEST_ASSERT_EQUAL_UINT8(0, state.standing);
    TEST_ASSERT_EQUAL_INT32(0, state.mean_q8.d);
}

/* (MN-22) and (MN-23) in double precision, written from the equations. */
typedef struct {
    double m[2], first[2];
    int standing, changed;
} twin_t;

static bool twin_step(twin_t *t, const double u[2])
{
    double change = 0.0;
    for (int x = 0; x < 2; x++) {
        t->m[x] += (u[x] - t->m[x]) / ((t->standing < 4) ? 1.0 : 4.0);
    }
    if (t->standing < SETTLED) {
        t->standing++;
        t->first[0] = t->m[0];
        t->first[1] = t->m[1];
        return false;
    }
    for (int x = 0; x < 2; x++) {
        t->first[x] += (t->m[x] - t->first[x]) / 1024.0;
        change += (t->m[x] - t->first[x]) * (t->m[x] - t->first[x]);
    }
    t->changed = (sqrt(change) > 1060.0) ? t->changed + 1 : 0;
    return t->changed >= CONFIRMED;
}

/* A rotor that turns at 0.02 to 2 rad per step while the angle is frozen, with voltages around the threshold. Mean and
 * length are rounded by up to 3 counts; where the twin is so close to its threshold both results are right. */
void test_a_rotor_that_turns_below_the_angle_is_found_when_the_twin_finds_it(void)
{
    int agreed = 0;
    for (int k = 0; k < 400; k++) {
        setUp();
        twin_t twin = {0};
        const double amplitude = 200.0 + 20.0 * k, omega = 0.02 * pow(100.0, (k * 37 % 400) / 400.0);
        int fixed = 0, exact = 0;
        for (int n = 1; n <= 150; n++) {
            const double u[2] = {floor(amplitude * sin(omega * n)), floor(amplitude * cos(omega * n))};
            in.u_sum = (dq_q15_t){(int32_t)u[0], (int32_t)u[1]};
            fixed = (step() != 0U && fixed == 0) ? n : fixed;
            exact = (twin_step(&twin, u) && exact == 0) ? n : exact;
        }
        agreed += (fixed == exact) ? 1 : 0;
    }
    TEST_ASSERT_GREATER_OR_EQUAL_INT(390, agreed);
}

/* The threshold is 1060 counts. The reference of the mean follows by 265/256 in the step: 271625/1024. */
void test_a_change_of_just_the_threshold_is_none(void)
{
    for (int beyond = 0; beyond <= 1; beyond++) {
        setUp();
        in.u_sum = (dq_q15_t){0, 0};
        state = (frozen_angle_state_t){
            .first_q8 = {-271625 - 256 * beyond, 0}, .i_ref = in.i_ref, .theta_e = in.theta_e, .standing = SETTLED};
        TEST_ASSERT_EQUAL_HEX32(0, step());
        TEST_ASSERT_EQUAL_UINT8(beyond, state.frozen);
    }
}

/* (MN-22), (MN-23) and (MN-27) in double precision with everything that moves; rate_gain is 3. */
typedef struct {
    double m[2], first[2], psi[2], i[2];
    uint32_t theta;
    int standing;
} mover_t;

static bool has_twin_moved(mover_t *t)
{
    const double turned = (double)(int32_t)(in.theta_e - t->theta);
    if (fabs(turned) <= 16777216.0 && fabs(in.i_ref.d - t->i[0]) <= 819.0 && fabs(in.i_ref.q - t->i[1]) <= 819.0) {
        return false;
    }
    t->theta = in.theta_e;
    t->i[0] = in.i_ref.d;
    t->i[1] = in.i_ref.q;
    return true;
}

/* Returns the change beyond its threshold; negative while nothing is compared. */
static double mover_step(mover_t *t)
{
    const double u[2] = {in.u_sum.d - 3.0 * (in.psi_ref.d - t->psi[0]), in.u_sum.q - 3.0 * (in.psi_ref.q - t->psi[1])};
    t->standing = has_twin_moved(t) ? 0 : t->standing;
    for (int x = 0; x < 2; x++) {
        t->m[x] += (u[x] - t->m[x]) / ((t->standing < 4) ? 1.0 : 4.0);
        t->first[x] = (t->standing < SETTLED) ? t->m[x] : t->first[x] + (t->m[x] - t->first[x]) / 1024.0;
    }
    t->psi[0] = in.psi_ref.d;
    t->psi[1] = in.psi_ref.q;
    TEST_ASSERT_INT32_WITHIN(0, (int32_t)u[0], state.u_standing.d);
    TEST_ASSERT_INT32_WITHIN(0, (int32_t)u[1], state.u_standing.q);
    if (t->standing < SETTLED) {
        t->standing++;
        return -100.0;
    }
    return hypot(t->m[0] - t->first[0], t->m[1] - t->first[1]) - ((in.i_phase_min > 1638) ? 1060.0 : 8480.0);
}

static int32_t uniform(int32_t lo, int32_t hi)
{
    static uint32_t x = 1;
    x = 1664525U * x + 1013904223U;
    const uint32_t values = (uint32_t)hi - (uint32_t)lo + 1U;
    return (int32_t)((uint32_t)lo + (uint32_t)(((uint64_t)x * values) >> 32));
}

/* Means are rounded down by 3/256 at most, their references by 4 counts. */
void test_means_and_decisions_are_those_of_the_twin(void)
{
    static const int32_t turns[] = {1 << 24, -(1 << 24), (1 << 24) + 1, -(1 << 24) - 1};
    mover_t twin = {0};
    dq_q15_t u = {0, 0};
    int compared[2] = {0, 0};
    for (int n = 0; n < 60000; n++) {
        if (n % 60 == 0) {
            in.i_ref = (dq_q15_t){uniform(-20000, -4000), uniform(-20000, 20000)};
            in.theta_e = (uint32_t)uniform(-2000000000, 2000000000);
            in.i_phase_min = (q15_t)((n % 120 == 0) ? 1638 : 1639);
            u = (dq_q15_t){uniform(-30000, 30000), uniform(-30000, 30000)};
        }
        in.theta_e += (n % 60 == 25) ? (uint32_t)turns[n / 60 % 4] : 0U;
        in.i_ref.q += (n % 60 == 45) ? ((n & 64) ? 819 : -820) : 0;
        const int32_t noise = (n % 180 < 60) ? 20000 : 1500;
        in.u_sum = (dq_q15_t){u.d + uniform(-noise, noise), u.q + uniform(-noise, noise)};
        in.psi_ref = (n % 7 == 0) ? (dq_q15_t){uniform(0, 15000), uniform(-15000, 15000)} : in.psi_ref;
        (void)step();
        const double beyond = mover_step(&twin);
        if (twin.standing > 1) { /* the step that begins anew leaves the means to the next one */
            TEST_ASSERT_DOUBLE_WITHIN(0.05, twin.m[0], state.mean_q8.d / 256.0);
            TEST_ASSERT_DOUBLE_WITHIN(0.05, twin.m[1], state.mean_q8.q / 256.0);
            TEST_ASSERT_DOUBLE_WITHIN(4.5, twin.first[0], state.first_q8.d / 256.0);
            TEST_ASSERT_DOUBLE_WITHIN(4.5, twin.first[1], state.first_q8.q / 256.0);
        }
        TEST_ASSERT_EQUAL_INT(twin.standing, state.standing);
        if (fabs(beyond) > 12.0) {
            TEST_ASSERT_EQUAL_INT(beyond > 0.0, state.frozen > 0);
            compared[beyond > 0.0]++;
        }
    }
    TEST_ASSERT_TRUE(compared[0] > 10000 && compared[1] > 10000);
}

void test_no_argument_wraps(void)
{
    static const int32_t ends[] = {-40 * 32768, 40 * 32767};
    for (unsigned n = 0; n < 1024; n++) {
        const int32_t i = (n >> 2 & 1U) ? 32767 : -32768, psi = (n >> 3 & 1U) ? 32767 : -32768;
        in = (frozen_angle_in_t){.acting = true,
                                 .u_sum = {ends[n & 1U], ends[n >> 1 & 1U]},
                                 .i_ref = {i, -1 - i},
                                 .psi_ref = {psi, -1 - psi},
                                 .i_phase_min = INT16_MAX,
                                 .theta_e = n << 28};
        (void)step();
        TEST_ASSERT_TRUE(abs(state.mean_q8.d) <= (40 + 3) * 32768 * 256);
    }
}

/* Also after a single step, which has stored only a reference, an angle and a voltage. */
void test_a_step_that_does_not_act_leaves_nothing_but_the_flux(void)
{
    static const int acting[] = {1, 2, 40};
    for (unsigned n = 0; n < sizeof acting / sizeof acting[0]; n++) {
        in.acting = true;
        steps(acting[n]);
        in.acting = false;
        in.psi_ref = (dq_q15_t){7000, -3000};
        steps(1);
        TEST_ASSERT_EQUAL_UINT8(0, state.standing);
        TEST_ASSERT_EQUAL_INT32(0, state.u_standing.d);
        TEST_ASSERT_EQUAL_INT32(0, state.i_ref.q);
        TEST_ASSERT_EQUAL_UINT32(0, state.theta_e);
        TEST_ASSERT_EQUAL_INT32(7000, state.psi.d);
        TEST_ASSERT_EQUAL_INT32(-3000, state.psi.q);
    }
}
