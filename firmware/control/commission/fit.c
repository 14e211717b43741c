/* SPDX-License-Identifier: Apache-2.0 */
#include "control/commission/fit.h"

#include "fx/codegen.h"
#include "fx/div.h"

#define UPPER (COMMISSION_LEVELS / 2U)
#define PER_UPPER Q31(0.2) /* 1/UPPER */
#define ITERATIONS 20      /* each at least halves the error */

static FX_NOT_INLINED int32_t mul_q30(int32_t a, int32_t b)
{
    return (int32_t)(((int64_t)a * b + (1 << 29)) >> 30);
}

static int32_t mean_upper(const int32_t *x)
{
    int32_t sum = 0;
    for (unsigned k = UPPER; k < COMMISSION_LEVELS; k++) {
        sum += fx_mul_q31(x[k], PER_UPPER);
    }
    return sum;
}

/* Least-squares slope of u over i, Q30; 0 if it is not positive. The Q60 sums are shifted until a division fits. */
static int32_t slope(const commission_data_t *data)
{
    const int32_t i_mean = mean_upper(data->i);
    const int32_t u_mean = mean_upper(data->u);
    int64_t iu = 0;
    int64_t ii = 0;
    for (unsigned k = UPPER; k < COMMISSION_LEVELS; k++) {
        const int64_t di = fx_sub_q31(data->i[k], i_mean);
        iu += di * fx_sub_q31(data->u[k], u_mean);
        ii += di * di;
    }
    while (ii > INT32_MAX) {
        ii >>= 1;
        iu >>= 1;
    }
    return (iu > 0 && iu < ii) ? fx_div_q31((int32_t)iu, (int32_t)ii) >> 1 : 0;
}

/* Linear between the knots, constant below the first and above the last known one. */
static int32_t interpolate(const commission_curve_t *curve, unsigned last, int32_t i)
{
    unsigned k = 0;
    while (k < last && curve->knot[k + 1U] < i) {
        k++;
    }
    if (k >= last || i <= curve->knot[k]) {
        return curve->v[k];
    }
    const int32_t weight = fx_div_q31(i - curve->knot[k], curve->knot[k + 1U] - curve->knot[k]);
    return curve->v[k] + fx_mul_q31(weight, curve->v[k + 1U] - curve->v[k]);
}

/* Solves (CM-3), which holds v_k on both sides, by adding half of the residual in each iteration (CM-4). */
static void solve_knot(const commission_data_t *data, commission_curve_t *curve, unsigned k, int32_t y)
{
    curve->v[k] = (k > 0U) ? curve->v[k - 1U] : 0;
    for (int n = 0; n < ITERATIONS; n++) {
        int32_t residual = y + (y >> 1);
        for (unsigned x = 0; x < 3U; x++) {
            const int32_t share = data->cosine[x] * 32768;
            residual -= mul_q30(share, interpolate(curve, k, mul_q30(share, data->i[k])));
        }
        curve->v[k] += residual >> 1;
    }
}

/* An equation that contains both v(I) and v(I/2) leaves errors of alternating sign, which this mean over the knots at
 * half and twice the current removes (CM-7). */
static void smooth(commission_curve_t *curve)
{
    const commission_curve_t before = *curve;
    const int32_t *v = before.v;
    for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
        const int32_t lower = (k >= 2U) ? v[k - 2U] : v[k + 2U];
        const int32_t upper = (k + 2U < COMMISSION_LEVELS) ? v[k + 2U] : v[k - 2U];
        curve->v[k] = (v[k] >> 1) + (lower >> 2) + (upper >> 2);
    }
}

bool commission_fit(const commission_data_t *data, commission_curve_t *curve)
{
    int32_t last = 0;
    for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
        const int32_t knot = mul_q30(data->cosine[0] * 32768, data->i[k]);
        if (knot <= last) {
            return false;
        }
        curve->knot[k] = knot;
        last = knot;
    }
    curve->r = slope(data);
    for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
        solve_knot(data, curve, k, fx_sub_q31(data->u[k], mul_q30(curve->r, data->i[k])));
    }
    smooth(curve);
    curve->level = mean_upper(curve->v);
    return curve->r > 0;
}

int32_t commission_knee(const commission_curve_t *curve)
{
    if (curve->level <= 0) {
        return 0;
    }
    /* Area between the level and the curve, which is taken as constant below the first knot. */
    int64_t area = (int64_t)curve->knot[0] * fx_sub_q31(curve->level, curve->v[0]);
    for (unsigned k = 1; k < UPPER; k++) {
        const int32_t below = fx_sub_q31(curve->level, (curve->v[k - 1U] >> 1) + (curve->v[k] >> 1));
        area += (int64_t)(curve->knot[k] - curve->knot[k - 1U]) * below;
    }
    const int32_t twice_area = fx_sat_q31(area >> 29); /* Q60 to Q30, times two */
    if (twice_area <= 0) {
        return 0;
    }
    return fx_div_q31(twice_area, curve->level) >> 1; /* saturates: a knee is at most 1 */
}
