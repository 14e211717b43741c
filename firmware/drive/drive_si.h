/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_DRIVE_SI_H
#define DRIVE_DRIVE_SI_H
/** Values of a drive in physical units, the same for the bus and for calibration tools.
 * Source   docs/scaling.md
 * Units    as named
 * Range    every state of a drive
 * Errors   none
 * Context  1 kHz task or below; floating point, hence in no interrupt above it */
#include "drive/drive.h"

/** Mechanical speed; omega: electrical. */
float drive_speed_rpm(const drive_t *drive, q31_t omega);
/** Identified magnet flux. */
float drive_psi_f_Vs(const drive_t *drive);
/** Identified resistance. */
float drive_r_ohm(const drive_t *drive);

#endif
