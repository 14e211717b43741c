/* SPDX-License-Identifier: Apache-2.0 */
/* The 1 kHz task's part of the voltage pulses: it starts or refuses them, and ends them when the drive stops. */
#include "drive/drive.h"

#define V_MAX Q15(0.7)         /* of both axes at once: inside the voltage circle */
#define ANGLE_MAX 0x20000000U  /* an eighth of an electrical turn */
#define BURST_PERIODS_MAX 20000U

static bool is_axis(const drive_t *drive, const pulses_axis_config_t *axis)
{
    const q15_t i_max = drive->motor->commission.i_max;
    return axis->v >= 0 && axis->v <= V_MAX && axis->low < axis->high && axis->low >= -i_max && axis->high <= i_max;
}

static bool is_in_range(const drive_t *drive, const pulses_config_t *c)
{
    return is_axis(drive, &c->d) && is_axis(drive, &c->q) && (c->d.v | c->q.v) != 0 && c->first >= 0 &&
           c->angle_max <= ANGLE_MAX && c->reversals != 0U && c->periods_max <= BURST_PERIODS_MAX;
}

static bool has_no_request(const request_t *request)
{
    const dq_q15_t i_ref = request->i_ref;
    return request->torque_arbitrated == 0 && (!request->current_mode || (i_ref.d == 0 && i_ref.q == 0));
}

static bool may_start(const drive_t *drive, const snapshot_t *snapshot)
{
    return drive->task.run_state == RUN_STATE_RUN && !snapshot->mrai_is_chosen &&
           !commission_runs(&drive->task.commission) && !drive_is_moving(drive) && has_no_request(&drive->request) &&
           fx_abs_q31(snapshot->sample.point.omega) <= drive->motor->commission.omega_max;
}

/* A margin of 1/32, in the square 1/16, above the bounds: noise and the growth of the change by saturation. */
static uint32_t square_max(q15_t i_max)
{
    const uint32_t square = (uint32_t)(i_max * i_max);
    return square + (square >> 4);
}

static void end(pulsing_t *pulsing, pulses_failure_t failure)
{
    pulsing->phase = (failure == PULSES_GOOD) ? PULSES_DONE : PULSES_FAILED;
    pulsing->failure = failure;
}

static void start_or_refuse(drive_t *drive, const snapshot_t *snapshot)
{
    pulsing_t *pulsing = &drive->task.pulsing;
    const pulses_config_t *wanted = &drive->request.pulses.config;
    if (!drive->request.pulses_agreed) {
        end(pulsing, PULSES_NO_CONSENT);
        return;
    }
    if (!may_start(drive, snapshot) || !is_in_range(drive, wanted)) {
        end(pulsing, PULSES_REFUSED);
        return;
    }
    const uint16_t number = (uint16_t)(drive->pulses.number + 1U);
    drive->pulses = *wanted;
    drive->pulses.number = number;
    drive->pulses.square_max = square_max(drive->motor->commission.i_max);
    pulsing->phase = PULSES_PULSE;
    pulsing->failure = PULSES_GOOD;
}

static void continue_or_end(drive_t *drive)
{
    pulsing_t *pulsing = &drive->task.pulsing;
    const pulses_state_t *state = &drive->pulses_state;
    if (drive->task.run_state != RUN_STATE_RUN || !has_no_request(&drive->request)) {
        end(pulsing, PULSES_STOPPED);
        return;
    }
    if (!drive->request.pulses_agreed) {
        end(pulsing, PULSES_NO_CONSENT);
        return;
    }
    if (state->number == drive->pulses.number && !pulses_active(state)) {
        end(pulsing, state->failure);
    }
}

/* A start while pulses run has no effect. It must not delay their end: starts may come in every step. */
void drive_pulse(drive_t *drive, const snapshot_t *snapshot)
{
    pulsing_t *pulsing = &drive->task.pulsing;
    const bool starts = drive->request.pulses.starts != pulsing->starts;
    pulsing->starts = drive->request.pulses.starts;
    if (drive_is_pulsing(drive)) {
        continue_or_end(drive);
        return;
    }
    if (starts) {
        start_or_refuse(drive, snapshot);
    }
}
