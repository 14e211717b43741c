/* SPDX-License-Identifier: Apache-2.0 */
#include "twin/twin_commission.h"

#include <math.h>

enum { N = TWIN_COMMISSION_LEVELS, HALF = N / 2 };

void twin_cosines(double theta_rad, double cosine[3])
{
    const double third = 2.0943951023931953;
    const double c[3] = {fabs(cos(theta_rad)), fabs(cos(theta_rad - third)), fabs(cos(theta_rad + third))};
    const double sum = c[0] + c[1] + c[2];
    cosine[0] = fmax(c[0], fmax(c[1], c[2]));
    cosine[2] = fmin(c[0], fmin(c[1], c[2]));
    cosine[1] = sum - cosine[0] - cosine[2];
}

static double mean_upper(const double *x)
{
    double sum = 0.0;
    for (int k = HALF; k < N; k++) {
        sum += x[k];
    }
    return sum / (N - HALF);
}

/* (CM-2) */
static double slope(const double *i, const double *u)
{
    const double i_mean = mean_upper(i), u_mean = mean_upper(u);
    double iu = 0.0, ii = 0.0;
    for (int k = HALF; k < N; k++) {
        iu += (i[k] - i_mean) * (u[k] - u_mean);
        ii += (i[k] - i_mean) * (i[k] - i_mean);
    }
    return iu / ii;
}

static double line(const twin_curve_t *curve, int last, double i)
{
    if (i <= curve->knot[0]) {
        return curve->v[0];
    }
    for (int k = 0; k < last; k++) {
        if (i <= curve->knot[k + 1]) {
            return curve->v[k] +
                   (curve->v[k + 1] - curve->v[k]) * (i - curve->knot[k]) / (curve->knot[k + 1] - curve->knot[k]);
        }
    }
    return curve->v[last];
}

static double phase_error_sum(twin_curve_t *curve, int k, double v, const double c[3], double i)
{
    double sum = 0.0;
    curve->v[k] = v;
    for (int x = 0; x < 3; x++) {
        sum += c[x] * line(curve, k, c[x] * i);
    }
    return sum;
}

/* (CM-7) */
static void smooth(double *v)
{
    double w[N];
    for (int k = 0; k < N; k++) {
        const int below = k - 2 < 0 ? k + 2 : k - 2, above = k + 2 < N ? k + 2 : k - 2;
        w[k] = 0.5 * v[k] + 0.25 * (v[below] + v[above]);
    }
    for (int k = 0; k < N; k++) {
        v[k] = w[k];
    }
}

/* (CM-3) is linear in the one unknown: two trial values solve it. */
twin_curve_t twin_commission(const double *i, const double *u, const double cosine[3])
{
    twin_curve_t curve = {.r = slope(i, u)};
    for (int k = 0; k < N; k++) {
        curve.knot[k] = cosine[0] * i[k];
        const double at_zero = phase_error_sum(&curve, k, 0.0, cosine, i[k]);
        const double per_volt = phase_error_sum(&curve, k, 1.0, cosine, i[k]) - at_zero;
        curve.v[k] = (1.5 * (u[k] - curve.r * i[k]) - at_zero) / per_volt;
    }
    smooth(curve.v);
    curve.level = mean_upper(curve.v);
    return curve;
}

/* (CM-5) */
double twin_knee(const twin_curve_t *curve)
{
    double area = curve->knot[0] * (curve->level - curve->v[0]);
    for (int k = 1; k < HALF; k++) {
        area += (curve->knot[k] - curve->knot[k - 1]) * (curve->level - 0.5 * (curve->v[k] + curve->v[k - 1]));
    }
    return fmax(2.0 * area / curve->level, 0.0);
}
