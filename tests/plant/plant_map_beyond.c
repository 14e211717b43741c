/* SPDX-License-Identifier: Apache-2.0 */
/* Extrapolation of the map beyond its edges (PL-2): three more grid lines on each side, then constant slopes. */
#include <math.h>

#include "plant_map_impl.h"

/* One edge: n is the flux component of the axis across the edge, t the other one (N and T in PL-2). */
typedef struct {
    map_node_t *n, *t;     /* first node of the edge */
    int count, along, out; /* nodes of the edge; steps in nodes along it and outwards */
    int by_n, by_t;        /* index of the slope across and along the edge */
    double sign;           /* +1: the current increases outwards */
    const double *x;       /* the currents along the edge */
    double *line;          /* current of the edge's grid line; outward by line[sign * k] */
    double reach_A;        /* largest current of the map on the axis across the edge */
} edge_t;

/* Distances within which the edge's slopes change: own slope near_A, cross slope far_A; cross: kappa of (PL-2). */
typedef struct {
    double near_A, far_A, cross;
} fade_t;

/* The functions of (PL-2) and their derivatives (_x) or integrals (_int) at the distance x. */
typedef struct {
    double x, own, own_x, skew, skew_int, cross, cross_x, cross_int;
} shape_t;

static shape_t shape_at(const fade_t *f, double x)
{
    const double s = x < f->near_A ? x / f->near_A : 1.0, r = 1.0 - s, w = x / f->far_A;
    shape_t k = {.x = x,
                 .own = f->near_A * s * r * r,
                 .own_x = r * (1.0 - 3.0 * s),
                 .skew = r * r,
                 .skew_int = f->near_A / 3.0 * (1.0 - r * r * r)};
    if (w <= 0.5) {
        k.cross = 1.0 - 2.0 * w * w;
        k.cross_x = -4.0 * w / f->far_A;
        k.cross_int = x * (1.0 - 2.0 / 3.0 * w * w);
    } else {
        k.cross = 2.0 * (1.0 - w) * (1.0 - w);
        k.cross_x = -4.0 * (1.0 - w) / f->far_A;
        k.cross_int = f->far_A * (0.5 - 2.0 / 3.0 * (1.0 - w) * (1.0 - w) * (1.0 - w));
    }
    return k;
}

/* Common to the whole edge: the constant slope at large distance and the flux that N tends to. */
typedef struct {
    double slope_H, level_Vs;
} asymptote_t;

static asymptote_t asymptote_of(const edge_t *e)
{
    double sum = 0.0, max = 0.0, low = INFINITY, high = -INFINITY;
    for (int j = 0; j < e->count; j++) {
        const double *v = e->n[(ptrdiff_t)j * e->along].v;
        sum += v[e->by_n];
        max = fmax(max, v[e->by_n]);
        low = fmin(low, v[MAP_F]);
        high = fmax(high, v[MAP_F]);
    }
    return (asymptote_t){fmax(sum / e->count, 0.5 * max), 0.5 * (low + high)};
}

static void set_outer_node(const edge_t *e, int j, const asymptote_t *far, const fade_t *fade, shape_t k, int out_by)
{
    const int at = j * e->along, to = at + out_by * e->out, by_n = e->by_n, by_t = e->by_t;
    const int stride = (int)(sizeof *e->n / sizeof(double)) * e->along;
    const double *n = e->n[at].v, *t = e->t[at].v, sign = e->sign;
    const double c = fade->cross * n[by_t];
    const double c_t = fade->cross * plant_map_slope(e->x, &e->n[0].v[by_t], stride, e->count, j);
    const double level = fade->cross * (n[MAP_F] - far->level_Vs), slope_excess = n[by_n] - far->slope_H;
    double *to_n = e->n[to].v, *to_t = e->t[to].v;

    to_n[MAP_F] = n[MAP_F] + (k.cross - 1.0) * level + sign * (k.own * slope_excess + k.x * far->slope_H);
    to_n[by_n] = sign * k.cross_x * level + k.own_x * slope_excess + far->slope_H;
    to_n[by_t] = n[by_t] + (k.cross - 1.0) * c + sign * k.own * n[MAP_TWIST];
    to_n[MAP_TWIST] = sign * k.cross_x * c + k.own_x * n[MAP_TWIST];

    to_t[MAP_F] = t[MAP_F] + sign * (k.skew_int * (t[by_n] - c) + k.cross_int * c);
    to_t[by_n] = k.skew * (t[by_n] - c) + k.cross * c;
    to_t[by_t] = t[by_t] + sign * (k.skew_int * (t[MAP_TWIST] - c_t) + k.cross_int * c_t);
    to_t[MAP_TWIST] = k.skew * (t[MAP_TWIST] - c_t) + k.cross * c_t;
}

static void extend(const edge_t *e, const fade_t *fade)
{
    const double out_A[MAP_BEYOND] = {fade->near_A, 0.5 * fade->far_A, fade->far_A};
    const asymptote_t far = asymptote_of(e);
    for (int k = 0; k < MAP_BEYOND; k++) {
        const shape_t shape = shape_at(fade, out_A[k]);
        e->line[(ptrdiff_t)(k + 1) * (int)e->sign] = *e->line + e->sign * out_A[k];
        for (int j = 0; j < e->count; j++) {
            set_outer_node(e, j, &far, fade, shape, k + 1);
        }
    }
}

/* Tries the largest cross part and the longest distance first and takes the first that keeps the given margins. With
 * cross = 0 and near_A towards 0, J is that of the edge with a growing share of the far slope, which always passes. */
static int extend_within(plant_map_t *map, map_nodes_t *nodes, const edge_t *e, map_block_t block, map_margin_t least)
{
    for (int part = 4; part >= 0; part--) {
        for (int halve = 0; halve < (part > 0 ? 4 : 20); halve++) {
            const fade_t fade = {.near_A = ldexp(0.4 * e->reach_A, -halve), .far_A = e->reach_A, .cross = 0.25 * part};
            extend(e, &fade);
            plant_map_fill_cells(map, nodes, block);
            const map_margin_t got = plant_map_margin(map, block);
            if (got.d > least.d && got.q > least.q && got.det > least.det) {
                return 1;
            }
        }
    }
    return 0;
}

static map_margin_t scaled(map_margin_t m, double part)
{
    return (map_margin_t){part * m.d, part * m.q, part * m.det};
}

static int extend_d(plant_map_t *map, map_nodes_t *nodes, int up, map_margin_t least)
{
    const int b = MAP_BEYOND, row = map->q.n, d_hi = map->d.n - 1 - b, q_hi = map->q.n - 1 - b;
    double *d = map->d.node;
    const int i = up ? d_hi : b, from = i * row + b;
    const edge_t e = {.n = &nodes->psi[0][from],
                      .t = &nodes->psi[1][from],
                      .count = q_hi - b + 1,
                      .along = 1,
                      .out = up ? row : -row,
                      .by_n = MAP_BY_D,
                      .by_t = MAP_BY_Q,
                      .sign = up ? 1.0 : -1.0,
                      .x = &map->q.node[b],
                      .line = &d[i],
                      .reach_A = fmax(fabs(d[b]), fabs(d[d_hi]))};
    const map_block_t strip = {up ? d_hi : 0, up ? d_hi + b : b, b, q_hi};
    return extend_within(map, nodes, &e, strip, scaled(least, 0.5));
}

/* Includes the corners, therefore called after extend_d(). */
static int extend_q(plant_map_t *map, map_nodes_t *nodes, int up, map_margin_t least)
{
    const int b = MAP_BEYOND, row = map->q.n, d_hi = map->d.n - 1 - b, q_hi = map->q.n - 1 - b;
    double *q = map->q.node;
    const int j = up ? q_hi : b;
    const edge_t e = {.n = &nodes->psi[1][j],
                      .t = &nodes->psi[0][j],
                      .count = map->d.n,
                      .along = row,
                      .out = up ? 1 : -1,
                      .by_n = MAP_BY_Q,
                      .by_t = MAP_BY_D,
                      .sign = up ? 1.0 : -1.0,
                      .x = map->d.node,
                      .line = &q[j],
                      .reach_A = fmax(fabs(q[b]), fabs(q[q_hi]))};
    const map_block_t strip = {0, d_hi + b, up ? q_hi : 0, up ? q_hi + b : b};
    return extend_within(map, nodes, &e, strip, scaled(least, 0.25));
}

int plant_map_extrapolate(plant_map_t *map, map_nodes_t *nodes, map_margin_t least)
{
    return extend_d(map, nodes, 0, least) && extend_d(map, nodes, 1, least) && extend_q(map, nodes, 0, least) &&
           extend_q(map, nodes, 1, least);
}
