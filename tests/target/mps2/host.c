/* SPDX-License-Identifier: Apache-2.0 */
/* The script of hal/mps2 on the host: the activities are called in the order of their priorities. */
#include <stdio.h>

#include "drive/mrai/mrai_seam.h"
#include "drive/slow_monitors.h"
#include "hal/adc.h"
#include "hal/angle.h"
#include "hal/irq.h"
#include "hal/mps2/script.h"
#include "hal/pwm.h"
#include "hal/temperature.h"

static drive_t drive;
static script_t script;
static duty_t duties;
static bool gates, pending;

void hal_adc_read(adc_counts_t *counts)
{
    *counts = script_adc(&script);
}

int16_t hal_adc_known_permille(void)
{
    return HAL_ADC_NOTHING_KNOWN;
}

uint32_t hal_angle_read(void)
{
    return script.angle;
}

bool hal_angle_is_absolute(void)
{
    return true;
}

void hal_pwm_write(duty_t duty)
{
    duties = duty;
}

void hal_pwm_enable(bool on)
{
    gates = on;
}

bool hal_pwm_gates(void)
{
    return gates;
}

void hal_irq_pend_mrai(void)
{
    pending = true;
}

int16_t hal_temperature_winding_dC(void)
{
    return TEMPERATURE_UNKNOWN;
}

int16_t hal_temperature_inverter_dC(void)
{
    return TEMPERATURE_UNKNOWN;
}

int main(void)
{
    static motor_t without_machine;
    without_machine = motor;
    slow_monitors_without_machine(&without_machine);
    drive_init(&drive, &without_machine);
    for (uint32_t k = 1; k <= SCRIPT_PERIODS; k++) {
        script_next(&script);
        fast_isr(&drive);
        script_note(&script, duties, gates);
        if (pending) {
            pending = false;
            mrai_isr(&drive);
        }
        if (k % motor.bases.periods_per_step == 0U) {
            script_request(&script, &drive.request);
            task_1khz(&drive);
        }
    }
    printf("low=%08x\nhigh=%08x\ndiffering=%08x\nfaults=%08x\noverruns=%08x\n", script.low, script.high,
           script.differing, drive.fast.faults, mrai_overruns(&drive));
    const identification_t *identification = &drive.task.identification;
    printf("psi_delta=%08x\nr_delta=%08x\n", (unsigned)identification->psi_delta, (unsigned)identification->r_delta);
    return 0;
}
