/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>

#include "twin/twin_stages.h"

static const double two_pi = 6.283185307179586476925286766559;

twin_ab_t twin_clarke(twin_abc_t x)
{
    return (twin_ab_t){(2.0 * x.a - x.b - x.c) / 3.0, (x.b - x.c) / sqrt(3.0)};
}

twin_abc_t twin_clarke_inverse(twin_ab_t x)
{
    const double h = 0.5 * sqrt(3.0) * x.beta;
    return (twin_abc_t){x.alpha, h - 0.5 * x.alpha, -h - 0.5 * x.alpha};
}

twin_dq_t twin_park(twin_ab_t x, double theta_rad)
{
    const double c = cos(theta_rad);
    const double s = sin(theta_rad);
    return (twin_dq_t){c * x.alpha + s * x.beta, c * x.beta - s * x.alpha};
}

twin_ab_t twin_park_inverse(twin_dq_t x, double theta_rad)
{
    const double c = cos(theta_rad);
    const double s = sin(theta_rad);
    return (twin_ab_t){c * x.d - s * x.q, s * x.d + c * x.q};
}

double twin_wrap(double angle_rad)
{
    return angle_rad - two_pi * floor(angle_rad / two_pi + 0.5);
}

double twin_clamp(double x, double lo, double hi)
{
    return fmin(fmax(x, lo), hi);
}

bool twin_outside(const twin_grid_t *grid, double x, double y)
{
    const double u = (x - grid->x0) / grid->dx;
    const double v = (y - grid->y0) / grid->dy;
    return (u < 0.0) || (v < 0.0) || (u > grid->nx - 1) || (v > grid->ny - 1);
}

double twin_lookup(const twin_grid_t *grid, const double *values, double x, double y)
{
    const double u = twin_clamp((x - grid->x0) / grid->dx, 0.0, grid->nx - 1);
    const double v = twin_clamp((y - grid->y0) / grid->dy, 0.0, grid->ny - 1);
    const int ix = (int)fmin(floor(u), (grid->nx > 1) ? grid->nx - 2 : 0);
    const int iy = (int)fmin(floor(v), (grid->ny > 1) ? grid->ny - 2 : 0);
    const int jx = (grid->nx > 1) ? ix + 1 : ix;
    const int jy = (grid->ny > 1) ? iy + 1 : iy;
    const double a = u - ix;
    const double b = v - iy;
    const double low = (1.0 - b) * values[ix * grid->ny + iy] + b * values[ix * grid->ny + jy];
    const double high = (1.0 - b) * values[jx * grid->ny + iy] + b * values[jx * grid->ny + jy];
    return (1.0 - a) * low + a * high;
}
