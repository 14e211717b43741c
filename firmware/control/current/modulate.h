/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CURRENT_MODULATE_H
#define CURRENT_MODULATE_H
/** Space-vector modulation by min-max zero sequence, up to the hexagon: three duties from a dq voltage.
 *   v_ab = v_ratio rot(theta + 1.5 w T_s) v_dq;  d_x = 1/2 + v_x - (max v + min v)/2 + c_x
 *   c_x: dead-time compensation of phase x from its predicted current, linear inside +-i_knee, constant outside
 *   A voltage beyond the hexagon is limited to the nearest point of its boundary; a pulse shorter than min_pulse
 *     becomes 0 or min_pulse, whichever is nearer.
 *   modulate_clear(): the same for voltages so small that neither limit can be reached
 *   modulate_applied(): the voltage that limited duties apply after the dead time has removed c_x, in the rotor frame
 * Source   docs/theory/modulation.md (MO-1) ... (MO-11)
 * Units    v per unit of v_ratio v_dc; u per unit of V_b; duties with 2^15 = 1.0; dead_time = t_dead f_pwm times the
 *          compensated fraction, longest = 1/2 - min_pulse, nearer_rail = 1/2 - min_pulse/2
 * Range    |v| up to 1.23, the maximum after the voltage limit of the current control
 * Rounding 1 LSB of duty (2^-15)
 * Errors   limited reports that a pulse was changed
 * Context  fast ISR; no division */
#include <stdint.h>

#include "fx/trig.h"
#include "types/frames.h"
#include "types/samples.h"

typedef struct {
    q31_t alpha_q31;         /* v_ratio */
    q31_t side_q31;          /* sqrt(3)/2 of it */
    int32_t knee_q17;        /* 1/i_knee < 2^13: slope of the linear part */
    int32_t knee_side_q17;   /* sqrt(3)/2 of it */
    int32_t dead_time_q16;   /* duty error of one phase that is compensated */
    int32_t longest_q31;     /* half a duty minus the shortest pulse that the bridge can make */
    int32_t nearer_rail_q31; /* half a duty minus half of that pulse */
} modulate_config_t;

typedef struct {
    duty_t duty;
    uint32_t limited; /* not zero: the applied voltage differs from the commanded one by more than rounding */
} modulate_out_t;

/** v and i: (d, q); advanced: fx_rotation() of the electrical angle at the middle of the acting period. */
modulate_out_t modulate_step(const modulate_config_t *config, fx_pair_t v, fx_pair_t i, fx_pair_t advanced);

/** The same result for a v so small that no pulse can be limited (MO-11). */
duty_t modulate_clear(const modulate_config_t *config, fx_pair_t v, fx_pair_t i, fx_pair_t advanced);

/** Voltage that limited duties apply, per unit of V_b. Duties that are not limited apply the commanded voltage. */
dq_q15_t modulate_applied(const modulate_config_t *config, const duty_t *duty, fx_pair_t i, fx_pair_t advanced,
                          int32_t v_dc);

#endif
