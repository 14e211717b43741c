/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_HOST_ANGLE_SOURCE_H
#define HAL_HOST_ANGLE_SOURCE_H
/** Where the angle of this port comes from: the sensor, as it is connected, or for commissioning an imposed one.
 *   electrical = +-p theta_s + offset   sensor: pole pairs, direction and offset as set
 *   electrical += f T_s                 imposed: currents that do not turn with the rotor
 * Pole pairs, direction, offset and imposing act when switching is disabled: a jump of the angle while currents flow
 * would be a fault. Until one of them is set, the sensor's angle reaches the firmware unchanged.
 * Source   docs/theory/commissioning.md (CM-15)
 * Units    turns, Hz and rad; electrical but for the sensor's
 * Context  host port: no port of a controller has this */
#include <stdbool.h>
#include <stdint.h>

typedef struct {
    double pole_pairs; /* electrical turns of a turn of the sensor; 0: those of the motor data */
    double offset_rad; /* electrical */
    bool reversed;
    bool imposed;
} angle_connection_t;

typedef struct {
    angle_connection_t asked, acting;
    double imposed_hz;
    double imposed; /* electrical turns */
    double turns;   /* of the sensor since the start, continuous */
} angle_source_t;

typedef struct {
    double pole_pairs; /* of the motor data */
    double period_s;
    bool gates;
} angle_source_in_t;

/** The angle of the firmware's motor, 2^32 = one turn. changed: it has jumped, because another source acts now. */
uint32_t angle_source_step(angle_source_t *source, const angle_source_in_t *in, double sensor_turns, bool *changed);

#endif
