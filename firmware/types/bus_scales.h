/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TYPES_BUS_SCALES_H
#define TYPES_BUS_SCALES_H
/** Value of one count of each quantity on the bus: physical value = raw value * factor, the factors of the motor's DBC.
 *   A signal's unit names its quantity. `motor build` chooses the factors and writes the DBC that has them.
 * Source   docs/decisions/018-bus-scales.md; tools/fluxtrue_tools/bus/scales.py
 * Units    as the names say: the units of the signals
 * Range    1, 2 or 5 times a power of ten
 * Errors   none: constant data
 * Context  const data in flash, read by the 1 kHz task */
typedef struct {
    float torque_Nm;
    float speed_rpm;
    float resistance_mohm;
    float flux_mVs;
    float current_A;
    float voltage_V;
    float power_kW;
} bus_scales_t;

#endif
