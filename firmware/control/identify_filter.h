/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CONTROL_IDENTIFY_FILTER_H
#define CONTROL_IDENTIFY_FILTER_H
/** Kalman filter on normalised states: scalar measurements one by one, leak towards the prior.
 *   s = h P h' + r,  k = P h'/s,  x += k e,  P -= k h P
 *   leak  x -= lambda x,  P_jl -= (lambda_j + lambda_l) P_jl,  P_jj += 2 lambda_j prior_j
 * Source   docs/theory/identification.md (ID-9) ... (ID-12)
 * Units    x in prior sigmas, Q27; P relative to the prior's, Q30; h, e, r per unit of voltage
 * Range    |x| <= 4; 0 < P_jj <= 1; |h| <= 1/4; s >= 2^-24
 * Rounding 1/s downwards by at most 2^-15, so that P stays positive definite; states half up
 * Errors   a state at its limit is reported; e is limited to 1/16 before it acts
 * Context  1 kHz task, each tenth step; one division per update */
#include <stdbool.h>

#include "control/identify_model.h"

#define IDENTIFY_ONE_Q27 (1 << 27)
#define IDENTIFY_ONE_Q30 (1 << 30)
#define IDENTIFY_PAIRS (IDENTIFY_STATES * (IDENTIFY_STATES + 1) / 2)

typedef struct {
    int32_t x[IDENTIFY_STATES];
    int32_t p[IDENTIFY_PAIRS]; /* symmetric: the upper triangle, row by row */
} identify_filter_t;

/** Where P_jl lies, j <= l. */
static inline unsigned identify_pair(unsigned j, unsigned l)
{
    return j * (2U * IDENTIFY_STATES - 1U - j) / 2U + l;
}

typedef struct {
    bool clamped;      /* a state reached its limit */
    bool inconsistent; /* the innovation is beyond what P and the errors behind r can be */
} identify_verdict_t;

void identify_filter_reset(identify_filter_t *filter);
/** e: residual that is left with the present x. r: variance, Q60. */
identify_verdict_t identify_filter_update(identify_filter_t *filter, const identify_row_t *row, int32_t e_q30,
                                          int64_t r_q60);
void identify_filter_leak(const identify_config_t *config, identify_filter_t *filter, bool r_known);
/** h P h', Q60. */
int64_t identify_filter_variance(const identify_filter_t *filter, const identify_row_t *row);
/** h h', Q60: what it was with every state at its prior. */
int64_t identify_filter_prior(const identify_row_t *row);
/** h x, Q30. */
int32_t identify_filter_shift(const identify_filter_t *filter, const identify_row_t *row);

#endif
