/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CALIBRATION_CALIBRATION_H
#define CALIBRATION_CALIBRATION_H
/** Calibration values in SI against the drive's live parameters.
 *   Each value becomes one or two aligned words of the configuration, so that an interrupt sees the old or the new one.
 * Source   docs/howto/xcp.md; the relations of tools/fluxtrue_tools/motor/derived.py
 * Units    as named
 * Range    calibration/calibration_list.h; calibration_set() expects a value of calibration_range()
 * Rounding to the nearest step of the configuration's format
 * Errors   none: the callers refuse a value outside calibration_range()
 * Context  1 kHz task, or before it starts; never at a lower priority, because the task compares each word with its
 *          complement (drive/data_check.h) */
#include "calibration/calibration_list.h"
#include "drive/drive.h"
#include "types/value_range.h"

#define CALIBRATION_ENUM(name, lo, hi, unit, text) CALIBRATION_##name,
typedef enum { CALIBRATION_LIST(CALIBRATION_ENUM) CALIBRATION_COUNT } calibration_id_t;

typedef struct {
    const char *name;
    float lo, hi;
} calibration_info_t;

extern const calibration_info_t calibration_info[CALIBRATION_COUNT];

/** The present value in the drive's parameters. */
float calibration_get(const drive_t *drive, calibration_id_t id);
/** What may be set: calibration_info's range, down to one step of the format. */
value_range_t calibration_range(const drive_t *drive, calibration_id_t id);
void calibration_set(drive_t *drive, calibration_id_t id, float value);

#endif
