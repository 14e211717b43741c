/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_HOST_INSTANCE_H
#define HAL_HOST_INSTANCE_H
/** One software-in-the-loop drive: the firmware's drive and the port's registers.
 * Source   docs/howto/software-in-the-loop.md
 * Context  private to hal/host */
#include <stdbool.h>

#include "app/drive.h"
#include "hal/host/fluxtrue.h"
#include "types/samples.h"

struct fluxtrue {
    drive_t drive;
    adc_counts_t counts;
    uint32_t theta_m;
    double winding_C;
    duty_t duty;
    bool gates;
    bool mrai_pending;
    uint32_t periods; /* since creation: every tenth runs the 1 kHz task */
    double torque_command_Nm; /* as set: what get answers before the task has taken it over */
};

/** As fluxtrue_create() leaves it, in memory of the caller's. */
void fluxtrue_init(fluxtrue_t *instance);

#endif
