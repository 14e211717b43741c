/* SPDX-License-Identifier: Apache-2.0 */
#ifndef UNIT_COMM_XCP_MASTER_H
#define UNIT_COMM_XCP_MASTER_H
/** An XCP master for the tests: sends commands and compares the answers.
 * Context  unit tests of the XCP slave */
#include "comm/xcp.h"

#define SEND(...) master_send((const uint8_t[]){__VA_ARGS__}, sizeof((const uint8_t[]){__VA_ARGS__}))
#define EXPECT(...) master_expect((const uint8_t[]){__VA_ARGS__}, sizeof((const uint8_t[]){__VA_ARGS__}), __LINE__)
#define EXPECT_WHOLE(...) \
    master_expect_whole((const uint8_t[]){__VA_ARGS__}, sizeof((const uint8_t[]){__VA_ARGS__}), __LINE__)
#define EXPECT_ERROR(code) EXPECT_WHOLE(0xFE, (code))
/* An address as four bytes, the lowest first. */
#define AT(pointer) BYTE_OF(pointer, 0), BYTE_OF(pointer, 8), BYTE_OF(pointer, 16), BYTE_OF(pointer, 24)
#define BYTE_OF(pointer, shift) (uint8_t)(xcp_address(pointer) >> (shift))

#define PARAMETERS 3

extern xcp_t slave;
extern xcp_config_t slave_config;
extern float working[PARAMETERS];
extern uint8_t measured[16];
extern can_frame_t last_answer;
extern bool answered;

void master_reset(void);
void master_send(const uint8_t *data, unsigned length);
/* Checks that the answer begins with these bytes. */
void master_expect(const uint8_t *data, unsigned length, int line);
/* Checks that the answer consists of them. */
void master_expect_whole(const uint8_t *data, unsigned length, int line);
void master_connect(void);
void master_unlock(void);
void master_download(uint32_t address, const void *data, uint8_t size);

#endif
