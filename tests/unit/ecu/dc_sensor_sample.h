/* SPDX-License-Identifier: Apache-2.0 */
#ifndef UNIT_ECU_DC_SENSOR_SAMPLE_H
#define UNIT_ECU_DC_SENSOR_SAMPLE_H
#include "drive/drive.h"

#define COUNT_PER_V (32768.0 / 540.0) /* of hsm1 */

/* A machine at half of the speed base on 350 V whose dc voltage sensor reads so many times the voltage. The drive
 * computes the acting voltage from it. */
static inline sample_t sample_with_dc_gain(double gain)
{
    return (sample_t){
        .acting = true,
        .v_dc = (int32_t)(gain * 350.0 * COUNT_PER_V),
        .point = {.i = {0, 9000}, .u = {0, (int32_t)(gain * 7000.0)}, .flux = {.psi_d = 14000}, .omega = 1 << 30}};
}

#endif
