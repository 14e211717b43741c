/* SPDX-License-Identifier: Apache-2.0 */
/* Calibration values against the data of hsm1. Expected values are worked out by hand from motor.toml and the bases:
 * 294.664 N.m, 3298.6724 rad/s, 0.16370223 V.s, a step of 1 ms; a count of a q15 is 2^-15 of the base. */
#include "calibration/calibration.h"

#include "unity.h"

#define TOLERANCE 1e-4F /* of a value: single precision, and the rounding of the constants above */

static drive_t drive;
static motor_t other; /* hsm1 with one value changed */

void setUp(void)
{
    other = motor;
    drive_init(&drive, &motor);
}

void tearDown(void)
{
}

static void expect(float expected, float found)
{
    TEST_ASSERT_FLOAT_WITHIN(TOLERANCE * (expected < 0.0F ? -expected : expected) + 1e-12F, expected, found);
}

/* 132 N.m in 10 ms; half a count of the slew is 4.5 N.m/s. */
void test_the_values_are_those_of_the_motor_data(void)
{
    TEST_ASSERT_FLOAT_WITHIN(4.5F, 13200.0F, calibration_get(&drive, CALIBRATION_torque_slew_Nm_per_s));
    TEST_ASSERT_FLOAT_WITHIN(0.016F, 50.0F, calibration_get(&drive, CALIBRATION_torque_loop_bandwidth_rad_s));
    TEST_ASSERT_FLOAT_WITHIN(0.0007F, 1.0F, calibration_get(&drive, CALIBRATION_dead_time_compensation));
    expect(3.0F, calibration_get(&drive, CALIBRATION_observer_m));
    expect(30.0F, calibration_get(&drive, CALIBRATION_flux_bandwidth_rad_s));
    expect(10.0F, calibration_get(&drive, CALIBRATION_resistance_bandwidth_rad_s));
}

/* The last column: 294.664/2^15/1 ms; 1/2^15/1 ms; 1/2^15/0.0228571; none; 2^-31/(0.05 * 0.071658/0.163702 * 1 ms);
 * 2^-31/(0.2 * 0.018/1.35 * 1 ms). */
void test_the_ranges_are_those_of_the_list_down_to_a_step_of_the_format(void)
{
    static const value_range_t expected[CALIBRATION_COUNT] = {
        {0.0F, 1e6F, 8.99243F}, {0.0F, 500.0F, 0.0305176F},   {0.0F, 1.5F, 0.00133514F},
        {2.0F, 4.0F, 0.0F},     {0.0F, 500.0F, 2.127619e-5F}, {0.0F, 150.0F, 1.746230e-4F},
    };
    for (int k = 0; k < CALIBRATION_COUNT; k++) {
        const value_range_t found = calibration_range(&drive, (calibration_id_t)k);
        expect(expected[k].lo, found.lo);
        expect(expected[k].hi, found.hi);
        expect(expected[k].least, found.least);
    }
}

/* With a magnet a thousand times as strong the gain vanishes before the drift: 2^-31 * 3298.6724/2. */
void test_the_least_bandwidth_keeps_the_gain_above_zero_too(void)
{
    other.psi_f_Vs *= 1000.0F;
    drive_init(&drive, &other);
    expect(7.68031e-7F, calibration_range(&drive, CALIBRATION_flux_bandwidth_rad_s).least);
}

void test_an_ideal_bridge_has_nothing_to_compensate(void)
{
    other.bridge_duty = 0.0F;
    drive_init(&drive, &other);
    TEST_ASSERT_TRUE(calibration_get(&drive, CALIBRATION_dead_time_compensation) == 0.0F);
    TEST_ASSERT_TRUE(calibration_range(&drive, CALIBRATION_dead_time_compensation).least == 0.0F);
}

/* 20,000/8.99243 = 2224.1 counts; 100/0.0305176 = 3276.8; 0.5 * 0.0228571 * 2^15 = 374.5, twice that in q16. */
void test_a_value_becomes_counts_of_the_live_parameters(void)
{
    calibration_set(&drive, CALIBRATION_torque_slew_Nm_per_s, 20000.0F);
    calibration_set(&drive, CALIBRATION_torque_loop_bandwidth_rad_s, 100.0F);
    calibration_set(&drive, CALIBRATION_dead_time_compensation, 0.5F);
    TEST_ASSERT_EQUAL_INT32(2224, drive.parameters.torque_slew);
    TEST_ASSERT_EQUAL_INT32(3277, drive.parameters.torque_loop.ki);
    TEST_ASSERT_EQUAL_INT32(748, drive.parameters.modulate.dead_time_q16);
}

void test_a_slew_of_zero_is_none(void)
{
    calibration_set(&drive, CALIBRATION_torque_slew_Nm_per_s, 0.0F);
    TEST_ASSERT_EQUAL_INT32(Q15_MAX, drive.parameters.torque_slew);
    TEST_ASSERT_TRUE(calibration_get(&drive, CALIBRATION_torque_slew_Nm_per_s) == 0.0F);
}

/* Half a count and less: the drive must not run without a limit because of that. */
void test_a_slew_below_the_format_s_step_does_not_become_none(void)
{
    calibration_set(&drive, CALIBRATION_torque_slew_Nm_per_s, 0.5F);
    TEST_ASSERT_EQUAL_INT32(0, drive.parameters.torque_slew);
}

/* Twice the bandwidths and four thirds of m of motor.toml, whose counts the tables state. */
void test_the_paper_s_law_takes_its_values(void)
{
    calibration_set(&drive, CALIBRATION_observer_m, 4.0F);
    calibration_set(&drive, CALIBRATION_flux_bandwidth_rad_s, 60.0F);
    calibration_set(&drive, CALIBRATION_resistance_bandwidth_rad_s, 20.0F);
    TEST_ASSERT_INT32_WITHIN(64, 458129845, drive.mrai_parameters.pole_gain);
    TEST_ASSERT_INT32_WITHIN(16, 78121746, drive.mrai_parameters.flux_gain);
    TEST_ASSERT_INT32_WITHIN(2, 2820078, drive.mrai_parameters.psi_drift_full);
    TEST_ASSERT_INT32_WITHIN(8, 26040582, drive.mrai_parameters.resistance_gain);
    TEST_ASSERT_INT32_WITHIN(1, 114532, drive.mrai_parameters.r_drift_full);
}

/* The gain is 4 m R_0 2^shift: the same gain is half of m with a shift of 1, and twice with -1. */
void test_the_shift_of_the_gain_belongs_to_m(void)
{
    drive.mrai_parameters.g_shift = 1;
    expect(1.5F, calibration_get(&drive, CALIBRATION_observer_m));
    drive.mrai_parameters.g_shift = -1;
    expect(6.0F, calibration_get(&drive, CALIBRATION_observer_m));
}
