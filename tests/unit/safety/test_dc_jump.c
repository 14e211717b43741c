/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/dc_jump.h"

#include <math.h>

#include "unity.h"

/* r = 0.0137, psi_f = 0.44, 10 N·m = 0.034, 7 V = 0.013: about those of hsm1. */
static const dc_jump_config_t config = {.r = 898, .t_0 = 1112, .v_0 = 425, .rate_gain = 19867};
static dc_jump_state_t state;
static dc_jump_in_t in;

enum { STEADY = 4, FREE = 3, FOUND = 8, NEVER = 0, V_DC = 20000 };

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
    for (int n = 0; n < steps; n++) {
        TEST_ASSERT_FALSE(step());
    }
}

/* The step after the jump in which the sensor is found. */
static int found_in(int steps)
{
    for (int n = 1; n <= steps; n++) {
        if (step()) {
            return n;
        }
    }
    return NEVER;
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

/* 4 v_0 are 0.052. Without current the rotational voltage is 0.44 of the speed. */
void test_below_four_times_the_inverters_error_nothing_is_compared(void)
{
    begin(0.115, 0.0, 0.0, 1.0);
    drive(20);
    jump(1.2, 1.2);
    TEST_ASSERT_EQUAL(NEVER, found_in(50));
    begin(0.121, 0.0, 0.0, 1.0);
    drive(20);
    jump(1.2, 1.2);
    TEST_ASSERT_EQUAL(FOUND, found_in(50));
}

void test_a_bridge_that_does_not_act_ends_the_comparison(void)
{
    drive(20);
    jump(1.2, 1.2);
    drive(FOUND - 1);
    in.acting = false;
    drive(1);
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
