/* SPDX-License-Identifier: Apache-2.0 */
#include "control/angle_harmonics.h"

#include "fx/q.h"
#include "fx/trig.h"

#define RENEWED 4             /* parts per step: the whole table in 16 ms */
#define SLOWEST (1 << 26)     /* 1/64 turn per step: below, second differences hardly see harmonics */
#define FASTEST (1 << 30)     /* 1/4: beyond, the second harmonic aliases */
#define LATE_SHIFT 4          /* a sample one period late moves the angle by 1/10 of the step */

typedef struct {
    int32_t q31[ANGLE_HARMONICS];
} waves_t;

static __attribute__((noinline)) void wave(int32_t *q31, uint32_t theta)
{
    const fx_pair_t at = fx_rotation(theta);
    q31[0] = (int32_t)(at << 16);
    q31[1] = (int32_t)(at & 0xFFFF0000U);
}

static waves_t waves(uint32_t theta)
{
    waves_t at;
    wave(&at.q31[0], theta);
    wave(&at.q31[2], 2U * theta);
    return at;
}

/* c + d wave/64: Q32 * Q31 = half of Q32 above 2^32. */
static void learn(const angle_harmonics_config_t *config, angle_harmonics_state_t *state, int32_t d)
{
    const waves_t at = waves(state->last);
    for (unsigned n = 0; n < ANGLE_HARMONICS; n++) {
        const int32_t moved = state->c[n] + ((fx_mulhi(d, at.q31[n]) + 16) >> 5);
        state->c[n] = fx_clamp_q31(moved, -config->most, config->most);
    }
}

static int32_t correction(const angle_harmonics_state_t *state, uint32_t part)
{
    const waves_t at = waves((2U * part + 1U) << (ANGLE_HARMONICS_SHIFT - 1));
    int32_t half = 0;
    for (unsigned n = 0; n < ANGLE_HARMONICS; n++) {
        half += fx_mulhi(state->c[n], at.q31[n]);
    }
    return 2 * half;
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
