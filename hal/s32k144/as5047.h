/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_AS5047_H
#define HAL_S32K144_AS5047_H
/** Frames of the AS5047P magnetic encoder: 16 bits, most significant first. The answer to a command follows in the next
 * frame.
 * Source   ams AS5047P data sheet, SPI interface and register map: from memory and from public drivers
 * Units    angle: fraction of a turn, 2^32 = one turn; 14 bits
 * Errors   as5047_is_valid(): even parity, and no error of an earlier command. A line that is stuck high fails; one
 *          that is stuck low reads as a valid 0, which as5047_is_healthy() refuses
 * Context  values only */
#include <stdbool.h>
#include <stdint.h>

enum {
    AS5047_BITS = 16,
    AS5047_ERROR = 0x4000,            /* EF: a command was wrong; kept until ERRFL is read */
    AS5047_READ_ERRORS = 0x4001,      /* ERRFL */
    AS5047_READ_DIAGNOSTICS = 0xFFFC, /* DIAAGC */
    AS5047_READ_ANGLE = 0xFFFF,       /* ANGLECOM: the angle with dynamic angle error compensation */
    AS5047_LOOPS_SETTLED = 1 << 8,    /* of DIAAGC: LF, the offset loops have settled */
    AS5047_FIELD_FAULTS = 7 << 9      /* of DIAAGC: COF, MAGH, MAGL: overflow, field too strong, too weak */
};

static inline bool as5047_is_even(uint32_t frame)
{
    uint32_t folded = frame ^ frame >> 8;
    folded ^= folded >> 4;
    return (0x6996U >> (folded & 15U) & 1U) == 0U; /* parities of the numbers from 0 to 15 */
}

static inline bool as5047_is_valid(uint32_t frame)
{
    return as5047_is_even(frame) && (frame & AS5047_ERROR) == 0U;
}

/** Of the answer to AS5047_READ_DIAGNOSTICS. */
static inline bool as5047_is_healthy(uint32_t frame)
{
    return as5047_is_valid(frame) && (frame & (AS5047_LOOPS_SETTLED | AS5047_FIELD_FAULTS)) == AS5047_LOOPS_SETTLED;
}

static inline uint32_t as5047_angle(uint32_t frame)
{
    return frame << 18;
}

#endif
