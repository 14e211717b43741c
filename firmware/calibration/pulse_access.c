/* SPDX-License-Identifier: Apache-2.0 */
#include "calibration/pulse_access.h"

#define SET_LENGTH 4U

static xcp_result_t set_axis(pulses_axis_config_t *axis, uint32_t member, q15_t value)
{
    int32_t *const place[] = {&axis->v, &axis->low, &axis->high};
    *place[member] = value;
    return XCP_OK;
}

static xcp_result_t set_count(pulses_config_t *config, uint8_t field, uint16_t raw)
{
    switch (field) {
    case PULSE_DELAY:
        config->delay = raw;
        return XCP_OK;
    case PULSE_REVERSALS:
        config->reversals = raw;
        return XCP_OK;
    case PULSE_PERIODS:
        config->periods_max = raw;
        return XCP_OK;
    default:
        return XCP_ERR_OUT_OF_RANGE;
    }
}

static xcp_result_t set_field(pulses_config_t *config, uint8_t field, uint16_t raw)
{
    const q15_t value = (q15_t)(int16_t)raw;
    if (field <= PULSE_D_HIGH) {
        return set_axis(&config->d, field, value);
    }
    if (field <= PULSE_Q_HIGH) {
        return set_axis(&config->q, (uint32_t)field - PULSE_V_Q, value);
    }
    if (field == PULSE_FIRST) {
        config->first = value;
        return XCP_OK;
    }
    if (field == PULSE_ANGLE) {
        config->angle_max = (uint32_t)raw << 16;
        return XCP_OK;
    }
    return set_count(config, field, raw);
}

xcp_result_t pulse_access_command(drive_t *drive, bool unlocked, const uint8_t *command, uint8_t length)
{
    pulses_request_t *request = &drive->request.pulses;
    if (command[0] >= PULSE_STATE) { /* it and those after it only answer */
        return XCP_OK;
    }
    if (!unlocked) {
        return XCP_ERR_ACCESS_LOCKED;
    }
    if (command[0] == PULSE_START) {
        request->starts++;
        return XCP_OK;
    }
    return (length < SET_LENGTH) ? XCP_ERR_CMD_SYNTAX
                                 : set_field(&request->config, command[1], xcp_get_u16(&command[2]));
}

void pulse_access_state(const drive_t *drive, uint8_t command, can_frame_t *answer)
{
    const pulsing_t *pulsing = &drive->task.pulsing;
    const movement_state_t *movement = &drive->task.movement;
    if (command == PULSE_STATE) {
        answer->data[1] = (uint8_t)pulsing->phase;
        answer->data[2] = (uint8_t)pulsing->failure;
        answer->data[3] = drive->request.pulses_agreed ? 1U : 0U;
        answer->length = 4;
    }
    if (command == MOVEMENT_STATE) {
        answer->data[1] = (uint8_t)movement->phase;
        answer->data[2] = (uint8_t)movement->failure;
        answer->length = 3;
    }
    const uint32_t coefficient = (uint32_t)command - ANGLE_CORRECTION;
    if (coefficient < ANGLE_HARMONICS) {
        xcp_put_u32(&answer->data[1], (uint32_t)drive->task.angle_harmonics.c[coefficient]);
        answer->length = 5;
    }
}
