/* SPDX-License-Identifier: Apache-2.0 */
#ifndef VECU_LINE_BUFFER_H
#define VECU_LINE_BUFFER_H
/** Divides a stream of bytes into texts: lines, or texts between '<' and '>'.
 * Range    texts of up to LINE_LENGTH characters
 * Errors   a text that is too long, contains a NUL or is interrupted by another '<' is dropped and counted, and so is
 *          anything but white space between '>' and '<'
 * Context  simulation only; pure: the caller reads line_buffer_free() bytes at most into bytes[end] and advances end */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { LINE_LENGTH = 1023, LINE_BUFFER_SIZE = 4 * (LINE_LENGTH + 1) };

typedef enum { LINE_BY_NEWLINE, LINE_IN_BRACKETS } line_framing_t;

typedef struct {
    line_framing_t framing;
    bool skipping; /* the rest of a line that was too long */
    size_t begin, end;
    uint64_t dropped;
    char bytes[LINE_BUFFER_SIZE];
} line_buffer_t;

/** Moves the unread bytes to the front; answers how many bytes fit behind them. */
size_t line_buffer_free(line_buffer_t *b);
/** The next text, without its delimiters, NUL-terminated; false: none is complete. */
bool line_buffer_next(line_buffer_t *b, char text[LINE_LENGTH + 1]);
bool line_buffer_empty(const line_buffer_t *b);

#endif
