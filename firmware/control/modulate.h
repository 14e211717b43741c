/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CONTROL_MODULATE_H
#define CONTROL_MODULATE_H
/** From a dq voltage to three duties: space-vector modulation by min-max zero sequence, up to the hexagon.
 *   v_ab = v_ratio rot(theta + 1.5 w T_s) v_dq;  d_x = 1/2 + v_x - (max v + min v)/2 + c_x
 *   c_x: dead-time compensation of phase x by its predicted current, a straight line inside +-i_knee, constant outside
 *   beyond the hexagon the nearest point of its boundary; pulses shorter than min_pulse snap to the nearer of
 *     {0, min_pulse}.
 *   modulate_clear(): the usual period, in which nothing of the last two lines can happen
 *   modulate_acted(): what limited duties make once the inverter has taken c_x away, in the frame it acts in.
 * Source   docs/theory/modulation.md (MO-1) ... (MO-11)
 * Units    v per unit of v_ratio v_dc; u per unit of V_b; duties with 2^15 = 1.0; dead_time = t_dead f_pwm times the
 *          compensated fraction, longest = 1/2 - min_pulse, nearer_rail = 1/2 - min_pulse/2
 * Range    |v| up to 1.23, what current control leaves
 * Rounding 1 LSB of duty (2^-15)
 * Errors   limited says that a pulse was changed
 * Context  fast ISR; no division */
#include <stdint.h>

#include "fx/trig.h"
#include "types/frames.h"
#include "types/samples.h"

typedef struct {
    q31_t alpha_q31;      /* v_ratio */
    q31_t side_q31;       /* sqrt(3)/2 of it */
    int32_t knee_q17;     /* 1/i_knee < 2^13: 1.0 reached at the end of the straight line */
    int32_t knee_side_q17; /* sqrt(3)/2 of it */
    int32_t dead_time_q16; /* compensated duty error of one phase */
    int32_t longest_q31;   /* half a duty less the shortest pulse the bridge makes */
    int32_t nearer_rail_q31; /* half a duty less half of that pulse */
} modulate_config_t;

typedef struct {
    duty_t duty;
    uint32_t limited; /* not zero: what acts differs from the command by more than rounding */
} modulate_out_t;

/** v and i: (d, q); advanced: fx_rotation() of the electrical angle at the middle of the acting period. */
modulate_out_t modulate_step(const modulate_config_t *config, fx_pair_t v, fx_pair_t i, fx_pair_t advanced);

/** The same where v is so small that no duty can be out of reach (MO-11). */
duty_t modulate_clear(const modulate_config_t *config, fx_pair_t v, fx_pair_t i, fx_pair_t advanced);

/** What limited duties make of the dc voltage, per unit of V_b; duties that are not limited make what was wanted. */
dq_t modulate_acted(const modulate_config_t *config, duty_t duty, fx_pair_t i, fx_pair_t advanced, int32_t v_dc);

#endif
