/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "plant_map_impl.h"

/* Slope at node k of the parabola through it and its neighbours; at the ends the parabola of the
 * three end nodes, or the chord of the only two. */
double plant_map_slope(const double *x, const double *f, int stride, int n, int k)
{
    if (n == 2) {
        return (f[stride] - f[0]) / (x[1] - x[0]);
    }
    int m = k == 0 ? 1 : (k == n - 1 ? n - 2 : k);
    const ptrdiff_t at = (ptrdiff_t)m * stride;
    double h0 = x[m] - x[m - 1], h1 = x[m + 1] - x[m];
    double s0 = (f[at] - f[at - stride]) / h0;
    double s1 = (f[at + stride] - f[at]) / h1;
    double mid = (s0 * h1 + s1 * h0) / (h0 + h1);
    return k == 0 ? 2.0 * s0 - mid : (k == n - 1 ? 2.0 * s1 - mid : mid);
}

/* Values, slopes and twists at the given nodes; their indices follow those of the MAP_BEYOND added nodes. */
static void fill_inside(const plant_map_t *map, map_node_t *node, const double *psi)
{
    const int edge = MAP_BEYOND, row = map->q.n, nd = map->d.n - 2 * edge, nq = row - 2 * edge;
    const double *d = &map->d.node[edge], *q = &map->q.node[edge];
    const int stride = (int)(sizeof *node / sizeof(double));
    map_node_t *first = &node[edge * row + edge];
    for (int k = 0; k < nd * nq; k++) {
        first[k / nq * row + k % nq].v[MAP_F] = psi[k];
    }
    for (int k = 0; k < nd * nq; k++) {
        const int i = k / nq, j = k % nq;
        double *v = first[i * row + j].v;
        v[MAP_BY_D] = plant_map_slope(d, &first[j].v[MAP_F], stride * row, nd, i);
        v[MAP_BY_Q] = plant_map_slope(q, &first[(ptrdiff_t)i * row].v[MAP_F], stride, nq, j);
    }
    for (int k = 0; k < nd * nq; k++) {
        const int i = k / nq, j = k % nq;
        first[i * row + j].v[MAP_TWIST] = plant_map_slope(q, &first[(ptrdiff_t)i * row].v[MAP_BY_D], stride, nq, j);
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

static void fill_cell(const map_node_t *n00, const map_node_t *n10, double hd, double hq, int axis, map_cell_t *cell)
{
    const double *v00 = n00->v, *v01 = n00[1].v, *v10 = n10->v, *v11 = n10[1].v;
    double row[4][4]; /* value at t = 0, value at t = 1, slope at 0, slope at 1, over u */
    hermite(v00[MAP_F], v01[MAP_F], v00[MAP_BY_Q] * hq, v01[MAP_BY_Q] * hq, row[0]);
    hermite(v10[MAP_F], v11[MAP_F], v10[MAP_BY_Q] * hq, v11[MAP_BY_Q] * hq, row[1]);
    hermite(v00[MAP_BY_D] * hd, v01[MAP_BY_D] * hd, v00[MAP_TWIST] * hd * hq, v01[MAP_TWIST] * hd * hq, row[2]);
    hermite(v10[MAP_BY_D] * hd, v11[MAP_BY_D] * hd, v10[MAP_TWIST] * hd * hq, v11[MAP_TWIST] * hd * hq, row[3]);
    for (int j = 0; j < 4; j++) {
        double p[4];
        hermite(row[0][j], row[1][j], row[2][j], row[3][j], p);
        for (int i = 0; i < 4; i++) {
            cell->c[i][j][axis] = p[i];
        }
    }
}

void plant_map_fill_cells(plant_map_t *map, map_nodes_t *nodes, map_block_t block)
{
    const double *d = map->d.node, *q = map->q.node;
    const int row = map->q.n;
    for (int i = block.d0; i < block.d1; i++) {
        for (int j = block.q0; j < block.q1; j++) {
            for (int axis = 0; axis < 2; axis++) {
                const map_node_t *node = &nodes->psi[axis][i * row + j];
                fill_cell(node, node + row, d[i + 1] - d[i], q[j + 1] - q[j], axis, &map->cell[i * (row - 1) + j]);
            }
        }
    }
}

/* psi_d(0, i_q) is one cubic per i_q cell, computed from the map, also where i_d = 0 is outside its grid. */
static void fill_zero(plant_map_t *map)
{
    for (int j = 0; j + 1 < map->q.n; j++) {
        double q0 = map->q.node[j], q1 = map->q.node[j + 1], a, b, psi_q, ja[4], jb[4];
        plant_map_flux(map, 0.0, q0, &a, &psi_q, ja);
        plant_map_flux(map, 0.0, q1, &b, &psi_q, jb);
        hermite(a, b, ja[1] * (q1 - q0), jb[1] * (q1 - q0), map->zero[j]);
    }
}

map_margin_t plant_map_margin(const plant_map_t *map, map_block_t block)
{
    map_margin_t least = {INFINITY, INFINITY, INFINITY};
    for (int i = 4 * block.d0; i <= 4 * block.d1; i++) {
        for (int j = 4 * block.q0; j <= 4 * block.q1; j++) {
            const int ci = i / 4 < block.d1 ? i / 4 : block.d1 - 1;
            const int cj = j / 4 < block.q1 ? j / 4 : block.q1 - 1;
            double psi[2], jac[4];
            plant_map_cell_flux(map, ci, cj, (i - 4 * ci) / 4.0, (j - 4 * cj) / 4.0, psi, jac);
            const double product = jac[0] * jac[3];
            least.d = jac[0] > least.d ? least.d : jac[0]; /* keeps a NaN */
            least.q = jac[3] > least.q ? least.q : jac[3];
            const double det = (product - jac[1] * jac[2]) / product;
            least.det = det > least.det ? least.det : det;
        }
    }
    return least;
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

/* Copies the given nodes and leaves space for MAP_BEYOND nodes on either side. */
static int axis_copy(map_axis_t *axis, const double *x, int n)
{
    axis->n = n + 2 * MAP_BEYOND;
    axis->first = x[0];
    axis->last = x[n - 1];
    axis->per_step = (n - 1) / (x[n - 1] - x[0]);
    axis->node = calloc((size_t)axis->n, sizeof *axis->node);
    axis->per_h = calloc((size_t)axis->n, sizeof *axis->per_h);
    if (axis->node == NULL || axis->per_h == NULL) {
        return 0;
    }
    memcpy(&axis->node[MAP_BEYOND], x, (size_t)n * sizeof *x);
    return 1;
}

/* Once every node is known. */
static void axis_cells(map_axis_t *axis)
{
    for (int k = 0; k + 1 < axis->n; k++) {
        axis->per_h[k] = 1.0 / (axis->node[k + 1] - axis->node[k]);
    }
}

/* Cells and nodes; 0 if an allocation fails. */
static int allocate(plant_map_t *map, map_nodes_t *nodes, int nd, int nq)
{
    const size_t ed = (size_t)nd + (size_t)2 * MAP_BEYOND, eq = (size_t)nq + (size_t)2 * MAP_BEYOND;
    map->cell = calloc((ed - 1) * (eq - 1), sizeof *map->cell);
    map->zero = calloc(eq - 1, sizeof *map->zero);
    nodes->psi[0] = calloc(ed * eq, sizeof *nodes->psi[0]);
    nodes->psi[1] = calloc(ed * eq, sizeof *nodes->psi[1]);
    return map->cell != NULL && map->zero != NULL && nodes->psi[0] != NULL && nodes->psi[1] != NULL;
}

/* 0: the map cannot be inverted. */
static int fill(plant_map_t *map, map_nodes_t *nodes, const double *psi_d_Vs, const double *psi_q_Vs)
{
    const int edge = MAP_BEYOND;
    const map_block_t inside = {edge, map->d.n - 1 - edge, edge, map->q.n - 1 - edge};
    fill_inside(map, nodes->psi[0], psi_d_Vs);
    fill_inside(map, nodes->psi[1], psi_q_Vs);
    plant_map_fill_cells(map, nodes, inside);
    const map_margin_t least = plant_map_margin(map, inside);
    if (!(least.d > 0.0 && least.q > 0.0 && least.det > 1e-6) || !plant_map_extrapolate(map, nodes, least)) {
        return 0;
    }
    axis_cells(&map->d);
    axis_cells(&map->q);
    fill_zero(map);
    return 1;
}

plant_map_t *plant_map_create(const double *id_A, int nd, const double *iq_A, int nq, const double *psi_d_Vs,
                              const double *psi_q_Vs)
{
    if (nd < 2 || nq < 2 || nd > 10000 || nq > 10000 || !axis_ok(id_A, nd) || !axis_ok(iq_A, nq) ||
        !all_finite(psi_d_Vs, nd * nq) || !all_finite(psi_q_Vs, nd * nq)) {
        return NULL;
    }
    map_nodes_t nodes = {{NULL, NULL}};
    plant_map_t *map = calloc(1, sizeof *map);
    int ok = map != NULL && axis_copy(&map->d, id_A, nd) && axis_copy(&map->q, iq_A, nq) &&
             allocate(map, &nodes, nd, nq) && fill(map, &nodes, psi_d_Vs, psi_q_Vs);
    free(nodes.psi[0]);
    free(nodes.psi[1]);
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
        free(map->d.per_h);
        free(map->q.per_h);
        free(map->cell);
        free(map->zero);
        free(map);
    }
}
