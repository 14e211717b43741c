/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_RETAINED_H
#define HAL_S32K144_RETAINED_H
/** Data that outlast a reset, in SRAM_U, which holds nothing else. Two copies are written in turn, each with a magic
 * word, a sequence number and the complement of every word: a reset during a write leaves the previous copy.
 *   SIM_CHIPCTL.SRAMU_RETEN = 0 makes the RAM keep its content through a reset; meanwhile nothing may access it.
 *   Therefore it is 1 only while the copies are read or one is written. A reset sets it to 1 itself, and the first
 *   instructions of reset_handler() (startup.c) to 0 again, so that a further reset finds the copies, too.
 * Source   README.md, reset; reference manual, SRAM retention
 * Errors   retained_read(): false after a power-on, or when no copy is intact
 * Context  retained_read(): start-up, once; retained_write(): 1 kHz task, then */
#include <stdbool.h>
#include <stdint.h>

#include "drive/after_reset.h"

typedef struct {
    before_reset_t drive;
    uint32_t lines; /* outputs of port C that were on */
} retained_t;

#define RETAINED_STEPS 4U /* speed, dc voltage and flux hardly change meanwhile */

/** Whether `now` must be written in this step: in every fourth one, and at once when a line, the permission of the
 * short circuit or the validity of the speed, which decide by themselves, differs from what was written last. */
static inline bool retained_is_due(const retained_t *now, const retained_t *last, uint32_t step)
{
    return step % RETAINED_STEPS == 0U || now->lines != last->lines || now->drive.armed != last->drive.armed ||
           now->drive.speed_valid != last->drive.speed_valid;
}

bool retained_read(retained_t *retained);
void retained_write(const retained_t *retained);

#endif
