/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TYPES_FAULTS_H
#define TYPES_FAULTS_H
/** The fault word's bits.
 * Source   docs/architecture.md, fault table
 * Context  values only */

enum {
    FAULT_OVER_CURRENT = 1u << 0,
    FAULT_OVER_VOLTAGE = 1u << 1,
    FAULT_UNDER_VOLTAGE = 1u << 2,
    FAULT_CURRENT_SUM = 1u << 3,
    FAULT_ANGLE = 1u << 4,
    FAULT_INPUT = 1u << 5,   /* the port delivered NaN, infinity or no samples */
    FAULT_OVERRUN = 1u << 6, /* the identification did not finish within its period, 3 times in a row */
    FAULT_CONFIG = 1u << 7,  /* start-up check of the motor data failed */
    FAULT_CONTROL = 1u << 8, /* the current does not follow its reference */
    FAULT_PHASE_LOST = 1u << 9,
    FAULT_CURRENT_STUCK = 1u << 10, /* a current sensor repeats the same value */
    FAULT_OVER_SPEED = 1u << 11,
    FAULT_ANGLE_OFFSET = 1u << 12, /* the back-EMF does not fit the measured angle */
    FAULT_TORQUE = 1u << 13,       /* the torque monitor's torque exceeds the commanded one */
    FAULT_TEMPERATURE = 1u << 14,
    FAULT_GATE = 1u << 15 /* reported by the gate driver, which has disabled switching */
};

#endif
