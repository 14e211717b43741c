/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SECOND_LEVEL_FRAMES_H
#define SECOND_LEVEL_FRAMES_H
/** The commands received from the bus, checked and decoded by the second level's own code.
 *   CRC-8 0x1D over the data id and bytes 1 ... 7, from a table of 16 entries; counter 0 ... 14, advancing by 1 or 2;
 *   the first frame, and the first after a jump or a time-out, only synchronises
 * Source   firmware/comm/fluxtrue.dbc: frames 0x110 and 0x111; AUTOSAR profile 11
 * Units    counts of the bus, in the motor's scale (docs/decisions/018-bus-scales.md); µs
 * Range    a frame with a value out of the DBC's range is refused
 * Errors   a refused frame changes nothing but the counter it synchronises to
 * Context  1 kHz task: each received frame, then second_level_frames_tick() once */
#include <stdbool.h>
#include <stdint.h>

#include "types/can_frame.h"

typedef struct {
    uint32_t age_us;
    uint8_t counter;
    bool synced, alive, seen;
} second_level_channel_t;

typedef struct {
    second_level_channel_t command, battery;
    int32_t torque_counts, drive_counts, regen_counts; /* zero while there is no valid command, or it does not enable */
    int32_t power_drive_counts, power_regen_counts;    /* zero after a time-out */
} second_level_frames_t;

void second_level_frame(second_level_frames_t *frames, const can_frame_t *frame);
void second_level_frames_tick(second_level_frames_t *frames, uint32_t elapsed_us);

#endif
