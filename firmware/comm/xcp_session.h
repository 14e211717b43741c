/* SPDX-License-Identifier: Apache-2.0 */
#ifndef COMM_XCP_SESSION_H
#define COMM_XCP_SESSION_H
/** Connection, status, seed and key of the XCP slave. A wrong key ends the session; after three wrong
 *   keys the slave gives no seed before its next reset.
 * Source   ASAM MCD-1 XCP 1.x; docs/howto/xcp.md
 * Units    bytes and numbers of the protocol
 * Errors   the protocol's codes
 * Context  comm/xcp.c only */
#include "comm/xcp.h"

static inline bool xcp_is_session(uint8_t command)
{
    return command >= XCP_UNLOCK;
}

xcp_result_t xcp_session_command(xcp_t *xcp, const xcp_config_t *config, const uint8_t *command, uint8_t *answer,
                                 uint8_t *length);

#endif
