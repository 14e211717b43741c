/* SPDX-License-Identifier: Apache-2.0 */
/* The firmware with scripted sensor values. SysTick is the PWM period, PendSV the identification, a spare interrupt the
 * task. */
#include "drive/mrai/mrai_seam.h"
#include "drive/slow_monitors.h"
#include "fx/codegen.h"
#include "hal/adc.h"
#include "hal/angle.h"
#include "hal/irq.h"
#include "hal/mps2/core.h"
#include "hal/mps2/script.h"
#include "hal/mps2/semihosting.h"
#include "hal/pwm.h"
#include "hal/temperature.h"

static drive_t the_drive;
static script_t script;
static volatile uint32_t done; /* periods */
static duty_t duties;
static bool gates;

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

int16_t hal_temperature_winding_dC(void)
{
    return TEMPERATURE_UNKNOWN;
}

int16_t hal_temperature_inverter_dC(void)
{
    return TEMPERATURE_UNKNOWN;
}

void hal_irq_pend_mrai(void)
{
    SCB_ICSR = ICSR_PENDSV;
}

void systick_handler(void)
{
    if (done == SCRIPT_PERIODS) {
        return;
    }
    script_next(&script);
    fast_isr(&the_drive);
    script_note(&script, duties, gates);
    done = done + 1U;
    if (done % the_drive.motor->bases.periods_per_step == 0U) {
        NVIC_ISPR0 = 1U << IRQ_TASK;
    }
}

void pendsv_handler(void)
{
    mrai_isr(&the_drive);
}

void task_handler(void)
{
    script_request(&script, &the_drive.request);
    task_1khz(&the_drive);
}

static void start(void)
{
    SCB_SHPR3 = PRIORITY_FAST << 24 | PRIORITY_MRAI << 16;
    NVIC_IPR(IRQ_TASK) = PRIORITY_TASK;
    NVIC_ISER0 = 1U << IRQ_TASK;
    SYST_RVR = TICKS_PER_PERIOD - 1U;
    SYST_CVR = 0;
    SYST_CSR = SYST_RUN;
}

FX_NOT_INLINED int main(void)
{
    static motor_t without_machine;
    without_machine = motor;
    slow_monitors_without_machine(&without_machine);
    drive_init(&the_drive, &without_machine);
    start();
    while (done < SCRIPT_PERIODS) {
        __asm__ volatile("wfi" ::: "memory");
    }
    semihosting_print_word("low", script.low);
    semihosting_print_word("high", script.high);
    semihosting_print_word("differing", script.differing);
    semihosting_print_word("faults", the_drive.fast.faults);
    semihosting_print_word("overruns", mrai_overruns(&the_drive));
    semihosting_print_word("psi_delta", (uint32_t)the_drive.task.identification.psi_delta);
    semihosting_print_word("r_delta", (uint32_t)the_drive.task.identification.r_delta);
    return 0;
}
