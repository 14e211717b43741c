/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SAFETY_DC_JUMP_H
#define SAFETY_DC_JUMP_H
/** Finds a dc voltage sensor whose gain jumps: the computed voltage jumps with it, the machine's does not.
 *   w      = j w psi + r i: what the machine's voltage is by speed, tables and currents; e = u - d psi/dt
 *   kappa  = e.w/|w|^2, compared while |w| > 4 v_0 and |i| > i_0: with less current the duties do not determine the
 *            machine's voltage
 *   jump   |v_dc - v_0dc| > 3/32 v_0dc between two steps; v_0dc, kappa_0: of the last steps before it
 *   sensor |(kappa - kappa_0) v_0dc - (v_dc - v_0dc) kappa_0| < |(v_dc - v_0dc) kappa_0|/2 in the 4th to 8th step
 *   A battery whose voltage jumps leaves kappa as it is. Speed (1/64) and commanded torque (t_0/4) must be steady in
 *   the 4 steps before the jump and in all steps after it, otherwise the comparison begins anew.
 * Source   docs/theory/monitors.md (MN-45) ... (MN-48), (MN-53)
 * Units    per unit
 * Range    every argument; saturates
 * Rounding 2^-14 of kappa, three times that of its mean, against a threshold of 0.05
 * Errors   returns true in the step in which the sensor is found; the caller raises the fault
 * Context  1 kHz task; one division */
#include <stdbool.h>
#include <stdint.h>

#include "types/frames.h"

typedef struct {
    q16_t r;         /* at 20 C */
    q16_t rate_gain; /* 1/(omega_b task period): flux step to voltage */
    q15_t v_0;       /* voltage error of the inverter */
    q15_t t_0;       /* torque error allowed at no torque */
    q15_t i_0;       /* with less current two legs may be near their zero crossings */
} dc_jump_config_t;

typedef struct {
    bool acting;            /* the bridge follows the torque path's references */
    dq_q15_t u, i;          /* acting voltage, as it follows from v_dc, and current */
    dq_q15_t psi, psi_last; /* the tables' flux there, now and one step ago */
    q15_t omega, torque;    /* tracked; commanded */
    q15_t v_dc;
} dc_jump_in_t;

typedef struct {
    q15_t v_dc, half_kappa; /* of the last step without a jump; mean */
    q15_t omega, torque;    /* when the steady time began */
    uint8_t before, after;  /* steps: steady, up to the jump; from the jump on */
} dc_jump_state_t;

bool dc_jump_step(const dc_jump_config_t *config, dc_jump_state_t *state, const dc_jump_in_t *in);

#endif
