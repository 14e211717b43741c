/* SPDX-License-Identifier: Apache-2.0 */
#ifndef ECU_BATTERY_VOLTAGE_H
#define ECU_BATTERY_VOLTAGE_H
/** Compares the dc voltage that the inverter measures with the battery's voltage that the bus transmits.
 *   near         |V_bat - v_dc| <= 5 % of V_bat: the contactor may close (MN-30); true while V_bat is not known,
 *                false after it was known and its message is lost
 *   contradicts  |V_bat - v_dc| > 8 % of V_bat for more than 250 ms of a live message with the contactor closed (MN-31)
 * Source   docs/theory/monitors.md (MN-30), (MN-31)
 * Units    V; us
 * Range    every voltage; a battery_V of 0 is not known
 * Errors   none; the caller latches the mismatch
 * Context  1 kHz task; pure */
#include <stdbool.h>
#include <stdint.h>

typedef struct {
    float battery_V; /* 0: not known */
    float v_dc_V;
    bool alive; /* the battery's message */
    bool contactor;
    uint32_t elapsed_us; /* since the last step */
} battery_voltage_in_t;

typedef struct {
    uint32_t us; /* for which the voltages have contradicted each other */
} battery_voltage_t;

bool battery_voltage_is_near(const battery_voltage_in_t *in);
bool battery_voltage_contradicts(battery_voltage_t *state, const battery_voltage_in_t *in);

#endif
