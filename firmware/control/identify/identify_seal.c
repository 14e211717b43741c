/* SPDX-License-Identifier: Apache-2.0 */
#include "control/identify/identify.h"
#include "signal/seal.h"

/* size in bytes */
static void check_seal(identify_state_t *state, const void *data, uint32_t size, uint32_t seal)
{
    if (seal_of(data, size) != seal) {
        state->damaged = true;
    }
}

void identify_check_kept(identify_state_t *state)
{
    check_seal(state, &state->kept, sizeof state->kept, state->seal);
}

void identify_check_parameters(identify_state_t *state)
{
    check_seal(state, &state->kalman, sizeof state->kalman, state->kalman_seal);
}

void identify_seal_kept(identify_state_t *state)
{
    state->seal = seal_of(&state->kept, sizeof state->kept);
}

void identify_seal_parameters(identify_state_t *state)
{
    state->kalman_seal = seal_of(&state->kalman, sizeof state->kalman);
}

void identify_seal(identify_state_t *state)
{
    identify_seal_kept(state);
    identify_seal_parameters(state);
}

void identify_set(identify_state_t *state, identify_index_t index, int32_t x_q27)
{
    identify_check_parameters(state);
    state->kalman.x_q27[index] = x_q27;
    identify_seal_parameters(state);
}
