/* SPDX-License-Identifier: Apache-2.0 */
#include "control/identify/record.h"

#define X_MAX_Q27 (4U * IDENTIFY_ONE_Q27)

/* A stop of unknown length adds 2^-n of the prior's variance (ID-19): winding and magnet may have cooled; the voltage
 * drop of the inverter and the machine's geometry hardly change. */
static const uint8_t added_variance_shift[IDENTIFY_STATES] = {
    [IDENTIFY_R] = 0,  [IDENTIFY_DROP] = 3,  [IDENTIFY_FLUX] = 2, [IDENTIFY_LQ] = 8,
    [IDENTIFY_LD] = 8, [IDENTIFY_ANGLE] = 8, [IDENTIFY_IRON] = 6,
};

/* The torque depends mainly on magnet and q axis: both must be known as well as (ID-18) demands. */
static bool is_torque_certain(const kalman_t *kalman)
{
    const int32_t level = IDENTIFY_ONE_Q30 / 8 * 3;
    return kalman->p_q30[kalman_p_index(IDENTIFY_FLUX, IDENTIFY_FLUX)] < level &&
           kalman->p_q30[kalman_p_index(IDENTIFY_LQ, IDENTIFY_LQ)] < level;
}

void identify_record_get(const identify_state_t *state, identify_record_t *record)
{
    record->version = IDENTIFY_RECORD_VERSION;
    for (unsigned j = 0, p = 0; j < IDENTIFY_STATES; p += IDENTIFY_STATES - j, j++) {
        record->x_q27[j] = state->kalman.x_q27[j];
        record->variance_q30[j] = state->kalman.p_q30[p];
    }
}

static bool is_plausible(const identify_record_t *record)
{
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        const uint32_t above = (uint32_t)record->x_q27[j] + X_MAX_Q27; /* the lower end */
        if (above > 2U * X_MAX_Q27 || (uint32_t)record->variance_q30[j] - 1U >= IDENTIFY_ONE_Q30) {
            return false;
        }
    }
    return record->version == IDENTIFY_RECORD_VERSION;
}

bool identify_record_restore(identify_state_t *state, const identify_record_t *record)
{
    if (!is_plausible(record)) {
        return false;
    }
    kalman_reset(&state->kalman);
    for (unsigned j = 0, p = 0; j < IDENTIFY_STATES; p += IDENTIFY_STATES - j, j++) {
        state->kalman.x_q27[j] = record->x_q27[j];
        const int32_t variance = fx_add_q31(record->variance_q30[j], IDENTIFY_ONE_Q30 >> added_variance_shift[j]);
        state->kalman.p_q30[p] = fx_min_s32(variance, IDENTIFY_ONE_Q30);
    }
    state->kept.torque_certain = is_torque_certain(&state->kalman);
    state->kept.confidence = state->kept.torque_certain ? Q15_MAX : 0;
    identify_seal(state);
    return true;
}
