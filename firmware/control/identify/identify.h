/* SPDX-License-Identifier: Apache-2.0 */
#ifndef IDENTIFY_IDENTIFY_H
#define IDENTIFY_IDENTIFY_H
/** Robust identification: seven slow parameters and a local flux error from the two voltage equations, and the torque.
 *   each step  residuals of the operating point, local flux error, torque
 *     psi^ = psi(i_m) + parameters + local,  t^ = psi^_d i^_mq - psi^_q i^_md, over the period
 *     local  += rate ((w e_q, -w e_d)/(w^2 + w_x^2) - local): the flux of the voltage model, weighted by the speed
 *   each tenth step  Kalman update with the mean residuals of the d axis; in the step after it the q axis, before
 *                    the residuals; one step later Kalman prediction, confidence
 * Source   docs/theory/identification.md (ID-5) ... (ID-21)
 * Units    per unit
 * Range    as in its parts
 * Rounding 1/2 LSB q15 in the torque
 * Errors   what is kept from step to step is sealed at the end of each and compared at the next, parameters and their
 *          variances at each update: damage by the memory is reported until the reset of the processor
 *          without valid windows the parameters only return to their priors; clamped states and innovations beyond the
 *          gate reduce the confidence to 0, the torque estimate continues
 * Context  1 kHz task; five divisions per step, one more per update and axis. An update is spread over three steps, so
 *          that none computes much more than the others */
#include "control/identify/kalman.h"
#include "types/temperature.h"

#define IDENTIFY_STEPS 10 /* per update */

/** What is kept from step to step. Without bytes between the fields, which would have no value that a seal covers. */
typedef struct {
    dq_q30_t local; /* flux error of this operating point */
    q31_t r_prior;
    q15_t mismatch_share; /* of recent updates: those beyond the innovation gate or with a clamped state */
    q15_t confidence;
    bool torque_certain; /* the confidence rises, else it falls */
    bool update_valid;   /* every step of this update so far was valid */
    bool clamped;        /* a state reached its limit in the last update; before the q axis's turn, by the d axis */
    bool r_known;        /* the winding temperature is measured */
} identify_kept_t;
_Static_assert(sizeof(identify_kept_t) == 20U, "no bytes between the fields");

typedef struct {
    uint8_t steps;
    uint8_t gate_exceeded_updates; /* in a row, up to 25: the d axis exceeds the innovation gate (MN-12) */
    bool damaged;                  /* a seal did not match: the memory has changed what only this stage writes */
    identify_kept_t kept;
    uint32_t seal;               /* of kept */
    int32_t torque_variance_q30; /* at the last update */
    identify_measurement_t mean; /* over the steps of one update */
    uint32_t kalman_seal;
    kalman_t kalman; /* last, because it is large */
} identify_state_t;

typedef struct {
    const identify_point_t *point;
    const identify_tables_t *tables;
    int16_t winding_dC; /* tenths of a degree C, or TEMPERATURE_UNKNOWN */
    bool enabled;
} identify_in_t;

typedef struct {
    int32_t torque;      /* q15: air gap, mean over the window */
    int32_t psi_d_error; /* q15: identified minus table's flux in the d axis, here */
} identify_out_t;

/* Check the two seals: of what is kept from step to step, and of the parameters with their covariance. */
void identify_check_kept(identify_state_t *state);
void identify_check_parameters(identify_state_t *state);
void identify_seal_kept(identify_state_t *state);
void identify_seal_parameters(identify_state_t *state);
/** Renews both seals, after the state was set from outside as a whole. */
void identify_seal(identify_state_t *state);
/** Sets one parameter, in standard deviations of its prior. */
void identify_set(identify_state_t *state, identify_index_t index, int32_t x_q27);
void identify_reset(const identify_config_t *config, identify_state_t *state);
identify_out_t identify_step(const identify_config_t *config, identify_state_t *state, const identify_in_t *in);
/** Value of a parameter, per unit, q31: sigma x, limited to +-1. */
q31_t identify_value(const identify_config_t *config, const identify_state_t *state, identify_index_t index);

#endif
