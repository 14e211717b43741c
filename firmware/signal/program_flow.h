/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SIGNAL_PROGRAM_FLOW_H
#define SIGNAL_PROGRAM_FLOW_H
/** Signature of the parts of a step that have been passed, and of their order:
 *   s <- ror(s, 1) xor n * 0x9E3779B1, for the points n in the order in which they are passed
 * It begins with the question of the external watchdog, so that a signature of an earlier step is wrong.
 * Source   docs/theory/third-level.md (QA-1)
 * Units    none: a signature of 32 bits
 * Range    every question and every point
 * Errors   none
 * Context  any; pure */
#include <stdint.h>

#define FLOW_FACTOR 0x9E3779B1U

typedef enum {
    FLOW_INTEGRITY = 1,  /* the data are checked for changes by errors of the memory */
    FLOW_RECEIVED = 2,   /* frames are received, their ages advanced */
    FLOW_INTERRUPTS = 3, /* the fast ISR has completed periods since the last step, and not too many */
    FLOW_STATES = 4,     /* the state machine, and with it the board's outputs */
    FLOW_ARBITRATED = 5, /* the torque and its limits are arbitrated */
    FLOW_MONITORED = 6,  /* the monitors of the drive */
    FLOW_DECIDED = 7,    /* whether the drive may run */
    FLOW_COMMANDED = 8,  /* the command for the fast ISR */
    FLOW_CHECKED = 9     /* the second level has been called */
} flow_point_t;

static inline uint32_t flow_pass(uint32_t flow, flow_point_t point)
{
    return (flow >> 1 | flow << 31) ^ (uint32_t)point * FLOW_FACTOR;
}

#endif
