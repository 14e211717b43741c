/* SPDX-License-Identifier: Apache-2.0 */
#ifndef COMM_XCP_DAQ_H
#define COMM_XCP_DAQ_H
/** Measurement lists of the XCP slave: dynamic lists, one frame (ODT) of up to 7 bytes each, two rasters.
 *   An event samples every running list that is due. A list that does not fit into the send queue completely is not
 *   sampled; this is counted and reported by the protocol's overload event.
 *   Event 0 comes in each step of the 1 kHz task, event 1 in the step in which a multiple of 10 ms has passed.
 * Source   ASAM MCD-1 XCP 1.x; docs/howto/xcp.md
 * Units    time stamps of 1 ms of true time, 16 bits, in the first frame of a list
 * Range    sizes below; absolute ODT numbers as packet identifiers
 * Errors   the protocol's codes
 * Context  1 kHz task; xcp_daq_event() after the drive's step, so that all values of a raster are from one instant */
#include <stdbool.h>
#include <stdint.h>

#include "comm/xcp_memory.h"
#include "comm/xcp_protocol.h"
#include "types/can_frame.h"

#define XCP_DAQ_PAYLOAD 7U   /* bytes of a frame less its identifier */
#define XCP_DAQ_TIMESTAMP 2U
#define XCP_DAQ_TENTH 10U
#define XCP_DAQ_LISTS 4
#define XCP_DAQ_ODTS 24
#define XCP_DAQ_ENTRIES 72
#define XCP_DAQ_QUEUE 32 /* frames; a power of two */
#define XCP_DAQ_EVENTS 2 /* 0: each step, 1: each tenth millisecond */

typedef struct {
    uint32_t address;
    uint8_t size; /* 0: not written */
} xcp_entry_t;

typedef struct {
    uint8_t first_entry, entries;
} xcp_odt_t;

typedef struct {
    uint8_t first_odt, odts;
    uint8_t event, prescaler, countdown;
    bool timestamp, selected, running;
} xcp_list_t;

typedef struct {
    xcp_list_t list[XCP_DAQ_LISTS];
    xcp_odt_t odt[XCP_DAQ_ODTS];
    xcp_entry_t entry[XCP_DAQ_ENTRIES];
    uint8_t lists, odts, entries;      /* in use */
    uint8_t stage;                     /* of the allocation, whose commands have a fixed order */
    uint8_t at_list, at_odt, at_entry; /* where WRITE_DAQ writes */
    bool pointer_valid;
    uint16_t now_ms;
    uint8_t step_10us; /* length of a step, rounded; only reported to the tool */
    can_frame_t queue[XCP_DAQ_QUEUE];
    uint32_t queued, sent; /* count up; the difference is the number of waiting frames */
    uint32_t overloads;
    bool overload_pending;
} xcp_daq_t;

void xcp_daq_reset(xcp_daq_t *daq);
bool xcp_daq_running(const xcp_daq_t *daq);
/** Answers a DAQ command; *length is the answer's, at least 1. */
xcp_result_t xcp_daq_command(xcp_daq_t *daq, const xcp_memory_t *memory, const uint8_t *command, uint8_t *answer,
                             uint8_t *length);
/** Once per step of the task; passed_ms: milliseconds that passed in this step. */
void xcp_daq_event(xcp_daq_t *daq, const xcp_memory_t *memory, uint32_t passed_ms);
/** The oldest waiting frame; false: none. */
bool xcp_daq_next(const xcp_daq_t *daq, can_frame_t *frame);
/** The oldest frame has been sent. */
void xcp_daq_sent(xcp_daq_t *daq);

#endif
