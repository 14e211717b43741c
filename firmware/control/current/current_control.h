/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CURRENT_CURRENT_CONTROL_H
#define CURRENT_CURRENT_CONTROL_H
/** Current control in the rotor frame: one PI controller per axis in flux linkage, decoupled by the flux tables and the
 * identified flux. A share m of the rotational voltage follows the measured flux, the rest w' = (1 - m) w the target:
 *   u_d = sigma (f_d - psi_d) + s_d - m w psi_q, s_d += a_i (sigma (psi_d* - psi_d) - w' (psi_q* - psi_q))
 *   u_q = sigma (f_q - psi_q) + s_q + m w psi_d, s_q += a_i (sigma (psi_q* - psi_q) + w' (psi_d* - psi_d))
 *   psi* = tables at i*;  f = psi* - (1 - b) l i* + (r/sigma) i* + j (w' r + w dpsi)/sigma
 * r follows f's flux: at once in small steps, a large one by half and then by three quarters of the rest (CC-25)
 * (set-point weight b, resistive drop and rotational voltage fed forward). The measured flux is a period and a half old
 * when its voltage acts: with m = 1 the phase margin would fall with speed (CC-24).
 * The error is a flux linkage: sigma (psi* - psi) equals sigma l (i* - i) with l the incremental inductance between
 * both points, so that the gain is scheduled over the whole step and a step into saturation does not overshoot.
 *   sigma = 1/(2 T_d), T_d = 1.5 T_s
 * Voltage limit: v = u/v_max, v_max = v_ratio v_dc, is limited to the unit circle.
 *   psi_d* < psi_d and v_d < 0: the d axis has priority. Otherwise the d axis gets what v_q leaves of the circle, at
 *     least 0.7, or half if |v_q| >= 1.5; if it had priority there, the q current could never fall, and its flux would
 *     keep the d axis at its limit.
 *   v_q is reduced, with the sign of w, by what v_d exceeds its bound, because only a smaller q flux gives the d axis
 *     its voltage. It then gets the rest of the circle, at least a quarter.
 * Anti-windup: while the circle limits, s also integrates a T_s (u_limited - u). The response then is that to a
 *   reference which the voltage can follow, without a slow tail.
 * clear: |v| < v_clear/v_ratio; neither this circle nor the modulation can limit such a voltage (MO-11).
 * Source   docs/theory/current-control.md (CC-4) ... (CC-15)
 * Units    per unit
 * Range    sigma = 1/(2 T_d omega_b) < 128; b, a_i in q15; |omega| < 1, |w'| < sigma; 0.5 < v_ratio < 0.7; |s| <= 1;
 *          v_dc >= 0. A v_dc below 1/(64 v_ratio) is replaced by that value; below 2 LSB the voltage is 0
 * Rounding half up: 1/2 LSB q15 in u and in v; s is integrated exactly; the circle is a table of 256 steps that never
 *          exceeds it
 * Errors   saturates and reports it in limited; raises no fault
 * Context  step: fast ISR, one bounded hardware division; target: 1 kHz task */
#include <stdbool.h>

#include "control/current/flux_table_types.h"
#include "types/frames.h"
#include "types/operating_point.h"

#define MEASURED_SHARE_Q5 11 /* m: of the rotational voltage, by the measured flux (CC-24) */

typedef struct {
    int32_t sigma_q24;         /* 0, as integral_gain, where current_control_turning.h is used */
    q16_t drop_gain;           /* r/sigma: resistive voltage drop as a flux error */
    q15_t setpoint_weight;     /* b = w_c/(w_c + a) */
    q15_t integral_gain;       /* sigma a_i < 1/2 */
    int32_t tracking_gain_q34; /* a T_s v_ratio = a_i v_ratio/b < 1/8 */
    uint32_t per_ratio_q31;    /* 1/v_ratio: usable part of v_dc as phase peak; 1/sqrt(3) is the linear limit */
    uint32_t clear_q30;        /* (v_clear/v_ratio)^2 < 1: limit of |v|^2 for clear */
} current_control_config_t;

/** Current reference as flux linkage. */
typedef struct {
    dq_q15_halfword_t psi; /* psi*: reference of the integral part */
    dq_q30_t weighted;     /* f: reference of the proportional part */
    int32_t turn;          /* m w, q15: its rotational voltage follows the measured flux; its sign is that of w */
    q15_t integral_turn;   /* a_i w' */
    q15_t integral_gain;   /* a_i sigma */
} current_target_t;

/** r: flux whose rotational voltage the target makes. */
typedef struct {
    dq_q15_t psi;
    bool behind; /* after a change too large to be made at once */
} rotating_flux_t;

typedef struct {
    int32_t s_d_q30, s_q_q30;
} current_control_state_t;

typedef struct {
    const current_target_t *target;
    const flux_point_t *flux; /* at the measured current */
    int32_t v_dc;             /* q15, not negative */
} current_control_in_t;

typedef struct {
    dq_q15_t u;       /* before the limit, per unit of V_b */
    fx_pair_t v;      /* (d, q) after the limit, q15, per unit of v_max */
    uint32_t limited; /* not zero: the circle limited u */
    bool clear;
} current_control_out_t;

static inline void current_control_reset(current_control_state_t *state)
{
    *state = (current_control_state_t){0};
}

/** psi/(1 - m): the target makes all of the rotational voltage of this flux, which the tables do not contain, while it
 * makes only 1 - m of that of the other flux. */
static inline int32_t current_control_by_target(int32_t psi)
{
    return 32 * psi / (32 - MEASURED_SHARE_Q5);
}

/** at: currents and flux that are wanted, and the speed. psi_d_error: identified flux minus the table's, over 1 - m.
 * rotating: follows the target; the measured flux before the first call. */
current_target_t current_control_target(const current_control_config_t *config, const operating_point_t *at,
                                        int32_t psi_d_error, rotating_flux_t *rotating);
current_control_out_t current_control_step(const current_control_config_t *config, current_control_state_t *state,
                                           const current_control_in_t *in);

#endif
