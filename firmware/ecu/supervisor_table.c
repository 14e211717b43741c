/* SPDX-License-Identifier: Apache-2.0 */
#include "ecu/supervisor.h"

/* The first row that applies is taken, so urgent transitions come first; the rows of a state follow each other in the
 * order of the states. docs/howto/can.md contains a drawing of it.
 * Ready, run, derate and safe state hold contactor and gate supply. Every way out of these four needs WHEN_SLOW: a
 * machine that turns fast would charge the dc link through the diodes. */
const transition_t supervisor_table[] = {
    {STATE_INIT, WHEN_FAULTED, STATE_FAULT},
    {STATE_INIT, WHEN_SELF_TEST_PASSED, STATE_STANDBY},
    {STATE_STANDBY, WHEN_FAULTED, STATE_FAULT},
    {STATE_STANDBY, WHEN_ON, STATE_PRECHARGE},
    {STATE_PRECHARGE, WHEN_FAULTED, STATE_FAULT},
    {STATE_PRECHARGE, WHEN_OFF, STATE_DISCHARGE},
    {STATE_PRECHARGE, WHEN_CHARGED, STATE_READY},
    {STATE_READY, WHEN_TRIPPED, STATE_SAFE_STATE},
    {STATE_READY, WHEN_FAULTED, STATE_SAFE_STATE},
    {STATE_READY, WHEN_OFF | WHEN_SLOW, STATE_DISCHARGE},
    {STATE_READY, WHEN_ENABLED, STATE_RUN},
    {STATE_RUN, WHEN_TRIPPED, STATE_SAFE_STATE},
    {STATE_RUN, WHEN_FAULTED | WHEN_NO_TORQUE, STATE_SAFE_STATE},
    {STATE_RUN, WHEN_STOPPED, STATE_READY},
    {STATE_RUN, WHEN_DERATED, STATE_DERATE},
    {STATE_DERATE, WHEN_TRIPPED, STATE_SAFE_STATE},
    {STATE_DERATE, WHEN_FAULTED | WHEN_NO_TORQUE, STATE_SAFE_STATE},
    {STATE_DERATE, WHEN_STOPPED, STATE_READY},
    {STATE_DERATE, WHEN_FULL, STATE_RUN},
    {STATE_SAFE_STATE, WHEN_SLOW, STATE_FAULT},
    {STATE_FAULT, WHEN_HEALTHY, STATE_STANDBY},
    {STATE_FAULT, WHEN_OFF | WHEN_NOT_DISCHARGED, STATE_DISCHARGE},
    {STATE_DISCHARGE, WHEN_DISCHARGED | WHEN_FAULTED, STATE_FAULT},
    {STATE_DISCHARGE, WHEN_DISCHARGED, STATE_STANDBY},
    {STATE_DISCHARGE, WHEN_DISCHARGE_FAILED, STATE_FAULT},
};

#define ROWS 25U

const uint8_t supervisor_first[STATES_AND_END] = {
    [STATE_INIT] = 0,    [STATE_STANDBY] = 2, [STATE_PRECHARGE] = 4,   [STATE_READY] = 7,      [STATE_RUN] = 11,
    [STATE_DERATE] = 15, [STATE_FAULT] = 20,  [STATE_SAFE_STATE] = 19, [STATE_DISCHARGE] = 22, [STATES] = ROWS,
};

_Static_assert(sizeof supervisor_table / sizeof supervisor_table[0] == ROWS, "the rows of the last state end here");

const state_outputs_t supervisor_outputs[STATES] = {
    [STATE_PRECHARGE] = {.precharge = true},
    [STATE_READY] = {.contactor = true, .gate_driver = true},
    [STATE_RUN] = {.contactor = true, .gate_driver = true, .run = true},
    [STATE_DERATE] = {.contactor = true, .gate_driver = true, .run = true},
    [STATE_SAFE_STATE] = {.contactor = true, .gate_driver = true},
    [STATE_DISCHARGE] = {.discharge = true},
};
