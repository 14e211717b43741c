/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PLANT_PLANT_MAP_IMPL_H
#define PLANT_PLANT_MAP_IMPL_H
/** What plant_map.c and plant_map_beyond.c build and plant_map_eval.c reads. */
#include <stddef.h>

#include "plant_map.h"

/* Grid lines that are added beyond each edge (PL-2). */
#define MAP_BEYOND 3

/* Powers of the two local coordinates t (i_d) and u (i_q): psi = sum c[i][j] t^i u^j. */
typedef struct {
    double c[4][4][2]; /* [2]: psi_d, psi_q */
} map_cell_t;

typedef struct {
    double *node; /* n strictly increasing currents: MAP_BEYOND, those given, MAP_BEYOND */
    int n;
    double first, last, per_step; /* of those given; (count - 1)/span: where the search begins */
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

/* The least incremental inductances and det J over their product in a block; NaN when any is. */
typedef struct {
    double d, q, det;
} map_margin_t;

/* Slope at node k of the parabola through it and its neighbours; at the ends the parabola of the
 * three end nodes, or the chord of the only two. */
double plant_map_slope(const double *x, const double *f, int stride, int n, int k);

void plant_map_fill_cells(plant_map_t *map, map_nodes_t *nodes, map_block_t block);

/* At the nodes and at three points between: a cubic that dips between good nodes is found. */
map_margin_t plant_map_margin(const plant_map_t *map, map_block_t block);

/* Flux and its derivatives (as plant_map_flux()) at t, u of cell (i, j). */
void plant_map_cell_flux(const plant_map_t *map, int i, int j, double t, double u, double psi[2], double jac[4]);

/* Nodes and cells beyond the four edges; least: of the inside. 0 when they cannot be inverted. */
int plant_map_go_beyond(plant_map_t *map, map_nodes_t *nodes, map_margin_t least);

#endif
