/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "control/torque/current_reference.h"
#include "fixture.h"
#include "unity.h"

/* The fixture's resistance, and the voltage and speed of the tests in field weakening. */
#define R (674.0 / 65536.0)
#define V_PLAN 12015
#define V (V_PLAN / 32768.0)
#define W (26214.0 / 32768.0)
#define PSI_WITHOUT_TORQUE psi_with(0.0)

static fixture_t f;
static current_reference_in_t in;

void setUp(void)
{
    f = fixture();
    in = (current_reference_in_t){.torque_corrected = 4096, .v_plan = V_PLAN, .omega = 1000, .i_d_max = INT16_MAX};
}

void tearDown(void)
{
}

static current_reference_t step(void)
{
    return current_reference_step(&f.current_reference, &in);
}

/* At low speed the voltage is sufficient for any flux: the last row of the table, maximum torque per ampere. */
void test_at_low_speed_a_node_gives_the_tabulated_mtpa_currents(void)
{
    for (int ix = 0; ix < 7; ix++) {
        in.torque_corrected = (q15_t)(ix * 2048);
        const current_reference_t y = step();
        const int n = ix * f.current_reference.grid.ny + f.current_reference.grid.ny - 1;
        TEST_ASSERT_EQUAL_INT(f.current_reference.i_d[n], y.i_ref.d);
        TEST_ASSERT_EQUAL_INT(f.current_reference.i_q[n], y.i_ref.q);
        TEST_ASSERT_FALSE(y.limited);
    }
}

void test_i_q_takes_the_sign_of_the_torque_and_i_d_does_not(void)
{
    const current_reference_t motor = step();
    in.torque_corrected = -4096;
    const current_reference_t generator = step();
    TEST_ASSERT_EQUAL_INT(motor.i_ref.d, generator.i_ref.d);
    TEST_ASSERT_EQUAL_INT(-motor.i_ref.q, generator.i_ref.q);
    TEST_ASSERT_LESS_THAN_INT(0, motor.i_ref.d);
    TEST_ASSERT_GREATER_THAN_INT(0, motor.i_ref.q);
}

void test_the_direction_of_rotation_does_not_matter(void)
{
    in.omega = 20000;
    const current_reference_t forward = step();
    in.omega = -20000;
    in.torque_corrected = -4096;
    const current_reference_t backward = step();
    TEST_ASSERT_EQUAL_INT(forward.i_ref.d, backward.i_ref.d);
    TEST_ASSERT_EQUAL_INT(-forward.i_ref.q, backward.i_ref.q);
}

/* The flux that the planned voltage leaves beside a torque that drives. */
static double psi_with(double torque)
{
    return sqrt(V * V - 2.0 * R * torque * W) / W;
}

/* Steps until the limit no longer changes; the last one. */
static current_reference_t settled(void)
{
    current_reference_t y = step();
    for (int k = 0; k < 100; k++) {
        in.torque_limit = y.torque_limit;
        y = step();
    }
    return y;
}

/* By hand: 0.3667 at w = 0.8 is a flux of 0.4583, between flux nodes 5 and 6. */
void test_the_available_flux_is_the_planned_voltage_over_the_speed(void)
{
    in.omega = 26214;
    in.torque_corrected = 0;
    /* 0.2 + 0.4 psi: torque_max of the fixture. */
    TEST_ASSERT_DOUBLE_WITHIN(2.0, (0.2 + 0.4 * PSI_WITHOUT_TORQUE) * 32768.0, step().torque_max);
}

/* The current that drives has its voltage along that of the rotating magnet; 0.25 of torque cost 0.7 % of the flux. */
void test_torque_that_drives_reduces_the_planned_flux_and_torque_that_brakes_does_not(void)
{
    in.torque_limit = INT16_MAX;
    for (int k = 0; k < 4; k++) {
        const bool backward = (k & 1) != 0, brakes = (k & 2) != 0;
        in.omega = backward ? -26214 : 26214;
        in.torque_corrected = (backward != brakes) ? -8192 : 8192;
        const double psi = brakes ? PSI_WITHOUT_TORQUE : psi_with(0.25);
        TEST_ASSERT_DOUBLE_WITHIN(2.0, psi * 32768.0, step().psi_plan);
    }
}

/* T = 0.2 + 0.4 psi(T), solved by hand: T = 0.3790. */
void test_the_limit_is_the_torque_whose_own_drop_leaves_the_flux_for_it(void)
{
    in.omega = 26214;
    in.torque_corrected = 32767;
    const current_reference_t y = settled();
    const double torque = y.torque_max / 32768.0;
    TEST_ASSERT_DOUBLE_WITHIN(2e-4, 0.2 + 0.4 * psi_with(torque), torque);
    TEST_ASSERT_DOUBLE_WITHIN(2e-4, 0.3790, torque);
    TEST_ASSERT_INT_WITHIN(4, y.torque_max, y.torque_limit);
    TEST_ASSERT_INT_WITHIN(4, (int)lrint(psi_with(torque) * 32768.0), y.psi_plan);
}

/* The largest torque that brakes is that of the whole planned voltage; without a request it is that which drives. */
void test_the_drop_limits_no_torque_that_brakes(void)
{
    in.omega = -26214;
    in.torque_corrected = 0;
    const int drives = settled().torque_max;
    in.torque_corrected = 4096;
    TEST_ASSERT_DOUBLE_WITHIN(2.0, (0.2 + 0.4 * PSI_WITHOUT_TORQUE) * 32768.0, settled().torque_max);
    in.torque_corrected = -4096;
    TEST_ASSERT_INT_WITHIN(4, drives, settled().torque_max);
    TEST_ASSERT_LESS_THAN_INT((int)((0.2 + 0.4 * PSI_WITHOUT_TORQUE) * 32768.0) - 20, drives);
}

void test_the_limit_approaches_the_largest_torque_by_a_quarter_of_the_difference(void)
{
    in.omega = 26214;
    in.torque_limit = 4000;
    const current_reference_t y = step();
    TEST_ASSERT_INT_WITHIN(1, 4000 + (y.torque_max - 4000) / 4, y.torque_limit);
}

/* Without torque a weak magnet leaves flux, on which the reach does not count. The drop of a torque that needs this
 * flux would leave no reach. */
void test_a_weak_magnet_does_not_take_the_torque_that_the_whole_voltage_allows(void)
{
    static int16_t steep[9];
    for (int k = 0; k < 9; k++) {
        steep[k] = (int16_t)(6554 * ((k > 4) ? k - 4 : 0)); /* 0.2 for each 1/16 of flux above 0.375 */
    }
    f.current_reference.torque_max = steep;
    f.current_reference.r_q16 = 6554; /* 0.1 */
    in.omega = 26214;
    in.torque_corrected = 0;
    in.shift = -3277;
    in.psi_d_error = -3277;
    TEST_ASSERT_GREATER_THAN_INT(3277, settled().torque_max);
}

/* Near the end of field weakening a little flux is much torque, here 16 times as much, and twice the drop: without the
 * slow approach the limit would alternate between two values. */
void test_the_limit_settles_where_torque_and_flux_depend_strongly_on_each_other(void)
{
    static int16_t steep[9];
    for (int k = 0; k < 9; k++) {
        steep[k] = (k < 5) ? 0 : 32767; /* from 0.4375 to 0.5 */
    }
    f.current_reference.torque_max = steep;
    f.current_reference.r_q16 = 4000; /* 0.061 */
    in.omega = 26214;
    in.torque_corrected = 32767;
    const int torque = settled().torque_max;
    for (int k = 0; k < 8; k++) {
        const current_reference_t y = step();
        TEST_ASSERT_INT_WITHIN(64, torque, y.torque_max);
        in.torque_limit = y.torque_limit;
    }
    TEST_ASSERT_GREATER_THAN_INT(1000, torque);
}

/* A large current without torque, as in the middle of field weakening, leaves the torque that the voltage allows. */
void test_a_current_without_torque_does_not_reduce_the_limit(void)
{
    in.omega = 26214;
    in.torque_corrected = 0;
    const current_reference_t y = settled();
    in.torque_corrected = y.torque_max;
    TEST_ASSERT_FALSE(step().limited);
}

void test_torque_beyond_the_limit_is_reduced_to_it_and_flagged(void)
{
    in.omega = 26214;
    in.torque_corrected = 32767;
    const current_reference_t limited = step();
    TEST_ASSERT_TRUE(limited.limited);
    in.torque_corrected = limited.torque_max;
    const current_reference_t full = step();
    TEST_ASSERT_FALSE(full.limited);
    TEST_ASSERT_EQUAL_INT(full.i_ref.d, limited.i_ref.d);
    TEST_ASSERT_EQUAL_INT(full.i_ref.q, limited.i_ref.q);
    in.torque_corrected = (q15_t)(-limited.torque_max - 1);
    TEST_ASSERT_TRUE(step().limited);
    in.torque_corrected = INT16_MIN;
    TEST_ASSERT_EQUAL_INT(-full.i_ref.q, step().i_ref.q);
}

void test_flux_below_the_table_is_flagged_and_uses_its_edge(void)
{
    in.v_plan = 1650;
    in.omega = 32767;
    in.torque_corrected = 100;
    const current_reference_t y = step();
    TEST_ASSERT_TRUE(y.limited);
    int on_edge = 0;
    for (; in.v_plan < 16000; in.v_plan++) {
        const current_reference_t above = step();
        on_edge += (above.psi_plan == f.current_reference.grid.y0) ? 1 : 0;
        TEST_ASSERT_EQUAL(above.psi_plan < f.current_reference.grid.y0, above.limited);
    }
    TEST_ASSERT_GREATER_THAN_INT(0, on_edge);
    in.v_plan = 0;
    TEST_ASSERT_EQUAL_INT(y.i_ref.d, step().i_ref.d);
    in.v_plan = 50; /* less than the resistive drop: no negative flux */
    in.torque_limit = 32767;
    TEST_ASSERT_EQUAL_INT(y.i_ref.d, step().i_ref.d);
    in.v_plan = -200;
    TEST_ASSERT_EQUAL_INT(y.i_ref.d, step().i_ref.d);
}

void test_the_identified_flux_error_is_subtracted_from_the_planned_flux(void)
{
    in.omega = 26214;
    in.torque_corrected = 0;
    TEST_ASSERT_DOUBLE_WITHIN(2.0, PSI_WITHOUT_TORQUE * 32768.0, step().psi_plan);
    in.shift = 1000;
    TEST_ASSERT_DOUBLE_WITHIN(2.0, PSI_WITHOUT_TORQUE * 32768.0 - 1000.0, step().psi_plan);
    in.shift = -1000;
    TEST_ASSERT_DOUBLE_WITHIN(2.0, PSI_WITHOUT_TORQUE * 32768.0 + 1000.0, step().psi_plan);
}

void test_a_stronger_magnet_reduces_the_planned_flux_only_where_the_voltage_limits(void)
{
    in.shift = 3000;
    TEST_ASSERT_EQUAL_INT(INT16_MAX, step().psi_plan);
    in.shift = INT16_MAX;
    in.omega = INT16_MAX;
    TEST_ASSERT_EQUAL_INT(0, step().psi_plan);
}

/* In the fixture i_q = 1.1 t - 0.2 t^2, here at t_max = 0.3833; its linear interpolation between nodes at a distance of
 * 1/16 is accurate to 2e-4. */
void test_the_largest_torque_includes_the_identified_error_of_the_magnet_flux(void)
{
    in.omega = 26214;
    const q15_t nominal = step().torque_max;
    const double t = nominal / 32768.0;
    in.psi_d_error = -3277; /* -0.1 */
    TEST_ASSERT_DOUBLE_WITHIN(8.0, nominal - 3276.8 * (1.1 * t - 0.2 * t * t), step().torque_max);
    in.psi_d_error = INT16_MIN;
    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, step().torque_max);
}

/* The reluctance torque is -psi_q i_d: 0.1 more q flux changes it by -0.1 i_d. */
void test_the_largest_torque_includes_the_identified_error_of_the_q_flux(void)
{
    in.omega = 26214;
    in.torque_corrected = INT16_MAX;
    const q15_t nominal = settled().torque_max;
    const int32_t i_d = step().i_ref.d;
    TEST_ASSERT_LESS_THAN_INT(-1000, i_d);
    in.psi_q_delta = 3277; /* 0.1 */
    TEST_ASSERT_DOUBLE_WITHIN(2.0, nominal - 0.1 * i_d, step().torque_max);
    in.psi_q_delta = -3277;
    TEST_ASSERT_DOUBLE_WITHIN(2.0, nominal + 0.1 * i_d, step().torque_max);
}

void test_i_d_is_limited_to_the_demagnetisation_limit_and_reported(void)
{
    const current_reference_t unlimited = step();
    TEST_ASSERT_FALSE(unlimited.i_d_limited);
    in.i_d_max = (q15_t)(-unlimited.i_ref.d - 10);
    const current_reference_t limited = step();
    TEST_ASSERT_EQUAL_INT(unlimited.i_ref.d + 10, limited.i_ref.d);
    TEST_ASSERT_EQUAL_INT(unlimited.i_ref.q, limited.i_ref.q);
    TEST_ASSERT_TRUE(limited.i_d_limited);
    in.i_d_max = (q15_t)-unlimited.i_ref.d;
    TEST_ASSERT_FALSE(step().i_d_limited);
}

void test_at_standstill_there_is_no_division_by_zero(void)
{
    in.omega = 0;
    const current_reference_t standstill = step();
    in.omega = 1;
    TEST_ASSERT_EQUAL_INT(step().i_ref.q, standstill.i_ref.q);
    TEST_ASSERT_FALSE(standstill.limited);
    in.torque_corrected = 0;
    in.v_plan = 1; /* one count of voltage is the whole flux at one count of speed */
    TEST_ASSERT_EQUAL_INT(INT16_MAX, step().psi_plan);
    in.v_plan = 0;
    TEST_ASSERT_TRUE(step().limited);
}

/* The largest drop is just below 2^31 in Q30: no sum overflows, and the limit is that of the table's least flux. */
void test_the_largest_drop_leaves_no_flux(void)
{
    f.current_reference.r_q16 = UINT16_MAX;
    in.torque_limit = INT16_MAX;
    for (int k = 0; k < 4; k++) {
        in.omega = (k & 1) ? INT16_MAX : INT16_MIN;
        in.torque_corrected = (k & 1) ? INT16_MAX : INT16_MIN;
        in.v_plan = (k & 2) ? INT16_MAX : 0;
        const current_reference_t y = step();
        TEST_ASSERT_TRUE(y.limited);
        TEST_ASSERT_EQUAL_INT(f.current_reference.torque_max[0], y.torque_max);
    }
}

/* The planned flux has an error of 1/2 LSB of the quotient and 0.7 LSB of the root divided by |w| > 0.09: below 9 LSB.
 * The slope of the currents over it is below 0.2. */
void test_the_references_follow_the_twin_over_torque_speed_and_voltage(void)
{
    worst_t worst = {0};
    uint64_t seed = 111;
    for (int n = 0; n < 300000; n++) {
        in = (current_reference_in_t){(q15_t)random_in(&seed, -16000, 16000), (q15_t)random_in(&seed, 400, 20000),
                                      (q15_t)random_in(&seed, 3000, 32767),   (q15_t)random_in(&seed, 0, 16000),
                                      (q15_t)random_in(&seed, -4000, 2000),   (q15_t)random_in(&seed, -4000, 2000),
                                      (q15_t)random_in(&seed, 1000, 32767),   (q15_t)random_in(&seed, -3000, 3000)};
        in.omega = (n & 1) ? in.omega : (q15_t)-in.omega;
        const twin_reference_in_t t = {
            from_q15(in.torque_corrected) * f.t, from_q15(in.v_plan) * f.v,       from_q15(in.omega) * f.w,
            from_q15(in.torque_limit) * f.t,     from_q15(in.shift) * f.psi,      from_q15(in.psi_d_error) * f.psi,
            from_q15(in.i_d_max) * f.i,          from_q15(in.psi_q_delta) * f.psi};
        const current_reference_t y = step();
        const twin_reference_t s = twin_current_reference(&f.si, &t);
        worst_note(&worst, y.i_ref.d - s.i_ref.d / f.i * 32768, "i_d of T %d v %d w %d", in.torque_corrected, in.v_plan,
                   in.omega);
        worst_note(&worst, y.i_ref.q - s.i_ref.q / f.i * 32768, "i_q of T %d v %d w %d", in.torque_corrected, in.v_plan,
                   in.omega);
        worst_note(&worst, y.torque_limit - s.torque_limit / f.t * 32768, "next limit of T %d v %d w %d",
                   in.torque_corrected, in.v_plan, in.omega);
        worst_note(&worst, y.torque_max - s.torque_max / f.t * 32768, "limit of T %d v %d w %d", in.torque_corrected,
                   in.v_plan, in.omega);
    }
    ASSERT_WORST(worst, 8.0);
}

void test_the_current_circle_limits_i_q_and_keeps_i_d(void)
{
    f.current_reference.i_max = 7000;
    in.torque_corrected = 8192;
    const current_reference_t y = step();
    const current_reference_config_t wide = fixture().current_reference;
    const current_reference_t unlimited = current_reference_step(&wide, &in);
    TEST_ASSERT_EQUAL_INT(unlimited.i_ref.d, y.i_ref.d);
    TEST_ASSERT_DOUBLE_WITHIN(1.5, 7000.0, hypot(y.i_ref.d, y.i_ref.q));
    f.current_reference.i_max = 3000; /* less than i_d alone */
    const current_reference_t d_only = step();
    TEST_ASSERT_EQUAL_INT(-3000, d_only.i_ref.d);
    TEST_ASSERT_EQUAL_INT(0, d_only.i_ref.q);
    in.torque_corrected = -8192;
    TEST_ASSERT_EQUAL_INT(0, step().i_ref.q);
}

void test_a_complete_table_is_accepted_and_a_broken_one_rejected(void)
{
    static int16_t bad[82]; /* the last one is behind the table of 81 values */
    current_reference_config_t c = f.current_reference;
    TEST_ASSERT_EQUAL_INT(MOTOR_CHECK_OK, current_reference_check(&c));
    c.i_d = 0;
    TEST_ASSERT_NOT_EQUAL_INT(MOTOR_CHECK_OK, current_reference_check(&c));
    c = f.current_reference;
    c.i_q = 0;
    TEST_ASSERT_NOT_EQUAL_INT(MOTOR_CHECK_OK, current_reference_check(&c));
    c = f.current_reference;
    c.torque_max = 0;
    TEST_ASSERT_NOT_EQUAL_INT(MOTOR_CHECK_OK, current_reference_check(&c));
    c = f.current_reference;
    c.grid.nx = 1;
    TEST_ASSERT_NOT_EQUAL_INT(MOTOR_CHECK_OK, current_reference_check(&c));
    c = f.current_reference;
    c.grid.ny = 1;
    TEST_ASSERT_NOT_EQUAL_INT(MOTOR_CHECK_OK, current_reference_check(&c));
    c = f.current_reference;
    c.i_max = 0;
    TEST_ASSERT_NOT_EQUAL_INT(MOTOR_CHECK_OK, current_reference_check(&c));
    c.i_max = 1;
    TEST_ASSERT_EQUAL_INT(MOTOR_CHECK_OK, current_reference_check(&c));
    c = f.current_reference;
    c.i_d = bad;
    bad[81] = 1;
    TEST_ASSERT_EQUAL_INT(MOTOR_CHECK_OK, current_reference_check(&c));
    bad[80] = 1;
    TEST_ASSERT_NOT_EQUAL_INT(MOTOR_CHECK_OK, current_reference_check(&c));
    bad[80] = 0;
    bad[0] = 1;
    TEST_ASSERT_NOT_EQUAL_INT(MOTOR_CHECK_OK, current_reference_check(&c));
    bad[0] = 0;
    c = f.current_reference;
    c.i_q = bad;
    bad[81] = -1;
    TEST_ASSERT_EQUAL_INT(MOTOR_CHECK_OK, current_reference_check(&c));
    bad[80] = -1;
    TEST_ASSERT_NOT_EQUAL_INT(MOTOR_CHECK_OK, current_reference_check(&c));
}
