/* SPDX-License-Identifier: Apache-2.0 */
#include "xcp_master.h"

#include <string.h>

#include "unity.h"

xcp_t slave;
float working[PARAMETERS];
uint8_t measured[16];
can_frame_t last_answer;
bool answered;

static const float reference[PARAMETERS] = {1.0F, 2.0F, 3.0F};
static const value_range_t limits[PARAMETERS] = {{0.0F, 10.0F, 0.25F}, {2.0F, 4.0F, 0.0F}, {-1.0F, 5.0F, 0.0F}};
static const xcp_area_t areas[1] = {{measured, sizeof measured}};

static uint32_t key(uint32_t seed)
{
    return ~seed;
}

xcp_config_t slave_config = {
    .memory = {areas, 1},
    .working = working,
    .reference = reference,
    .limits = limits,
    .parameters = PARAMETERS,
    .key = key,
};

void master_reset(void)
{
    for (uint8_t k = 0; k < sizeof measured; k++) {
        measured[k] = (uint8_t)(0xA0 + k);
    }
    xcp_reset(&slave, &slave_config, 7);
    slave.daq.step_10us = 100;
}

void master_send(const uint8_t *data, unsigned length)
{
    can_frame_t frame = {.id = 0x650, .length = (uint8_t)length};
    memcpy(frame.data, data, length);
    memset(&last_answer, 0xEE, sizeof last_answer);
    answered = xcp_command(&slave, &slave_config, &frame, &last_answer);
}

void master_expect(const uint8_t *data, unsigned length, int line)
{
    UNITY_TEST_ASSERT(answered, (unsigned)line, "no answer");
    UNITY_TEST_ASSERT(last_answer.length >= length, (unsigned)line, "the answer is too short");
    UNITY_TEST_ASSERT_EQUAL_HEX8_ARRAY(data, last_answer.data, length, (unsigned)line, "a different answer");
}

void master_expect_whole(const uint8_t *data, unsigned length, int line)
{
    master_expect(data, length, line);
    UNITY_TEST_ASSERT_EQUAL_UINT8(length, last_answer.length, (unsigned)line, "an answer of another length");
}

void master_connect(void)
{
    SEND(0xFF, 0x00);
    EXPECT(0xFF, 0x05);
}

void master_unlock(void)
{
    SEND(0xF8, 0, 1);
    EXPECT(0xFF, 4);
    const uint8_t *s = &last_answer.data[2];
    SEND(0xF7, 4, (uint8_t)~s[0], (uint8_t)~s[1], (uint8_t)~s[2], (uint8_t)~s[3]);
    EXPECT(0xFF, 0);
}

void master_download(uint32_t address, const void *data, uint8_t size)
{
    uint8_t command[8] = {0xF0, size};
    SEND(0xF6, 0, 0, 0, (uint8_t)address, (uint8_t)(address >> 8), (uint8_t)(address >> 16), (uint8_t)(address >> 24));
    EXPECT(0xFF);
    memcpy(&command[2], data, size);
    master_send(command, 2U + size);
}
