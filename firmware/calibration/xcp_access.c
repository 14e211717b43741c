/* SPDX-License-Identifier: Apache-2.0 */
#include "calibration/xcp_access.h"

#define LIMITS(name, lo, hi, unit, text) {lo, hi},

static const xcp_limits_t limits[CALIBRATION_COUNT] = {CALIBRATION_LIST(LIMITS)};

/* Keeps a mistyped address from changing a drive; whoever needs more replaces it. */
static uint32_t key_of(uint32_t seed)
{
    return (seed << 7 | seed >> 25) ^ 0x5A17F10CU;
}

static xcp_config_t config_of(xcp_access_t *access)
{
    return (xcp_config_t){
        .memory = {access->area, XCP_ACCESS_AREAS},
        .working = access->working,
        .reference = access->reference,
        .limits = limits,
        .parameters = CALIBRATION_COUNT,
        .key = key_of,
    };
}

void xcp_access_init(xcp_access_t *access, const drive_t *drive, const freeze_frame_t *frame, uint32_t seed)
{
    for (int k = 0; k < (int)CALIBRATION_COUNT; k++) {
        access->reference[k] = calibration_get(&drive->motor, (calibration_id_t)k);
        access->put[k] = access->reference[k];
    }
    access->area[0] = (xcp_area_t){&access->measurements, sizeof access->measurements};
    access->area[1] = (xcp_area_t){frame, sizeof *frame};
    access->answer_waits = false;
    const xcp_config_t config = config_of(access);
    xcp_reset(&access->xcp, &config, seed);
    access->xcp.daq.step_10us = (uint8_t)(drive->motor.bases.step_s * 1e5F + 0.5F);
    access->applied = access->xcp.generation;
}

void xcp_access_receive(xcp_access_t *access, const can_frame_t *frame)
{
    const xcp_config_t config = config_of(access);
    access->answer_waits = xcp_command(&access->xcp, &config, frame, &access->answer);
    access->answer.id = XCP_ID_ANSWER;
}

static void apply(xcp_access_t *access, drive_t *drive)
{
    const xcp_config_t config = config_of(access);
    const float *page = xcp_active_page(&access->xcp, &config);
    for (int k = 0; k < (int)CALIBRATION_COUNT; k++) {
        const calibration_id_t id = (calibration_id_t)k;
        if (page[k] != access->put[k]) { /* the others keep every bit, and what the drive has measured itself */
            calibration_put(&drive->motor, id, page[k]);
            access->put[k] = page[k];
        }
    }
    access->applied = access->xcp.generation;
}

void xcp_access_step(xcp_access_t *access, drive_t *drive, uint32_t passed_ms)
{
    if (access->applied != access->xcp.generation) {
        apply(access, drive);
    }
    measurements_step(&access->measurements, drive);
    const xcp_config_t config = config_of(access);
    xcp_daq_event(&access->xcp.daq, &config.memory, passed_ms);
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
