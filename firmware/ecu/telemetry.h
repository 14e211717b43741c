/* SPDX-License-Identifier: Apache-2.0 */
#ifndef ECU_TELEMETRY_H
#define ECU_TELEMETRY_H
/** The drive's state in physical units: everything the bus tells that the drive itself knows.
 *   i_dc = 1.5 (u_d i_d + u_q i_q)/v_dc: from power, as there is no sensor; without the losses of the bridge
 * Source   docs/scaling.md (SC-1) ... (SC-5)
 * Units    SI or as the names of telemetry_t say
 * Errors   i_dc is 0 below 1 V
 * Context  1 kHz task; single precision, never in an interrupt */
#include "comm/messages.h"
#include "drive/drive.h"

void telemetry_read(const drive_t *drive, telemetry_t *telemetry);

#endif
