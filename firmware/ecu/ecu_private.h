/* SPDX-License-Identifier: Apache-2.0 */
#ifndef ECU_ECU_PRIVATE_H
#define ECU_ECU_PRIVATE_H
/** Inputs of supervisor, arbitration and telemetry, computed from the state of drive and bus; checks of what the ECU
 * keeps from step to step.
 * Source   docs/howto/can.md, docs/theory/data-integrity.md
 * Units    as in the headers of supervisor, arbitration and telemetry
 * Errors   FAULT_CONFIG by ecu_check_integrity(); the others none
 * Context  1 kHz task; ecu.c only */
#include "comm/messages.h"
#include "ecu/ecu.h"
#include "signal/program_flow.h"
#include "types/torque_limits.h"

/* Checks that the interrupts advance and that the task is in time; once per step. */
void ecu_watch(ecu_t *ecu);
/* Converts what the bus commands to per unit, if a frame has been taken or no command is valid. */
void ecu_convert(ecu_t *ecu, bool taken);
supervisor_in_t ecu_observe(ecu_t *ecu, bool gate_fault);
arbitrate_in_t ecu_arbitration(const ecu_t *ecu);
torque_limits_t ecu_limits(const ecu_t *ecu);
/* Raises FAULT_INPUT if the gain of the dc voltage sensor has jumped; once per step, before the drive's task. */
void ecu_check_dc_sensor(ecu_t *ecu);
/* The movement that the bus requests. */
movement_request_t ecu_movement(const ecu_t *ecu);
/* Passes the movement on to the drive, and whether the bus agrees to voltage pulses; once per step. */
void ecu_request_commissioning(ecu_t *ecu);
/* The part of the telemetry that comes from the bus and the state machine. */
void ecu_telemetry(const ecu_t *ecu, telemetry_t *telemetry);
/* Its counters of errors, if a message that contains them may be due. */
void ecu_diagnostics(const ecu_t *ecu, telemetry_t *telemetry);

/* Adds a part of the step that has run to the signature (signal/program_flow.h). */
static inline void ecu_pass(ecu_t *ecu, flow_point_t point)
{
    ecu->drive.task.flow = flow_pass(ecu->drive.task.flow, point);
}

/* Compares the rates of the arbitration, the flags and the options of the request with what the last step left; first
 * in each step. A difference is FAULT_CONFIG with MOTOR_CHECK_LIVE_DATA. */
void ecu_check_integrity(ecu_t *ecu);
/* Seals the rates of the arbitration, once, and the flags, last in each step. */
void ecu_seal_rates(ecu_t *ecu);
void ecu_seal_flags(ecu_t *ecu);

#endif
