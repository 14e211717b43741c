/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "plant_map_impl.h"

/* A node's value, slopes and twist (PL-1). */
typedef struct {
    double f, fd, fq, fdq;
} node_t;

/* Slope at node k of the parabola through it and its neighbours; at the ends the parabola of the
 * three end nodes, or the chord of the only two. */
static double slope_at(const double *x, const double *f, int stride, int n, int k)
{
    if (n == 2) {
        return (f[stride] - f[0]) / (x[1] - x[0]);
    }
    int m = k == 0 ? 1 : (k == n - 1 ? n - 2 : k);
    double h0 = x[m] - x[m - 1], h1 = x[m + 1] - x[m];
    double s0 = (f[m * stride] - f[(m - 1) * stride]) / h0;
    double s1 = (f[(m + 1) * stride] - f[m * stride]) / h1;
    double mid = (s0 * h1 + s1 * h0) / (h0 + h1);
    return k == 0 ? 2.0 * s0 - mid : (k == n - 1 ? 2.0 * s1 - mid : mid);
}

static void fill_slopes(const map_axis_t *d, const map_axis_t *q, node_t *node)
{
    const int stride = (int)(sizeof *node / sizeof(double));
    for (int i = 0; i < d->n; i++) {
        for (int j = 0; j < q->n; j++) {
            node_t *p = &node[i * q->n + j];
            p->fd = slope_at(d->node, &node[j].f, stride * q->n, d->n, i);
            p->fq = slope_at(q->node, &node[i * q->n].f, stride, q->n, j);
        }
    }
    for (int i = 0; i < d->n; i++) {
        for (int j = 0; j < q->n; j++) {
            node[i * q->n + j].fdq = slope_at(q->node, &node[i * q->n].fd, stride, q->n, j);
        }
    }
}

/* Cubic with values a, b and slopes sa, sb (per cell) at 0 and 1, as powers. */
static void hermite(double a, double b, double sa, double sb, double p[4])
{
    p[0] = a;
    p[1] = sa;
    p[2] = 3.0 * (b - a) - 2.0 * sa - sb;
    p[3] = 2.0 * (a - b) + sa + sb;
}

static void fill_cell(const node_t *n00, const node_t *n10, double hd, double hq, int axis,
                      map_cell_t *cell)
{
    const node_t *n01 = n00 + 1, *n11 = n10 + 1;
    double row[4][4]; /* value at t = 0, value at t = 1, slope at 0, slope at 1, over u */
    hermite(n00->f, n01->f, n00->fq * hq, n01->fq * hq, row[0]);
    hermite(n10->f, n11->f, n10->fq * hq, n11->fq * hq, row[1]);
    hermite(n00->fd * hd, n01->fd * hd, n00->fdq * hd * hq, n01->fdq * hd * hq, row[2]);
    hermite(n10->fd * hd, n11->fd * hd, n10->fdq * hd * hq, n11->fdq * hd * hq, row[3]);
    for (int j = 0; j < 4; j++) {
        double p[4];
        hermite(row[0][j], row[1][j], row[2][j], row[3][j], p);
        for (int i = 0; i < 4; i++) {
            cell->c[i][j][axis] = p[i];
        }
    }
}

static void fill_cells(plant_map_t *map, node_t *node, const double *psi, int axis)
{
    const int nd = map->d.n, nq = map->q.n;
    for (int k = 0; k < nd * nq; k++) {
        node[k].f = psi[k];
    }
    fill_slopes(&map->d, &map->q, node);
    for (int i = 0; i + 1 < nd; i++) {
        for (int j = 0; j + 1 < nq; j++) {
            fill_cell(&node[i * nq + j], &node[(i + 1) * nq + j],
                      map->d.node[i + 1] - map->d.node[i], map->q.node[j + 1] - map->q.node[j],
                      axis, &map->cell[i * (nq - 1) + j]);
        }
    }
}

/* psi_d(0, i_q) is one cubic per i_q cell: taken from the map itself, extrapolated or not. */
static void fill_zero(plant_map_t *map)
{
    for (int j = 0; j + 1 < map->q.n; j++) {
        double q0 = map->q.node[j], q1 = map->q.node[j + 1], a, b, psi_q, ja[4], jb[4];
        plant_map_flux(map, 0.0, q0, &a, &psi_q, ja);
        plant_map_flux(map, 0.0, q1, &b, &psi_q, jb);
        hermite(a, b, ja[1] * (q1 - q0), jb[1] * (q1 - q0), map->zero[j]);
    }
}

/* Nodes and four points between: a cubic that dips between good nodes is found. */
static int invertible(const plant_map_t *map)
{
    const int nd = map->d.n, nq = map->q.n;
    for (int i = 0; i < 4 * (nd - 1) + 1; i++) {
        for (int j = 0; j < 4 * (nq - 1) + 1; j++) {
            int ci = i / 4 < nd - 1 ? i / 4 : nd - 2, cj = j / 4 < nq - 1 ? j / 4 : nq - 2;
            double t = (i - 4 * ci) / 4.0, u = (j - 4 * cj) / 4.0, psi_d, psi_q, jac[4];
            double id = map->d.node[ci] + t * (map->d.node[ci + 1] - map->d.node[ci]);
            double iq = map->q.node[cj] + u * (map->q.node[cj + 1] - map->q.node[cj]);
            plant_map_flux(map, id, iq, &psi_d, &psi_q, jac);
            double product = jac[0] * jac[3];
            if (!(jac[0] > 0.0 && jac[3] > 0.0 && product - jac[1] * jac[2] > 1e-6 * product)) {
                return 0;
            }
        }
    }
    return 1;
}

static int axis_ok(const double *x, int n)
{
    for (int k = 0; k < n; k++) {
        if (!isfinite(x[k]) || (k > 0 && !(x[k] > x[k - 1]))) {
            return 0;
        }
    }
    return 1;
}

static int all_finite(const double *x, int n)
{
    for (int k = 0; k < n; k++) {
        if (!isfinite(x[k])) {
            return 0;
        }
    }
    return 1;
}

static int axis_copy(map_axis_t *axis, const double *x, int n)
{
    axis->n = n;
    axis->per_step = (n - 1) / (x[n - 1] - x[0]);
    axis->node = malloc((size_t)n * sizeof *axis->node);
    if (axis->node == NULL) {
        return 0;
    }
    memcpy(axis->node, x, (size_t)n * sizeof *x);
    return 1;
}

plant_map_t *plant_map_create(const double *id_A, int nd, const double *iq_A, int nq,
                              const double *psi_d_Vs, const double *psi_q_Vs)
{
    if (nd < 2 || nq < 2 || nd > 10000 || nq > 10000 || !axis_ok(id_A, nd) || !axis_ok(iq_A, nq) ||
        !all_finite(psi_d_Vs, nd * nq) || !all_finite(psi_q_Vs, nd * nq)) {
        return NULL;
    }
    plant_map_t *map = calloc(1, sizeof *map);
    node_t *node = calloc((size_t)(nd * nq), sizeof *node);
    int ok =
        map != NULL && node != NULL && axis_copy(&map->d, id_A, nd) && axis_copy(&map->q, iq_A, nq);
    if (ok) {
        map->cell = calloc((size_t)((nd - 1) * (nq - 1)), sizeof *map->cell);
        map->zero = calloc((size_t)(nq - 1), sizeof *map->zero);
        ok = map->cell != NULL && map->zero != NULL;
    }
    if (ok) {
        fill_cells(map, node, psi_d_Vs, 0);
        fill_cells(map, node, psi_q_Vs, 1);
        fill_zero(map);
        ok = invertible(map);
    }
    free(node);
    if (!ok) {
        plant_map_destroy(map);
        return NULL;
    }
    return map;
}

void plant_map_destroy(plant_map_t *map)
{
    if (map != NULL) {
        free(map->d.node);
        free(map->q.node);
        free(map->cell);
        free(map->zero);
        free(map);
    }
}
