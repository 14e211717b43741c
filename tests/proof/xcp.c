/* SPDX-License-Identifier: Apache-2.0 */
/* What a calibration tool can read and write: comm/xcp with its page and its measurement lists. Pointers are checked by
 * CBMC: an access outside of an object would fail the harness. */
#include "proof.h"

#include "comm/xcp_daq.c"

#include "comm/xcp_daq_setup.c"
#include "comm/xcp_page.c"

static uint8_t readable[12];
static float working[3];
static const float reference[3];
static const value_range_t limits[3] = {{0.0F, 1.0F}, {-1.0F, 1.0F}, {2.0F, 3.0F}};
static const xcp_area_t area[1] = {{readable, sizeof readable}};
static const xcp_config_t config = {
    .memory = {area, 1}, .working = working, .reference = reference, .limits = limits, .parameters = 3};

/* A property of the lists that holds after every command. */
static bool is_consistent(const xcp_daq_t *daq)
{
    bool ok = daq->lists <= XCP_DAQ_LISTS && daq->odts <= XCP_DAQ_ODTS && daq->entries <= XCP_DAQ_ENTRIES;
    for (unsigned k = 0; k < XCP_DAQ_LISTS; k++) {
        ok = ok && daq->list[k].first_odt + daq->list[k].odts <= daq->odts;
    }
    for (unsigned k = 0; k < XCP_DAQ_ODTS; k++) {
        ok = ok && daq->odt[k].first_entry + daq->odt[k].entries <= daq->entries &&
             daq->odt[k].entries <= XCP_DAQ_PAYLOAD;
    }
    return ok &&
           (!daq->pointer_valid || (daq->at_list < daq->lists && daq->at_odt < daq->list[daq->at_list].odts &&
                                    daq->at_entry < daq->odt[daq->list[daq->at_list].first_odt + daq->at_odt].entries));
}

static xcp_daq_t any_lists(void)
{
    xcp_daq_t daq;
    for (unsigned k = 0; k < XCP_DAQ_LISTS; k++) {
        daq.list[k].running = nondet_bool();
        daq.list[k].selected = nondet_bool();
        daq.list[k].timestamp = nondet_bool();
    }
    daq.pointer_valid = nondet_bool();
    ASSUME(is_consistent(&daq));
    return daq;
}

void proof_xcp_reads_inside_an_area(void)
{
    uint32_t address, size;
    const uint8_t *from = xcp_memory_find(&config.memory, address, size);
    if (from) {
        PROVE(from >= readable && size <= sizeof readable - (uint32_t)(from - readable));
        PROVE(xcp_address(from) == address);
    }
    const uint32_t offset = address - xcp_address(readable);
    PROVE(from || !(offset < sizeof readable && size <= sizeof readable - offset));
}

void proof_xcp_page_is_read_inside(void)
{
    xcp_t xcp;
    uint32_t address, size;
    ASSUME(size != 0U && xcp_page_holds(&config, address, size));
    const uint8_t *from = xcp_page_read(&xcp, &config, address);
    const uint8_t *page = (const uint8_t *)((xcp.xcp_page == XCP_PAGE_WORKING) ? config.working : config.reference);
    PROVE(from >= page && (uint64_t)(from - page) + size <= sizeof working);
}

void proof_xcp_running_lists_cannot_be_written(void)
{
    xcp_daq_t daq = any_lists();
    uint8_t command[XCP_PACKET_MAX];
    command[0] = XCP_WRITE_DAQ;
    const bool running = daq.pointer_valid && daq.list[daq.at_list].running;
    const xcp_result_t result = xcp_daq_setup(&daq, &config.memory, command);
    PROVE(!running || result != XCP_OK);
    PROVE(result != XCP_OK || xcp_memory_find(&config.memory, xcp_get_u32(&command[4]), command[2]) != 0);
}
