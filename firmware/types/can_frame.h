/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TYPES_CAN_FRAME_H
#define TYPES_CAN_FRAME_H
/** A classic CAN data frame.
 * Source   ISO 11898-1
 * Units    bytes; the bits of the identifier
 * Range    id 0 ... 0x7FF, or 0 ... 0x1FFFFFFF if extended; length 0 ... 8
 * Errors   none: values only
 * Context  values only */
#include <stdbool.h>
#include <stdint.h>

typedef struct {
    uint32_t id;
    bool extended;
    uint8_t length;
    uint8_t data[8];
} can_frame_t;

#endif
