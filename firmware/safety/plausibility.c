/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/plausibility.h"

#include "fx/q.h"
#include "fx/vec.h"
#include "types/faults.h"

enum {
    DEVIATION_LIMIT = 100, /* 20 ms at 5 a sample, 100 ms at 1 */
    DEVIATION_FREE = 5,
    LOST_LIMIT = 10,
    EQUAL_SAMPLES = 20,
    FAST_SAMPLES = 5,
    HOT_SAMPLES = 110
};

static uint32_t confirm(uint8_t *count, bool bad, uint8_t limit, uint32_t fault)
{
    *count = bad ? (uint8_t)fx_min_s32(*count + 1, limit) : 0;
    return (*count >= limit) ? fault : 0;
}

/* (MN-1); good samples take away what bad ones have added. */
static uint32_t deviation(const plausibility_config_t *config, plausibility_state_t *state, const plausibility_in_t *in)
{
    const q15_t error = fx_magnitude(fx_sat_q15(in->i.d - in->i_ref.d), fx_sat_q15(in->i.q - in->i_ref.q));
    const q15_t current = fx_magnitude((q15_t)in->i_ref.d, (q15_t)in->i_ref.q);
    const bool bad = error > config->e_0 + (current >> 3);
    const int32_t step = bad ? (in->voltage_limited ? 1 : DEVIATION_FREE) : -DEVIATION_FREE;
    state->deviation = (int16_t)fx_clamp_q31(state->deviation + step, 0, DEVIATION_LIMIT);
    return (state->deviation >= DEVIATION_LIMIT) ? FAULT_CONTROL : 0;
}

/* (MN-2): evidence only where the phase should carry current; its zero crossings say nothing. */
static bool lost(const plausibility_config_t *config, int8_t *count, int32_t wanted, int32_t measured)
{
    const int32_t size = fx_abs_q31(measured);
    if (size > config->i_dead) {
        *count = (int8_t)fx_max_s32(*count - 1, 0);
    } else if (fx_abs_q31(wanted) > config->i_alive) {
        *count = (int8_t)fx_min_s32(*count + 1, LOST_LIMIT);
    }
    return *count >= LOST_LIMIT;
}

/* (MN-3): without movement in another phase the machine stands still, and equal samples are right. */
static bool stuck(uint8_t *count, bool equal, bool others_move)
{
    if (!equal) {
        *count = 0;
    } else if (others_move) {
        *count = (uint8_t)fx_min_s32(*count + 1, EQUAL_SAMPLES);
    }
    return *count >= EQUAL_SAMPLES;
}

static uint32_t sensors(const plausibility_config_t *config, plausibility_state_t *state, const plausibility_in_t *in)
{
    const abc_t i = in->phases;
    const int32_t moved = config->i_dead >> 2; /* several steps of the converter: no noise around its edge */
    const int32_t a = fx_abs_q31(i.a - state->last.a);
    const int32_t b = fx_abs_q31(i.b - state->last.b);
    const int32_t c = fx_abs_q31(i.c - state->last.c);
    state->last = i;
    const bool is_stuck_a = stuck(&state->equal[0], a == 0, b > moved && c > moved);
    const bool is_stuck_b = stuck(&state->equal[1], b == 0, a > moved && c > moved);
    const bool is_stuck_c = stuck(&state->equal[2], c == 0, a > moved && b > moved);
    return (is_stuck_a || is_stuck_b || is_stuck_c) ? FAULT_CURRENT_STUCK : 0;
}

uint32_t plausibility_step(const plausibility_config_t *config, plausibility_state_t *state,
                           const plausibility_in_t *in)
{
    const bool hot = in->inverter_dC >= config->inverter_trip_dC || in->winding_dC >= config->winding_trip_dC;
    uint32_t faults = confirm(&state->hot, hot, HOT_SAMPLES, FAULT_TEMPERATURE);
    faults |= confirm(&state->fast, fx_abs_q15(in->omega) > config->omega_trip, FAST_SAMPLES, FAULT_OVER_SPEED);
    if (!in->acting) {
        state->deviation = 0;
        state->lost[0] = state->lost[1] = state->lost[2] = 0;
        state->equal[0] = state->equal[1] = state->equal[2] = 0;
        return faults;
    }
    faults |= deviation(config, state, in) | sensors(config, state, in);
    const bool is_lost_a = lost(config, &state->lost[0], in->wanted.a, in->phases.a);
    const bool is_lost_b = lost(config, &state->lost[1], in->wanted.b, in->phases.b);
    const bool is_lost_c = lost(config, &state->lost[2], in->wanted.c, in->phases.c);
    return faults | ((is_lost_a || is_lost_b || is_lost_c) ? FAULT_PHASE_LOST : 0U);
}
