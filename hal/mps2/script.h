/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_MPS2_SCRIPT_H
#define HAL_MPS2_SCRIPT_H
/** Scripted sensor values and requests, period by period: the same integers on every processor, so that the duties must
 * be identical too.
 *   angle: 41 s^-1 rising to 150 s^-1; currents: a vector that turns with the rotor, its d and q parts triangles of the
 *   period's number; dc voltage: a triangle around 350 V; torque: four levels one after the other, switching enabled
 *   from period 20
 * Source   none: a stimulus without a machine, with which the controller's integrators reach their limits
 * Units    as hal/adc.h and hal/angle.h; sum: Fletcher-like, over duties and enable of every period
 * Context  fast ISR: script_adc(), script_angle(), script_note(); 1 kHz task: script_request() */
#include <stdbool.h>
#include <stdint.h>

#include "drive/drive.h"
#include "types/samples.h"

#define SCRIPT_PERIODS 4000U

typedef struct {
    uint32_t period;
    uint32_t angle;
    uint32_t low, high; /* the sum */
    uint32_t differing; /* periods whose duty differs from the one before */
    uint32_t last;
} script_t;

void script_next(script_t *script);
adc_counts_t script_adc(const script_t *script);
void script_request(const script_t *script, request_t *request);
void script_note(script_t *script, duty_t duty, bool gates);

#endif
