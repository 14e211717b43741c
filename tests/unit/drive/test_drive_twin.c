/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <stdio.h>

#include "drive/data_check.h"
#include "hal/mock_adc.h"
#include "hal/mock_angle.h"
#include "hal/mock_irq.h"
#include "hal/mock_pwm.h"
#include "hal/mock_temperature.h"
#include "seam.h"
#include "twin/twin_private.h"
#include "unity.h"
#include "worst.h"

/* The whole drive and its double-precision twin get the same quantised samples of a machine that follows the references
 * of the twin with a first-order lag; every duty must agree. The integrators of current control and torque loop and the
 * identification are off: they have no effect on this machine and would only accumulate rounding errors. tests/loop
 * compares the closed loop of both with a real machine model. */

static twin_t *twin;
static const double two_pi = 6.283185307179586476925;

void setUp(void)
{
    seam_start();
    twin = twin_create();
    twin->motor.integral_ratio = 0.0;
    drive.parameters.current_control.integral_gain = 0;
    drive.parameters.current_control.tracking_gain_q34 = 0;
    twin->motor.torque_ki = 0.0;
    drive.parameters.torque_loop.ki = 0;
    data_check_start(&drive);
    twin_set(twin, "identification", 0.0);
    drive.request.identification = false;
    /* The currents of this machine lag and its voltages are not physical: the monitors would report faults. */
    seam.motor.plausibility.e_0 = INT16_MAX;
    seam.motor.plausibility.i_alive = INT16_MAX;
    seam.motor.torque_monitor.v_0 = INT16_MAX;
}

void tearDown(void)
{
    twin_destroy(twin);
}

static double ampere(uint32_t count)
{
    return (count - 2048.0) / 2048.0 * (double)motor.current_full_scale_A;
}

typedef struct {
    double theta_m, i_d, i_q;
} machine_t;

/* One period of both with the present samples of the machine. Returns the largest difference of a duty in 2^-15. */
static double period(machine_t *m, double rpm)
{
    double out[4];
    const twin_abc_t i = twin_clarke_inverse(twin_park_inverse((twin_dq_t){m->i_d, m->i_q}, 3.0 * m->theta_m));
    seam_current(i.a, i.b, i.c);
    const double turns = m->theta_m / two_pi;
    seam.theta_m = (uint32_t)((turns - floor(turns)) * 4294967295.0);
    const double in[6] = {ampere(seam.counts.i_a),
                          ampere(seam.counts.i_b),
                          ampere(seam.counts.i_c),
                          seam.counts.v_dc / 4096.0 * (double)motor.v_dc_full_scale_V,
                          m->theta_m,
                          20.0};
    twin_step(twin, in, out);
    seam_period();
    m->theta_m += rpm / 60.0 * two_pi * 1e-4;
    m->i_d += 0.1 * (twin_get(twin, "id_ref_A") - m->i_d);
    m->i_q += 0.1 * (twin_get(twin, "iq_ref_A") - m->i_q);
    TEST_ASSERT_EQUAL(out[3] > 0.5, seam.gates);
    return worse_of(fabs(seam.duty.a - out[0] * 32768.0),
                    worse_of(fabs(seam.duty.b - out[1] * 32768.0), fabs(seam.duty.c - out[2] * 32768.0)));
}

static void command(double torque_Nm)
{
    TEST_ASSERT_EQUAL_INT(TWIN_OK, twin_set(twin, "torque_requested_Nm", torque_Nm));
    drive.request.torque_arbitrated = (q15_t)lround(torque_Nm / (double)motor.bases.torque_Nm * 32768.0);
}

static void drive_at(double rpm, double torque_Nm)
{
    machine_t m = {0};
    double worst = 0.0;
    int off = 0;
    char where[80];
    command(torque_Nm);
    for (int n = 0; n < 3000; n++) {
        if (n == 100) {
            TEST_ASSERT_EQUAL_INT(TWIN_OK, twin_set(twin, "enable", 1.0));
            drive.request.enable = true;
        }
        if (n == 1500) {
            command(-0.5 * torque_Nm);
        }
        const double difference = period(&m, rpm);
        worst = worse_of(worst, difference);
        off += !(difference <= 40.0); /* a short pulse rounded to the other limit differs by 655 LSB for one period */
    }
    (void)snprintf(where, sizeof where, "%g rpm, %g N m: at most %.1f LSB, %d periods differ", rpm, torque_Nm, worst,
                   off);
    TEST_ASSERT_TRUE_MESSAGE(off <= 3, where);
    const double rated = (double)motor.torque_max_Nm;
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(
        1e-3 * rated, twin_get(twin, "torque_estimated_Nm"),
        drive.task.identification.torque_estimated / 32768.0 * (double)motor.bases.torque_Nm, where);
}

void test_the_whole_drive_switches_as_its_twin_at_low_speed(void)
{
    drive_at(300.0, 60.0);
}

void test_the_whole_drive_switches_as_its_twin_at_medium_speed_in_both_directions(void)
{
    drive_at(3000.0, 100.0);
}

void test_the_whole_drive_switches_as_its_twin_backwards_and_braking(void)
{
    drive_at(-3000.0, 80.0);
}

void test_the_whole_drive_switches_as_its_twin_in_field_weakening(void)
{
    drive_at(5000.0, 40.0);
}

void test_both_disable_switching_in_the_same_period(void)
{
    machine_t m = {0};
    twin_set(twin, "enable", 1.0);
    drive.request.enable = true;
    for (int n = 0; n < 50; n++) {
        (void)period(&m, 1000.0);
    }
    TEST_ASSERT_TRUE(seam.gates);
    m.i_d = -390.0;           /* at least 338 A in one of the phases */
    (void)period(&m, 1000.0); /* compares whether switching is enabled */
    TEST_ASSERT_FALSE(seam.gates);
    TEST_ASSERT_EQUAL_INT((int)drive.fast.faults, (int)twin_get(twin, "fault_word"));
}
