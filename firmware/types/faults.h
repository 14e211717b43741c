/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TYPES_FAULTS_H
#define TYPES_FAULTS_H
/** The fault word's bits, named and explained here only. From this list the tools (bus.words) write the value tables
 *   and comments of the DBC, the description file for calibration tools, the words of the library and the pages.
 *   X(NAME, bit, explanation): FAULT_NAME in C, the name in lower case everywhere else
 * Source   docs/theory/monitors.md, docs/architecture.md
 * Units    none: one bit for each fault
 * Range    bits 0 ... 15 of a 32-bit word
 * Errors   none: values only
 * Context  values only */
#include <stdint.h>

#define FAULT_LIST(X) \
    X(OVER_CURRENT, 0, "A phase current exceeds the trip level in one sample.") \
    X(OVER_VOLTAGE, 1, "The dc voltage exceeds its upper limit in 2 samples.") \
    X(UNDER_VOLTAGE, 2, "The dc voltage is below its lower limit in 10 samples while the drive runs.") \
    X(CURRENT_SUM, 3, "The sum of the phase currents exceeds 5 % of full scale in 5 samples.") \
    X(ANGLE, 4, "The angle is implausible for 7 ms or in more than one sample of 41, or its sensor reports an error.") \
    X(INPUT, 5, "Samples are invalid or repeatedly missing, or a converter's reference, zero or gain is wrong.") \
    X(OVERRUN, 6, "The 1 kHz task wrote no command for 2 steps, or the paper's law missed 3 periods in a row.") \
    X(CONFIG, 7, "The motor data or the port's settings failed a check; a separate value names the check.") \
    X(CONTROL, 8, "The current is off its reference for 20 ms, 100 ms at the voltage limit, or oscillates about it.") \
    X(PHASE_LOST, 9, "A phase carries no current although it should, in 8 ms of samples.") \
    X(CURRENT_STUCK, 10, "A phase current has 20 equal samples at 1 kHz while the others change.") \
    X(OVER_SPEED, 11, "The speed exceeds its maximum by 80 % of the margin to the end of the signal for 5 ms.") \
    X(ANGLE_OFFSET, 12, "The back-EMF contradicts the measured angle, or changes while that does not, for 5 ms.") \
    X(TORQUE, 13, "The torque exceeds the command by more than its tolerance, or voltages contradict the currents.") \
    X(TEMPERATURE, 14, "The inverter or the winding is at the end of its derating line for 110 ms.") \
    X(GATE, 15, "The gate driver reports a fault, or a current flows although switching is disabled.")

#define FAULT_BIT(name, bit, text) FAULT_##name = 1u << (bit),
enum { FAULT_LIST(FAULT_BIT) };
#undef FAULT_BIT

/** Faults after which the currents are still controlled: the drive moves them before it ends the control
 * (drive/switch_off.h). */
#define FAULTS_CONTROLLED ((uint32_t)FAULT_TEMPERATURE | (uint32_t)FAULT_OVER_SPEED)
/** Faults by a current that does not follow its reference. Their usual cause leaves the samples right; a wrong zero of
 * a current sensor or an eccentric angle can raise them, too (SS-31). */
#define FAULTS_OF_PHASE ((uint32_t)FAULT_CONTROL | (uint32_t)FAULT_PHASE_LOST)

#endif
