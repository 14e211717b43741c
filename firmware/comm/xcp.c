/* SPDX-License-Identifier: Apache-2.0 */
#include "comm/xcp.h"

#include <string.h>

#include "comm/xcp_page.h"
#include "comm/xcp_session.h"
#include "signal/crc32.h"

#define DATA_MAX (XCP_PACKET_MAX - 1)
#define CHECKSUM_MAX 4096U /* bytes per command: takes a fraction of the task's millisecond */

#define BYTES(command, count) [(command)-XCP_ALLOC_ODT_ENTRY] = (count)

/* Smallest number of bytes of a command; 0: not supported. */
static uint8_t min_length(uint8_t command)
{
    static const uint8_t count[] = {
        BYTES(XCP_CONNECT, 2),
        BYTES(XCP_DISCONNECT, 1),
        BYTES(XCP_GET_STATUS, 1),
        BYTES(XCP_SYNCH, 1),
        BYTES(XCP_GET_COMM_MODE_INFO, 1),
        BYTES(XCP_GET_SEED, 3),
        BYTES(XCP_UNLOCK, 6),
        BYTES(XCP_SET_MTA, 8),
        BYTES(XCP_UPLOAD, 2),
        BYTES(XCP_SHORT_UPLOAD, 8),
        BYTES(XCP_BUILD_CHECKSUM, 8),
        BYTES(XCP_DOWNLOAD, 3),
        BYTES(XCP_SET_CAL_PAGE, 4),
        BYTES(XCP_GET_CAL_PAGE, 3),
        BYTES(XCP_GET_PAG_PROCESSOR_INFO, 1),
        BYTES(XCP_COPY_CAL_PAGE, 5),
        BYTES(XCP_CLEAR_DAQ_LIST, 4),
        BYTES(XCP_SET_DAQ_PTR, 6),
        BYTES(XCP_WRITE_DAQ, 8),
        BYTES(XCP_SET_DAQ_LIST_MODE, 8),
        BYTES(XCP_GET_DAQ_LIST_MODE, 4),
        BYTES(XCP_START_STOP_DAQ_LIST, 4),
        BYTES(XCP_START_STOP_SYNCH, 2),
        BYTES(XCP_GET_DAQ_CLOCK, 1),
        BYTES(XCP_GET_DAQ_PROCESSOR_INFO, 1),
        BYTES(XCP_GET_DAQ_RESOLUTION_INFO, 1),
        BYTES(XCP_GET_DAQ_EVENT_INFO, 4),
        BYTES(XCP_FREE_DAQ, 1),
        BYTES(XCP_ALLOC_DAQ, 4),
        BYTES(XCP_ALLOC_ODT, 5),
        BYTES(XCP_ALLOC_ODT_ENTRY, 6),
    };
    return (command < XCP_ALLOC_ODT_ENTRY) ? 0 : count[command - XCP_ALLOC_ODT_ENTRY];
}

void xcp_reset(xcp_t *xcp, const xcp_config_t *config, uint32_t seed)
{
    *xcp = (xcp_t){.ecu_page = XCP_PAGE_WORKING, .xcp_page = XCP_PAGE_WORKING, .seed_counter = seed};
    (void)memcpy(config->working, config->reference, config->parameters * sizeof config->working[0]);
}

const float *xcp_active_page(const xcp_t *xcp, const xcp_config_t *config)
{
    return (xcp->ecu_page == XCP_PAGE_WORKING) ? config->working : config->reference;
}

static const uint8_t *readable_area(const xcp_t *xcp, const xcp_config_t *config, uint32_t size)
{
    if (xcp_page_holds(config, xcp->mta, size)) {
        return xcp_page_read(xcp, config, xcp->mta);
    }
    return xcp_memory_find(&config->memory, xcp->mta, size);
}

static xcp_result_t upload(xcp_t *xcp, const xcp_config_t *config, uint8_t size, uint8_t *answer, uint8_t *length)
{
    if (size == 0U || size > DATA_MAX) {
        return XCP_ERR_OUT_OF_RANGE;
    }
    const uint8_t *from = readable_area(xcp, config, size);
    if (!from) {
        return XCP_ERR_ACCESS_DENIED;
    }
    (void)memcpy(&answer[1], from, size);
    xcp->mta += size;
    *length = (uint8_t)(1U + size);
    return XCP_OK;
}

static xcp_result_t download(xcp_t *xcp, const xcp_config_t *config, const can_frame_t *command)
{
    const uint8_t size = command->data[1];
    if (size == 0U || size > command->length - 2) {
        return XCP_ERR_CMD_SYNTAX;
    }
    const xcp_result_t result = xcp_page_write(xcp, config, &command->data[2], size);
    xcp->mta += (result == XCP_OK) ? size : 0U;
    return result;
}

static xcp_result_t checksum(xcp_t *xcp, const xcp_config_t *config, uint32_t size, uint8_t *answer, uint8_t *length)
{
    if (size == 0U || size > CHECKSUM_MAX) {
        xcp_put_u32(&answer[4], CHECKSUM_MAX);
        *length = 8;
        return XCP_ERR_OUT_OF_RANGE;
    }
    const uint8_t *from = readable_area(xcp, config, size);
    if (!from) {
        return XCP_ERR_ACCESS_DENIED;
    }
    answer[1] = XCP_CHECKSUM_CRC_32;
    xcp_put_u32(&answer[4], crc32(from, size));
    xcp->mta += size;
    *length = 8;
    return XCP_OK;
}

static xcp_result_t set_pointer(xcp_t *xcp, const uint8_t *command)
{
    if (command[3] != 0U) {
        return XCP_ERR_OUT_OF_RANGE; /* one address space */
    }
    xcp->mta = xcp_get_u32(&command[4]);
    return XCP_OK;
}

static xcp_result_t short_upload(xcp_t *xcp, const xcp_config_t *config, const uint8_t *command, uint8_t *answer,
                                 uint8_t *length)
{
    const xcp_result_t moved = set_pointer(xcp, command);
    return (moved == XCP_OK) ? upload(xcp, config, command[1], answer, length) : moved;
}

static xcp_result_t memory_command(xcp_t *xcp, const xcp_config_t *config, const can_frame_t *command, uint8_t *answer,
                                   uint8_t *length)
{
    const uint8_t *data = command->data;
    switch (data[0]) {
    case XCP_SET_MTA:
        return set_pointer(xcp, data);
    case XCP_UPLOAD:
        return upload(xcp, config, data[1], answer, length);
    case XCP_SHORT_UPLOAD:
        return short_upload(xcp, config, data, answer, length);
    case XCP_BUILD_CHECKSUM:
        return checksum(xcp, config, xcp_get_u32(&data[4]), answer, length);
    case XCP_DOWNLOAD:
        return download(xcp, config, command);
    case XCP_SET_CAL_PAGE:
    case XCP_GET_CAL_PAGE:
    case XCP_GET_PAG_PROCESSOR_INFO:
    case XCP_COPY_CAL_PAGE:
        return xcp_page_command(xcp, config, data, answer, length);
    default:
        return xcp_daq_command(&xcp->daq, &config->memory, data, answer, length);
    }
}

static xcp_result_t execute(xcp_t *xcp, const xcp_config_t *config, const can_frame_t *command, can_frame_t *answer)
{
    const uint8_t code = command->data[0];
    if (min_length(code) == 0U) {
        return XCP_ERR_CMD_UNKNOWN;
    }
    if (min_length(code) > command->length) {
        return XCP_ERR_CMD_SYNTAX;
    }
    return xcp_is_session(code) ? xcp_session_command(xcp, config, command->data, answer->data, &answer->length)
                                : memory_command(xcp, config, command, answer->data, &answer->length);
}

static void finish(xcp_t *xcp, xcp_result_t result, can_frame_t *answer)
{
    xcp->counts.commands++;
    if (result != XCP_OK) {
        xcp->counts.refused += (result != XCP_ERR_CMD_SYNCH) ? 1U : 0U;
        answer->data[0] = XCP_PID_ERROR;
        answer->data[1] = (uint8_t)result;
        answer->length = (uint8_t)((answer->length > 2U) ? answer->length : 2U);
    }
}

void xcp_answer(xcp_t *xcp, xcp_result_t result, can_frame_t *answer)
{
    *answer = (can_frame_t){.length = 1, .data = {XCP_PID_RESPONSE}};
    finish(xcp, result, answer);
}

/* Without a connection a slave is silent, except to CONNECT. */
bool xcp_command(xcp_t *xcp, const xcp_config_t *config, const can_frame_t *command, can_frame_t *answer)
{
    if (command->length == 0U || command->length > XCP_PACKET_MAX ||
        (!xcp->connected && command->data[0] != XCP_CONNECT)) {
        xcp->counts.ignored++;
        return false;
    }
    *answer = (can_frame_t){.length = 1, .data = {XCP_PID_RESPONSE}};
    finish(xcp, execute(xcp, config, command, answer), answer);
    return true;
}
