/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_HOST_PORT_H
#define HAL_HOST_PORT_H
/** Chooses the instance whose registers the HAL functions see in this thread.
 * Context  fluxtrue_step() and start-up only */
#include "hal/host/instance.h"

void host_port_select(fluxtrue_t *instance);
/** Reads the gate drivers' line before a period; true: report the fault to the drive, once until switching is enabled
 * again. */
bool host_port_fault_line(fluxtrue_t *instance);
/** Restores the identified values from the flash at start-up. */
void host_port_recall(fluxtrue_t *instance);

#endif
