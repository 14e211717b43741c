/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/gather.h"

/* Write: nothing, unless your processor has a DMA that you want to use; false here means that it has none, and then
 * the other functions are not called to copy. */
bool hal_gather_is_idle(void)
{
    return false;
}

/* Write: one channel for each column, each of which starts the next one when it has ended. */
void hal_gather_set_up(uint32_t columns, const uint32_t *stride, uint32_t row_size)
{
    (void)columns;
    (void)stride;
    (void)row_size;
}

/* Write: the addresses with which the channel continues. */
void hal_gather_move(uint32_t column, const void *from, int16_t *to)
{
    (void)column;
    (void)from;
    (void)to;
}

/* Write: the number of values of each column. */
void hal_gather_add(uint32_t count, bool is_further)
{
    (void)count;
    (void)is_further;
}

/* Write: the start of the first channel. */
void hal_gather_start(uint32_t parts)
{
    (void)parts;
}
