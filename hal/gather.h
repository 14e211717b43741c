/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_GATHER_H
#define HAL_GATHER_H
/** Copies columns of half words in the background, without the processor, where a port has hardware for it.
 *   Each column takes one half word from each of several places that are a constant distance apart. The half words of
 *   one place go to adjacent half words, a row; the next row begins a constant distance later. A copy has one part or
 *   two. Each part begins where the last one has ended, unless the columns have been moved before it was added.
 *   A port without such hardware never reports that it is idle: the scope then copies by itself (scope/copy.c).
 * Source   docs/howto/port.md, docs/decisions/020-scope.md
 * Units    bytes, values
 * Range    1 ... HAL_GATHER_COLUMNS columns; with a distance above 32767 bytes each part has one value, and its columns
 *          are moved
 * Errors   a copy that does not end: hal_gather_is_idle() stays false
 * Context  1 kHz task; all others only while idle */
#include <stdbool.h>
#include <stdint.h>

#define HAL_GATHER_COLUMNS 8U
#define HAL_GATHER_PARTS 2U

/** Nothing is being copied, and the port is able to copy. Must not be called between a move or an addition and the
 * start that follows. */
bool hal_gather_is_idle(void);
/** Number of columns, and bytes from one row to the next; stride: of each column, the bytes from one half word to the
 * next, 0: it is always the same. All columns must be moved before the next part. */
void hal_gather_set_up(uint32_t columns, const uint32_t *stride, uint32_t row_size);
/** Where the column's next half word comes from, and where it goes: all columns one after the other, column 0 first.
 * Columns from the number of the set-up on may be moved, too, and are not copied. */
void hal_gather_move(uint32_t column, const void *from, int16_t *to);
/** The next `count` values, at least one, of each column. is_further: not the first part since the last start; there
 * are at most HAL_GATHER_PARTS, and the columns of a further one have been moved. */
void hal_gather_add(uint32_t count, bool is_further);
/** Begins to copy what has been added since the last start: so many parts. */
void hal_gather_start(uint32_t parts);

#endif
