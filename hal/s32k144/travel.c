/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/s32k144/travel.h"

#include "fx/codegen.h"
#include "signal/counter.h"

/* Debuggers find the counter by its name. */
struct {
    uint16_t invalid; /* samples that were outside the band, or frames that were disturbed or missing */
} angle_errors;

/* The rotor is assumed to have moved as in the period before. Not inlined: rare, and the usual path stays short. */
FX_NOT_INLINED FX_COLD void travel_predict(travel_t *sensor)
{
    sensor->last += (uint32_t)sensor->travel;
    count_up(&sensor->invalid);
    count_up(&angle_errors.invalid);
}
