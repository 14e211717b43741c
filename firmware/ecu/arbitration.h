/* SPDX-License-Identifier: Apache-2.0 */
#ifndef ECU_ARBITRATION_H
#define ECU_ARBITRATION_H
/** From what the bus asks to what the control may be asked: limits, dead band, slew and jerk.
 *   wanted = clamp(requested, -limit, +limit), limit = drive or regen by the sign of requested x speed;
 *            0 if |requested| <= dead_band: a vehicle at rest must not creep
 *   torque follows wanted with |dT/dt| <= slew and |d2T/dt2| <= jerk while the rate grows or is braked towards a target
 *   that stays (the last step may take two jerks); a rate that leads away from the target, or would pass one that has
 *   come nearer, is dropped at once: torque never rises after it was taken back, and never overshoots.
 *   drop     torque goes to zero with ramp_out alone: no jerk limit may delay it
 * arbitrate_hold(): what the drive's own limits did not allow is not remembered, but for one jerk, by which they still
 *   tell that they limit: when they open, the torque rises from where it is, with slew and jerk.
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
    bool run;  /* the gates are closed: else there is no torque */
    bool stop; /* wanted is zero, reached with slew and jerk */
    bool drop; /* wanted is zero, reached with ramp_out */
} arbitrate_in_t;

/** Before the step; torque_limited is what the drive has made of the last step's answer. */
void arbitrate_hold(const arbitrate_config_t *config, arbitrate_state_t *state, q15_t torque_limited);
q15_t arbitrate_step(const arbitrate_config_t *config, arbitrate_state_t *state, const arbitrate_in_t *in);

#endif
