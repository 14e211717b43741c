/* SPDX-License-Identifier: Apache-2.0 */
#include "seam.h"

#include <math.h>
#include <string.h>

#include "hal/mock_adc.h"
#include "hal/mock_angle.h"
#include "hal/mock_irq.h"
#include "hal/mock_pwm.h"
#include "hal/mock_temperature.h"
#include "unity.h"

seam_t seam;
drive_t drive;
static int periods;

static void note(char event)
{
    const size_t n = strlen(seam.log);
    TEST_ASSERT_TRUE_MESSAGE(n < sizeof seam.log - 1U, "too many hardware calls in one period");
    seam.log[n] = event;
    seam.log[n + 1U] = '\0';
}

static void adc_read(adc_counts_t *counts, int calls)
{
    (void)calls;
    note('a');
    *counts = seam.counts;
}

static uint32_t angle_read(int calls)
{
    (void)calls;
    note('r');
    return seam.theta_m;
}

static void pend(int calls)
{
    (void)calls;
    note('p');
    seam.pended++;
}

static void pwm_write(duty_t duty, int calls)
{
    (void)calls;
    note('w');
    seam.duty = duty;
}

static void pwm_enable(bool on, int calls)
{
    (void)calls;
    note(on ? '+' : '-');
    seam.gates = on;
}

static bool pwm_gates(int calls)
{
    (void)calls;
    return seam.gates && !seam.gates_blocked;
}

static bool angle_is_absolute(int calls)
{
    (void)calls;
    return !seam.angle_unknown;
}

static int16_t winding(int calls)
{
    (void)calls;
    return seam.winding_dC;
}

static int16_t inverter(int calls)
{
    (void)calls;
    return seam.inverter_dC;
}

static int16_t known_permille(int calls)
{
    (void)calls;
    return seam.known_permille;
}

void seam_start(void)
{
    memset(&seam, 0, sizeof seam);
    periods = 0;
    hal_adc_read_Stub(adc_read);
    hal_angle_read_Stub(angle_read);
    hal_angle_is_absolute_Stub(angle_is_absolute);
    hal_irq_pend_mrai_Stub(pend);
    hal_pwm_write_Stub(pwm_write);
    hal_pwm_enable_Stub(pwm_enable);
    hal_pwm_gates_Stub(pwm_gates);
    hal_temperature_winding_dC_Stub(winding);
    hal_temperature_inverter_dC_Stub(inverter);
    hal_adc_known_permille_Stub(known_permille);
    seam.known_permille = 1000;
    seam.motor = motor;
    drive_init(&drive, &seam.motor);
    seam_current(0.0, 0.0, 0.0);
    seam_voltage(350.0);
}

static uint16_t count_of(double share)
{
    return (uint16_t)fmin(fmax(floor(share * 4096.0 + 0.5), 0.0), 4095.0);
}

void seam_current(double a_A, double b_A, double c_A)
{
    const double span = 2.0 * (double)motor.current_full_scale_A;
    seam.counts.i_a = count_of(a_A / span + 0.5);
    seam.counts.i_b = count_of(b_A / span + 0.5);
    seam.counts.i_c = count_of(c_A / span + 0.5);
}

void seam_voltage(double v_dc_V)
{
    seam.counts.v_dc = count_of(v_dc_V / (double)motor.v_dc_full_scale_V);
}

void seam_period(void)
{
    seam.log[0] = '\0';
    const int before = seam.pended;
    fast_isr(&drive);
    if (seam.pended != before) {
        mrai_isr(&drive);
    }
    periods++;
    if (periods % 10 == 0) {
        task_1khz(&drive);
    }
}

void seam_periods(int count)
{
    for (int n = 0; n < count; n++) {
        seam_period();
    }
}

void seam_run(void)
{
    drive.request.enable = true;
    task_1khz(&drive);
}
