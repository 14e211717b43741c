/* SPDX-License-Identifier: Apache-2.0 */
#include "control/angle_harmonics.h"

#include "fx/q.h"
#include "fx/trig.h"

#define RENEWED 4             /* parts per step: the whole table in 16 ms */
#define SLOWEST (1 << 26)     /* 1/64 turn per step: below, second differences hardly see harmonics */
#define FASTEST (1 << 30)     /* 1/4: beyond, the second harmonic aliases */
#define LATE_SHIFT 4          /* a sample one period late moves the angle by 1/10 of the step */

typedef struct {
    int32_t cos_1, sin_1, cos_2, sin_2; /* Q31 */
} waves_t;

static waves_t waves(uint32_t theta)
{
    const fx_pair_t at = fx_rotation(theta);
    const fx_pair_t twice = fx_rotation(2U * theta);
    return (waves_t){(int32_t)(at << 16), (int32_t)(at & 0xFFFF0000U), (int32_t)(twice << 16),
                     (int32_t)(twice & 0xFFFF0000U)};
}

/* c + d wave/64: Q32 * Q31 = half of Q32 above 2^32. */
static int32_t learnt(int32_t c, int32_t d, int32_t wave, int32_t most)
{
    return fx_clamp_q31(c + ((fx_mulhi(d, wave) + 16) >> 5), -most, most);
}

static void learn(const angle_harmonics_config_t *config, angle_harmonics_state_t *state, int32_t d)
{
    const waves_t at = waves(state->last);
    state->c_1 = learnt(state->c_1, d, at.cos_1, config->most);
    state->s_1 = learnt(state->s_1, d, at.sin_1, config->most);
    state->c_2 = learnt(state->c_2, d, at.cos_2, config->most);
    state->s_2 = learnt(state->s_2, d, at.sin_2, config->most);
}

static int32_t correction(const angle_harmonics_state_t *state, uint32_t part)
{
    const waves_t at = waves((2U * part + 1U) << (ANGLE_HARMONICS_SHIFT - 1));
    return 2 * (fx_mulhi(state->c_1, at.cos_1) + fx_mulhi(state->s_1, at.sin_1) + fx_mulhi(state->c_2, at.cos_2) +
                fx_mulhi(state->s_2, at.sin_2));
}

void angle_harmonics_step(const angle_harmonics_config_t *config, angle_harmonics_state_t *state, uint32_t theta,
                          volatile int32_t table[ANGLE_HARMONICS_PARTS])
{
    const int32_t advance = (int32_t)(theta - state->last);
    const int32_t d = (int32_t)(theta - 2U * state->last + state->before);
    const int32_t speed = fx_abs_q31(advance);
    if (speed >= SLOWEST && speed <= FASTEST && fx_abs_q31(d) <= speed >> LATE_SHIFT) {
        learn(config, state, d);
    }
    state->before = state->last;
    state->last = theta;
    for (uint32_t n = 0; n < RENEWED; n++) {
        table[state->part] = correction(state, state->part);
        state->part = (uint8_t)((state->part + 1U) % ANGLE_HARMONICS_PARTS);
    }
}
