/* SPDX-License-Identifier: Apache-2.0 */
#ifndef COMM_XCP_PAGE_H
#define COMM_XCP_PAGE_H
/** The calibration segment of the XCP slave: a reference page in flash, a working page in RAM, at one address.
 *   Bytes wait until their parameter is complete. It is then compared with its limits (NaN is out of range) and stored
 *   as one word.
 * Source   docs/howto/xcp.md
 * Units    bytes; a parameter is a float
 * Range    the addresses of the segment
 * Errors   the protocol's codes; a refused write leaves page and waiting bytes as they were, a value out of its range
 *          also drops the bytes that had waited for it
 * Context  comm/xcp.c only */
#include "comm/xcp.h"

/** Whether the range lies in the segment's addresses. */
bool xcp_page_holds(const xcp_config_t *config, uint32_t address, uint32_t size);
/** Memory of the page the master has chosen; the range must be inside. */
const uint8_t *xcp_page_read(const xcp_t *xcp, const xcp_config_t *config, uint32_t address);
xcp_result_t xcp_page_write(xcp_t *xcp, const xcp_config_t *config, const uint8_t *data, uint8_t size);
/** Discards waiting bytes. */
void xcp_page_discard(xcp_t *xcp);
xcp_result_t xcp_page_command(xcp_t *xcp, const xcp_config_t *config, const uint8_t *command, uint8_t *answer,
                              uint8_t *length);

#endif
