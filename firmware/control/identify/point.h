/* SPDX-License-Identifier: Apache-2.0 */
#ifndef IDENTIFY_POINT_H
#define IDENTIFY_POINT_H
/** One operating point from the N periods of a window: means, speed, change of flux, magnetising current.
 *   i = trapezoidal mean, u = mean acting voltage/sinc, w = change of the measured angle over the window
 *   i_m = i + a (psi_q, -psi_d),  a = (k_h sgn w + k_e w)/1.5
 * Source   docs/theory/identification.md (ID-1) ... (ID-4)
 * Units    per unit
 * Range    |w| < 1; the number of whole turns follows from the tracked speed
 * Rounding half up, 1/2 LSB of Q30
 * Errors   saturates; valid is false if the window's voltage must not be used
 * Context  1 kHz task */
#include "control/identify/config.h"
#include "control/identify/window.h"

typedef struct {
    dq_q31_t i;
    dq_q30_t u, rate;
    dq_q15_t i_m;
    q31_t omega;
    q31_t iron;        /* a */
    int32_t chord_q30; /* theta^2/12: relative difference of sampled and mean flux of a period (ID-20) */
    uint8_t limited;
    bool valid;
} identify_point_t;

identify_point_t identify_point(const identify_config_t *config, const identify_window_t *window, q31_t omega_tracked);

#endif
