/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TYPES_TORQUE_LIMITS_H
#define TYPES_TORQUE_LIMITS_H
/** Limits set by the vehicle: magnitudes for driving (torque in the direction of rotation) and generating (against it).
 * Source   docs/theory/limits.md (LM-1)
 * Units    torque per unit of T_b; power, on the dc side, per unit of P_b = 1.5 V_b I_b
 * Range    0 ... Q15_MAX; Q15_MAX does not limit, negative values count as 0
 * Errors   none: values only
 * Context  values only */
#include "fx/q.h"

typedef struct {
    q15_t torque_drive, torque_regen;
    q15_t power_drive, power_regen;
} torque_limits_t;

#define TORQUE_LIMITS_NONE ((torque_limits_t){Q15_MAX, Q15_MAX, Q15_MAX, Q15_MAX})

#endif
