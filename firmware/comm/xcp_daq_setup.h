/* SPDX-License-Identifier: Apache-2.0 */
#ifndef COMM_XCP_DAQ_SETUP_H
#define COMM_XCP_DAQ_SETUP_H
/** The part of the DAQ commands that builds lists: allocation, and what each entry reads.
 * Source   ASAM MCD-1 XCP 1.x
 * Units    bytes and numbers of the protocol
 * Range    the sizes of comm/xcp_daq.h
 * Errors   the protocol's codes; a refused command changes nothing
 * Context  comm/xcp_daq_command.c only */
#include "comm/xcp_daq.h"

xcp_result_t xcp_daq_setup(xcp_daq_t *daq, const xcp_memory_t *memory, const uint8_t *command);

#endif
