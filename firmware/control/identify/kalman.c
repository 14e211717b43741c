/* SPDX-License-Identifier: Apache-2.0 */
#include "control/identify/kalman.h"

#include "fx/codegen.h"

#define X_MAX_Q27 (4 * IDENTIFY_ONE_Q27)
#define INNOVATION_MAX_Q30 (1 << 26)
#define S_MIN_Q60 (INT64_C(1) << 38) /* the square of the smallest noise that identify_check() accepts */
#define GATE_SHIFT 3                 /* e^2 > 8 h P h' + r; r already allows for errors that persist (ID-14) */
#define DIVISOR_BITS 16

/* 1/s = inverse 2^-(32 + shift), rounded down; inverse < 2^17. */
typedef struct {
    int32_t inverse;
    unsigned shift;
} reciprocal_t;

/* x 2^-n, half up, n = 1 ... 31, |x| < 2^62. Each word is shifted by itself: the compiler's shift of 64 bits takes
 * longer, because it allows for n > 31. */
static int32_t round_shift(int64_t x, unsigned n)
{
    const int64_t rounded = x + (int32_t)(1U << (n - 1U));
    const int32_t high = (int32_t)(rounded >> 32);
    const uint32_t low = (uint32_t)rounded >> n | (uint32_t)high << (32U - n);
    return fx_sat_q31((int64_t)((uint64_t)(uint32_t)(high >> n) << 32 | low));
}

_Static_assert(IDENTIFY_STATES % 2U == 1U, "dot() takes pairs and one more");

/* Not inlined: one copy takes less memory. */
static FX_NOT_INLINED int64_t dot(const int32_t *a, const int32_t *b)
{
    int64_t sum = (int64_t)a[IDENTIFY_STATES - 1U] * b[IDENTIFY_STATES - 1U]; /* a pair has no partner for it */
    FX_UNROLLED
    for (unsigned j = 0; j < IDENTIFY_STATES - 1U; j += 2U) {
        const fx_two_words_t x = fx_load_two_words(&a[j]), y = fx_load_two_words(&b[j]);
        sum += (int64_t)x.first * y.first;
        sum += (int64_t)x.second * y.second;
    }
    return sum;
}

void kalman_reset(kalman_t *kalman)
{
    *kalman = (kalman_t){{0}, {0}};
    for (unsigned j = 0, p = 0; j < IDENTIFY_STATES; p += IDENTIFY_STATES - j, j++) {
        kalman->p_q30[p] = IDENTIFY_ONE_Q30;
    }
}

/* Time update (ID-10): the diagonal returns to the prior, the rest to 0. */
void kalman_predict(const identify_config_t *config, kalman_t *kalman, bool r_known)
{
    int32_t *p = kalman->p_q30;
    int32_t prior = r_known ? config->r_known_q30 : IDENTIFY_ONE_Q30;
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        const int32_t twice = 2 * config->leak[j]; /* at most 1/2: identify_check() */
        kalman->x_q27[j] -= fx_mulhi(twice, kalman->x_q27[j]);
        for (unsigned l = j; l < IDENTIFY_STATES; l++) {
            *p = fx_mulhi_add(*p, fx_add2_q31(twice, config->leak[l]), fx_sub_q31(prior, *p));
            prior = 0;
            p++;
        }
        prior = IDENTIFY_ONE_Q30;
    }
}

/* Computes P h' and returns h P h', Q60. |P_jl| <= 1 and |h| <= 1/4, hence |P h'| < 2. */
static int64_t project_covariance(const kalman_t *kalman, const jacobian_row_t *row, int32_t *ph_q30)
{
    const int32_t *const end = &row->h_q30[IDENTIFY_STATES];
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        int64_t sum = 1 << 29; /* half a bit of the result */
        const int32_t *p = &kalman->p_q30[j];
        const int32_t *h = row->h_q30;
        unsigned step = IDENTIFY_STATES - 1U;
        while (h != &row->h_q30[j]) { /* down the column to the diagonal */
            sum += (int64_t)*p * *h;
            h++;
            p += step;
            step--;
        }
        while (h != end) { /* then along the row */
            sum += (int64_t)*p * *h;
            h++;
            p++;
        }
        ph_q30[j] = (int32_t)(sum >> 30);
    }
    return dot(ph_q30, row->h_q30);
}

int32_t kalman_output(const kalman_t *kalman, const jacobian_row_t *row)
{
    return round_shift(dot(kalman->x_q27, row->h_q30), 27);
}

int64_t kalman_output_variance(const kalman_t *kalman, const jacobian_row_t *row)
{
    int32_t ph_q30[IDENTIFY_STATES];
    return project_covariance(kalman, row, ph_q30);
}

int64_t kalman_output_variance_prior(const jacobian_row_t *row)
{
    return dot(row->h_q30, row->h_q30);
}

/* 1/s of a variance s >= S_MIN_Q60, whose upper word is therefore not zero. Only the leading 16 bits of s are used,
 * rounded up: the gain is never larger than the optimum, which keeps P positive definite (ID-11). They are shifted word
 * by word, as in round_shift(): zeros is at most 25. */
static reciprocal_t reciprocal(int64_t s_q60)
{
    const int64_t limited_q60 = (s_q60 < S_MIN_Q60) ? S_MIN_Q60 : s_q60;
    const uint32_t high = (uint32_t)(limited_q60 >> 32), low = (uint32_t)limited_q60;
    const unsigned zeros = fx_leading_zeros(high);
    const uint32_t leading = high << zeros | low >> 1 >> (31U - zeros);
    const uint32_t mantissa = (leading >> (32U - DIVISOR_BITS)) + 1U;
    return (reciprocal_t){(int32_t)(UINT32_MAX / mantissa), 64U - zeros - DIVISOR_BITS};
}

/* x += k e for one state; true if it was clamped. |k e| < 128/16. */
static bool update_state(int32_t *x_q27, int32_t gain_q24, int32_t innovation_q30)
{
    const int64_t step_q54 = (int64_t)gain_q24 * innovation_q30 + (1 << 26);
    const int32_t updated = fx_add_q31(*x_q27, (int32_t)(step_q54 >> 27));
    *x_q27 = fx_clamp_q31(updated, -X_MAX_Q27, X_MAX_Q27);
    return *x_q27 != updated;
}

/* One row from the diagonal on: P -= k h P, as P is symmetric: k (P h')'. Q24 * Q30, rounded to Q30;
 * |k_j (P h')_l| <= 1. */
static int32_t *update_row(int32_t *p, int32_t gain_q24, const int32_t *ph_q30, unsigned n)
{
    const int32_t *const end = &p[n];
    do {
        const int64_t reduction = (int64_t)gain_q24 * *ph_q30 + (1 << 23);
        *p -= (int32_t)(reduction >> 24);
        ph_q30++;
        p++;
    } while (p != end);
    return p;
}

/* Measurement update (ID-9). */
uint32_t kalman_update(kalman_t *kalman, const jacobian_row_t *row, int32_t innovation_q30, int32_t noise_q30)
{
    int32_t ph_q30[IDENTIFY_STATES];
    const int64_t hph_q60 = project_covariance(kalman, row, ph_q30);
    const int64_t r_q60 = (int64_t)noise_q30 * noise_q30;
    const int64_t beyond_noise_q60 = (int64_t)innovation_q30 * innovation_q30 - r_q60;
    const int32_t limited_q30 = fx_clamp_q31(innovation_q30, -INNOVATION_MAX_Q30, INNOVATION_MAX_Q30);
    const reciprocal_t by = reciprocal(hph_q60 + r_q60);

    uint32_t report = (beyond_noise_q60 >> GATE_SHIFT > hph_q60) ? KALMAN_GATE_EXCEEDED : 0U;
    int32_t *p = kalman->p_q30;
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        /* k = P h'/s. Q30 2^30/s = Q24 after 54 - 32 - shift. */
        const int32_t gain_q24 = round_shift((int64_t)ph_q30[j] * by.inverse, by.shift - 22U);
        if (update_state(&kalman->x_q27[j], gain_q24, limited_q30)) {
            report |= KALMAN_CLAMPED;
        }
        p = update_row(p, gain_q24, &ph_q30[j], IDENTIFY_STATES - j);
    }
    return report;
}
