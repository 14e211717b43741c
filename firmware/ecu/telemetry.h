/* SPDX-License-Identifier: Apache-2.0 */
#ifndef ECU_TELEMETRY_H
#define ECU_TELEMETRY_H
/** The drive's state in physical units, for transmission on the bus.
 *   i_dc = 1.5 (u_d i_d + u_q i_q)/v_dc: computed from power, because there is no sensor; without the bridge's losses
 * Source   docs/scaling.md (SC-1) ... (SC-5)
 * Units    SI or as the names of telemetry_t say
 * Range    every state of a drive
 * Errors   i_dc is 0 below 1 V
 * Context  1 kHz task; single precision, never in an interrupt */
#include "comm/can_tx.h"
#include "drive/drive.h"

/** Physical values are left as they are unless tx may send a message that contains them. */
void telemetry_read(const drive_t *drive, const can_tx_t *tx, telemetry_t *telemetry);

#endif
