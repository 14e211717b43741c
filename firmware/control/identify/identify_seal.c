/* SPDX-License-Identifier: Apache-2.0 */
#include "control/identify/identify.h"
#include "signal/seal.h"

/* Field by field, as the bytes between fields have no value (DI-3). */
static uint32_t kept_seal(const identify_state_t *state)
{
    uint32_t seal = seal_add(SEAL_START, (uint32_t)state->local.d);
    seal = seal_add(seal, (uint32_t)state->local.q);
    seal = seal_add(seal, (uint32_t)state->r_prior);
    seal = seal_add(seal, (uint32_t)state->mismatch_share);
    seal = seal_add(seal, (uint32_t)state->confidence);
    return seal_add(seal, state->torque_certain);
}

static uint32_t parameters_seal(const identify_state_t *state)
{
    return seal_of(&state->kalman, sizeof state->kalman);
}

void identify_check_kept(identify_state_t *state)
{
    state->damaged |= state->seal != kept_seal(state);
}

void identify_check_parameters(identify_state_t *state)
{
    state->damaged |= state->kalman_seal != parameters_seal(state);
}

void identify_seal_kept(identify_state_t *state)
{
    state->seal = kept_seal(state);
}

void identify_seal_parameters(identify_state_t *state)
{
    state->kalman_seal = parameters_seal(state);
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
