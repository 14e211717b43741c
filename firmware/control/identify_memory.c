/* SPDX-License-Identifier: Apache-2.0 */
#include "control/identify_memory.h"

#define X_MAX (4U * IDENTIFY_ONE_Q27)

/* What a stop of unknown length adds to the variance, in halvings of the prior's (ID-19): the winding has cooled, the
 * magnet too; the inverter's temperature and the machine's geometry have hardly changed. */
static const uint8_t halvings[IDENTIFY_STATES] = {
    [IDENTIFY_R] = 0,  [IDENTIFY_DROP] = 3,  [IDENTIFY_FLUX] = 2, [IDENTIFY_LQ] = 8,
    [IDENTIFY_LD] = 8, [IDENTIFY_ANGLE] = 8, [IDENTIFY_IRON] = 6,
};

/* Magnet and q axis make the torque: known as (ID-18) wants it, there is nothing to wait for. */
static bool known(const identify_filter_t *filter)
{
    const int32_t level = IDENTIFY_ONE_Q30 / 8 * 3;
    return filter->p[identify_pair(IDENTIFY_FLUX, IDENTIFY_FLUX)] < level &&
           filter->p[identify_pair(IDENTIFY_LQ, IDENTIFY_LQ)] < level;
}

identify_memory_t identify_memory_get(const identify_state_t *state)
{
    identify_memory_t memory; /* every field is written below */
    memory.version = IDENTIFY_MEMORY_VERSION;
    for (unsigned j = 0, p = 0; j < IDENTIFY_STATES; p += IDENTIFY_STATES - j, j++) {
        memory.x[j] = state->filter.x[j];
        memory.variance[j] = state->filter.p[p];
    }
    return memory;
}

static bool plausible(const identify_memory_t *memory)
{
    bool good = memory->version == IDENTIFY_MEMORY_VERSION;
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        const uint32_t above = (uint32_t)memory->x[j] + X_MAX; /* the lower end */
        good = good && above <= 2U * X_MAX && (uint32_t)memory->variance[j] - 1U < IDENTIFY_ONE_Q30;
    }
    return good;
}

bool identify_memory_restore(identify_state_t *state, const identify_memory_t *memory)
{
    if (!plausible(memory)) {
        return false;
    }
    identify_filter_reset(&state->filter);
    for (unsigned j = 0, p = 0; j < IDENTIFY_STATES; p += IDENTIFY_STATES - j, j++) {
        state->filter.x[j] = memory->x[j];
        const int32_t variance = fx_add_q31(memory->variance[j], IDENTIFY_ONE_Q30 >> halvings[j]);
        state->filter.p[p] = fx_min_s32(variance, IDENTIFY_ONE_Q30);
    }
    state->trusted = known(&state->filter);
    state->confidence = state->trusted ? Q15_MAX : 0;
    return true;
}
