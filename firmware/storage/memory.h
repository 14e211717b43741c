/* SPDX-License-Identifier: Apache-2.0 */
#ifndef STORAGE_MEMORY_H
#define STORAGE_MEMORY_H
/** Keeps the identified values, the measured compensation of the dead time and its trim over a power cycle, in the
 * store's flash slots.
 *   layout = CRC-32 of the record's version, the motor's name, its bases and the priors that scale the values: a record
 *     of another firmware, another motor or other priors is not used
 *   A save needs a run since the last save, MEMORY_REST_MS at standstill with switching disabled and no fault, a
 *     mismatch share below 1/4, and MEMORY_INTERVAL_MS since the last save; the interval does not apply to the first
 *     save after a start. In the last MEMORY_HOLD_STEPS before the save, and until it is complete, a request to enable
 *     switching waits: a port may slow its processor down to write the flash.
 * Source   docs/decisions/007-store.md
 * Units    ms are counted in steps of the robust identification, whose values are stored
 * Range    the counts wrap after 49 days; only differences are used
 * Errors   if the memory is empty, damaged or of another layout, the priors are used; a save that fails is counted and
 *          repeated after the interval, and the previous record stays valid
 * Context  memory_recall(): after drive_init(), before the interrupts. memory_background(): the port's idle loop, below
 *          every interrupt. A port without a driver for hal/nvm.h calls neither */
#include "drive/drive.h"
#include "storage/store.h"

#define MEMORY_REST_MS 100U
#define MEMORY_HOLD_STEPS 3U
#define MEMORY_INTERVAL_MS 300000U

typedef struct {
    uint32_t saves, failures;
    uint32_t erase_cycles;                     /* of the flash, after the last save (store_erase_cycles()) */
    uint32_t failed_sectors;                   /* that did not erase, program or verify and were passed over */
    uint32_t rest_since, held_since, tried_at; /* counts of the drive's identifications */
    bool recalled;                             /* a record was found and taken */
    bool has_run, has_tried;                   /* since the last save; since the start */
} memory_t;

uint32_t memory_layout(const motor_t *m);
void memory_recall(memory_t *memory, drive_t *drive);
/** True: a record has been saved in this call. */
bool memory_background(memory_t *memory, drive_t *drive);

#endif
