/* SPDX-License-Identifier: Apache-2.0 */
#ifndef IDENTIFY_IRON_H
#define IDENTIFY_IRON_H
/** Nominal admittance of the iron: the current of its loss per flux linkage.
 *   a = (k_h sgn w + k_e w)/1.5, where sgn w passes through zero with a finite slope
 * Source   docs/theory/identification.md (ID-4)
 * Units    per unit, q31
 * Range    every speed
 * Rounding 2 LSB
 * Errors   none: saturates
 * Context  1 kHz task */
#include "control/identify/config.h"

static inline q31_t identify_iron_admittance(const identify_config_t *config, q31_t omega)
{
    const q31_t sign = fx_mul_gain_q31(config->iron_sign_gain, omega);
    return fx_add_q31(fx_mul_q31(config->iron_hysteresis, sign), fx_mul_q31(config->iron_eddy, omega));
}

#endif
