/* SPDX-License-Identifier: Apache-2.0 */
#include "control/identify/kalman.h"

#define X_MAX_Q27 (4 * IDENTIFY_ONE_Q27)
#define INNOVATION_MAX_Q30 (1 << 26)
#define S_MIN_Q60 (INT64_C(1) << 38) /* the square of the smallest noise that identify_check() accepts */
#define GATE_SHIFT 3                 /* e^2 > 8 h P h' + r; r counts one error many times over (ID-14) */
#define DIVISOR_BITS 16

/* 1/s = inverse 2^-(32 + shift), rounded down. */
typedef struct {
    uint32_t inverse;
    unsigned shift;
} reciprocal_t;

static int32_t round_shift(int64_t x, unsigned n)
{
    return fx_sat_q31(((x >> (n - 1U)) + 1) >> 1);
}

void kalman_reset(kalman_t *kalman)
{
    *kalman = (kalman_t){{0}, {0}};
    for (unsigned j = 0, p = 0; j < IDENTIFY_STATES; p += IDENTIFY_STATES - j, j++) {
        kalman->p_q30[p] = IDENTIFY_ONE_Q30;
    }
}

/* Time update (ID-10). */
void kalman_predict(const identify_config_t *config, kalman_t *kalman, bool r_known)
{
    int32_t *p = kalman->p_q30;
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        const int32_t prior = (j == IDENTIFY_R && r_known) ? config->r_known_q30 : IDENTIFY_ONE_Q30;
        kalman->x_q27[j] -= fx_mul_q31(config->leak[j], kalman->x_q27[j]);
        *p += fx_mul_q31(2 * config->leak[j], prior - *p);
        p++;
        for (unsigned l = j + 1U; l < IDENTIFY_STATES; l++) {
            *p -= fx_mul_q31(config->leak[j] + config->leak[l], *p);
            p++;
        }
    }
}

/* Computes P h' and returns h P h', Q60. */
static int64_t project_covariance(const kalman_t *kalman, const jacobian_row_t *row, int32_t *ph_q30)
{
    int64_t variance = 0;
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        int64_t sum = 0;
        const int32_t *p = &kalman->p_q30[j];
        for (unsigned l = 0; l < IDENTIFY_STATES; l++) {
            sum += (int64_t)*p * row->h_q30[l];
            p += (l < j) ? IDENTIFY_STATES - 1U - l : 1U; /* down the column to the diagonal, then along the row */
        }
        ph_q30[j] = round_shift(sum, 30);
        variance += (int64_t)ph_q30[j] * row->h_q30[j];
    }
    return variance;
}

int32_t kalman_output(const kalman_t *kalman, const jacobian_row_t *row)
{
    int64_t sum = 0;
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        sum += (int64_t)kalman->x_q27[j] * row->h_q30[j];
    }
    return round_shift(sum, 27);
}

int64_t kalman_output_variance(const kalman_t *kalman, const jacobian_row_t *row)
{
    int32_t ph_q30[IDENTIFY_STATES];
    return project_covariance(kalman, row, ph_q30);
}

int64_t kalman_output_variance_prior(const jacobian_row_t *row)
{
    int64_t variance = 0;
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        variance += (int64_t)row->h_q30[j] * row->h_q30[j];
    }
    return variance;
}

/* The divisor's first 16 bits, rounded up: the gain is never larger than the optimum, which keeps P positive definite
 * (ID-11). */
static reciprocal_t reciprocal(int64_t s_q60)
{
    const uint64_t divisor = (uint64_t)s_q60;
    const unsigned shift = 64U - (unsigned)__builtin_clzll(divisor) - DIVISOR_BITS;
    const uint32_t mantissa = (uint32_t)(divisor >> shift) + 1U;
    return (reciprocal_t){UINT32_MAX / mantissa, shift};
}

/* k = P h'/s. Q30 2^30/s = Q24 after 54 - 32 - shift. */
static void compute_gain(const int32_t *ph_q30, int64_t s_q60, int32_t *gain_q24)
{
    const reciprocal_t by = reciprocal(s_q60);
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        gain_q24[j] = round_shift((int64_t)ph_q30[j] * by.inverse, by.shift - 22U);
    }
}

/* x += k e; true if a state was clamped. */
static bool update_states(kalman_t *kalman, const int32_t *gain_q24, int32_t innovation_q30)
{
    bool clamped = false;
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        const int32_t correction = round_shift((int64_t)gain_q24[j] * innovation_q30, 27);
        const int32_t updated = fx_add_q31(kalman->x_q27[j], correction);
        kalman->x_q27[j] = fx_clamp_q31(updated, -X_MAX_Q27, X_MAX_Q27);
        clamped |= kalman->x_q27[j] != updated;
    }
    return clamped;
}

/* P -= k h P, as P is symmetric: k (P h')'. Q24 * Q30, rounded to Q30; |k_j (P h')_l| <= 1. */
static void update_covariance(kalman_t *kalman, const int32_t *gain_q24, const int32_t *ph_q30)
{
    int32_t *p = kalman->p_q30;
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        for (unsigned l = j; l < IDENTIFY_STATES; l++) {
            const int64_t reduction = (int64_t)gain_q24[j] * ph_q30[l] + (1 << 23);
            *p++ -= (int32_t)(reduction >> 24);
        }
    }
}

/* Measurement update (ID-9). */
kalman_update_t kalman_update(kalman_t *kalman, const jacobian_row_t *row, int32_t innovation_q30, int64_t r_q60)
{
    int32_t ph_q30[IDENTIFY_STATES];
    int32_t gain_q24[IDENTIFY_STATES];
    const int64_t hph_q60 = project_covariance(kalman, row, ph_q30);
    const int64_t innovation_variance_q60 = (hph_q60 + r_q60 < S_MIN_Q60) ? S_MIN_Q60 : hph_q60 + r_q60;
    const int64_t innovation_squared_q60 = (int64_t)innovation_q30 * innovation_q30;
    const bool gate_exceeded = innovation_squared_q60 >> GATE_SHIFT > hph_q60 + (r_q60 >> GATE_SHIFT);
    const int32_t limited_q30 = fx_clamp_q31(innovation_q30, -INNOVATION_MAX_Q30, INNOVATION_MAX_Q30);

    compute_gain(ph_q30, innovation_variance_q60, gain_q24);
    const bool clamped = update_states(kalman, gain_q24, limited_q30);
    update_covariance(kalman, gain_q24, ph_q30);
    return (kalman_update_t){clamped, gate_exceeded};
}
