/* SPDX-License-Identifier: Apache-2.0 */
/* What outlasts a reset of the processor, and what the drive makes of it. */
#include "drive/after_reset.h"

#include "seam.h"
#include "unity.h"

static before_reset_t before;

/* Of hsm1 at 350 V the short circuit is the safe state above 8085 rpm, and below 7186 rpm it is left. */
static q15_t speed_of(float rpm)
{
    const float omega = rpm * 0.1047198F * (float)motor.angle_tracker.pole_pairs;
    return (q15_t)(32768.0F * omega / motor.bases.omega_rad_s);
}

static q15_t volts(float value)
{
    return (q15_t)(32768.0F * value / motor.bases.voltage_V);
}

static bool needs(float rpm, float v)
{
    return after_reset_needs_short_circuit(&motor, &before, speed_of(rpm), volts(v));
}

void setUp(void)
{
    drive_init(&drive, &motor);
    before = (before_reset_t){.speed = speed_of(9500.0F), .v_dc = volts(350.0F), .armed = true, .speed_valid = true};
}

void tearDown(void)
{
}

/* The count that the seam has for 350 V; less an offset of 20 V, and not below 0. */
void test_the_voltage_after_a_reset_is_that_of_a_sample(void)
{
    const uint32_t count = (uint32_t)(350.0F / motor.v_dc_full_scale_V * (float)(1U << motor.adc_bits) + 0.5F);
    TEST_ASSERT_INT_WITHIN(8, volts(350.0F), after_reset_v_dc(&motor, count));
    motor_t with_offset = motor;
    with_offset.measure.v_dc.bias -= (int32_t)(20.0F / motor.bases.voltage_V * 1073741824.0F);
    TEST_ASSERT_INT_WITHIN(8, volts(330.0F), after_reset_v_dc(&with_offset, count));
    TEST_ASSERT_EQUAL_INT(0, after_reset_v_dc(&with_offset, 0));
}

void test_the_present_speed_decides_by_the_lower_level(void)
{
    TEST_ASSERT_TRUE(needs(9500.0F, 350.0F));
    TEST_ASSERT_TRUE(needs(7300.0F, 350.0F));
    TEST_ASSERT_FALSE(needs(7000.0F, 350.0F));
}

/* Rectifying, the machine raises the voltage with which its back-EMF is compared. */
void test_a_voltage_that_has_risen_meanwhile_does_not_count(void)
{
    TEST_ASSERT_TRUE(needs(7300.0F, 420.0F));
    TEST_ASSERT_TRUE(needs(7000.0F, 300.0F));
}

void test_a_sensor_that_shows_no_speed_is_not_used(void)
{
    TEST_ASSERT_TRUE(needs(0.0F, 350.0F));
    TEST_ASSERT_TRUE(after_reset_needs_short_circuit(&motor, &before, -1, volts(350.0F)));
    before.speed_valid = false;
    TEST_ASSERT_TRUE(needs(7000.0F, 350.0F));
}

/* At 2000 of the speed base the back-EMF is 1516, at 1000 758: 0.8 of a dc voltage of 1300 lies between them. */
void test_from_half_of_the_speed_before_the_reset_on_the_present_one_counts(void)
{
    before.speed = 2000;
    before.v_dc = 1300;
    TEST_ASSERT_FALSE(after_reset_needs_short_circuit(&motor, &before, 1000, 1300));
    TEST_ASSERT_TRUE(after_reset_needs_short_circuit(&motor, &before, 999, 1300));
}

void test_a_magnet_that_was_found_stronger_is_taken_into_account(void)
{
    TEST_ASSERT_FALSE(needs(7000.0F, 350.0F));
    before.psi_d_error = Q15(0.05);
    TEST_ASSERT_TRUE(needs(7000.0F, 350.0F));
}

void test_a_bridge_that_was_not_armed_is_left_alone(void)
{
    before.armed = false;
    TEST_ASSERT_FALSE(needs(9500.0F, 350.0F));
}

void test_what_is_kept_is_what_the_drive_knows(void)
{
    drive.task.safe_state.speed = 1234;
    drive.task.armed = true;
    drive.psi_d_error = -5;
    sample_box_begin(&drive.samples)->v_dc = 12345;
    sample_box_publish(&drive.samples);
    before_reset_t kept;
    before_reset(&drive, &kept);
    TEST_ASSERT_EQUAL_INT16(1234, kept.speed);
    TEST_ASSERT_EQUAL_INT16(12345, kept.v_dc);
    TEST_ASSERT_EQUAL_INT16(-5, kept.psi_d_error);
    TEST_ASSERT_TRUE(kept.armed && kept.speed_valid);
    drive.fast.faults = FAULT_ANGLE;
    before_reset(&drive, &kept);
    TEST_ASSERT_TRUE(kept.armed && !kept.speed_valid);
    drive.fast.faults = FAULT_INPUT;
    before_reset(&drive, &kept);
    TEST_ASSERT_FALSE(kept.speed_valid);
    drive.fast.faults = FAULT_CONFIG;
    before_reset(&drive, &kept);
    TEST_ASSERT_FALSE(kept.armed);
    drive.fast.faults = 0;
    drive.task.armed = false;
    before_reset(&drive, &kept);
    TEST_ASSERT_FALSE(kept.armed);
}

void test_the_drive_goes_on_with_the_short_circuit(void)
{
    after_reset_hold(&drive, &before, speed_of(9000.0F));
    TEST_ASSERT_EQUAL_INT(SAFE_SHORT_CIRCUIT, command_box_read(&drive.commands)->safe);
    TEST_ASSERT_FALSE(command_box_read(&drive.commands)->run);
    TEST_ASSERT_EQUAL_INT16(speed_of(9000.0F), drive.task.safe_state.speed);
    TEST_ASSERT_TRUE(drive.task.safe_state.line_emf > volts(315.0F));
    TEST_ASSERT_TRUE(drive.task.armed && drive.task.safe_state.short_circuit);
}

/* Between the levels the diodes may conduct already before the reset: the supply of the short circuit stays on. */
void test_the_drive_goes_on_with_diodes_that_conduct_down_to_the_lower_level(void)
{
    after_reset_hold(&drive, &before, speed_of(7300.0F));
    TEST_ASSERT_TRUE(drive.task.safe_state.rectifies && drive.task.safe_state.short_circuit);
    setUp();
    after_reset_hold(&drive, &before, speed_of(7000.0F));
    TEST_ASSERT_FALSE(drive.task.safe_state.rectifies || drive.task.safe_state.short_circuit);
}
