/* SPDX-License-Identifier: Apache-2.0 */
#ifndef ECU_ECU_PRIVATE_H
#define ECU_ECU_PRIVATE_H
/** What ecu.c needs to know before it acts: the drive and the bus, seen through the eyes of supervisor, arbitration
 * and telemetry.
 * Source   docs/howto/can.md
 * Context  1 kHz task; ecu.c only */
#include "comm/messages.h"
#include "ecu/ecu.h"
#include "types/torque_limits.h"

/* Whether the interrupts advance and the task is in time; once per task. */
void ecu_watch(ecu_t *ecu);
supervisor_in_t ecu_observe(ecu_t *ecu, bool gate_fault);
arbitrate_in_t ecu_arbitration(const ecu_t *ecu);
torque_limits_t ecu_limits(const ecu_t *ecu);
/* What the bus, not the drive, knows. */
void ecu_telemetry(const ecu_t *ecu, telemetry_t *telemetry);

#endif
