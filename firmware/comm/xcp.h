/* SPDX-License-Identifier: Apache-2.0 */
#ifndef COMM_XCP_H
#define COMM_XCP_H
/** XCP slave on CAN: reading memory, calibration pages, seed and key. Measurement lists are in comm/xcp_daq.h.
 *   One command, one answer. Writes reach the working page parameter by parameter: a value takes effect when all its
 *   bytes have arrived and it lies in its declared range; otherwise the command is refused and has no effect.
 * Source   ASAM MCD-1 XCP 1.x, protocol and CAN transport layer; commands in docs/howto/xcp.md
 * Units    addresses as the processor's, 32 bits, little endian; MAX_CTO = MAX_DTO = 8 bytes
 * Range    only the areas named in the configuration can be read; only the calibration page can be written
 * Errors   the protocol's error packets; a frame that is no command is counted and not answered
 * Context  1 kHz task, one command per call; never in an interrupt above it */
#include <stdbool.h>
#include <stdint.h>

#include "comm/xcp_daq.h"
#include "types/can_frame.h"
#include "types/value_range.h"

#define XCP_PARAMETERS_MAX 32

enum { XCP_PAGE_REFERENCE = 0, XCP_PAGE_WORKING = 1 };

typedef struct {
    xcp_memory_t memory;            /* what may be read besides the page */
    float *working;                 /* the page the master writes; its address is the segment's */
    const float *reference;         /* never written */
    const value_range_t *limits;    /* one per parameter, which is a float at its word of the page */
    uint8_t parameters;             /* <= XCP_PARAMETERS_MAX */
    uint32_t (*key)(uint32_t seed); /* what the master must answer; called at task level only */
} xcp_config_t;

typedef struct {
    uint32_t commands, refused, ignored, locked_out;
} xcp_counts_t;

typedef struct {
    bool connected;
    bool unlocked; /* calibration; measuring needs no key */
    uint8_t ecu_page, xcp_page;
    uint8_t wrong_keys; /* at 3 the slave answers no seed before it is reset */
    uint32_t seed, seed_counter;
    uint32_t mta;
    uint8_t arrived[XCP_PARAMETERS_MAX]; /* bytes of a parameter that wait for the rest, one bit each */
    uint8_t waiting[4 * XCP_PARAMETERS_MAX];
    uint32_t generation; /* counted up when the active values change */
    xcp_daq_t daq;
    xcp_counts_t counts;
} xcp_t;

void xcp_reset(xcp_t *xcp, const xcp_config_t *config, uint32_t seed);
/** True: answer holds the frame to send (its id is the transport's). */
bool xcp_command(xcp_t *xcp, const xcp_config_t *config, const can_frame_t *command, can_frame_t *answer);
/** The answer to a command that the caller has carried out itself: XCP_USER_CMD, once connected. It counts as one. */
void xcp_answer(xcp_t *xcp, xcp_result_t result, can_frame_t *answer);
/** The page the drive runs on. */
const float *xcp_active_page(const xcp_t *xcp, const xcp_config_t *config);

#endif
