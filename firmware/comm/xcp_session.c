/* SPDX-License-Identifier: Apache-2.0 */
#include "comm/xcp_session.h"

#include "comm/xcp_page.h"

#define PROTOCOL_VERSION 1
#define DRIVER_VERSION 1
#define WRONG_KEYS_MAX 3
#define SEED_SIZE 4
#define SPREAD 2654435761U /* 2^32 divided by the golden ratio: neighbouring counts give distant seeds */

static void end_session(xcp_t *xcp)
{
    xcp->connected = false;
    xcp->unlocked = false;
    xcp_page_discard(xcp);
    xcp_daq_reset(&xcp->daq);
}

static xcp_result_t connect(xcp_t *xcp, uint8_t *answer, uint8_t *length)
{
    end_session(xcp);
    xcp->connected = true;
    answer[1] = XCP_RESOURCE_CALIBRATION | XCP_RESOURCE_DAQ;
    answer[2] = 0x80; /* Intel byte order, byte addresses; more from GET_COMM_MODE_INFO */
    answer[3] = XCP_PACKET_MAX;
    xcp_put_u16(&answer[4], XCP_PACKET_MAX);
    answer[6] = PROTOCOL_VERSION;
    answer[7] = PROTOCOL_VERSION;
    *length = 8;
    return XCP_OK;
}

static uint8_t protected_resources(const xcp_t *xcp)
{
    return xcp->unlocked ? 0 : XCP_RESOURCE_CALIBRATION;
}

static xcp_result_t status(const xcp_t *xcp, uint8_t *answer, uint8_t *length)
{
    answer[1] = xcp_daq_running(&xcp->daq) ? 0x40 : 0;
    answer[2] = protected_resources(xcp);
    *length = 6;
    return XCP_OK;
}

static xcp_result_t get_seed(xcp_t *xcp, const uint8_t *command, uint8_t *answer, uint8_t *length)
{
    if (command[1] != 0U || command[2] != XCP_RESOURCE_CALIBRATION) {
        return XCP_ERR_OUT_OF_RANGE;
    }
    if (xcp->wrong_keys >= WRONG_KEYS_MAX) {
        return XCP_ERR_ACCESS_LOCKED;
    }
    *length = 2;
    if (!xcp->unlocked) {
        xcp->seed_counter++;
        xcp->seed = xcp->seed_counter * SPREAD | 1U; /* 0: no seed was given */
        answer[1] = SEED_SIZE;
        xcp_put_u32(&answer[2], xcp->seed);
        *length = 2 + SEED_SIZE;
    }
    return XCP_OK;
}

/* A wrong key ends the session, as the protocol demands; each seed is valid for one attempt. */
static xcp_result_t unlock(xcp_t *xcp, const xcp_config_t *config, const uint8_t *command, uint8_t *answer,
                           uint8_t *length)
{
    if (xcp->seed == 0U) {
        return XCP_ERR_SEQUENCE;
    }
    const bool right = command[1] == SEED_SIZE && xcp_get_u32(&command[2]) == config->key(xcp->seed);
    xcp->seed = 0;
    if (!right) {
        xcp->wrong_keys++;
        xcp->counts.locked_out += (xcp->wrong_keys == WRONG_KEYS_MAX) ? 1U : 0U;
        end_session(xcp);
        return XCP_ERR_ACCESS_LOCKED;
    }
    xcp->wrong_keys = 0;
    xcp->unlocked = true;
    answer[1] = protected_resources(xcp);
    *length = 2;
    return XCP_OK;
}

xcp_result_t xcp_session_command(xcp_t *xcp, const xcp_config_t *config, const uint8_t *command, uint8_t *answer,
                                 uint8_t *length)
{
    switch (command[0]) {
    case XCP_CONNECT:
        return connect(xcp, answer, length);
    case XCP_DISCONNECT:
        end_session(xcp);
        return XCP_OK;
    case XCP_GET_STATUS:
        return status(xcp, answer, length);
    case XCP_SYNCH:
        return XCP_ERR_CMD_SYNCH;
    case XCP_GET_SEED:
        return get_seed(xcp, command, answer, length);
    case XCP_UNLOCK:
        return unlock(xcp, config, command, answer, length);
    default: /* XCP_GET_COMM_MODE_INFO */
        answer[7] = DRIVER_VERSION;
        *length = 8;
        return XCP_OK;
    }
}
