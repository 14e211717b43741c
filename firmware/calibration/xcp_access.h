/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CALIBRATION_XCP_ACCESS_H
#define CALIBRATION_XCP_ACCESS_H
/** Connects the calibration protocol with the drive: readable memory, writable values, and when they take effect.
 * Source   docs/howto/xcp.md
 * Units    SI, as calibration/calibration_list.h says
 * Range    calibration/calibration_list.h, calibration/measurement_list.h
 * Errors   the protocol's own; seed and key protect against mistakes, not attacks: the key is a published function
 * Context  1 kHz task; xcp_access_receive() before the drive's step, the rest after it */
#include "calibration/calibration.h"
#include "calibration/freeze_frame.h"
#include "calibration/measurements.h"
#include "comm/xcp.h"
#include "scope/scope.h"

/** Identifiers on the bus, standard frames. */
#define XCP_ID_COMMAND 0x650U /* master to slave */
#define XCP_ID_ANSWER 0x651U  /* slave to master */

#define XCP_ACCESS_AREAS 4

_Static_assert(CALIBRATION_COUNT <= XCP_PARAMETERS_MAX, "the protocol's page holds every value");

typedef struct {
    xcp_t xcp;
    float working[CALIBRATION_COUNT];
    float reference[CALIBRATION_COUNT];     /* the built-in values; written once at start-up */
    float applied_value[CALIBRATION_COUNT]; /* value that the drive uses */
    value_range_t limits[CALIBRATION_COUNT];
    measurements_t measurements;
    xcp_area_t area[XCP_ACCESS_AREAS];
    uint32_t applied; /* generation of the values that the drive runs on */
    can_frame_t answer;
    bool answer_waits;
} xcp_access_t;

/** frame, scope: readable besides the measurements. */
void xcp_access_init(xcp_access_t *access, const drive_t *drive, const freeze_frame_t *frame, const scope_t *scope,
                     uint32_t seed);
/** A frame with id XCP_ID_COMMAND. XCP_USER_CMD holds a command for the voltage pulses (calibration/pulse_access.h) or
 * for the scope; the scope's need no key, as they change nothing that the drive runs on. */
void xcp_access_receive(xcp_access_t *access, drive_t *drive, scope_t *scope, const can_frame_t *frame);
/** Once per step: takes over changed values and samples the measurement lists. passed_ms: milliseconds that passed in
 * this step. */
void xcp_access_step(xcp_access_t *access, drive_t *drive, uint32_t passed_ms);
/** The next frame for the bus, answers first; false: none. Call xcp_access_sent() after it has been sent. */
bool xcp_access_next(const xcp_access_t *access, can_frame_t *frame);
void xcp_access_sent(xcp_access_t *access);

#endif
