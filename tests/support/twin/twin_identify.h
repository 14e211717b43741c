/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TWIN_IDENTIFY_H
#define TWIN_IDENTIFY_H
/** The robust identification in SI doubles, from docs/theory/identification.md.
 * Units    SI; the parameters x and their covariance P in standard deviations of the priors
 * Context  tests and simulation on a host */
#include "twin/twin_stages.h"

enum { TWIN_STATES = 7 };

typedef struct {
    twin_dq_t i, u, psi;
    double theta;
} twin_end_t;

/* The N periods of one step: sums over the samples 1 ... N, and the samples at both ends. */
typedef struct {
    twin_end_t first, last;
    twin_dq_t sum_i, sum_u;
    int count, limited;
    bool acting;
} twin_window_t;

/* Adds one period; true when the window is complete. */
bool twin_window(const motor_si_t *motor, twin_window_t *window, const twin_end_t *sample, bool acting, bool limited);

typedef struct {
    twin_dq_t i, u, rate, i_m;
    double omega, iron; /* iron: A/Vs */
    int limited;
    bool valid;
} twin_point_t;

/* A/Vs (ID-4). */
double twin_iron_admittance(const motor_si_t *motor, double omega);
twin_point_t twin_point(const motor_si_t *motor, const twin_window_t *window, double omega_tracked);

typedef struct {
    twin_dq_t y, psi, angle_flux, iron_psi, iron_i;
    double d[TWIN_STATES], q[TWIN_STATES], torque[TWIN_STATES]; /* per prior sigma; torque in Vs A */
    double slope, l_d, l_qq;
    bool current;
} twin_model_t;

twin_model_t twin_model(const motor_si_t *motor, const twin_point_t *point, double r_prior);

typedef struct {
    double x[TWIN_STATES], p[TWIN_STATES][TWIN_STATES];
} twin_kalman_t;

void twin_kalman_reset(twin_kalman_t *kalman);
/* Scalar measurement; true if the innovation exceeds its gate or a state reaches its limit. */
bool twin_kalman_update(twin_kalman_t *kalman, const double h[TWIN_STATES], double e, double r);
void twin_kalman_predict(const motor_si_t *motor, twin_kalman_t *kalman, bool r_known);

typedef struct {
    twin_kalman_t kalman;
    double mean_d[TWIN_STATES], mean_q[TWIN_STATES], noise;
    twin_dq_t e, local;
    double r_prior, mismatch_share, confidence;
    double torque, psi_delta; /* N m, Vs */
    int steps;
    bool update_valid, mismatch_d, r_known, torque_certain;
} twin_identify_t;

void twin_identify_reset(const motor_si_t *motor, twin_identify_t *state);
/* winding_C: NaN without a sensor. */
void twin_identify(const motor_si_t *motor, twin_identify_t *state, const twin_point_t *point, double winding_C,
                   bool enabled);

#endif
