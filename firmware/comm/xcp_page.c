/* SPDX-License-Identifier: Apache-2.0 */
#include "comm/xcp_page.h"

#include <string.h>

#define WORD 4U
#define WHOLE 0x0FU

enum { MODE_ECU = 0x01, MODE_XCP = 0x02, MODE_ALL = 0x80 };

static uint32_t segment_size(const xcp_config_t *config)
{
    return WORD * config->parameters;
}

bool xcp_page_holds(const xcp_config_t *config, uint32_t address, uint32_t size)
{
    const uint32_t offset = address - xcp_address(config->working);
    return offset < segment_size(config) && size <= segment_size(config) - offset;
}

const uint8_t *xcp_page_read(const xcp_t *xcp, const xcp_config_t *config, uint32_t address)
{
    const float *page = (xcp->xcp_page == XCP_PAGE_WORKING) ? config->working : config->reference;
    return (const uint8_t *)page + (address - xcp_address(config->working));
}

void xcp_page_discard(xcp_t *xcp)
{
    (void)memset(xcp->arrived, 0, sizeof xcp->arrived);
}

static float waiting_value(const xcp_t *xcp, uint32_t parameter)
{
    float value;
    (void)memcpy(&value, &xcp->waiting[(size_t)WORD * parameter], sizeof value);
    return value;
}

/* Every parameter that a command completes must be in range before the first one is stored. */
static xcp_result_t check_whole(xcp_t *xcp, const xcp_config_t *config, uint32_t first, uint32_t last)
{
    xcp_result_t result = XCP_OK;
    for (uint32_t k = first; k <= last; k++) {
        if (xcp->arrived[k] == WHOLE && !value_range_holds(&config->limits[k], waiting_value(xcp, k))) {
            result = XCP_ERR_OUT_OF_RANGE;
        }
    }
    return result;
}

static void store_whole(xcp_t *xcp, const xcp_config_t *config, uint32_t first, uint32_t last)
{
    for (uint32_t k = first; k <= last; k++) {
        if (xcp->arrived[k] == WHOLE) {
            config->working[k] = waiting_value(xcp, k);
            xcp->arrived[k] = 0;
            xcp->generation += (xcp->ecu_page == XCP_PAGE_WORKING) ? 1U : 0U;
        }
    }
}

xcp_result_t xcp_page_write(xcp_t *xcp, const xcp_config_t *config, const uint8_t *data, uint8_t size)
{
    if (!xcp_page_holds(config, xcp->mta, size)) {
        return XCP_ERR_ACCESS_DENIED;
    }
    if (!xcp->unlocked) {
        return XCP_ERR_ACCESS_LOCKED;
    }
    if (xcp->xcp_page != XCP_PAGE_WORKING) {
        return XCP_ERR_WRITE_PROTECTED;
    }
    const uint32_t offset = xcp->mta - xcp_address(config->working);
    const uint32_t first = offset / WORD;
    const uint32_t last = (offset + size - 1U) / WORD;
    for (uint32_t k = 0; k < size; k++) {
        const uint32_t at = offset + k;
        xcp->waiting[at] = data[k];
        xcp->arrived[at / WORD] = (uint8_t)(xcp->arrived[at / WORD] | 1U << (at % WORD));
    }
    const xcp_result_t result = check_whole(xcp, config, first, last);
    if (result == XCP_OK) {
        store_whole(xcp, config, first, last);
    } else {
        (void)memset(&xcp->arrived[first], 0, last - first + 1U);
    }
    return result;
}

static xcp_result_t set_page(xcp_t *xcp, uint8_t mode, uint8_t segment, uint8_t page)
{
    if (segment != 0U && (mode & MODE_ALL) == 0) {
        return XCP_ERR_SEGMENT_NOT_VALID;
    }
    if (page > XCP_PAGE_WORKING) {
        return XCP_ERR_PAGE_NOT_VALID;
    }
    if ((mode & (MODE_ECU | MODE_XCP)) == 0) {
        return XCP_ERR_MODE_NOT_VALID;
    }
    if ((mode & MODE_ECU) != 0 && !xcp->unlocked) {
        return XCP_ERR_ACCESS_LOCKED; /* changes what the drive runs on */
    }
    if ((mode & MODE_XCP) != 0) {
        xcp->xcp_page = page;
    }
    if ((mode & MODE_ECU) != 0) {
        xcp->generation += (xcp->ecu_page != page) ? 1U : 0U;
        xcp->ecu_page = page;
    }
    return XCP_OK;
}

static xcp_result_t get_page(const xcp_t *xcp, uint8_t mode, uint8_t segment, uint8_t *answer, uint8_t *length)
{
    if (segment != 0U) {
        return XCP_ERR_SEGMENT_NOT_VALID;
    }
    if (mode != MODE_ECU && mode != MODE_XCP) {
        return XCP_ERR_MODE_NOT_VALID;
    }
    answer[3] = (mode == MODE_ECU) ? xcp->ecu_page : xcp->xcp_page;
    *length = 4;
    return XCP_OK;
}

/* Only from flash to RAM: restores the built-in values. */
static xcp_result_t copy_page(xcp_t *xcp, const xcp_config_t *config, const uint8_t *command)
{
    if (command[1] != 0U || command[3] != 0U) {
        return XCP_ERR_SEGMENT_NOT_VALID;
    }
    if (command[2] != XCP_PAGE_REFERENCE || command[4] > XCP_PAGE_WORKING) {
        return XCP_ERR_PAGE_NOT_VALID;
    }
    if (command[4] == XCP_PAGE_REFERENCE) {
        return XCP_ERR_WRITE_PROTECTED;
    }
    if (!xcp->unlocked) {
        return XCP_ERR_ACCESS_LOCKED;
    }
    (void)memcpy(config->working, config->reference, segment_size(config));
    xcp_page_discard(xcp);
    xcp->generation++;
    return XCP_OK;
}

xcp_result_t xcp_page_command(xcp_t *xcp, const xcp_config_t *config, const uint8_t *command, uint8_t *answer,
                              uint8_t *length)
{
    switch (command[0]) {
    case XCP_SET_CAL_PAGE:
        return set_page(xcp, command[1], command[2], command[3]);
    case XCP_GET_CAL_PAGE:
        return get_page(xcp, command[1], command[2], answer, length);
    case XCP_COPY_CAL_PAGE:
        return copy_page(xcp, config, command);
    default: /* XCP_GET_PAG_PROCESSOR_INFO: one segment, nothing is frozen */
        answer[1] = 1;
        *length = 3;
        return XCP_OK;
    }
}
