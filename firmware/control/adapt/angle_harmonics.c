/* SPDX-License-Identifier: Apache-2.0 */
#include "control/adapt/angle_harmonics.h"

#include "fx/codegen.h"
#include "fx/q.h"
#include "fx/trig.h"
#include "signal/seal.h"

#define PARTS_PER_STEP 4        /* the whole table in 16 steps */
#define ADVANCE_MIN (1 << 26)   /* 1/64 turn per step: below, the second difference of a harmonic is too small */
#define ADVANCE_MAX (1 << 30)   /* 1/4 turn per step: above, the second harmonic aliases */
#define ADVANCE_FAST_SHIFT 28   /* between 1/16 and 1/8 turn per step mu = 1/16; 4 (d - a) stays below 2^29 */
#define DIFFERENCE_MAX_SHIFT 4  /* 1/16 of the step: a sample one period late deviates by 1/10 of ten periods */

/* cos theta, sin theta, cos 2 theta, sin 2 theta. The low half of the sine's word still contains the cosine, which is
 * less than an LSB of the 16-bit sine. Clearing it would take a constant more in the flash. */
static FX_NOT_INLINED void harmonics(uint32_t theta, int32_t q31[ANGLE_HARMONICS])
{
    for (unsigned n = 0; n < ANGLE_HARMONICS; n += 2U) {
        const fx_pair_t at = fx_unit_vector(theta);
        q31[n] = (int32_t)(at << 16);
        q31[n + 1U] = (int32_t)at;
        theta *= 2U;
    }
}

/* c += d harmonic/64: the high word of Q32 * Q31 is half of the product in Q32. For mu = 1/16 the caller passes 4 d. */
static void update_coefficients(const angle_harmonics_config_t *config, angle_harmonics_state_t *state, int32_t d)
{
    int32_t at_q31[ANGLE_HARMONICS];
    harmonics(state->last, at_q31);
    for (unsigned n = 0; n < ANGLE_HARMONICS; n++) {
        const int32_t updated = state->c[n] + ((fx_mulhi(d, at_q31[n]) + 16) >> 5);
        state->c[n] = fx_clamp_q31(updated, -config->max, config->max);
    }
}

/* (AT-20): the second difference without its mean over 16 steps, which is the rotor's acceleration. */
static int32_t without_acceleration(angle_harmonics_state_t *state, int32_t d)
{
    const int32_t rest = d - state->acceleration_q21 * (1 << 11);
    state->acceleration_q21 = (int16_t)(state->acceleration_q21 + (rest >> 15));
    return rest;
}

static int32_t correction(const angle_harmonics_state_t *state, uint32_t part)
{
    int32_t at_q31[ANGLE_HARMONICS];
    harmonics((2U * part + 1U) << (ANGLE_HARMONICS_SHIFT - 1), at_q31);
    int32_t half = 0;
    for (unsigned n = 0; n < ANGLE_HARMONICS; n++) {
        half += fx_mulhi(state->c[n], at_q31[n]);
    }
    return 2 * half;
}

/* Of the coefficients, complemented, so that a state of zeros is sealed (DI-3). */
static uint32_t seal_complement(const angle_harmonics_state_t *state)
{
    return ~seal_of(state->c, sizeof state->c);
}

void angle_harmonics_step(const angle_harmonics_config_t *config, angle_harmonics_state_t *state, uint32_t theta,
                          volatile int32_t table[ANGLE_HARMONICS_PARTS])
{
    const int32_t advance = (int32_t)(theta - state->last);
    const int32_t d = (int32_t)(theta - 2U * state->last + state->before);
    const int32_t speed = fx_abs_q31(advance);
    if (state->seal_complement != seal_complement(state)) {
        state->damaged = true;
    }
    if (speed >= ADVANCE_MIN && speed <= ADVANCE_MAX && fx_abs_q31(d) <= speed >> DIFFERENCE_MAX_SHIFT) {
        const int32_t of_sensor = without_acceleration(state, d);
        update_coefficients(config, state, ((speed >> ADVANCE_FAST_SHIFT) == 1) ? 4 * of_sensor : of_sensor);
        state->seal_complement = seal_complement(state);
    }
    state->before = state->last;
    state->last = theta;
    uint32_t part = state->part % ANGLE_HARMONICS_PARTS;
    do {
        table[part] = correction(state, part);
        part++;
    } while (part % PARTS_PER_STEP != 0U);
    state->part = (uint8_t)part;
}
