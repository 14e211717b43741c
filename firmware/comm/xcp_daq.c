/* SPDX-License-Identifier: Apache-2.0 */
#include "comm/xcp_daq.h"

#include <string.h>

void xcp_daq_reset(xcp_daq_t *daq)
{
    *daq = (xcp_daq_t){.now_ms = daq->now_ms, .step_10us = daq->step_10us};
}

bool xcp_daq_running(const xcp_daq_t *daq)
{
    bool running = false;
    for (uint8_t k = 0; k < daq->lists; k++) {
        running = running || daq->list[k].running;
    }
    return running;
}

static can_frame_t *next_free_frame(xcp_daq_t *daq)
{
    can_frame_t *frame = &daq->queue[daq->queued % XCP_DAQ_QUEUE];
    daq->queued++;
    return frame;
}

static uint32_t free_frames(const xcp_daq_t *daq)
{
    return XCP_DAQ_QUEUE - (daq->queued - daq->sent);
}

/* The areas are constant, so the addresses that WRITE_DAQ accepted remain readable. A running list was complete when it
 * started and cannot be changed, so its bytes fit into the frame. */
static void sample_frame(xcp_daq_t *daq, const xcp_memory_t *memory, const xcp_list_t *list, uint8_t odt)
{
    const xcp_odt_t *o = &daq->odt[list->first_odt + odt];
    can_frame_t *frame = next_free_frame(daq);
    *frame = (can_frame_t){.length = 1};
    frame->data[0] = (uint8_t)(list->first_odt + odt);
    if (list->timestamp && odt == 0U) {
        xcp_put_u16(&frame->data[1], daq->now_ms);
        frame->length = 1 + XCP_DAQ_TIMESTAMP;
    }
    for (uint8_t e = 0; e < o->entries; e++) {
        const xcp_entry_t *entry = &daq->entry[o->first_entry + e];
        const uint8_t *from = xcp_memory_find(memory, entry->address, entry->size);
        if (from != NULL) {
            (void)memcpy(&frame->data[frame->length], from, entry->size);
        }
        frame->length = (uint8_t)(frame->length + entry->size);
    }
}

static void sample_list(xcp_daq_t *daq, const xcp_memory_t *memory, const xcp_list_t *list)
{
    if (free_frames(daq) < list->odts + 1U) { /* one stays free for the overload event */
        daq->overloads++;
        daq->overload_pending = true;
        return;
    }
    for (uint8_t odt = 0; odt < list->odts; odt++) {
        sample_frame(daq, memory, list, odt);
    }
}

static bool is_due(xcp_list_t *list, bool tenth)
{
    if (!list->running || (list->event == 1U && !tenth)) {
        return false;
    }
    if (list->countdown > 0U) {
        list->countdown--;
        return false;
    }
    list->countdown = (uint8_t)(list->prescaler - 1U);
    return true;
}

void xcp_daq_event(xcp_daq_t *daq, const xcp_memory_t *memory, uint32_t passed_ms)
{
    daq->now_ms = (uint16_t)(daq->now_ms + passed_ms);
    const bool tenth = daq->now_ms % XCP_DAQ_TENTH < passed_ms;
    for (uint8_t k = 0; k < daq->lists; k++) {
        if (is_due(&daq->list[k], tenth)) {
            sample_list(daq, memory, &daq->list[k]);
        }
    }
    if (daq->overload_pending && free_frames(daq) > 0U) {
        daq->overload_pending = false;
        *next_free_frame(daq) = (can_frame_t){.length = 2, .data = {XCP_PID_EVENT, XCP_EVENT_DAQ_OVERLOAD}};
    }
}

bool xcp_daq_next(const xcp_daq_t *daq, can_frame_t *frame)
{
    if (daq->queued == daq->sent) {
        return false;
    }
    *frame = daq->queue[daq->sent % XCP_DAQ_QUEUE];
    return true;
}

void xcp_daq_sent(xcp_daq_t *daq)
{
    daq->sent++;
}
