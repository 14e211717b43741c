/* SPDX-License-Identifier: Apache-2.0 */
/* What the monitor of a common gain of the current sensors is fed with, and which voltage belongs to the current. */
#include "drive/gain_jump_check.h"

#include <math.h>

#include "hal/mock_adc.h"
#include "hal/mock_angle.h"
#include "hal/mock_irq.h"
#include "hal/mock_pwm.h"
#include "hal/mock_temperature.h"
#include "seam.h"
#include "types/faults.h"
#include "unity.h"

enum { SETTLED = 33, DECIDED = 23, NEVER = 0 };

static const dq_q15_t i_ref = {-6000, 9000};
static const winding_resistance_t r = {.r = 900, .error = 0};
static snapshot_t snapshot;

static void set_speed(double omega)
{
    snapshot.sample.point.omega = (q31_t)lround(omega * 2147483648.0);
}

static dq_q15_t flux_at(double share)
{
    const dq_q15_t i = {(int32_t)lround(share * i_ref.d), (int32_t)lround(share * i_ref.q)};
    const flux_point_t flux = flux_table_step(&motor.flux_table, i);
    return (dq_q15_t){flux.psi_d, flux.psi_q};
}

void setUp(void)
{
    seam_start();
    snapshot = (snapshot_t){.i_mean = i_ref, .i_magnitude = 10817};
    set_speed(0.2);
    drive.task.i_ref = i_ref;
    drive.task.psi_ref = flux_at(1.0);
    drive.task.torque_monitor.settling = motor.torque_monitor.settle_steps;
    drive.task.torque_monitor.residual = (dq_q15_halfword_t){120, -340};
}

void tearDown(void)
{
}

static uint32_t step(void)
{
    return gain_jump_check(&drive, &snapshot, true, r);
}

static void run(int steps)
{
    for (int n = 0; n < steps; n++) {
        TEST_ASSERT_EQUAL_HEX32(0, step());
    }
}

/* Four times the voltage of the last quarter of the current. */
static void change_residual(double share, double omega, double turned)
{
    const dq_q15_t all = flux_at(1.0), less = flux_at(0.75);
    const double gain = r.r / 65536.0;
    const double d = gain * i_ref.d - 4.0 * omega * (all.q - less.q);
    const double q = gain * i_ref.q + 4.0 * omega * (all.d - less.d);
    dq_q15_halfword_t *residual = &drive.task.torque_monitor.residual;
    residual->d = (q15_t)(residual->d + lround(share * (cos(turned) * d - sin(turned) * q)));
    residual->q = (q15_t)(residual->q + lround(share * (sin(turned) * d + cos(turned) * q)));
}

static int found_after_a_jump(void)
{
    snapshot.i_mean = (dq_q15_t){i_ref.d + i_ref.d / 20, i_ref.q + i_ref.q / 20};
    run(1);
    snapshot.i_mean = i_ref;
    for (int n = 2; n <= DECIDED; n++) {
        const uint32_t faults = step();
        if (faults != 0U) {
            TEST_ASSERT_EQUAL_HEX32(FAULT_INPUT, faults);
            return n;
        }
    }
    return NEVER;
}

static int found_with(double share, double omega, double turned)
{
    setUp();
    set_speed(omega);
    run(SETTLED + 3);
    change_residual(share, omega, turned);
    return found_after_a_jump();
}

/* The limits are 1/16 and 3/4 of D, and a third of it across. */
void test_the_voltage_is_that_of_the_current_by_resistance_and_tables(void)
{
    static const double speeds[] = {0.0, 0.2, -0.2, 0.6};
    for (int n = 0; n < 4; n++) {
        const bool stands = n == 0; /* there 2 LSB of the voltage are 3 % of it, and its least value counts */
        TEST_ASSERT_EQUAL_INT(DECIDED, found_with(0.7, speeds[n], 0.0));
        TEST_ASSERT_EQUAL_INT(NEVER, found_with(0.81, speeds[n], 0.0));
        TEST_ASSERT_EQUAL_INT(stands ? NEVER : DECIDED, found_with(0.075, speeds[n], 0.0));
        TEST_ASSERT_EQUAL_INT(NEVER, found_with(0.055, speeds[n], 0.0));
        TEST_ASSERT_EQUAL_INT(DECIDED, found_with(0.5, speeds[n], stands ? 0.25 : 0.3));
        TEST_ASSERT_EQUAL_INT(NEVER, found_with(0.5, speeds[n], 0.36));
        TEST_ASSERT_EQUAL_INT(NEVER, found_with(0.5, speeds[n], -0.36));
    }
}

void test_the_last_residual_the_current_and_the_speed_count(void)
{
    snapshot.i_magnitude = (q15_t)(4 * motor.torque_monitor.i_0);
    run(SETTLED + 3);
    change_residual(0.5, 0.2, 0.0);
    TEST_ASSERT_EQUAL_INT(NEVER, found_after_a_jump());
    setUp();
    run(SETTLED + 3);
    change_residual(0.5, 0.2, 0.0);
    set_speed(0.21);
    TEST_ASSERT_EQUAL_INT(NEVER, found_after_a_jump());
}

void test_without_a_complete_window_or_a_settled_torque_monitor_it_begins_anew(void)
{
    run(SETTLED);
    TEST_ASSERT_EQUAL_HEX32(0, gain_jump_check(&drive, &snapshot, false, r));
    TEST_ASSERT_EQUAL_UINT8(0, drive.task.gain_jump.steps);
    run(SETTLED);
    TEST_ASSERT_EQUAL_UINT8(SETTLED, drive.task.gain_jump.steps);
    drive.task.torque_monitor.settling = (uint8_t)(motor.torque_monitor.settle_steps - 1U);
    run(1);
    TEST_ASSERT_EQUAL_UINT8(0, drive.task.gain_jump.steps);
    drive.task.torque_monitor.settling = motor.torque_monitor.settle_steps;
    run(1);
    TEST_ASSERT_EQUAL_UINT8(1, drive.task.gain_jump.steps);
}
