/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CALIBRATION_MEASUREMENTS_H
#define CALIBRATION_MEASUREMENTS_H
/** The snapshot that measurement tools read.
 * Source   calibration/measurement_list.h
 * Units    per unit of motor.bases or SI, as the list says
 * Errors   none
 * Context  1 kHz task; floating point, hence in no interrupt above it */
#include <stdbool.h>
#include <stdint.h>

#include "calibration/measurement_list.h"
#include "drive/drive.h"

#define MEASUREMENT_TYPE_S16 int16_t
#define MEASUREMENT_TYPE_U8 uint8_t
#define MEASUREMENT_TYPE_U32 uint32_t
#define MEASUREMENT_TYPE_F32 float
#define MEASUREMENT_FIELD(name, type, base, expression, text) MEASUREMENT_TYPE_##type name;

typedef struct {
    MEASUREMENT_LIST(MEASUREMENT_FIELD)
} measurements_t;

/** recorded: a tool may read the values. Otherwise only those that the freeze frame keeps are written. */
void measurements_step(measurements_t *measurements, const drive_t *d, bool recorded);

#endif
