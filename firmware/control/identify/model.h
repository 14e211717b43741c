/* SPDX-License-Identifier: Apache-2.0 */
#ifndef IDENTIFY_MODEL_H
#define IDENTIFY_MODEL_H
/** Voltage and torque that the tables predict at an operating point, and their derivatives by the states.
 *   residual  y = u - R i - w J psi(i_m) - d psi/dt     h = d(voltage)/d(state), per sigma, both axes
 *   torque    t = psi_d i_mq - psi_q i_md               h_t = dt/d(state), per sigma
 *   mean over a period, in which the flux moves along a chord:   t - theta^2/12 (t + psi_d psi_q (1/l_qq - 1/l_d))
 * Source   docs/theory/identification.md (ID-5) ... (ID-8), (ID-20)
 * Units    per unit, Q30
 * Range    |h| is limited to 1/4
 * Rounding half up, a few LSB of Q30
 * Errors   saturates
 * Context  1 kHz task; two divisions each, of bounded quantities */
#include "control/current/flux_table_types.h"
#include "control/identify/point.h"

/** The tables at point->i_m. */
typedef struct {
    flux_point_t flux;
    flux_inductances_t inductances;
} identify_tables_t;

typedef struct {
    int32_t h_q30[IDENTIFY_STATES];
} jacobian_row_t;

/** The voltage equations of both axes as a measurement of the states. Only words: identify_step() takes means of them
 * one by one. */
typedef struct {
    jacobian_row_t d, q;
    dq_q30_t e;        /* residual */
    int32_t noise_q30; /* standard deviation of the noise */
} identify_measurement_t;

typedef struct {
    identify_measurement_t now; /* with every state at its prior, without noise */
    dq_q30_t psi;               /* of the tables, at i_m */
    dq_q30_t i_m;
    dq_q30_t iron_i; /* change of i_m with the scale of the iron loss */
    bool current;    /* the current is large enough to define the direction of the voltage drop */
    /* Change of psi with each state from IDENTIFY_FIRST_OF_FLUX on. The entry of the magnet's flux is 0: its change, 1,
     * is added where it is used. */
    jacobian_row_t psi_d, psi_q;
} identify_model_t;

void identify_model(const identify_config_t *config, const identify_point_t *point, const identify_tables_t *tables,
                    q31_t r_prior, identify_model_t *model);
void identify_torque_row(const identify_config_t *config, const identify_model_t *model, jacobian_row_t *row);

/** Flux and magnetising current at both ends of the period. */
typedef struct {
    dq_q30_t psi, i_m;
} identify_flux_t;

/** Torque over the period, Q30. */
int32_t identify_mean_torque(const identify_config_t *config, const flux_inductances_t *l, int32_t chord,
                             const identify_flux_t *at);

#endif
