/* SPDX-License-Identifier: Apache-2.0 */
#include "comm/xcp_daq_setup.h"

#include <string.h>

enum { ALLOC_NONE, ALLOC_LISTS, ALLOC_ODTS, ALLOC_ENTRIES };

/* ALLOC_DAQ, ALLOC_ODT and ALLOC_ENTRY come in this order, after FREE_DAQ. */
static xcp_result_t allocate_lists(xcp_daq_t *daq, uint16_t count)
{
    if (daq->stage != ALLOC_NONE) {
        return XCP_ERR_SEQUENCE;
    }
    if (count > XCP_DAQ_LISTS) {
        return XCP_ERR_MEMORY_OVERFLOW;
    }
    daq->lists = (uint8_t)count;
    daq->stage = ALLOC_LISTS;
    return XCP_OK;
}

static xcp_result_t allocate_odts(xcp_daq_t *daq, uint16_t list, uint8_t count)
{
    if (daq->stage != ALLOC_LISTS && daq->stage != ALLOC_ODTS) {
        return XCP_ERR_SEQUENCE;
    }
    if (list >= daq->lists || daq->list[list].odts > 0U) {
        return XCP_ERR_OUT_OF_RANGE;
    }
    if (count > XCP_DAQ_ODTS - daq->odts) {
        return XCP_ERR_MEMORY_OVERFLOW;
    }
    daq->list[list].first_odt = daq->odts;
    daq->list[list].odts = count;
    daq->list[list].prescaler = 1;
    daq->odts = (uint8_t)(daq->odts + count);
    daq->stage = ALLOC_ODTS;
    return XCP_OK;
}

static xcp_result_t allocate_entries(xcp_daq_t *daq, uint16_t list, uint8_t odt, uint8_t count)
{
    if (daq->stage != ALLOC_ODTS && daq->stage != ALLOC_ENTRIES) {
        return XCP_ERR_SEQUENCE;
    }
    if (list >= daq->lists || odt >= daq->list[list].odts) {
        return XCP_ERR_OUT_OF_RANGE;
    }
    xcp_odt_t *o = &daq->odt[daq->list[list].first_odt + odt];
    if (o->entries > 0U) {
        return XCP_ERR_OUT_OF_RANGE;
    }
    if (count > XCP_DAQ_PAYLOAD || count > XCP_DAQ_ENTRIES - daq->entries) {
        return XCP_ERR_MEMORY_OVERFLOW;
    }
    *o = (xcp_odt_t){daq->entries, count};
    daq->entries = (uint8_t)(daq->entries + count);
    daq->stage = ALLOC_ENTRIES;
    return XCP_OK;
}

static xcp_result_t set_pointer(xcp_daq_t *daq, uint16_t list, uint8_t odt, uint8_t entry)
{
    daq->pointer_valid = false;
    if (list >= daq->lists || odt >= daq->list[list].odts ||
        entry >= daq->odt[daq->list[list].first_odt + odt].entries) {
        return XCP_ERR_OUT_OF_RANGE;
    }
    if (daq->list[list].running) {
        return XCP_ERR_DAQ_ACTIVE;
    }
    daq->at_list = (uint8_t)list;
    daq->at_odt = odt;
    daq->at_entry = entry;
    daq->pointer_valid = true;
    return XCP_OK;
}

/* Bit offset 0xFF means whole bytes; single bits are not supported. */
static xcp_result_t write_entry(xcp_daq_t *daq, const xcp_memory_t *memory, const uint8_t *command)
{
    const uint32_t address = xcp_get_u32(&command[4]);
    const uint8_t size = command[2];
    if (!daq->pointer_valid) {
        return XCP_ERR_SEQUENCE;
    }
    if (daq->list[daq->at_list].running) { /* it may have been started since the pointer was set */
        return XCP_ERR_DAQ_ACTIVE;
    }
    if (command[1] != 0xFFU || size == 0U || size > XCP_DAQ_PAYLOAD || command[3] != 0U) {
        return XCP_ERR_OUT_OF_RANGE;
    }
    if (!xcp_memory_find(memory, address, size)) {
        return XCP_ERR_ACCESS_DENIED;
    }
    const xcp_odt_t *o = &daq->odt[daq->list[daq->at_list].first_odt + daq->at_odt];
    daq->entry[o->first_entry + daq->at_entry] = (xcp_entry_t){address, size};
    daq->at_entry++;
    daq->pointer_valid = daq->at_entry < o->entries; /* after the last entry the master must set the pointer again */
    return XCP_OK;
}

static xcp_result_t free_all(xcp_daq_t *daq)
{
    const uint32_t overloads = daq->overloads;
    xcp_daq_reset(daq);
    daq->overloads = overloads;
    return XCP_OK;
}

static xcp_result_t clear_list(xcp_daq_t *daq, uint16_t number)
{
    if (number >= daq->lists) {
        return XCP_ERR_OUT_OF_RANGE;
    }
    xcp_list_t *list = &daq->list[number];
    list->running = false;
    list->selected = false;
    for (uint8_t k = 0; k < list->odts; k++) {
        const xcp_odt_t *o = &daq->odt[list->first_odt + k];
        (void)memset(&daq->entry[o->first_entry], 0, o->entries * sizeof daq->entry[0]);
    }
    return XCP_OK;
}

xcp_result_t xcp_daq_setup(xcp_daq_t *daq, const xcp_memory_t *memory, const uint8_t *command)
{
    const uint16_t list = xcp_get_u16(&command[2]);
    switch (command[0]) {
    case XCP_FREE_DAQ:
        return free_all(daq);
    case XCP_ALLOC_DAQ:
        return allocate_lists(daq, list);
    case XCP_ALLOC_ODT:
        return allocate_odts(daq, list, command[4]);
    case XCP_ALLOC_ODT_ENTRY:
        return allocate_entries(daq, list, command[4], command[5]);
    case XCP_CLEAR_DAQ_LIST:
        return clear_list(daq, list);
    case XCP_SET_DAQ_PTR:
        return set_pointer(daq, list, command[4], command[5]);
    case XCP_WRITE_DAQ:
        return write_entry(daq, memory, command);
    default:
        return XCP_ERR_CMD_UNKNOWN;
    }
}
