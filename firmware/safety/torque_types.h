/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SAFETY_TORQUE_TYPES_H
#define SAFETY_TORQUE_TYPES_H
/** Motor data of the monitors that compare the voltages with the machine's: torque_monitor.h, gain_jump.h.
 * Source   docs/theory/monitors.md
 * Units    per unit
 * Range    stated per value
 * Errors   none: values only
 * Context  values only */
#include <stdint.h>

#include "fx/q.h"

typedef struct {
    q31_t r;                                /* at 20 C, < 1/4 */
    q31_t r_per_dC;                         /* per 0.1 K */
    int16_t winding_min_dC, winding_max_dC; /* range of the winding's temperature: -40 C to its trip */
    q15_t psi_f;
    q15_t t_0;                                       /* torque error allowed at no torque */
    q15_t v_0;                                       /* voltage error of the inverter */
    q15_t v_noise;                                   /* of one period's voltage, beyond v_0 */
    q15_t i_0;                                       /* current error of noise and of the current's zero crossings */
    q16_t rate_gain;                                 /* 1/(omega_b task period): flux step to voltage */
    q16_t lag_gain;                                  /* lag of the tracked speed, in steps */
    q15_t lag_noise;                                 /* apparent lag that one count of the sensor causes */
    q15_t v_lag;                                     /* rotational voltage that may be missing */
    q15_t mean_rate;                                 /* of the first-order mean, per step */
    uint8_t torque_steps, angle_steps, settle_steps; /* 20, 5, 5 ms */
} torque_monitor_config_t;

#endif
