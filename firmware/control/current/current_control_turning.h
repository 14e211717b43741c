/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CURRENT_CURRENT_CONTROL_TURNING_H
#define CURRENT_CURRENT_CONTROL_TURNING_H
/** Current control for a field that turns far in one PWM period: up to 1.2 rad. current_control.h loses its margins
 * there, because its feed-forward -w psi acts a period and a half after the sample.
 *   A model of the flux, r, approaches the reference and is what the machine should do: r' = r + alpha (psi* - r).
 *   The voltage that takes the machine from r to r' in one period is known exactly, whatever the angle theta = w T_s:
 *   u = (e^(j theta/2) r' - e^(-j theta/2) r)/T_s + k (r_k - psi) + s + R_0 i + j w' dpsi
 *   s += epsilon (k + j w') (r_k - psi),  k = k_0/T_s e^(-j 1.5 theta),  w' = 2 sin(theta/2)/T_s
 * r is the model's flux at the coming sample, r' at the one after it, r_k at this one. The deviation from the model is
 * fed back in the direction that it had when it was sampled, hence -1.5 theta: in the stationary frame, in which the
 * machine is an integrator at every speed. The loop's margins therefore do not depend on the speed.
 * Voltage limit: that of current_control_step(), which gets u as its integrator and must have no gains of its own; r'
 *   then becomes the flux that the limited voltage can reach.
 * Source   docs/theory/current-control.md (CC-16) ... (CC-20)
 * Units    per unit; angles in turns times 2^32
 * Range    0.36 < w_b T_s < 1.57; |r| <= 1, |u| <= 1, |s| w_b T_s < 2
 * Rounding half up: 1/2 LSB q15 in u and v; 2^-28 of a flux in s, 2^-25 in r. The voltage limit gets the sign of w as
 *          a turn of 0 or -1, which leaves up to 1 LSB q15 in u
 * Errors   saturates and reports it in limited; raises no fault
 * Context  fast ISR, in place of current_control_step(), which it calls */
#include "control/current/current_control.h"

typedef struct {
    int32_t per_period_q29; /* 1/(w_b T_s) < 4; 0: the motor does not need this law */
    int32_t approach_q32;   /* alpha < 1/2 */
    int32_t feedback_q32;   /* k_0 < 1/2 */
    int32_t integral_q32;   /* epsilon */
    int32_t drop_q29;       /* w_b T_s R_0 */
    int32_t knee_turns_q27; /* knee_q17 of modulate.h times theta in turns (MO-12) */
} turning_control_config_t;

typedef struct {
    dq_q28_t s;    /* integral part */
    dq_q29_t now;  /* r_k: the model's flux at this sample */
    dq_q29_t next; /* r: at the coming one */
} turning_control_state_t;

typedef struct {
    current_control_in_t control;
    dq_q15_t i;
    int32_t angle_step;  /* theta */
    int32_t psi_d_error; /* q15: identified flux minus the table's */
} turning_control_in_t;

static inline bool turning_control_used(const turning_control_config_t *config)
{
    return config->per_period_q29 != 0;
}

/** The model rests at the machine's flux. */
void turning_control_reset(turning_control_state_t *state, const flux_point_t *flux);
/** limits: gains of 0 and tracking_gain_q34 = w_b T_s v_ratio/16. */
current_control_out_t turning_control_step(const turning_control_config_t *config,
                                           const current_control_config_t *limits, turning_control_state_t *state,
                                           const turning_control_in_t *in);

#endif
