/* SPDX-License-Identifier: Apache-2.0 */
#ifndef ECU_ARBITRATION_H
#define ECU_ARBITRATION_H
/** Arbitration of the requested torque: limits of the vehicle, dead band, slew and jerk.
 *   target = clamp(requested, -limit, +limit), limit = drive or regen by the sign of requested x speed;
 *            0 if |requested| <= dead_band, so that a vehicle at rest does not creep
 *   The torque approaches the target with |dT/dt| <= slew and |d2T/dt2| <= jerk, also while the rate is reduced before
 *   a constant target is reached (the last step may take two jerks). If the rate leads away from the target, or the
 *   torque would pass a target that has changed, the rate is set to zero at once: the torque does not continue to rise
 *   after the request was reduced, and it never overshoots.
 *   ramp_out ends the torque with the rate ramp_out, without a limit of jerk
 * arbitrate_hold(): limits the arbitrated torque to the drive's limited torque plus one jerk. When the drive's limits
 *   rise again, the torque then rises from its present value, with slew and jerk. The one jerk keeps the arbitrated
 *   torque beyond the limit, so that the limit continues to be reported. A rate towards zero is kept: a falling limit
 *   does not delay the answer to a smaller request.
 * Source   docs/howto/can.md, torque path
 * Units    per unit of T_b, q15; slew, jerk and ramp_out in q31 per step (and per step squared)
 * Range    slew, jerk, ramp_out > 0 and below 2^29
 * Rounding torque is kept in q31: half up to q15, 1/2 LSB
 * Errors   none; everything saturates
 * Context  1 kHz task; no division */
#include <stdbool.h>

#include "fx/q.h"

typedef struct {
    q31_t slew, jerk, ramp_out;
    q15_t dead_band;
    q31_t omega_standstill; /* below it every torque counts as driving */
} arbitrate_config_t;

typedef struct {
    q31_t torque_arbitrated;
    q31_t rate; /* per step, signed */
} arbitrate_state_t;

typedef struct {
    q15_t torque_requested;
    q15_t limit_drive, limit_regen; /* magnitudes */
    q31_t omega;
    bool run;      /* switching is enabled; without it there is no torque */
    bool stop;     /* the target is zero, reached with slew and jerk */
    bool ramp_out; /* the target is zero, reached with the rate ramp_out */
} arbitrate_in_t;

/** Whether the limit for braking applies, not the one for driving. */
bool arbitrate_is_braking(const arbitrate_config_t *config, q31_t omega, bool torque_is_negative);
/** Before the step; torque_limited is the drive's limited torque of the last step. */
void arbitrate_hold(const arbitrate_config_t *config, arbitrate_state_t *state, q15_t torque_limited);
q15_t arbitrate_step(const arbitrate_config_t *config, arbitrate_state_t *state, const arbitrate_in_t *in);

#endif
