/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_HOST_STATIONS_H
#define HAL_HOST_STATIONS_H
/** The torque at each station of its way through the drive, in SI, and the names of version 0.1 for some of them.
 *   requested -> arbitrated -> limited -> commanded (after slew) -> corrected (after the torque loop); estimated
 * Source   docs/glossary.md
 * Units    N·m
 * Context  private to hal/host */
#include "hal/host/fluxtrue.h"

/** On a bus the request of the last accepted command frame, otherwise the value that was set. */
double stations_requested_Nm(const fluxtrue_t *drive);
/** Without a bus there is no arbitration: the requested torque becomes the arbitrated one. */
void stations_set_requested_Nm(fluxtrue_t *drive, double value);
double stations_arbitrated_Nm(const fluxtrue_t *drive);
double stations_limited_Nm(const fluxtrue_t *drive);
double stations_commanded_Nm(const fluxtrue_t *drive);
double stations_corrected_Nm(const fluxtrue_t *drive);
double stations_estimated_Nm(const fluxtrue_t *drive);

/** The present name for a name of version 0.1; any other name, and NULL, is returned unchanged. */
const char *stations_name(const char *name);

#endif
