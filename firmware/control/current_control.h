/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CONTROL_CURRENT_CONTROL_H
#define CONTROL_CURRENT_CONTROL_H
/** Current control in the rotor frame: one PI per axis, decoupled by the tables and the identified flux.
 *   u_d = sigma (f_d - psi_d) + s_d - w psi_q,          s_d += sigma a_i (psi_d* - psi_d)
 *   u_q = sigma (f_q - psi_q) + s_q + w (psi_d + dpsi), s_q += sigma a_i (psi_q* - psi_q)
 *   psi* = tables at i*;  f = psi* - (1 - b) l i* + (r/sigma) i*  (set-point weight b, resistive drop fed forward)
 * The error is taken in flux linkage: sigma (psi* - psi) is sigma l (i* - i) with l the incremental inductance
 * between the two points, so the gain is scheduled over the whole step and a step into saturation does not overshoot.
 *   sigma = 1/(2 T_d), T_d = 1.5 T_s
 * While the circle cuts, s also takes a T_s (u_limited - u): the response goes on as if the reference had been one
 * that the voltage can follow, and no slow tail remains.
 *   |u| <= v_max = v_ratio v_dc: u_d comes first with up to 31/32 v_max, u_q gets sqrt(v_max^2 - u_d^2) and gives up
 *   what u_d is short of, with the sign of w
 * While d asks for more flux (psi_d* > psi_d) the vector is shortened instead, else u_q could never shed the flux
 * that binds u_d.
 * clear: |u| < v_clear v_dc, a circle inside of everything that may limit here or in the modulation (MO-11)
 * Source   docs/theory/current-control.md (CC-4) ... (CC-14)
 * Units    per unit
 * Range    sigma = 1/(2 T_d omega_b) < 128; b, a_i in q15; |omega| < 1; v_ratio < 0.7; |s| <= 1
 * Rounding half up: 1/2 LSB q15 in u; s takes its step exactly
 * Errors   saturates and says so in limited; no fault of its own
 * Context  step: fast ISR, one root, or its inverse, only while limited; no division; target: 1 kHz task */
#include <stdbool.h>

#include "control/flux_table_types.h"
#include "types/frames.h"

typedef struct {
    int32_t sigma_q24;
    q16_t drop_gain;       /* r/sigma: flux that asks for the resistive drop */
    q15_t setpoint_weight; /* b = w_c/(w_c + a) */
    q15_t integral_gain;   /* sigma a_i < 1/2 */
    q15_t tracking_gain;   /* a T_s = a_i/b < 1/2 */
    q15_t v_ratio;         /* usable part of v_dc as phase peak; 1/sqrt(3) is the linear limit */
    int32_t clear_q32;     /* v_clear^2: below this part of v_dc nothing limits; v_clear <= 31/32 v_ratio */
} current_control_config_t;

/** Where the current shall go, in flux linkage. */
typedef struct {
    dq_t psi;      /* psi*: what the integrators follow */
    dq_t weighted_q30; /* f: what the proportional part follows, q15 times 2^15 */
} current_target_t;

typedef struct {
    int32_t s_d_q30, s_q_q30;
} current_control_state_t;

typedef struct {
    const current_target_t *target;
    const flux_point_t *flux; /* at the measured current */
    q31_t omega;     /* its upper half is used: a LSB of q15 of the feed-forward, which the integrators carry */
    q15_t psi_delta; /* identified flux minus the table's */
    int32_t v_dc;    /* not negative */
} current_control_in_t;

typedef struct {
    dq_t u;
    bool limited; /* the circle cut it */
    bool clear;
} current_control_out_t;

void current_control_reset(current_control_state_t *state);
current_target_t current_control_target(const current_control_config_t *config, dq_t i_ref, const flux_point_t *at_ref);
current_control_out_t current_control_step(const current_control_config_t *config, current_control_state_t *state,
                                           const current_control_in_t *in);

#endif
