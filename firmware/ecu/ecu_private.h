/* SPDX-License-Identifier: Apache-2.0 */
#ifndef ECU_ECU_PRIVATE_H
#define ECU_ECU_PRIVATE_H
/** Inputs of supervisor, arbitration and telemetry, computed from the state of drive and bus.
 * Source   docs/howto/can.md
 * Context  1 kHz task; ecu.c only */
#include "comm/messages.h"
#include "ecu/ecu.h"
#include "types/torque_limits.h"

/* Checks that the interrupts advance and that the task is in time; once per step. */
void ecu_watch(ecu_t *ecu);
supervisor_in_t ecu_observe(ecu_t *ecu, bool gate_fault);
arbitrate_in_t ecu_arbitration(const ecu_t *ecu);
torque_limits_t ecu_limits(const ecu_t *ecu);
/* The part of the telemetry that comes from the bus and the state machine. */
void ecu_telemetry(const ecu_t *ecu, telemetry_t *telemetry);

#endif
