/* SPDX-License-Identifier: Apache-2.0 */
#ifndef MRAI_MRAI_CALIBRATION_H
#define MRAI_MRAI_CALIBRATION_H
/** The values of calibration/mrai/mrai_calibration_list.h and their place in the parameters of the law.
 *   calibration/calibration.c calls these functions for every value that is not its own.
 * Source   docs/theory/mrai.md (MR-7), (MR-9), (MR-10), (MR-18)
 * Units    SI outside, per unit inside
 * Range    as calibration/calibration.h
 * Errors   a value that is not in the list is 0, and setting it changes nothing
 * Context  1 kHz task or below; without FLUXTRUE_MRAI the functions are empty */
#include "calibration/calibration.h"

#if FLUXTRUE_MRAI

float mrai_calibration_get(const drive_t *drive, calibration_id_t id);
float mrai_calibration_least(const drive_t *drive, calibration_id_t id);
void mrai_calibration_set(drive_t *drive, calibration_id_t id, float value);

#else

static inline float mrai_calibration_get(const drive_t *drive, calibration_id_t id)
{
    (void)drive;
    (void)id;
    return 0.0F;
}

static inline float mrai_calibration_least(const drive_t *drive, calibration_id_t id)
{
    (void)drive;
    (void)id;
    return 0.0F;
}

static inline void mrai_calibration_set(drive_t *drive, calibration_id_t id, float value)
{
    (void)drive;
    (void)id;
    (void)value;
}

#endif

#endif
