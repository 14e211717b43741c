/* SPDX-License-Identifier: Apache-2.0 */
#include "control/identify_memory.h"

#define X_MAX (4 * IDENTIFY_ONE_Q27)

/* What a stop of unknown length adds to the variance, in prior variances (ID-19): the winding has cooled, the magnet
 * too; the inverter's temperature and the machine's geometry have hardly changed. */
static const int32_t since[IDENTIFY_STATES] = {
    [IDENTIFY_R] = IDENTIFY_ONE_Q30,        [IDENTIFY_DROP] = IDENTIFY_ONE_Q30 / 8,
    [IDENTIFY_FLUX] = IDENTIFY_ONE_Q30 / 4, [IDENTIFY_LQ] = IDENTIFY_ONE_Q30 / 256,
    [IDENTIFY_LD] = IDENTIFY_ONE_Q30 / 256, [IDENTIFY_ANGLE] = IDENTIFY_ONE_Q30 / 256,
    [IDENTIFY_IRON] = IDENTIFY_ONE_Q30 / 64,
};

identify_memory_t identify_memory_get(const identify_state_t *state)
{
    identify_memory_t memory = {.version = IDENTIFY_MEMORY_VERSION};
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
        good = good && memory->x[j] >= -X_MAX && memory->x[j] <= X_MAX && memory->variance[j] > 0 &&
               memory->variance[j] <= IDENTIFY_ONE_Q30;
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
        state->filter.p[p] = fx_min_s32(fx_add_q31(memory->variance[j], since[j]), IDENTIFY_ONE_Q30);
    }
    return true;
}
