/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/host/port.h"

#include "hal/adc.h"
#include "hal/angle.h"
#include "hal/irq.h"
#include "hal/pwm.h"

/* The HAL's functions have no instance argument; a thread serves one instance at a time. */
static _Thread_local fluxtrue_t *active;

void host_port_select(fluxtrue_t *instance)
{
    active = instance;
}

void hal_adc_read(adc_counts_t *counts)
{
    *counts = active->counts;
}

uint32_t hal_angle_read(void)
{
    return active->theta_m;
}

void hal_pwm_write(duty_t duty)
{
    active->duty = duty;
}

void hal_pwm_enable(bool on)
{
    active->gates = on;
}

void hal_irq_pend_mrai(void)
{
    active->mrai_pending = true;
}
