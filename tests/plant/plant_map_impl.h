/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PLANT_PLANT_MAP_IMPL_H
#define PLANT_PLANT_MAP_IMPL_H
/** Data of a map: plant_map.c and plant_map_beyond.c build them, plant_map_eval.c evaluates them. */
#include <stddef.h>

#include "plant_map.h"

/* Grid lines that are added beyond each edge (PL-2). */
#define MAP_BEYOND 3

/* Polynomial in the local coordinates t (along i_d) and u (along i_q): psi = sum c[i][j] t^i u^j. */
typedef struct {
    double c[4][4][2]; /* last index: psi_d, psi_q */
} map_cell_t;

typedef struct {
    double *node;  /* n strictly increasing currents: MAP_BEYOND added, the given ones, MAP_BEYOND added */
    double *per_h; /* of each of the n - 1 cells: 1 over its width */
    int n;
    double first, last, per_step; /* of the given nodes; per_step: (count - 1)/span, for the first guess of a cell */
} map_axis_t;

struct plant_map {
    map_axis_t d, q;
    map_cell_t *cell;  /* (d.n - 1) x (q.n - 1), row-major */
    double (*zero)[4]; /* psi_d(0, i_q) per i_q cell, powers of u */
};

/* A node's value, slopes and twist (PL-1). */
enum { MAP_F = 0, MAP_BY_D = 1, MAP_BY_Q = 2, MAP_TWIST = 3 };
typedef struct {
    double v[4];
} map_node_t;

/* psi_d and psi_q at the d.n x q.n nodes while the map is built. */
typedef struct {
    map_node_t *psi[2];
} map_nodes_t;

/* Cells d0 ... d1 - 1 by q0 ... q1 - 1. */
typedef struct {
    int d0, d1, q0, q1;
} map_block_t;

/* Smallest incremental inductances of a block, and smallest ratio of det J to their product; NaN if any is NaN. */
typedef struct {
    double d, q, det;
} map_margin_t;

/* Slope at node k of the parabola through it and its neighbours; at the ends the parabola of the
 * three end nodes, or the chord of the only two. */
double plant_map_slope(const double *x, const double *f, int stride, int n, int k);

void plant_map_fill_cells(plant_map_t *map, map_nodes_t *nodes, map_block_t block);

/* Evaluated at the nodes and at three points between neighbours: between two nodes with positive slopes a cubic may
 * fall. */
map_margin_t plant_map_margin(const plant_map_t *map, map_block_t block);

/* Flux and its derivatives (as plant_map_flux()) at t, u of cell (i, j). */
void plant_map_cell_flux(const plant_map_t *map, int i, int j, double t, double u, double psi[2], double jac[4]);

/* Adds nodes and cells beyond the four edges; least: margins of the inside. 0: no extrapolation keeps the required
 * share of them. */
int plant_map_extrapolate(plant_map_t *map, map_nodes_t *nodes, map_margin_t least);

#endif
