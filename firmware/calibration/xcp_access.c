/* SPDX-License-Identifier: Apache-2.0 */
#include "calibration/xcp_access.h"

#include <stddef.h>

#include "calibration/pulse_access.h"

/* Protects against accidental writes only. A product that needs protection against attacks must replace it. */
static uint32_t compute_key(uint32_t seed)
{
    return (seed << 7 | seed >> 25) ^ 0x5A17F10CU;
}

static xcp_config_t protocol_config(xcp_access_t *access)
{
    return (xcp_config_t){
        .memory = {access->area, XCP_ACCESS_AREAS},
        .working = access->working,
        .reference = access->reference,
        .limits = access->limits,
        .parameters = CALIBRATION_COUNT,
        .key = compute_key,
    };
}

void xcp_access_init(xcp_access_t *access, const drive_t *drive, const freeze_frame_t *frame, const scope_t *scope,
                     uint32_t seed)
{
    for (int k = 0; k < CALIBRATION_COUNT; k++) {
        access->reference[k] = calibration_get(drive, (calibration_id_t)k);
        access->applied_value[k] = access->reference[k];
        access->limits[k] = calibration_range(drive, (calibration_id_t)k);
    }
    access->area[0] = (xcp_area_t){&access->measurements, sizeof access->measurements};
    access->area[1] = (xcp_area_t){frame, sizeof *frame};
    access->area[2] = (xcp_area_t){&scope->capture, offsetof(capture_t, next)};
    access->area[3] = (xcp_area_t){scope->memory, sizeof scope->memory};
    access->answer_waits = false;
    const xcp_config_t config = protocol_config(access);
    xcp_reset(&access->xcp, &config, seed);
    access->xcp.daq.step_10us = (uint8_t)(drive->motor->bases.step_s * 1e5F + 0.5F);
    access->applied = access->xcp.generation;
}

static xcp_result_t scope_answer(scope_t *scope, const drive_t *drive, const can_frame_t *frame)
{
    static const xcp_result_t results[SCOPE_RESULTS] = {[SCOPE_OK] = XCP_OK,
                                                        [SCOPE_UNKNOWN] = XCP_ERR_CMD_UNKNOWN,
                                                        [SCOPE_TOO_SHORT] = XCP_ERR_CMD_SYNTAX,
                                                        [SCOPE_OUT_OF_RANGE] = XCP_ERR_OUT_OF_RANGE,
                                                        [SCOPE_BUSY] = XCP_ERR_CMD_BUSY};
    return results[scope_command(scope, drive, &frame->data[1], (uint8_t)(frame->length - 1U))];
}

static void pulse_answer(xcp_access_t *access, drive_t *drive, const can_frame_t *frame)
{
    const uint8_t *command = &frame->data[1];
    const xcp_result_t result = pulse_access_command(drive, access->xcp.unlocked, command,
                                                     (uint8_t)(frame->length - 1U));
    xcp_answer(&access->xcp, result, &access->answer);
    pulse_access_state(drive, command[0], &access->answer);
}

static void user_answer(xcp_access_t *access, drive_t *drive, scope_t *scope, const can_frame_t *frame)
{
    if (frame->length > 1U && pulse_access_is_command(frame->data[1])) {
        pulse_answer(access, drive, frame);
    } else {
        xcp_answer(&access->xcp, scope_answer(scope, drive, frame), &access->answer);
    }
}

void xcp_access_receive(xcp_access_t *access, drive_t *drive, scope_t *scope, const can_frame_t *frame)
{
    const xcp_config_t config = protocol_config(access);
    if (access->xcp.connected && frame->length > 0U && frame->length <= XCP_PACKET_MAX &&
        frame->data[0] == XCP_USER_CMD) {
        user_answer(access, drive, scope, frame);
        access->answer_waits = true;
    } else {
        access->answer_waits = xcp_command(&access->xcp, &config, frame, &access->answer);
    }
    access->answer.id = XCP_ID_ANSWER;
}

static void apply(xcp_access_t *access, drive_t *drive)
{
    const xcp_config_t config = protocol_config(access);
    const float *page = xcp_active_page(&access->xcp, &config);
    for (int k = 0; k < CALIBRATION_COUNT; k++) {
        const calibration_id_t id = (calibration_id_t)k;
        if (page[k] !=
            access->applied_value
                [k]) { /* unchanged values are not converted again, so what the drive has measured itself is kept */
            calibration_set(drive, id, page[k]);
            access->applied_value[k] = page[k];
        }
    }
    access->applied = access->xcp.generation;
}

void xcp_access_step(xcp_access_t *access, drive_t *drive, uint32_t passed_ms)
{
    if (access->applied != access->xcp.generation) {
        apply(access, drive);
    }
    measurements_step(&access->measurements, drive, access->xcp.connected);
    const xcp_memory_t memory = {access->area, XCP_ACCESS_AREAS};
    xcp_daq_event(&access->xcp.daq, &memory, passed_ms);
}

bool xcp_access_next(const xcp_access_t *access, can_frame_t *frame)
{
    if (access->answer_waits) {
        *frame = access->answer;
        return true;
    }
    const bool waits = xcp_daq_next(&access->xcp.daq, frame);
    frame->id = XCP_ID_ANSWER;
    return waits;
}

void xcp_access_sent(xcp_access_t *access)
{
    if (access->answer_waits) {
        access->answer_waits = false;
    } else {
        xcp_daq_sent(&access->xcp.daq);
    }
}
