/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/gain_jump.h"

enum { SETTLED = 33, COUNTED = 41, DECIDED = 56 }; /* steps: the last before a candidate; the first and last summed */
enum { MEAN = 4, BEFORE = 8, SINCE = 4 };          /* powers of two: 16 steps; the movements of (MN-59), (MN-61) */

static q15_t approach(q15_t mean, int32_t x, int shift)
{
    return (q15_t)(mean + ((x - mean) >> shift));
}

/* i* has moved by less than a share of it since the mean before, and the speed hardly. */
static bool is_steady(const torque_monitor_config_t *config, const gain_jump_state_t *state, const gain_jump_in_t *in,
                      int share)
{
    const fx_pair_t before = fx_pair(state->i_ref.d, state->i_ref.q);
    const fx_pair_t moved = fx_pair_sub(in->i_ref, before);
    const int32_t faster = fx_abs_q31(in->omega - state->omega) - config->lag_noise;
    return fx_dot2(moved, moved) < fx_dot2(before, before) >> share && 64 * faster <= fx_abs_q31(state->omega);
}

/* (MN-59) */
static bool is_candidate(const torque_monitor_config_t *config, const gain_jump_in_t *in)
{
    const int32_t along = fx_abs_q31(fx_dot2(in->i_excess, in->i_ref));
    return in->current > 4 * config->i_0 && along > fx_mul_q30(in->current, config->i_0) >> 2;
}

/* The means begin with the second residual, because the torque monitor may not have known the first. The weight of a
 * new step falls from 1 to 1/16 in the first 16: with 1/16 at once the first step would have most of the weight. */
static void follow(gain_jump_state_t *state, const gain_jump_in_t *in)
{
    const int shift = fx_min_s32(31 - (int)fx_leading_zeros(state->steps | 1U), MEAN);
    state->change_x16.d += (16 * in->residual.d - state->change_x16.d) >> shift;
    state->change_x16.q += (16 * in->residual.q - state->change_x16.q) >> shift;
    state->i_ref.d = approach(state->i_ref.d, (int16_t)(in->i_ref & 0xFFFFU), shift);
    state->i_ref.q = approach(state->i_ref.q, (int16_t)(in->i_ref >> 16), shift);
    state->omega = approach(state->omega, in->omega, shift);
    state->steps = (uint8_t)fx_min_s32((int32_t)state->steps + 1, SETTLED);
}

bool gain_jump_step(const torque_monitor_config_t *config, gain_jump_state_t *state, const gain_jump_in_t *in)
{
    const bool candidate = is_candidate(config, in);
    const bool steady = is_steady(config, state, in, (state->steps <= (uint8_t)SETTLED) ? BEFORE : SINCE);
    if (!steady || (candidate && state->steps < (uint8_t)SETTLED)) {
        state->steps = 0;
    }
    if (state->steps < (uint8_t)SETTLED || (state->steps == (uint8_t)SETTLED && !candidate)) {
        follow(state, in);
        return false;
    }
    state->steps++;
    if (state->steps >= (uint8_t)COUNTED) {
        state->change_x16.d -= in->residual.d;
        state->change_x16.q -= in->residual.q;
    }
    if (state->steps == (uint8_t)DECIDED) {
        state->steps = 0;
        return true;
    }
    return false;
}

/* (MN-60), (MN-61); the sign of u does not matter. */
bool gain_jump_is_found(const torque_monitor_config_t *config, const gain_jump_state_t *state, dq_q15_t per_quarter)
{
    const fx_pair_t u = fx_pair(fx_sat_q15(state->change_x16.d >> 4), fx_sat_q15(state->change_x16.q >> 4));
    const fx_pair_t quarter = fx_pair(per_quarter.d, per_quarter.q);
    const int32_t along = fx_abs_q31(fx_dot2(u, quarter)) >> 2; /* a quarter: three times as much fits */
    const int32_t across = fx_abs_q31(fx_difference2_cross_acc(0, u, quarter)) >> 2;
    const int32_t squared = (int32_t)((uint32_t)fx_dot2(quarter, quarter) >> 2);
    /* A twelfth; u and the mean are rounded. */
    const int32_t v = ((config->v_0 + config->v_noise) * 171 >> 11) + 2;
    return along > squared >> 2 && along < 3 * squared && 3 * across < along &&
           (uint32_t)fx_dot2(u, u) > (uint32_t)(v * v);
}
