/* SPDX-License-Identifier: Apache-2.0 */
#include "comm/xcp_daq_setup.h"

#define TIMESTAMP_MODE 0x62 /* 2 bytes, unit 1 ms */
#define EVENT_CYCLE_UNIT_1MS 6
#define EVENT_CYCLE_UNIT_10US 4
#define STEP_1MS 100

enum { MODE_TIMESTAMP = 0x10, MODE_SELECTED = 0x01, MODE_RUNNING = 0x40 };
enum { STOP = 0, START = 1, SELECT = 2 };

/* Whether every entry of this frame has been written and all of them fit into it. */
static bool frame_complete(const xcp_daq_t *daq, const xcp_list_t *list, uint8_t odt)
{
    const xcp_odt_t *o = &daq->odt[list->first_odt + odt];
    uint32_t size = (list->timestamp && odt == 0U) ? XCP_DAQ_TIMESTAMP : 0U;
    for (uint8_t e = 0; e < o->entries; e++) {
        const xcp_entry_t *entry = &daq->entry[o->first_entry + e];
        if (entry->size == 0U) {
            return false;
        }
        size += entry->size;
    }
    return o->entries > 0U && size <= XCP_DAQ_PAYLOAD;
}

static bool list_complete(const xcp_daq_t *daq, const xcp_list_t *list)
{
    bool complete = list->odts > 0U;
    for (uint8_t k = 0; k < list->odts; k++) {
        complete = complete && frame_complete(daq, list, k);
    }
    return complete;
}

static xcp_result_t set_mode(xcp_daq_t *daq, const uint8_t *command)
{
    const uint16_t number = xcp_get_u16(&command[2]);
    const uint16_t event = xcp_get_u16(&command[4]);
    if (number >= daq->lists || event >= XCP_DAQ_EVENTS || command[6] == 0U) {
        return XCP_ERR_OUT_OF_RANGE;
    }
    if ((command[1] & ~MODE_TIMESTAMP) != 0) {
        return XCP_ERR_MODE_NOT_VALID;
    }
    xcp_list_t *list = &daq->list[number];
    if (list->running) {
        return XCP_ERR_DAQ_ACTIVE;
    }
    list->timestamp = (command[1] & MODE_TIMESTAMP) != 0;
    list->event = (uint8_t)event;
    list->prescaler = command[6];
    return XCP_OK;
}

static void run(xcp_list_t *list, bool on)
{
    list->running = on;
    list->selected = false;
    list->countdown = 0;
}

static xcp_result_t start_stop_list(xcp_daq_t *daq, const uint8_t *command, uint8_t *answer, uint8_t *length)
{
    const uint16_t number = xcp_get_u16(&command[2]);
    if (number >= daq->lists) {
        return XCP_ERR_OUT_OF_RANGE;
    }
    xcp_list_t *list = &daq->list[number];
    if (command[1] > SELECT) {
        return XCP_ERR_MODE_NOT_VALID;
    }
    if (command[1] != STOP && !list_complete(daq, list)) {
        return XCP_ERR_DAQ_CONFIG;
    }
    if (command[1] == SELECT) {
        list->selected = true;
    } else {
        run(list, command[1] == START);
    }
    answer[1] = list->first_odt;
    *length = 2;
    return XCP_OK;
}

static xcp_result_t start_stop_selected(xcp_daq_t *daq, uint8_t mode)
{
    if (mode > 2U) {
        return XCP_ERR_MODE_NOT_VALID;
    }
    for (uint8_t k = 0; k < daq->lists; k++) { /* a list may have changed since it was selected; start all or none */
        if (mode == 1U && daq->list[k].selected && !list_complete(daq, &daq->list[k])) {
            return XCP_ERR_DAQ_CONFIG;
        }
    }
    for (uint8_t k = 0; k < daq->lists; k++) {
        if (mode == 0U || daq->list[k].selected) {
            run(&daq->list[k], mode == 1U);
        }
    }
    return XCP_OK;
}

/* A step of 1 ms is reported in the unit 1 ms, any other in the unit 10 us. */
static void describe_event(const xcp_daq_t *daq, uint16_t event, uint8_t *answer)
{
    const bool whole = event != 0U || daq->step_10us == STEP_1MS;
    answer[1] = 0x04; /* measurement */
    answer[2] = XCP_DAQ_LISTS;
    answer[4] = (event != 0U) ? XCP_DAQ_TENTH : whole ? 1 : daq->step_10us;
    answer[5] = whole ? EVENT_CYCLE_UNIT_1MS : EVENT_CYCLE_UNIT_10US;
}

static xcp_result_t describe(const xcp_daq_t *daq, const uint8_t *command, uint8_t *answer, uint8_t *length)
{
    *length = 8;
    switch (command[0]) {
    case XCP_GET_DAQ_PROCESSOR_INFO: /* dynamic lists, prescaler, time stamp, overload as an event */
        answer[1] = 0x01 | 0x02 | 0x10 | 0x80;
        xcp_put_u16(&answer[2], XCP_DAQ_LISTS);
        xcp_put_u16(&answer[4], XCP_DAQ_EVENTS);
        break; /* no predefined list; identified by the absolute ODT number */
    case XCP_GET_DAQ_RESOLUTION_INFO:
        answer[1] = 1;
        answer[2] = XCP_DAQ_PAYLOAD;
        answer[3] = 1;
        answer[5] = TIMESTAMP_MODE;
        xcp_put_u16(&answer[6], 1);
        break;
    case XCP_GET_DAQ_CLOCK:
        xcp_put_u32(&answer[4], daq->now_ms);
        break;
    default: /* XCP_GET_DAQ_EVENT_INFO */
        if (xcp_get_u16(&command[2]) >= XCP_DAQ_EVENTS) {
            return XCP_ERR_OUT_OF_RANGE;
        }
        describe_event(daq, xcp_get_u16(&command[2]), answer);
        *length = 7;
        break;
    }
    return XCP_OK;
}

static xcp_result_t get_mode(const xcp_daq_t *daq, uint16_t number, uint8_t *answer, uint8_t *length)
{
    if (number >= daq->lists) {
        return XCP_ERR_OUT_OF_RANGE;
    }
    const xcp_list_t *list = &daq->list[number];
    answer[1] = (uint8_t)((list->selected ? MODE_SELECTED : 0) | (list->timestamp ? MODE_TIMESTAMP : 0) |
                          (list->running ? MODE_RUNNING : 0));
    xcp_put_u16(&answer[4], list->event);
    answer[6] = list->prescaler;
    *length = 8;
    return XCP_OK;
}

xcp_result_t xcp_daq_command(xcp_daq_t *daq, const xcp_memory_t *memory, const uint8_t *command, uint8_t *answer,
                             uint8_t *length)
{
    switch (command[0]) {
    case XCP_SET_DAQ_LIST_MODE:
        return set_mode(daq, command);
    case XCP_GET_DAQ_LIST_MODE:
        return get_mode(daq, xcp_get_u16(&command[2]), answer, length);
    case XCP_START_STOP_DAQ_LIST:
        return start_stop_list(daq, command, answer, length);
    case XCP_START_STOP_SYNCH:
        return start_stop_selected(daq, command[1]);
    case XCP_GET_DAQ_PROCESSOR_INFO:
    case XCP_GET_DAQ_RESOLUTION_INFO:
    case XCP_GET_DAQ_CLOCK:
    case XCP_GET_DAQ_EVENT_INFO:
        return describe(daq, command, answer, length);
    default:
        return xcp_daq_setup(daq, memory, command);
    }
}
