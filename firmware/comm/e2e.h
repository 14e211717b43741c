/* SPDX-License-Identifier: Apache-2.0 */
#ifndef COMM_E2E_H
#define COMM_E2E_H
/** End-to-end protection of a CAN frame: AUTOSAR profile 11, variant 11A.
 *   byte 0           CRC-8 SAE J1850, x^8 + x^4 + x^3 + x^2 + 1 (0x1D), start 0x00, no final inversion, over the low
 *                    and the high byte of the data id (which is not sent), then over bytes 1 to the end
 *   byte 1, bits 0-3 counter 0 ... 14, then 0 again; bits 4-7 belong to the message
 *   The counter must advance by 1; an advance by 2 means one lost frame and is accepted, by more it is a jump, by 0 a
 *   repetition. After a jump the next frame must follow the new counter. The first frame only synchronises the counter.
 * Source   AUTOSAR PRS_E2EProtocol, profile 11, data-id mode BOTH; docs/howto/can.md
 * Units    bytes
 * Range    counter 15 is never valid
 * Errors   one status for each kind of error; no error is corrected
 * Context  1 kHz task */
#include <stdbool.h>
#include <stdint.h>

#include "types/can_frame.h"

#define E2E_COUNTERS 15U /* values the counter takes */
#define E2E_SKIP_MAX 2U  /* largest accepted advance */
#define E2E_LENGTH 8U    /* every protected message has eight bytes */

typedef enum {
    E2E_OK = 0,
    E2E_SKIPPED, /* valid; the frame before it was lost */
    E2E_FIRST,   /* valid CRC, but no counter to compare with: must not be used */
    E2E_REPEATED,
    E2E_JUMP,
    E2E_CRC,
    E2E_WRONG_LENGTH
} e2e_status_t;

typedef struct {
    uint8_t counter; /* of the last valid frame */
    bool synced;     /* counter is known */
} e2e_state_t;

uint8_t e2e_crc(uint16_t data_id, const can_frame_t *frame);
/** Writes counter and CRC and advances the counter; the rest of the frame is in place. */
void e2e_protect(uint16_t data_id, uint8_t *counter, can_frame_t *frame);
e2e_status_t e2e_check(uint16_t data_id, e2e_state_t *state, const can_frame_t *frame);

#endif
