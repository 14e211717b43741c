/* SPDX-License-Identifier: Apache-2.0 */
/* The calibration protocol under commands that are valid one by one, in a random order:
 *   fuzz_xcp <commands> <seed>
 * Purely random frames hardly ever get beyond CONNECT. These use valid addresses and the key, and allocate lists. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "comm/xcp.h"

#define PARAMETERS 3
#define FRAME_MAX 8U

static xcp_t slave;
static float working[PARAMETERS], page_before[PARAMETERS];
static uint8_t measured[32];
static uint64_t state, sent, answers, sampled, writes;

static const float reference[PARAMETERS] = {1.0F, 2.0F, 3.0F};
static const value_range_t limits[PARAMETERS] = {{0.0F, 10.0F, 0.25F}, {2.0F, 4.0F, 0.0F}, {-1.0F, 5.0F, 0.0F}};
static const xcp_area_t areas[1] = {{measured, sizeof measured}};

static uint32_t key(uint32_t seed)
{
    return ~seed;
}

static const xcp_config_t config = {.memory = {areas, 1},
                                    .working = working,
                                    .reference = reference,
                                    .limits = limits,
                                    .parameters = PARAMETERS,
                                    .key = key};

/* xorshift64* */
static uint32_t below(uint32_t count)
{
    state ^= state >> 12;
    state ^= state << 25;
    state ^= state >> 27;
    return (uint32_t)((state * 0x2545F4914F6CDD1DULL) >> 32) % count;
}

static void check(bool good, const char *what)
{
    if (!good) {
        printf("FAILED after %" PRIu64 " commands: %s\n", sent, what);
        exit(1);
    }
}

/* Mostly near a valid address. */
static uint32_t some_address(void)
{
    const uint32_t base = (below(2) == 0U) ? xcp_address(measured) : xcp_address(working);
    return (below(20) == 0U) ? below(UINT32_MAX) : base + below(36) - 2U;
}

/* A valid command with arguments near the valid ones. */
static can_frame_t some_command(void)
{
    const bool wild = below(30) == 0U;
    can_frame_t frame = {.length = (uint8_t)((below(50) == 0U) ? below(9) : FRAME_MAX)};
    for (unsigned n = 1; n < FRAME_MAX; n++) {
        frame.data[n] = (uint8_t)below(wild ? 256U : (n == 3U) ? 1U : 3U);
    }
    frame.data[0] = (uint8_t)(0xD3U + below(0x100U - 0xD3U));
    if (frame.data[0] == 0xE1) {
        frame.data[1] = 0xFF;
        frame.data[2] = (uint8_t)(1U + below(7));
    }
    if (frame.data[0] == 0xE1 || frame.data[0] == 0xF4 || frame.data[0] == 0xF6) {
        const uint32_t address = some_address();
        memcpy(&frame.data[4], &address, sizeof address);
    }
    return frame;
}

static void give(const can_frame_t *frame)
{
    can_frame_t answer = {0};
    const bool unlocked = slave.unlocked;
    memcpy(page_before, working, sizeof working);
    if (xcp_command(&slave, &config, frame, &answer)) {
        answers++;
        check(answer.length >= 1U && answer.length <= FRAME_MAX, "an answer of impossible length");
    }
    const bool changed = memcmp(page_before, working, sizeof working) != 0;
    check(!changed || (unlocked && answer.data[0] == 0xFF), "a value changed without the key or against a refusal");
    writes += changed ? 1U : 0U;
    for (unsigned k = 0; k < PARAMETERS; k++) {
        check(working[k] >= limits[k].lo && working[k] <= limits[k].hi, "a value out of its range");
    }
    sent++;
}

/* A step of a valid session; sometimes another command is inserted, or the step is left out. */
static void step(const uint8_t data[8])
{
    can_frame_t frame = {.length = FRAME_MAX};
    while (below(8) == 0U) {
        const can_frame_t other = some_command();
        give(&other);
    }
    memcpy(frame.data, data, FRAME_MAX);
    if (below(40) != 0U) {
        give(&frame);
    }
}

#define STEP(...) step((const uint8_t[8]){__VA_ARGS__})
#define BYTES_OF(x) (uint8_t)(x), (uint8_t)((x) >> 8), (uint8_t)((x) >> 16), (uint8_t)((x) >> 24)

/* Lists of random entries, started one by one or together. */
static void record(void)
{
    const uint8_t lists = (uint8_t)(1U + below(XCP_DAQ_LISTS)), entries = (uint8_t)(1U + below(4));
    STEP(0xD6);
    STEP(0xD5, 0, lists);
    for (uint8_t list = 0; list < lists; list++) {
        STEP(0xD4, 0, list, 0, 1);
    }
    for (uint8_t list = 0; list < lists; list++) {
        STEP(0xD3, 0, list, 0, 0, entries);
    }
    for (uint8_t list = 0; list < lists; list++) {
        STEP(0xE0, (uint8_t)(below(2) * 0x10U), list, 0, (uint8_t)below(2), 0, 1);
        STEP(0xE2, 0, list);
        for (uint8_t n = 0; n < entries; n++) {
            STEP(0xE1, 0xFF, (uint8_t)(1U + below(2)), 0, BYTES_OF(xcp_address(measured)));
        }
        STEP(0xE2, 0, list, 0, 0, (uint8_t)below(entries));
        STEP(0xDE, (uint8_t)(1U + below(2)), list);
    }
    STEP(0xDD, 1);
}

static void calibrate(void)
{
    STEP(0xF8, 0, 1);
    STEP(0xF7, 4, BYTES_OF(key(slave.seed)));
    STEP(0xEB, 0x83, 0, (uint8_t)(below(10) != 0U));
    for (uint32_t n = below(8); n > 0U; n--) {
        const uint32_t address = (below(3) == 0U) ? some_address() : xcp_address(&working[below(PARAMETERS)]);
        const float value = (float)below(2000) / 100.0F - 5.0F;
        uint8_t download[8] = {0xF0, (uint8_t)(1U + below(6))};
        memcpy(&download[2], &value, sizeof value);
        STEP(0xF6, 0, 0, 0, BYTES_OF(address));
        step(download);
    }
}

static void millisecond(void)
{
    can_frame_t frame;
    xcp_daq_event(&slave.daq, &config.memory, below(3));
    check(slave.daq.queued - slave.daq.sent <= XCP_DAQ_QUEUE, "the queue holds more than it can");
    for (uint32_t n = below(6); n > 0U && xcp_daq_next(&slave.daq, &frame); n--) {
        check(frame.length >= 1U && frame.length <= FRAME_MAX, "a measurement frame of impossible length");
        xcp_daq_sent(&slave.daq);
        sampled++;
    }
}

int main(int argc, char **argv)
{
    if (argc != 3) {
        fprintf(stderr, "usage: fuzz_xcp <commands> <seed>\n");
        return 2;
    }
    const uint64_t commands = strtoull(argv[1], NULL, 10);
    xcp_reset(&slave, &config, 1);
    state = strtoull(argv[2], NULL, 10) * 0x9E3779B97F4A7C15ULL + 1ULL;
    while (sent < commands) {
        if (slave.wrong_keys > 2U) {
            xcp_reset(&slave, &config, (uint32_t)sent);
        }
        STEP(0xFF);
        if (below(2) == 0U) {
            calibrate();
        } else {
            record();
        }
        for (uint32_t ms = below(60); ms > 0U; ms--) {
            millisecond();
        }
    }
    check(writes > commands / 1000U && sampled > commands / 10U, "hardly anything was written or measured");
    printf("%" PRIu64 " commands: %" PRIu64 " answers, %" PRIu64 " values changed, %" PRIu64 " measurement frames\n",
           sent, answers, writes, sampled);
    return 0;
}
