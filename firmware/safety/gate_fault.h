/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SAFETY_GATE_FAULT_H
#define SAFETY_GATE_FAULT_H
/** The safe state that a gate-driver fault needs. Its usual cause is a shorted switch: with switching disabled,
 * half-wave currents then brake a turning machine at any speed.
 *   e > v_dc/8: short circuit, after the search for a shorted switch (SS-30); e < v_dc/16: switching disabled;
 *   between: as before
 *   A current above i_alive + 2 |i_0| although switching is disabled, while the sum of (v_dc - e) T over the steps
 *   exceeds 1.5 sqrt(3) psi_b: the dc link ends any current of the windings sooner, so a switch is shorted.
 *   That is a gate fault, too, and needs the short circuit until the faults are reset. i_0, the mean of the measured
 *   phases, excludes the offset of one sensor, which looks like a current of 2 |i_0|. Zeros of two sensors that are
 *   wrong against each other have no mean. Unless a gate fault is latched already, the current must therefore also
 *   exceed 4 i_alive in such a step.
 *   Contactor and gate supply may be switched off with a gate fault when the machine is at rest (e <= v_dc/64), or when
 *   no switch is shorted and no current above i_alive was measured for 50 steps with switching disabled.
 * Source   docs/theory/safe-state.md (SS-9), (SS-10), (SS-32)
 * Units    per unit
 * Range    every argument
 * Errors   none
 * Context  1 kHz task; no division */
#include <stdbool.h>
#include <stdint.h>

#include "fx/q.h"

typedef struct {
    q15_t i_alive;      /* a phase current above this is not a measuring error */
    int32_t volt_steps; /* 1.5 sqrt(3) psi_b in V_b times a step */
} gate_fault_config_t;

typedef struct {
    int32_t opposed;     /* sum of v_dc - e, q15, while a current flows with switching disabled; saturates */
    uint8_t quiet;       /* steps without current with switching disabled; saturates */
    bool above;          /* of e: a gate fault needs the short circuit now, or would need it */
    bool switch_shorted; /* found by its current; until the gate fault is reset */
    bool holds_supply;   /* contactor and gate supply must stay on for a gate fault */
} gate_fault_state_t;

typedef struct {
    bool latched;   /* a gate fault */
    bool gates;     /* as read back: the switches follow the duties */
    bool rectifies; /* the diodes of an intact bridge may conduct (safety/safe_state.h) */
    bool currents_valid;
    q15_t line_emf, v_dc;
    int32_t zero;      /* mean of the three phases, magnitude, q15 */
    q15_t i_magnitude; /* of the current vector */
} gate_fault_in_t;

/** Whether a current above the error of one sensor flows although switching is disabled. */
bool gate_fault_current_flows(const gate_fault_config_t *config, const gate_fault_in_t *in);

/** Whether a gate fault needs the short circuit now, or would need it. */
bool gate_fault_step(const gate_fault_config_t *config, gate_fault_state_t *state, const gate_fault_in_t *in);

#endif
