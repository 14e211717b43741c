/* SPDX-License-Identifier: Apache-2.0 */
#ifndef COMM_XCP_PROTOCOL_H
#define COMM_XCP_PROTOCOL_H
/** The protocol's numbers, and little-endian access to its packets.
 * Source   ASAM MCD-1 XCP 1.x
 * Context  comm/xcp*.c and their tests */
#include <stdint.h>

enum {
    XCP_CONNECT = 0xFF,
    XCP_DISCONNECT = 0xFE,
    XCP_GET_STATUS = 0xFD,
    XCP_SYNCH = 0xFC,
    XCP_GET_COMM_MODE_INFO = 0xFB,
    XCP_GET_SEED = 0xF8,
    XCP_UNLOCK = 0xF7,
    XCP_SET_MTA = 0xF6,
    XCP_UPLOAD = 0xF5,
    XCP_SHORT_UPLOAD = 0xF4,
    XCP_BUILD_CHECKSUM = 0xF3,
    XCP_USER_CMD = 0xF1,
    XCP_DOWNLOAD = 0xF0,
    XCP_SET_CAL_PAGE = 0xEB,
    XCP_GET_CAL_PAGE = 0xEA,
    XCP_GET_PAG_PROCESSOR_INFO = 0xE9,
    XCP_COPY_CAL_PAGE = 0xE4,
    XCP_CLEAR_DAQ_LIST = 0xE3,
    XCP_SET_DAQ_PTR = 0xE2,
    XCP_WRITE_DAQ = 0xE1,
    XCP_SET_DAQ_LIST_MODE = 0xE0,
    XCP_GET_DAQ_LIST_MODE = 0xDF,
    XCP_START_STOP_DAQ_LIST = 0xDE,
    XCP_START_STOP_SYNCH = 0xDD,
    XCP_GET_DAQ_CLOCK = 0xDC,
    XCP_GET_DAQ_PROCESSOR_INFO = 0xDA,
    XCP_GET_DAQ_RESOLUTION_INFO = 0xD9,
    XCP_GET_DAQ_EVENT_INFO = 0xD7,
    XCP_FREE_DAQ = 0xD6,
    XCP_ALLOC_DAQ = 0xD5,
    XCP_ALLOC_ODT = 0xD4,
    XCP_ALLOC_ODT_ENTRY = 0xD3
};

/** An error, or XCP_OK. */
typedef enum {
    XCP_ERR_CMD_SYNCH = 0x00,
    XCP_ERR_CMD_BUSY = 0x10,
    XCP_ERR_DAQ_ACTIVE = 0x11,
    XCP_ERR_CMD_UNKNOWN = 0x20,
    XCP_ERR_CMD_SYNTAX = 0x21,
    XCP_ERR_OUT_OF_RANGE = 0x22,
    XCP_ERR_WRITE_PROTECTED = 0x23,
    XCP_ERR_ACCESS_DENIED = 0x24,
    XCP_ERR_ACCESS_LOCKED = 0x25,
    XCP_ERR_PAGE_NOT_VALID = 0x26,
    XCP_ERR_MODE_NOT_VALID = 0x27,
    XCP_ERR_SEGMENT_NOT_VALID = 0x28,
    XCP_ERR_SEQUENCE = 0x29,
    XCP_ERR_DAQ_CONFIG = 0x2A,
    XCP_ERR_MEMORY_OVERFLOW = 0x30,
    XCP_OK = 0xFF
} xcp_result_t;

enum { XCP_PID_RESPONSE = 0xFF, XCP_PID_ERROR = 0xFE, XCP_PID_EVENT = 0xFD, XCP_EVENT_DAQ_OVERLOAD = 0x06 };
enum { XCP_RESOURCE_CALIBRATION = 0x01, XCP_RESOURCE_DAQ = 0x04 };
enum { XCP_CHECKSUM_CRC_32 = 0x09, XCP_PACKET_MAX = 8 };

static inline uint16_t xcp_get_u16(const uint8_t *at)
{
    return (uint16_t)(at[0] | at[1] << 8);
}

static inline uint32_t xcp_get_u32(const uint8_t *at)
{
    return (uint32_t)xcp_get_u16(at) | (uint32_t)xcp_get_u16(at + 2) << 16;
}

static inline void xcp_put_u16(uint8_t *at, uint32_t value)
{
    at[0] = (uint8_t)value;
    at[1] = (uint8_t)(value >> 8);
}

static inline void xcp_put_u32(uint8_t *at, uint32_t value)
{
    xcp_put_u16(at, value);
    xcp_put_u16(at + 2, value >> 16);
}

#endif
