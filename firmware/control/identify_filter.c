/* SPDX-License-Identifier: Apache-2.0 */
#include "control/identify_filter.h"

#define X_MAX (4 * IDENTIFY_ONE_Q27)
#define E_MAX (1 << 26)
#define S_MIN (INT64_C(1) << 38) /* the square of the smallest noise that identify_valid() accepts */
#define INCONSISTENT_SHIFT 3 /* e^2 > 8 h P h' + r: r counts one error many times over (ID-14) */
#define SIGNIFICANT 16 /* bits of the divisor */

/* s as mantissa and exponent: 1/s = inverse 2^-(32 + shift), rounded down. */
typedef struct {
    uint32_t inverse;
    unsigned shift;
} reciprocal_t;

static int32_t round_shift(int64_t x, unsigned n)
{
    return fx_sat_q31(((x >> (n - 1U)) + 1) >> 1);
}

void identify_filter_reset(identify_filter_t *filter)
{
    *filter = (identify_filter_t){{0}, {0}};
    for (unsigned j = 0, p = 0; j < IDENTIFY_STATES; p += IDENTIFY_STATES - j, j++) {
        filter->p[p] = IDENTIFY_ONE_Q30;
    }
}

/* P h', Q30; answers h P h' in Q60. */
static int64_t project(const identify_filter_t *filter, const identify_row_t *row, int32_t *ph)
{
    int64_t variance = 0;
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        int64_t sum = 0;
        const int32_t *p = &filter->p[j];
        for (unsigned l = 0; l < IDENTIFY_STATES; l++) {
            sum += (int64_t)*p * row->h[l];
            p += (l < j) ? IDENTIFY_STATES - 1U - l : 1U; /* down the column, then along the row */
        }
        ph[j] = round_shift(sum, 30);
        variance += (int64_t)ph[j] * row->h[j];
    }
    return variance;
}

int64_t identify_filter_variance(const identify_filter_t *filter, const identify_row_t *row)
{
    int32_t ph[IDENTIFY_STATES];
    return project(filter, row, ph);
}

int64_t identify_filter_prior(const identify_row_t *row)
{
    int64_t variance = 0;
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        variance += (int64_t)row->h[j] * row->h[j];
    }
    return variance;
}

int32_t identify_filter_shift(const identify_filter_t *filter, const identify_row_t *row)
{
    int64_t sum = 0;
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        sum += (int64_t)filter->x[j] * row->h[j];
    }
    return round_shift(sum, 27);
}

/* The divisor's first 16 bits, rounded up: the gain is never larger than the optimum (ID-11). */
static reciprocal_t reciprocal(int64_t s)
{
    const uint64_t divisor = (uint64_t)s;
    const unsigned shift = 64U - (unsigned)__builtin_clzll(divisor) - SIGNIFICANT;
    const uint32_t mantissa = (uint32_t)(divisor >> shift) + 1U;
    return (reciprocal_t){UINT32_MAX / mantissa, shift};
}

/* Q24 * Q30, cut to Q30. */
static void shrink(identify_filter_t *filter, const int32_t *ph, const int32_t *gain_q24)
{
    int32_t *p = filter->p;
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        for (unsigned l = j; l < IDENTIFY_STATES; l++) {
            const int64_t drop = (int64_t)gain_q24[j] * ph[l] + (1 << 23);
            *p++ -= (int32_t)(drop >> 24); /* |k_j Ph_l| <= 1: no more than there is */
        }
    }
}

identify_verdict_t identify_filter_update(identify_filter_t *filter, const identify_row_t *row, int32_t e_q30,
                                          int64_t r_q60)
{
    int32_t ph[IDENTIFY_STATES];
    int32_t gain[IDENTIFY_STATES];
    const int64_t own = project(filter, row, ph);
    const int64_t s = (own + r_q60 < S_MIN) ? S_MIN : own + r_q60;
    const reciprocal_t by = reciprocal(s);
    const int32_t e = fx_clamp_q31(e_q30, -E_MAX, E_MAX);
    const int64_t credible = own + (r_q60 >> INCONSISTENT_SHIFT);
    identify_verdict_t verdict = {false, ((int64_t)e_q30 * e_q30) >> INCONSISTENT_SHIFT > credible};
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        /* Q30 2^30/s = Q24 after 54 - 32 - shift. */
        gain[j] = round_shift((int64_t)ph[j] * by.inverse, by.shift - 22U);
        const int32_t moved = fx_add_q31(filter->x[j], round_shift((int64_t)gain[j] * e, 27));
        filter->x[j] = fx_clamp_q31(moved, -X_MAX, X_MAX);
        verdict.clamped |= filter->x[j] != moved;
    }
    shrink(filter, ph, gain);
    return verdict;
}

void identify_filter_leak(const identify_config_t *config, identify_filter_t *filter, bool r_known)
{
    int32_t *p = filter->p;
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        const int32_t prior = (j == IDENTIFY_R && r_known) ? config->r_known_q30 : IDENTIFY_ONE_Q30;
        filter->x[j] -= fx_mul_q31(config->leak[j], filter->x[j]);
        *p += fx_mul_q31(2 * config->leak[j], prior - *p);
        p++;
        for (unsigned l = j + 1U; l < IDENTIFY_STATES; l++) {
            *p -= fx_mul_q31(config->leak[j] + config->leak[l], *p);
            p++;
        }
    }
}
