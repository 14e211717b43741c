/* SPDX-License-Identifier: Apache-2.0 */
#include "control/adapt/angle_harmonics.h"

#include "fx/codegen.h"
#include "fx/q.h"
#include "fx/trig.h"
#include "signal/seal.h"

#define QUARTER 16U             /* parts of the table in a quarter of a turn: the whole table in 16 steps */
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

/* c += d harmonic/64: the high word of Q32 * Q31 is half of the product in Q32, and the harmonic, whose sines have 16
 * bits, loses nothing by the shift of 5. For mu = 1/16 the caller passes 4 d. */
static void update_coefficients(const angle_harmonics_config_t *config, angle_harmonics_state_t *state, int32_t d)
{
    int32_t at_q31[ANGLE_HARMONICS];
    harmonics(state->last, at_q31);
    int32_t *c = state->c;
    for (unsigned n = 0; n < ANGLE_HARMONICS; n++) {
        const int32_t updated = fx_mulhi_add(c[n], d, at_q31[n] >> 5);
        c[n] = fx_clamp_q31(updated, -config->max, config->max);
    }
}

/* (AT-20): the second difference without its mean over 16 steps, which is the rotor's acceleration. */
static int32_t without_acceleration(angle_harmonics_state_t *state, int32_t d)
{
    const int32_t rest = d - state->acceleration_q21 * (1 << 11);
    state->acceleration_q21 = (int16_t)(state->acceleration_q21 + (rest >> 15));
    return rest;
}

/* One part of the table and those a quarter, a half and three quarters of a turn further. A quarter of a turn makes the
 * negative sine of theta of its cosine and the cosine of its sine, and changes the sign of the second harmonic. Returns
 * the last part plus a quarter. */
static uint32_t correct_parts(const angle_harmonics_state_t *state, uint32_t part,
                              volatile int32_t table[ANGLE_HARMONICS_PARTS])
{
    int32_t at_q31[ANGLE_HARMONICS];
    const int32_t *c = state->c;
    harmonics((2U * part + 1U) << (ANGLE_HARMONICS_SHIFT - 1), at_q31);
    int32_t first = fx_mulhi_add(fx_mulhi(c[0], at_q31[0]), c[1], at_q31[1]);
    int32_t further = fx_mulhi_sub(fx_mulhi(c[1], at_q31[0]), c[0], at_q31[1]);
    int32_t second = fx_mulhi_add(fx_mulhi(c[2], at_q31[2]), c[3], at_q31[3]);
    while (part < ANGLE_HARMONICS_PARTS) {
        const int32_t sum = first + second;
        second = -second;
        const int32_t opposite = -first;
        first = further;
        further = opposite;
        table[part] = 2 * sum;
        part += QUARTER;
    }
    return part;
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
    const int32_t d = (int32_t)((uint32_t)advance - state->advance);
    const int32_t speed = fx_abs_q31(advance);
    if (seal_complement(state) != state->seal_complement) {
        state->damaged = true;
    }
    if (speed >= ADVANCE_MIN && speed <= ADVANCE_MAX && fx_abs_q31(d) <= speed >> DIFFERENCE_MAX_SHIFT) {
        const int32_t of_sensor = without_acceleration(state, d);
        update_coefficients(config, state, ((speed >> ADVANCE_FAST_SHIFT) == 1) ? 4 * of_sensor : of_sensor);
        state->seal_complement = seal_complement(state);
    }
    state->last = theta;
    state->advance = (uint32_t)advance;
    state->part = (uint8_t)(1U + correct_parts(state, state->part % QUARTER, table));
}
