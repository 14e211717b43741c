/* SPDX-License-Identifier: Apache-2.0 */
#ifndef MRAI_SCHEDULE_BOX_H
#define MRAI_SCHEDULE_BOX_H
/** Gains from the 1 kHz task to the MRAI interrupt: two slots; the generation selects the complete one.
 * Source   docs/architecture.md, shared data
 * Units    as in control/mrai
 * Errors   none
 * Context  written by the 1 kHz task, read by the MRAI interrupt, which the task never interrupts: one read suffices */
#include "drive/exchange.h"
#include "drive/mrai/mrai_data.h"

static inline void schedule_box_write(schedule_box_t *box, mrai_schedule_t schedule)
{
    box->slot[(box->generation + 1U) & 1U] = schedule;
    exchange_barrier();
    box->generation = box->generation + 1U;
}

static inline const mrai_schedule_t *schedule_box_read(const schedule_box_t *box)
{
    return &box->slot[box->generation & 1U];
}

#endif
