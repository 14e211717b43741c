/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/dc_jump.h"

#include <math.h>
#include <stdlib.h>

#include "counted.h"
#include "unity.h"

/* r = 0.0137, psi_f = 0.44, 10 N·m = 0.034, 7 V = 0.013, 10 A = 0.025: about those of hsm1. */
static const dc_jump_config_t hsm1 = {.r = 898, .t_0 = 1112, .v_0 = 425, .i_0 = 819, .rate_gain = 19867};
static dc_jump_config_t config;
static dc_jump_state_t state;
static dc_jump_in_t in;

enum { STEADY = 4, FREE = 3, FOUND = 8, V_DC = 20000 };

static int32_t q15(double x)
{
    return (int32_t)lround(x * 32768.0);
}

/* A machine with l_d = 0.65, l_q = 1.6 in steady state, whose flux is magnified beside the tables. The drive computes
 * the voltage with a sensor that reads so many times what it has read before. */
static void machine(double omega, double i_d, double i_q, double flux, double gain)
{
    const double psi_d = 0.44 + 0.65 * i_d, psi_q = 1.6 * i_q, r = 898.0 / 65536.0;
    in.acting = true;
    in.u = (dq_q15_t){q15(gain * (r * i_d - omega * flux * psi_q)), q15(gain * (r * i_q + omega * flux * psi_d))};
    in.i = (dq_q15_t){q15(i_d), q15(i_q)};
    in.psi = (dq_q15_t){q15(psi_d), q15(psi_q)};
    in.psi_last = in.psi;
    in.omega = (q15_t)q15(omega);
    in.torque = (q15_t)q15(psi_d * i_q - psi_q * i_d);
}

static bool step(void)
{
    return dc_jump_step(&config, &state, &in);
}

static void drive(int steps)
{
    run_without_finding(step, steps);
}

/* The step after the jump in which the sensor is found. */
static int found_in(int steps)
{
    return found_in_step(step, steps);
}

/* The computed voltage and the measured one become so many times as large. */
static void jump(double voltage, double measured)
{
    in.u = (dq_q15_t){(int32_t)lround(voltage * in.u.d), (int32_t)lround(voltage * in.u.q)};
    in.v_dc = (q15_t)lround(measured * in.v_dc);
}

static void begin(double omega, double i_d, double i_q, double flux)
{
    state = (dc_jump_state_t){0};
    in = (dc_jump_in_t){.v_dc = V_DC};
    machine(omega, i_d, i_q, flux, 1.0);
}

void setUp(void)
{
    config = hsm1;
    begin(0.3, -0.2, 0.3, 1.0);
}

void tearDown(void)
{
}

void test_a_sensor_that_jumps_is_found_in_8_steps_in_any_quadrant_with_any_magnet(void)
{
    static const double gains[] = {0.7, 0.8, 0.9, 1.1, 1.2, 1.3}, fluxes[] = {0.8, 1.0, 1.1};
    for (unsigned n = 0; n < 72; n++) {
        const double gain = gains[n % 6U], flux = fluxes[n / 6U % 3U];
        begin((n / 18U % 2U) ? 0.3 : -0.3, -0.2, (n / 36U) ? 0.3 : -0.3, flux);
        drive(20);
        jump(gain, gain);
        TEST_ASSERT_EQUAL(FOUND, found_in(20));
    }
}

void test_a_battery_whose_voltage_jumps_is_no_fault(void)
{
    static const double gains[] = {0.5, 0.7, 0.8, 0.9, 1.1, 1.2, 1.3, 1.5};
    for (unsigned n = 0; n < sizeof gains / sizeof gains[0]; n++) {
        setUp();
        drive(20);
        jump(1.0, gains[n]);
        drive(50);
        jump(1.0, 1.0 / gains[n]);
        drive(50);
    }
}

/* 3/32 of 20000 are 1875 counts. */
void test_a_jump_is_more_than_three_32nds_of_the_voltage_before_it(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        setUp();
        drive(20);
        jump(1.0 + sign * 0.09375, 1.0);
        in.v_dc = (q15_t)(V_DC + sign * 1875);
        TEST_ASSERT_EQUAL(NEVER, found_in(50));
        setUp();
        drive(20);
        jump(1.0 + sign * 0.09375, 1.0);
        in.v_dc = (q15_t)(V_DC + sign * 1876);
        TEST_ASSERT_EQUAL(FOUND, found_in(50));
    }
}

void test_a_voltage_that_changes_in_several_steps_is_no_jump(void)
{
    drive(20);
    for (int n = 0; n < 10; n++) {
        jump(0.93, 0.93);
        drive(1);
    }
}

/* Of a jump of a fifth the computed voltage shows between half and one and a half. */
void test_the_computed_voltage_must_have_jumped_by_at_least_half_and_less_than_one_and_a_half(void)
{
    static const struct {
        double share;
        int found;
    } cases[] = {{0.48, NEVER}, {0.52, FOUND}, {1.48, FOUND}, {1.52, NEVER}, {-1.0, NEVER}};
    for (unsigned n = 0; n < 10; n++) {
        const double change = (n < 5) ? 0.2 : -0.2;
        setUp();
        drive(20);
        jump(1.0 + cases[n % 5U].share * change, 1.0 + change);
        TEST_ASSERT_EQUAL(cases[n % 5U].found, found_in(50));
    }
}

/* In the first three steps after the jump the currents are still disturbed. */
void test_every_step_from_the_fourth_on_is_compared_and_none_before(void)
{
    for (int wrong = 1; wrong <= FOUND; wrong++) {
        setUp();
        drive(20);
        const dq_q15_t before = in.u;
        jump(1.2, 1.2);
        const dq_q15_t after = in.u;
        int found = NEVER;
        for (int n = 1; n <= 20 && found == NEVER; n++) {
            in.u = (n == wrong) ? before : after;
            found = step() ? n : NEVER;
        }
        TEST_ASSERT_EQUAL((wrong <= FREE) ? FOUND : NEVER, found);
    }
}

void test_a_voltage_that_comes_back_is_no_fault(void)
{
    drive(20);
    const dc_jump_in_t before = in;
    jump(1.2, 1.2);
    drive(FOUND - 1);
    in = before;
    drive(1);
    jump(1.2, 1.2);
    drive(20);
}

void test_four_steady_steps_are_needed_before_the_jump(void)
{
    drive(STEADY - 1);
    jump(1.2, 1.2);
    TEST_ASSERT_EQUAL(NEVER, found_in(50));
    setUp();
    drive(STEADY);
    jump(1.2, 1.2);
    TEST_ASSERT_EQUAL(FOUND, found_in(50));
}

/* A 64th of 9830 are 153 counts, a quarter of t_0 278. */
void test_speed_and_torque_must_be_steady(void)
{
    for (int n = 0; n < 8; n++) {
        const int sign = (n & 1) ? 1 : -1, beyond = (n >> 1) & 1;
        setUp();
        drive(20);
        jump(1.2, 1.2);
        drive(FREE);
        if (n < 4) {
            in.omega = (q15_t)(in.omega + sign * (153 + beyond));
        } else {
            in.torque = (q15_t)(in.torque + sign * (278 + beyond));
        }
        TEST_ASSERT_EQUAL(beyond ? NEVER : FOUND - FREE, found_in(50));
    }
}

void test_a_movement_begins_the_steady_time_anew(void)
{
    drive(20);
    in.torque = (q15_t)(in.torque + 279);
    drive(STEADY - 1);
    jump(1.2, 1.2);
    TEST_ASSERT_EQUAL(NEVER, found_in(50));
}

/* 4 v_0 are 0.052. Almost without current the rotational voltage is 0.44 of the speed. */
void test_below_four_times_the_inverters_error_nothing_is_compared(void)
{
    config.i_0 = 10;
    begin(0.115, 0.0, 0.001, 1.0);
    drive(20);
    jump(1.2, 1.2);
    TEST_ASSERT_EQUAL(NEVER, found_in(50));
    begin(0.121, 0.0, 0.001, 1.0);
    drive(20);
    jump(1.2, 1.2);
    TEST_ASSERT_EQUAL(FOUND, found_in(50));
}

/* 491^2 + 655^2 is just below 819^2, and with 656 above it, in any quadrant. */
void test_up_to_the_error_of_the_currents_zero_crossings_nothing_is_compared(void)
{
    for (int n = 0; n < 8; n++) {
        const int beyond = n & 1, sign_d = (n & 2) ? 1 : -1, sign_q = (n & 4) ? 1 : -1;
        setUp();
        in.i = (dq_q15_t){sign_d * 491, sign_q * (655 + beyond)};
        drive(20);
        TEST_ASSERT_EQUAL(beyond ? STEADY : 0, state.before);
        jump(1.2, 1.2);
        TEST_ASSERT_EQUAL(beyond ? FOUND : NEVER, found_in(50));
    }
}

/* In `leaf` at 1256 rpm with 0.9 N·m: the voltage that moved no current wandered by 0.19 of the machine's within 10 ms,
 * and fell as the battery's voltage did. */
void test_a_voltage_that_wanders_without_current_is_no_fault(void)
{
    in.i = (dq_q15_t){-100, 160};
    drive(20);
    jump(0.89, 0.89);
    TEST_ASSERT_EQUAL(NEVER, found_in(50));
}

void test_a_current_that_ends_ends_the_comparison(void)
{
    drive(20);
    const dq_q15_t current = in.i;
    jump(1.2, 1.2);
    drive(FOUND - 1);
    in.i = (dq_q15_t){0, 819};
    drive(1);
    in.i = current;
    drive(50);
}

static void expect_nothing_compared(void)
{
    static const dc_jump_state_t nothing;
    TEST_ASSERT_EQUAL_MEMORY(&nothing, &state, sizeof nothing);
}

static int32_t random_in(int32_t low, int32_t high)
{
    return low + rand() % (high - low + 1);
}

static void draw(void)
{
    in.u = (dq_q15_t){random_in(-20000, 20000), random_in(-20000, 20000)};
    in.i = (dq_q15_t){random_in(-20000, 20000), random_in(-20000, 20000)};
    in.psi_last = (dq_q15_t){random_in(2000, 20000), random_in(-20000, 20000)};
    in.psi = (dq_q15_t){in.psi_last.d + random_in(-1500, 1500), in.psi_last.q + random_in(-1500, 1500)};
    in.omega = (q15_t)random_in(-32767, 32767);
    in.torque = 10000; /* not that of a state that is empty */
}

/* (MN-45) and (MN-53) by hand; 0 where it is not compared. */
static double twin_kappa(double *w)
{
    const double r = 898.0 / 65536.0, rate = 19867.0 / 65536.0, omega = in.omega / 32768.0;
    const double w_d = r * in.i.d - omega * (in.psi.q + in.psi_last.q) / 2.0;
    const double w_q = r * in.i.q + omega * (in.psi.d + in.psi_last.d) / 2.0;
    const double e_d = in.u.d - rate * (in.psi.d - in.psi_last.d), e_q = in.u.q - rate * (in.psi.q - in.psi_last.q);
    *w = hypot(w_d, w_q);
    return (*w > 4.0 * 425.0 && hypot(in.i.d, in.i.q) > 819.0) ? (e_d * w_d + e_q * w_q) / (*w * *w) : 0.0;
}

/* A component of e is rounded by 1/2 count, one of w by 1.5 (two products, a mean of two fluxes): 0.8 and 2.2 together.
 * An error of w changes kappa by at most its share of |w|, times 2 |kappa| + |e|/|w|. A flux changes by up to 1500
 * counts in each axis, its voltage by 643. */
void test_kappa_is_the_share_of_the_rotational_voltage_in_any_direction(void)
{
    int compared = 0, opposed = 0;
    srand(1);
    for (int n = 0; n < 100000; n++) {
        double w;
        state = (dc_jump_state_t){0};
        draw();
        const double kappa = twin_kappa(&w), e = hypot(in.u.d, in.u.q) + 650.0;
        const double tolerance = 1.0 + 16384.0 / w * (0.8 + 2.2 * (2.0 * fabs(kappa) + e / w));
        (void)step();
        if (fabs(w - 1700.0) > 3.0 && fabs(hypot(in.i.d, in.i.q) - 819.0) > 1.0 && fabs(kappa) < 1.9) {
            TEST_ASSERT_DOUBLE_WITHIN(tolerance, fmax(16384.0 * kappa, 0.0), state.half_kappa);
            compared += state.half_kappa > 0;
            opposed += kappa < 0.0;
        }
    }
    TEST_ASSERT_TRUE(compared > 20000 && opposed > 20000);
}

/* Half of it is a Q15 number. */
void test_kappa_is_limited_to_two(void)
{
    jump(2.5, 1.0);
    (void)step();
    TEST_ASSERT_EQUAL(INT16_MAX, state.half_kappa);
}

/* A rotational voltage of 8192 and as much computed: kappa is 1, half of it 16384 exactly. */
static void begin_exactly(int32_t u_q)
{
    config.r = 0;
    state = (dc_jump_state_t){0};
    in = (dc_jump_in_t){.acting = true,
                        .u = {0, u_q},
                        .i = {0, 8192},
                        .psi = {16384, 0},
                        .psi_last = {16384, 0},
                        .omega = 16384,
                        .v_dc = 16000};
}

void test_kappa_before_the_jump_is_a_mean_of_four_steps(void)
{
    static const int means[] = {16384, 17408, 18176, 18752, 19184, 19508};
    begin_exactly(8192);
    drive(1);
    in.u.q = 10240; /* 20480 */
    for (unsigned n = 1; n < sizeof means / sizeof means[0]; n++) {
        drive(1);
        TEST_ASSERT_EQUAL_INT(means[n], state.half_kappa);
    }
}

/* A jump of a quarter: exactly half and exactly one and a half of it, 1024 and 3072 counts, are not the sensor's. */
void test_exactly_half_and_one_and_a_half_of_the_jump_are_not_of_the_sensor(void)
{
    static const struct {
        int32_t change;
        int found;
    } cases[] = {{1024, NEVER}, {1025, FOUND}, {3071, FOUND}, {3072, NEVER}};
    for (unsigned n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        begin_exactly(8192);
        drive(10);
        in.v_dc = 20000;
        in.u.q = 8192 + cases[n].change;
        TEST_ASSERT_EQUAL(cases[n].found, found_in(20));
    }
}

/* v_0 = 400 counts, and a rotational voltage of 1600 or 1601. */
void test_a_rotational_voltage_of_exactly_four_times_the_inverters_error_is_not_compared(void)
{
    config.v_0 = 400;
    begin_exactly(1600);
    in.psi.d = in.psi_last.d = 3200;
    drive(1);
    expect_nothing_compared();
    in.psi.d = in.psi_last.d = 3202;
    drive(1);
    TEST_ASSERT_EQUAL_INT(1, state.before);
}

/* So a rig without a machine disables the comparison: (4 v_0)^2 is larger than any voltage, and than 32 bits of Q28. */
void test_with_the_largest_error_of_the_inverter_nothing_is_compared(void)
{
    config.v_0 = INT16_MAX;
    drive(20);
    jump(1.2, 1.2);
    TEST_ASSERT_EQUAL(NEVER, found_in(50));
}

void test_a_bridge_that_does_not_act_ends_the_comparison(void)
{
    drive(20);
    jump(1.2, 1.2);
    drive(FOUND - 1);
    in.acting = false;
    drive(1);
    expect_nothing_compared();
    in.acting = true;
    drive(50);
}

/* The flux falls just so fast that a fifth of the rotational voltage is not needed: 0.303 of the change in a step. */
void test_the_voltage_of_a_changing_flux_does_not_count(void)
{
    drive(20);
    const dq_q15_t psi = in.psi,
                   half = {(int32_t)lround(-0.1 * in.u.d / 0.303), (int32_t)lround(-0.1 * in.u.q / 0.303)};
    in.psi = (dq_q15_t){psi.d + half.d, psi.q + half.q};
    in.psi_last = (dq_q15_t){psi.d - half.d, psi.q - half.q};
    jump(0.8, 0.8);
    TEST_ASSERT_EQUAL(NEVER, found_in(50));
}

void test_a_voltage_against_the_rotational_one_is_not_compared(void)
{
    jump(-1.0, 1.0);
    drive(20);
    expect_nothing_compared();
    jump(1.2, 1.2);
    TEST_ASSERT_EQUAL(NEVER, found_in(50));
}

void test_no_argument_wraps(void)
{
    static const int32_t ends[] = {-32768, 0, 32767};
    for (int n = 0; n < 243; n++) {
        in = (dc_jump_in_t){.acting = true,
                            .u = {ends[n % 3], ends[n / 3 % 3]},
                            .i = {ends[n / 9 % 3], -ends[n / 9 % 3] - 1},
                            .psi = {ends[n / 27 % 3], ends[n / 81]},
                            .omega = (q15_t)ends[n / 27 % 3],
                            .v_dc = (q15_t)((n % 2) ? 32767 : 0)};
        (void)step();
    }
}
