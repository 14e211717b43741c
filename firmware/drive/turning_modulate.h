/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_TURNING_MODULATE_H
#define DRIVE_TURNING_MODULATE_H
/** Modulation for current_control_turning.h: the knee of the dead-time compensation widens with speed.
 *   i_knee >= 1.5 |theta| c T_s/(k_0 l_min): a deviation of the current keeps its direction in the stationary frame
 *   while the rotor turns, so that the compensation acts on it rotated by the angle of one and a half periods.
 * Source   docs/theory/modulation.md (MO-12)
 * Units    knee_turns_q27: knee_q17 times theta in turns; angle_step 2^32 = one turn
 * Range    knee_turns_q27 > 0
 * Rounding theta to an odd number of 2^-10 turns
 * Errors   none
 * Context  fast ISR, not its usual route; one hardware division */
#include "control/current/modulate.h"

modulate_config_t turning_modulate(const modulate_config_t *given, int32_t knee_turns_q27, int32_t angle_step);

#endif
