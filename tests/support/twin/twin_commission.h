/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TWIN_COMMISSION_H
#define TWIN_COMMISSION_H
/** The inverter's voltage error from currents along the magnet at standstill, from docs/theory/commissioning.md.
 * Units    any consistent ones
 * Context  tests on a host */

enum { TWIN_COMMISSION_LEVELS = 10 };

typedef struct {
    double knot[TWIN_COMMISSION_LEVELS], v[TWIN_COMMISSION_LEVELS];
    double r, level;
} twin_curve_t;

/* Magnitudes of the phases' cosines, the largest first. */
void twin_cosines(double theta_rad, double cosine[3]);
twin_curve_t twin_commission(const double *i, const double *u, const double cosine[3]);
double twin_knee(const twin_curve_t *curve);

#endif
