/* SPDX-License-Identifier: Apache-2.0 */
#include "storage/memory.h"

#include "hal/nvm.h"
#include "signal/crc32.h"

#define VERSION 3U /* of record_t */
#define MISMATCH_MAX Q15(0.25) /* half of the share that makes the confidence fall */
#define STANDSTILL Q31(0.002)  /* of the speed base */

/* No padding: the store's checksum runs over its bytes. */
typedef struct {
    identify_record_t identified;
    compensation_t compensation;
    int32_t trim;
} record_t;

uint32_t memory_layout(const motor_t *m)
{
    const uint32_t version[2] = {VERSION, (uint32_t)sizeof(record_t)};
    uint32_t crc = crc32_update(CRC32_START, version, sizeof version);
    for (const char *letter = m->name; *letter != '\0'; letter++) {
        crc = crc32_update(crc, letter, 1);
    }
    crc = crc32_update(crc, &m->bases, sizeof m->bases);
    return ~crc32_update(crc, m->identify.sigma, sizeof m->identify.sigma);
}

void memory_recall(memory_t *memory, drive_t *drive)
{
    record_t record;
    *memory = (memory_t){0};
    if (store_load(memory_layout(drive->motor), &record, sizeof record) == STORE_OK) {
        memory->recalled = (record.compensation.measured == 0 || drive_compensate(drive, &record.compensation)) &&
                           drive_recall(drive, &record.identified);
        if (memory->recalled) {
            drive_restore_trim(drive, record.trim);
        }
    }
}

/* The robust identification counts steps of the task. */
static uint32_t in_steps(const drive_t *drive, uint32_t ms)
{
    return (uint32_t)((float)ms * 1e-3F / drive->motor->bases.step_s + 0.5F);
}

static bool stands_still(const drive_t *drive)
{
    const q31_t omega = sample_box_read(&drive->samples).point.omega;
    return omega <= STANDSTILL && omega >= -STANDSTILL;
}

static bool at_rest(const drive_t *drive)
{
    return drive->task.run_state == RUN_STATE_OFF && drive->fast.faults == 0U &&
           command_box_read(&drive->commands)->safe != SAFE_SHORT_CIRCUIT && stands_still(drive);
}

/* A save is wanted as soon as the drive has rested for long enough. */
static bool is_wanted(const memory_t *memory, const drive_t *drive, uint32_t now)
{
    return memory->has_run &&
           (!memory->has_tried || now - memory->tried_at + MEMORY_HOLD_STEPS >= in_steps(drive, MEMORY_INTERVAL_MS)) &&
           drive->task.identify.mismatch_share <= MISMATCH_MAX;
}

static bool save_record(memory_t *memory, const drive_t *drive, uint32_t now)
{
    const record_t record = {drive_identified_record(drive), drive->task.compensation, drive->task.trim.trim};
    bool saved = false;
    if (hal_nvm_begin()) {
        saved = store_save(memory_layout(drive->motor), &record, sizeof record);
        memory->erase_cycles = store_erase_cycles();
        hal_nvm_end();
    }
    memory->has_tried = true;
    memory->tried_at = now;
    memory->has_run = !saved;
    memory->saves += saved ? 1U : 0U;
    memory->failures += saved ? 0U : 1U;
    return saved;
}

/* The counters wrap after 49 days; only differences are used. */
bool memory_background(memory_t *memory, drive_t *drive)
{
    const uint32_t now = drive->task.identifications;
    if (!at_rest(drive)) {
        memory->has_run = memory->has_run || drive->task.run_state == RUN_STATE_RUN;
        memory->rest_since = now;
        drive_hold(drive, false);
        return false;
    }
    const uint32_t rested = now - memory->rest_since, needed = in_steps(drive, MEMORY_REST_MS);
    if (rested + MEMORY_HOLD_STEPS < needed || !is_wanted(memory, drive, now)) {
        drive_hold(drive, false);
        return false;
    }
    if (!drive->held) {
        drive_hold(drive, true);
        memory->held_since = now;
    }
    if (rested < needed || now - memory->held_since < MEMORY_HOLD_STEPS) {
        return false;
    }
    const bool saved = save_record(memory, drive, now);
    drive_hold(drive, false);
    return saved;
}
