/* SPDX-License-Identifier: Apache-2.0 */
#ifndef IDENTIFY_KALMAN_H
#define IDENTIFY_KALMAN_H
/** Kalman filter with scalar measurements, one at a time, and states in units of their prior's standard deviation.
 *   predict  x <- (1 - lambda) x,  P_jl <- (1 - lambda_j - lambda_l) P_jl,  P_jj <- P_jj + 2 lambda_j prior_j:
 *            each state is a first-order Gauss-Markov process, which returns to its prior without measurements
 *   update   innovation e (computed by the caller), innovation variance s = h P h' + r, gain k = P h'/s,
 *            x <- x + k e,  P <- P - k h P
 *   gate     e^2 > 8 h P h' + r is reported; such an innovation is limited, not discarded
 * Source   docs/theory/identification.md (ID-9) ... (ID-12)
 * Units    x in standard deviations of the prior; P relative to the prior's variance; h, e per unit of voltage
 * Range    |x| <= 4; 0 < P_jj <= 1; |h| <= 1/4; s >= 2^-22
 * Rounding 1/s is rounded down by at most 2^-15, so that P stays positive definite without the Joseph form; states are
 *          rounded half up
 * Errors   a state that reaches its limit is reported; e is limited to 1/16 before it acts
 * Context  1 kHz task: in ten steps one update of each axis and one prediction; one division per update */
#include <stdbool.h>

#include "control/identify/model.h"

#define IDENTIFY_ONE_Q27 (1 << 27)
#define KALMAN_P_SIZE (IDENTIFY_STATES * (IDENTIFY_STATES + 1) / 2)

typedef struct {
    int32_t x_q27[IDENTIFY_STATES];
    int32_t p_q30[KALMAN_P_SIZE]; /* symmetric: the upper triangle, row by row */
} kalman_t;

/** Index of P_jl in p_q30, j <= l. */
static inline unsigned kalman_p_index(unsigned j, unsigned l)
{
    return j * (2U * IDENTIFY_STATES - 1U - j) / 2U + l;
}

/** What an update reports, one bit each. */
enum {
    KALMAN_CLAMPED = 1U,      /* a state reached its limit */
    KALMAN_GATE_EXCEEDED = 2U /* the innovation is larger than P and the errors behind the noise can explain */
};

/** x = 0, P = prior. */
void kalman_reset(kalman_t *kalman);
void kalman_predict(const identify_config_t *config, kalman_t *kalman, bool r_known);
/** One scalar measurement with Jacobian row h, innovation e = z - h x and the standard deviation of its noise. */
uint32_t kalman_update(kalman_t *kalman, const jacobian_row_t *row, int32_t innovation_q30, int32_t noise_q30);
/** h x, Q30. */
int32_t kalman_output(const kalman_t *kalman, const jacobian_row_t *row);
/** Variance of h x: h P h', Q60. */
int64_t kalman_output_variance(const kalman_t *kalman, const jacobian_row_t *row);
/** The same with every state at its prior: h h', Q60. */
int64_t kalman_output_variance_prior(const jacobian_row_t *row);

#endif
