/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_AFTER_RESET_H
#define DRIVE_AFTER_RESET_H
/** The safe state through a reset of the processor: what a port keeps over it, and how the drive continues.
 *   before_reset()  in each step of the task, for memory that outlasts a reset
 *   after_reset_needs_short_circuit()  before anything else after one, with what is measured then
 *   after_reset_v_dc()  what a port measures then, without the offset of its sensor
 *   after_reset_hold()  after drive_init(): the drive holds the short circuit that the port has applied, until the
 *     speed allows disabled switching, as after a fault
 * Source   docs/theory/safe-state.md, section 6
 * Units    per unit of motor.bases
 * Range    speed -1 ... 1: negative if it cannot be measured; v_dc 0 ... 1
 * Errors   after_reset_needs_short_circuit(): false also where it is not permitted, because the bridge had no supply or
 *          the motor data were refused
 * Context  1 kHz task; start-up */
#include "drive/drive.h"

typedef struct {
    q15_t speed; /* known (SS-5) */
    q15_t v_dc;
    q15_t psi_d_error;
    bool armed; /* the short circuit was permitted, and the motor data valid */
    bool speed_valid;
} before_reset_t;

void before_reset(const drive_t *drive, before_reset_t *before);

/** The dc voltage of a converter's count, as each sample of the fast interrupt has it. */
q15_t after_reset_v_dc(const motor_t *m, uint32_t count);

/** speed: magnitude measured now, negative if it cannot be. If it is less than half of the last known one, or its
 * sensor had failed, the last known one counts (SS-14). */
bool after_reset_needs_short_circuit(const motor_t *m, const before_reset_t *before, q15_t speed, q15_t v_dc);

void after_reset_hold(drive_t *drive, const before_reset_t *before, q15_t speed);

#endif
