/* SPDX-License-Identifier: Apache-2.0 */
#ifndef IDENTIFY_Q30_H
#define IDENTIFY_Q30_H
/** Products of the identification's 1 kHz part: Q30 has a range of +-2.
 *   identify_mul: Q30 * Q30 = Q28, brought back with saturation; identify_sigma: Q31 * Q30 = Q29, limited to 1/4;
 *   identify_add_share: to[n] + from[n] share/2^32, words > 0
 * Source   docs/theory/identification.md, section 12
 * Units    per unit
 * Range    every argument
 * Rounding half up, 1/2 LSB of Q28 and of Q29: 2e-9 per unit
 * Errors   saturates
 * Context  any; three instructions each, identify_add_share six for each word */
#include "fx/codegen.h"
#include "fx/q.h"

static inline int32_t identify_mul(int32_t a, int32_t b)
{
    return fx_sat_bits(fx_mulhi(a, b), 30) * 4;
}

static inline int32_t identify_sigma(q31_t sigma, int32_t derivative)
{
    return fx_sat_bits(fx_mulhi(sigma, derivative), 28) * 2;
}

static inline void identify_add_share(int32_t *to, const int32_t *from, unsigned words, int32_t share)
{
    const int32_t *const end = &from[words];
    const int32_t kept = fx_in_register(share); /* else the constant is loaded again for each word */
    int32_t *sum = to;
    const int32_t *word = from;
    do {
        *sum = fx_mulhi_add(*sum, *word, kept);
        sum++;
        word++;
    } while (word != end);
}

#endif
