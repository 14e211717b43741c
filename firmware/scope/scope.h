/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SCOPE_SCOPE_H
#define SCOPE_SCOPE_H
/** The drive's scope: one memory for what a tool captures and for the freeze frame around a fault.
 *   Without a tool's capture each first fault leaves a freeze frame: 32 samples before it and 32 from it on, one in
 *   each PWM period, of eight signals. It replaces a tool's capture that still waits for its trigger, unless that
 *   trigger is a fault. A capture that has been triggered is kept until it is released. The freeze frame is
 *   released by a command, or when all faults have been reset.
 * Source   docs/howto/scope.md; docs/decisions/020-scope.md
 * Units    raw half words, scope/signal_list.h; PWM periods
 * Range    commands of scope_command_t; a refused command changes nothing
 * Errors   scope_result_t
 * Context  1 kHz task, after the drive's step */
#include <stdbool.h>
#include <stdint.h>

#include "drive/drive.h"
#include "scope/capture.h"

#define SCOPE_FREEZE_BEFORE 32U
#define SCOPE_FREEZE_SAMPLES 64U

/** First byte of a command, which has at most 7 of them; 16-bit numbers are little endian. */
typedef enum {
    SCOPE_SELECT = 1,  /* position, signal */
    SCOPE_SETUP = 2,   /* number of signals, divisor (2), trigger, its signal */
    SCOPE_SAMPLES = 3, /* samples (2), samples before the trigger (2), level (2) */
    SCOPE_ARM = 4,     /* with what was set up; refused unless the scope is idle */
    SCOPE_TRIGGER = 5, /* now; without effect unless armed */
    SCOPE_STOP = 6     /* ends and releases a capture or a freeze frame */
} scope_command_t;

typedef enum { SCOPE_OK, SCOPE_UNKNOWN, SCOPE_TOO_SHORT, SCOPE_OUT_OF_RANGE, SCOPE_BUSY, SCOPE_RESULTS } scope_result_t;

typedef struct {
    capture_t capture;      /* first: what tools read begins here */
    capture_config_t setup; /* as the commands have left it; acts when it is armed */
    int16_t memory[CAPTURE_MEMORY];
} scope_t;

/** command: without the protocol's own code. */
scope_result_t scope_command(scope_t *scope, const drive_t *drive, const uint8_t *command, uint8_t length);
/** fault: one has come, to the drive or to the ECU, and there was none; else all have gone. */
void scope_follow_fault(scope_t *scope, const drive_t *drive, bool fault);
/** A step of the scope while it records. */
void scope_record(scope_t *scope, const drive_t *drive);

/** Once per step. changed: whether there is a fault differs from the last step. */
static inline void scope_step(scope_t *scope, const drive_t *drive, bool changed, bool fault)
{
    if (changed) {
        scope_follow_fault(scope, drive, fault);
    }
    if (scope->capture.recording != (uint8_t)CAPTURE_RECORDS_NOT) {
        scope_record(scope, drive);
    }
}

#endif
