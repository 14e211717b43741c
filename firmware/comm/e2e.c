/* SPDX-License-Identifier: Apache-2.0 */
#include "comm/e2e.h"

#define POLYNOMIAL 0x1DU
#define TOP_BIT 0x80U
#define COUNTER_MASK 0x0FU

static uint8_t crc_byte(uint8_t crc, uint8_t byte)
{
    unsigned rest = (unsigned)crc ^ byte;
    for (int bit = 0; bit < 8; bit++) {
        rest = ((rest & TOP_BIT) != 0U) ? (rest << 1) ^ POLYNOMIAL : rest << 1;
        rest &= 0xFFU;
    }
    return (uint8_t)rest;
}

uint8_t e2e_crc(uint16_t data_id, const can_frame_t *frame)
{
    uint8_t crc = crc_byte(0U, (uint8_t)(data_id & 0xFFU));
    crc = crc_byte(crc, (uint8_t)(data_id >> 8));
    for (unsigned n = 1; n < E2E_LENGTH; n++) {
        crc = crc_byte(crc, frame->data[n]);
    }
    return crc;
}

void e2e_protect(uint16_t data_id, uint8_t *counter, can_frame_t *frame)
{
    frame->data[1] = (uint8_t)((frame->data[1] & ~COUNTER_MASK) | *counter);
    frame->data[0] = e2e_crc(data_id, frame);
    *counter = (uint8_t)((*counter + 1U) % E2E_COUNTERS);
}

static e2e_status_t check_counter(e2e_state_t *state, uint8_t counter)
{
    if (counter >= E2E_COUNTERS) {
        return E2E_JUMP;
    }
    if (!state->synced) {
        *state = (e2e_state_t){counter, true};
        return E2E_FIRST;
    }
    const unsigned ahead = (counter + E2E_COUNTERS - state->counter) % E2E_COUNTERS;
    state->counter = counter;
    if (ahead == 0U) {
        return E2E_REPEATED;
    }
    if (ahead > E2E_SKIP_MAX) {
        return E2E_JUMP;
    }
    return (ahead == 1U) ? E2E_OK : E2E_SKIPPED;
}

e2e_status_t e2e_check(uint16_t data_id, e2e_state_t *state, const can_frame_t *frame)
{
    if (frame->length != E2E_LENGTH) {
        return E2E_WRONG_LENGTH;
    }
    if (frame->data[0] != e2e_crc(data_id, frame)) {
        return E2E_CRC;
    }
    return check_counter(state, frame->data[1] & COUNTER_MASK);
}
