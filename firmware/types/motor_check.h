/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TYPES_MOTOR_CHECK_H
#define TYPES_MOTOR_CHECK_H
/** The checks that a drive makes before it can run, each with a name: the reason of FAULT_CONFIG.
 *   X(NAME, value, explanation): MOTOR_CHECK_NAME in C. A value is transmitted and stored: a new check gets a new
 *   value, and no value is used again
 * Source   docs/architecture.md, faults
 * Units    none: a number for each check
 * Errors   none: values only
 * Context  each control block checks its own data (flux_table_check() and the like); drive/motor.c checks what lies
 *          between them and puts the checks in order; a port adds its own, IMAGE_CHECKSUM and PWM_TIMER */

#define MOTOR_CHECK_LIST(X) \
    X(OK, 0, "Every check of the motor data passed.") \
    X(IMAGE_CHECKSUM, 1, "The motor data in flash do not match their checksum.") \
    X(PWM_TIMER, 2, "The PWM timer cannot make the PWM period or the dead time of the motor data.") \
    X(TASK_STEP, 3, "A step of the 1 kHz task must be 4 to 40 PWM periods and 0.8 to 1.25 ms long.") \
    X(FLUX_TABLE_MISSING, 4, "A flux table is missing.") \
    X(FLUX_TABLE_GRID, 5, "The grid of the flux tables or the scale of their inductances does not fit the look-up.") \
    X(FLUX_TABLE_VALUE, 6, "A flux table contains an inductance or observer gain that is not positive.") \
    X(REFERENCE_TABLE_MISSING, 7, "A table of current references is missing.") \
    X(REFERENCE_TABLE_GRID, 8, "The grid of the current references does not fit the look-up.") \
    X(REFERENCE_TABLE_VALUE, 9, "A table of current references contains a positive i_d or a negative i_q.") \
    X(CURRENT_MAX, 10, "The largest current of the current references is not positive.") \
    X(TORQUE_MAX, 11, "The largest torque is not positive.") \
    X(TORQUE_LIMIT, 12, "The torque limits have no torque, a negative device drop, or a loss that never settles.") \
    X(DERATING_STANDSTILL, 13, "The line over the speed that finds the direction of power must rise.") \
    X(DERATING_INVERTER, 14, "The derating line over the inverter's temperature must fall.") \
    X(DERATING_WINDING, 15, "The derating line over the winding's temperature must fall.") \
    X(DERATING_DC_LOW, 16, "The derating line over a low dc voltage must rise with the voltage.") \
    X(DERATING_DC_HIGH, 17, "The derating line over a high dc voltage must fall with the voltage.") \
    X(DERATING_SPEED, 18, "The derating line over the speed must fall.") \
    X(OVER_CURRENT_LEVEL, 19, "The over-current level must lie between 0 and 80 % of the full scale of the current.") \
    X(DC_VOLTAGE_LEVELS, 20, "The under-voltage level must lie below the over-voltage level.") \
    X(UNDER_VOLTAGE_LEVEL, 21, "The under-voltage level lies below the lowest dc voltage of current control.") \
    X(CURRENT_SUM_LEVEL, 22, "The level of the current sum must be positive and match the one for its third.") \
    X(NORMAL_CURRENT_LEVEL, 23, "The current up to which samples are not examined could hide an over-current.") \
    X(SAFE_STATE_FLUX, 24, "The magnet flux that decides between freewheel and short circuit is not positive.") \
    X(SAFE_STATE_LEVELS, 25, "The speed at which the short circuit ends must lie below the one at which it begins.") \
    X(MRAI_GAINS, 26, "A gain, the resistance or the period of the MRAI observer is out of its range.") \
    X(MRAI_LIMITS, 27, "The limits of an MRAI parameter are in the wrong order or beyond 0.5 per unit.") \
    X(MRAI_GATES, 28, "The smallest speed, or a drift that means no quality, is not positive in the MRAI data.") \
    X(IDENTIFY_WINDOW, 29, "The constants of the identification's window do not match one step of the task.") \
    X(IDENTIFY_RESISTANCE, 30, "The resistance of the identification or its prior variance is out of its range.") \
    X(IDENTIFY_NOISE, 31, "A noise of the identification is out of its range.") \
    X(IDENTIFY_THRESHOLDS, 32, "A speed, current or torque threshold of the identification is out of its range.") \
    X(IDENTIFY_CONFIDENCE, 33, "The identification's confidence has no rate, or its levels are in the wrong order.") \
    X(IDENTIFY_PRIOR, 34, "A prior's standard deviation or leak of the identification is out of its range.") \
    X(CURRENT_CONTROL_GAINS, 35, "A gain of the current control is out of its range.") \
    X(VOLTAGE_RATIO, 36, "The usable share of the dc voltage is not 0.5 to 0.7 or differs between its copies.") \
    X(VOLTAGE_RESERVE, 37, "The voltage reserve has no share of the dc voltage, or limits of the wrong sign.") \
    X(TORQUE_LOOP, 38, "The torque loop has no authority or no smallest torque.") \
    X(SHORTEST_PULSE, 39, "The shortest pulse of the bridge is out of its range.") \
    X(DEAD_TIME, 40, "The compensated dead time is negative or beyond a fifth of the PWM period.") \
    X(CURRENT_KNEE, 41, "The current at which the dead-time compensation is complete is out of its range.") \
    X(CLEAR_VOLTAGE, 42, "The voltage that is modulated without limits could be limited.") \
    X(LIVE_DATA, 43, "The data in RAM have changed by themselves: a complement or a seal does not match.")

#define MOTOR_CHECK_VALUE(name, value, text) MOTOR_CHECK_##name = (value),
typedef enum { MOTOR_CHECK_LIST(MOTOR_CHECK_VALUE) } motor_check_t;
#undef MOTOR_CHECK_VALUE

#endif
