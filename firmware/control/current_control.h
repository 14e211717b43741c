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
 *   v = u/v_max, v_max = v_ratio v_dc: v_d comes first, v_q gets what the circle leaves, at least a quarter,
 *   and gives up what v_d is short of, with the sign of w
 * While d asks for more flux (psi_d* > psi_d) q comes first instead, else it could never shed the flux that binds d,
 *   and d keeps 0.7
 * clear: |v| < v_clear/v_ratio, a circle inside of everything that may limit here or in the modulation (MO-11)
 * Source   docs/theory/current-control.md (CC-4) ... (CC-15)
 * Units    per unit
 * Range    sigma = 1/(2 T_d omega_b) < 128; b, a_i in q15; |omega| < 1; 0.5 < v_ratio < 0.7; |s| <= 1; v_dc from 0;
 *          below 1/(64 v_ratio) it is taken for that, below 2 LSB the voltage is none
 * Rounding half up: 1/2 LSB q15 in u and in v; s takes its step exactly; the circle in 256 steps from inside
 * Errors   saturates and says so in limited; no fault of its own
 * Context  step: fast ISR, one bounded hardware division; target: 1 kHz task */
#include <stdbool.h>

#include "control/flux_table_types.h"
#include "types/frames.h"

typedef struct {
    int32_t sigma_q24;
    q16_t drop_gain;       /* r/sigma: flux that asks for the resistive drop */
    q15_t setpoint_weight; /* b = w_c/(w_c + a) */
    q15_t integral_gain;   /* sigma a_i < 1/2 */
    int32_t tracking_gain_q34; /* a T_s v_ratio = a_i v_ratio/b < 1/8 */
    uint32_t per_ratio_q31; /* 1/v_ratio: usable part of v_dc as phase peak; 1/sqrt(3) is the linear limit */
    uint32_t clear_q30;    /* (v_clear/v_ratio)^2 < 1: inside, nothing limits */
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
    dq_t u;       /* wanted, per unit of V_b */
    fx_pair_t v;  /* (d, q) of what the circle leaves of it, per unit of v_max */
    uint32_t limited; /* not zero: the circle cut it */
    bool clear;
} current_control_out_t;

void current_control_reset(current_control_state_t *state);
current_target_t current_control_target(const current_control_config_t *config, dq_t i_ref, const flux_point_t *at_ref);
current_control_out_t current_control_step(const current_control_config_t *config, current_control_state_t *state,
                                           const current_control_in_t *in);

#endif
