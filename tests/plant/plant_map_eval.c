/* SPDX-License-Identifier: Apache-2.0 */
#include "flux_solve.h"
#include "plant_map_impl.h"

/* Position of a current on an axis: cell k, local coordinate t limited to 0 ... 1, and the distance beyond the last
 * grid line in cells, 0 inside. */
typedef struct {
    int k;
    double t, beyond, per_h;
} grid_position_t;

static inline grid_position_t locate(const map_axis_t *axis, double x)
{
    const double *node = axis->node;
    double guess = (x - axis->first) * axis->per_step + MAP_BEYOND;
    const int top = axis->n - 2 - (x > axis->last ? 0 : MAP_BEYOND); /* the edge itself counts as inside */
    int k = guess > 0.0 ? (guess < top ? (int)guess : top) : 0;      /* NaN: 0 */
    while (k > 0 && x < node[k]) {
        k--;
    }
    while (k < top && x >= node[k + 1]) {
        k++;
    }
    double per_h = axis->per_h[k];
    double t = (x - node[k]) * per_h;
    double limited = t < 0.0 ? 0.0 : (t > 1.0 ? 1.0 : t);
    return (grid_position_t){.k = k, .t = limited, .beyond = t - limited, .per_h = per_h};
}

static inline void evaluate_cell(const plant_map_t *map, grid_position_t d, grid_position_t q, double psi[2],
                                 double jac[4])
{
    const map_cell_t *cell = &map->cell[d.k * (map->q.n - 1) + q.k];
    const double t = d.t, u = q.t;
    for (int a = 0; a < 2; a++) {
        double p[4], pu[4];
        for (int i = 0; i < 4; i++) {
            double c1 = cell->c[i][1][a], c2 = cell->c[i][2][a], c3 = cell->c[i][3][a];
            p[i] = cell->c[i][0][a] + u * (c1 + u * (c2 + u * c3));
            pu[i] = c1 + u * (2.0 * c2 + u * 3.0 * c3);
        }
        double f = p[0] + t * (p[1] + t * (p[2] + t * p[3]));
        double ft = p[1] + t * (2.0 * p[2] + t * 3.0 * p[3]);
        double fu = pu[0] + t * (pu[1] + t * (pu[2] + t * pu[3]));
        /* Beyond the last added grid line: the tangent; the twist is zero there (PL-2). */
        psi[a] = f + d.beyond * ft + q.beyond * fu;
        jac[(ptrdiff_t)2 * a] = ft * d.per_h;
        jac[(ptrdiff_t)2 * a + 1] = fu * q.per_h;
    }
}

void plant_map_flux(const plant_map_t *map, double id_A, double iq_A, double *psi_d_Vs, double *psi_q_Vs, double jac[4])
{
    double psi[2], unused[4];
    evaluate_cell(map, locate(&map->d, id_A), locate(&map->q, iq_A), psi, jac != NULL ? jac : unused);
    *psi_d_Vs = psi[0];
    *psi_q_Vs = psi[1];
}

void plant_map_cell_flux(const plant_map_t *map, int i, int j, double t, double u, double psi[2], double jac[4])
{
    const double *d = &map->d.node[i], *q = &map->q.node[j];
    evaluate_cell(map, (grid_position_t){.k = i, .t = t, .per_h = 1.0 / (d[1] - d[0])},
                  (grid_position_t){.k = j, .t = u, .per_h = 1.0 / (q[1] - q[0])}, psi, jac);
}

static inline double evaluate_axis(const plant_map_t *map, grid_position_t q, double *slope_H)
{
    const double *c = map->zero[q.k], u = q.t;
    double slope = c[1] + u * (2.0 * c[2] + u * 3.0 * c[3]);
    *slope_H = slope * q.per_h;
    return c[0] + u * (c[1] + u * (c[2] + u * c[3])) + q.beyond * slope;
}

double plant_map_axis_flux(const plant_map_t *map, double iq_A, double *slope_H)
{
    return evaluate_axis(map, locate(&map->q, iq_A), slope_H);
}

double plant_map_both(const plant_map_t *map, const double i[2], double psi[2], double jac[4], double *slope_H)
{
    const grid_position_t q = locate(&map->q, i[1]);
    evaluate_cell(map, locate(&map->d, i[0]), q, psi, jac);
    return evaluate_axis(map, q, slope_H);
}

static void map_flux(const void *map, const double i[2], double psi[2], double jac[4])
{
    plant_map_flux(map, i[0], i[1], &psi[0], &psi[1], jac);
}

int plant_map_invert(const plant_map_t *map, double psi_d_Vs, double psi_q_Vs, double *id_A, double *iq_A)
{
    const double psi[2] = {psi_d_Vs, psi_q_Vs};
    double i[2] = {*id_A, *iq_A}, jac[4];
    int failed = flux_solve(map_flux, map, psi, i, jac);
    *id_A = i[0];
    *iq_A = i[1];
    return failed;
}
