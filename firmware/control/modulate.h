/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CONTROL_MODULATE_H
#define CONTROL_MODULATE_H
/** From a dq voltage to three duties: space-vector modulation by min-max zero sequence, up to the hexagon.
 *   u_ab = rot(theta + 1.5 w T_s) u_dq;  v_x = u_x/v_dc;  d_x = 1/2 + v_x - (max v + min v)/2 + c_x
 *   c_x: dead-time compensation of phase x by its predicted current, a straight line inside +-i_knee, constant outside
 *   beyond the hexagon the vector is shortened, its direction kept; pulses shorter than min_pulse snap to the nearer
 *     of {0, min_pulse}.
 *   modulate_clear(): the usual period, in which nothing of the last two lines can happen
 *   modulate_acted(): what limited duties make once the inverter has taken c_x away, in the frame it acts in.
 * Source   docs/theory/modulation.md (MO-1) ... (MO-9)
 * Units    u per unit of V_b; duties with 2^15 = 1.0; dead_time = t_dead f_pwm in duty units times the compensated
 *          fraction
 * Range    v_dc >= v_dc_min (below it the minimum is used)
 * Rounding 1 LSB of duty (2^-15)
 * Errors   limited says that what acts differs from the command by more than rounding
 * Context  fast ISR; one bounded hardware division, a second one beyond the hexagon only */
#include <stdbool.h>
#include <stdint.h>

#include "fx/trig.h"
#include "types/frames.h"
#include "types/samples.h"

typedef struct {
    q15_t dead_time;      /* compensated duty error of one phase */
    int32_t knee_q17;     /* 1/i_knee < 2^13: 1.0 reached at the end of the straight line */
    int32_t knee_side_q17; /* sqrt(3)/2 of it */
    q15_t min_pulse;      /* shortest pulse the bridge makes, in duty */
    q15_t v_dc_min;       /* floor for the normalisation, at least 2 */
} modulate_config_t;

typedef struct {
    dq_t u;             /* commanded voltage */
    fx_pair_t i;        /* currents for the polarity, (d, q) */
    fx_pair_t advanced; /* fx_rotation() of the electrical angle at the middle of the acting period */
    int32_t v_dc;
} modulate_in_t;

typedef struct {
    duty_t duty;
    bool limited;
} modulate_out_t;

modulate_out_t modulate_step(const modulate_config_t *config, const modulate_in_t *in);

/** The same where u is so small that no duty can be out of reach (MO-11); v_dc is then at least 2. */
duty_t modulate_clear(const modulate_config_t *config, fx_pair_t u, fx_pair_t i, fx_pair_t advanced, int32_t v_dc);

/** What limited duties make; duties that are not limited make in->u. */
dq_t modulate_acted(const modulate_config_t *config, const modulate_in_t *in, duty_t duty);

#endif
