/* SPDX-License-Identifier: Apache-2.0 */
#include "storage/memory.h"

#include "hal/nvm.h"
#include "signal/crc32.h"

#define VERSION 3U /* of record_t */
#define MISMATCH_MAX Q15(0.25) /* half of the share that makes the confidence fall */
#define DISTANCE_MAX_Q26 1610612736   /* 24: of chi square with 7 degrees of freedom one in a thousand */
#define DUTY_MARGIN 0.0078125F               /* of the period */
#define LSB_Q15 3.0517578125e-5F

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

/* Chi-square test: only one machine in a thousand has seven values that are further from the motor data (ID-22). */
static bool is_near_priors(const identify_record_t *identified)
{
    int64_t distance_q26 = 0;
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        const int64_t x_q13 = identified->x_q27[j] / 16384;
        distance_q26 += x_q13 * x_q13;
    }
    return distance_q26 <= DISTANCE_MAX_Q26;
}

/* Accepts dead time and device drop within half of motor.toml's, or within DUTY_MARGIN if these are small, and a knee
 * that commissioning could have found: nothing confirms the compensation before it acts. */
static bool is_near_bridge(const motor_t *m, const compensation_t *compensation)
{
    const float duty = (float)compensation->dead_time * LSB_Q15;
    const float half = 0.5F * m->bridge_duty;
    const float range = (half > DUTY_MARGIN) ? half : DUTY_MARGIN;
    const int32_t knee_q17 = m->parameters.modulate.knee_q17;
    return compensation->measured == 0 ||
           (duty <= m->bridge_duty + range && duty >= m->bridge_duty - range && compensation->knee_q17 <= knee_q17 &&
            compensation->knee_q17 >= knee_q17 / COMPENSATION_KNEE_RANGE);
}

/* Takes all of the record or, if the drive refuses a part of it, nothing. */
static bool take(drive_t *drive, const record_t *record)
{
    if (!drive_recall(drive, &record->identified)) {
        return false;
    }
    if (record->compensation.measured != 0 && !drive_compensate(drive, &record->compensation)) {
        drive_reset_identification(drive);
        return false;
    }
    drive_restore_trim(drive, record->trim);
    return true;
}

void memory_recall(memory_t *memory, drive_t *drive)
{
    record_t record;
    *memory = (memory_t){0};
    if (store_load(memory_layout(drive->motor), &record, sizeof record) == STORE_OK &&
        is_near_priors(&record.identified) && is_near_bridge(drive->motor, &record.compensation)) {
        memory->recalled = take(drive, &record);
    }
}

/* The robust identification counts steps of the task. */
static uint32_t in_steps(const drive_t *drive, uint32_t ms)
{
    return (uint32_t)((float)ms * 1e-3F / drive->motor->bases.step_s + 0.5F);
}

static bool at_rest(const drive_t *drive)
{
    return drive->task.run_state == RUN_STATE_OFF && drive->fast.faults == 0U &&
           command_box_read(&drive->commands)->safe != SAFE_SHORT_CIRCUIT &&
           drive_stands_still(sample_box_last(&drive->samples)->point.omega);
}

/* A save is wanted as soon as the drive has rested for long enough. */
static bool is_wanted(const memory_t *memory, const drive_t *drive, uint32_t now)
{
    return memory->has_run &&
           (!memory->has_tried || now - memory->tried_at + MEMORY_HOLD_STEPS >= in_steps(drive, MEMORY_INTERVAL_MS)) &&
           drive->task.identify.kept.mismatch_share <= MISMATCH_MAX;
}

static bool save_record(memory_t *memory, const drive_t *drive, uint32_t now)
{
    const record_t record = {drive_identified_record(drive), drive->task.compensation, drive->task.trim.trim};
    bool saved = false;
    if (hal_nvm_begin()) {
        saved = store_save(memory_layout(drive->motor), &record, sizeof record, &memory->failed_sectors);
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
    if (now - memory->held_since < MEMORY_HOLD_STEPS) {
        return false;
    }
    const bool saved = save_record(memory, drive, now);
    drive_hold(drive, false);
    return saved;
}
