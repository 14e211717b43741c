/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PLANT_PLANT_MAP_IMPL_H
#define PLANT_PLANT_MAP_IMPL_H
/** What plant_map.c builds and plant_map_eval.c reads. */
#include "plant_map.h"

/* Powers of the two local coordinates t (i_d) and u (i_q): psi = sum c[i][j] t^i u^j. */
typedef struct {
    double c[4][4][2]; /* [2]: psi_d, psi_q */
} map_cell_t;

typedef struct {
    double *node; /* n strictly increasing currents */
    int n;
    double per_step; /* (n - 1)/(last - first): where to look first */
} map_axis_t;

struct plant_map {
    map_axis_t d, q;
    map_cell_t *cell;  /* (nd - 1) x (nq - 1), row-major */
    double (*zero)[4]; /* psi_d(0, i_q) per i_q cell, powers of u */
};

#endif
