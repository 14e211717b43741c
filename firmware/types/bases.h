/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TYPES_BASES_H
#define TYPES_BASES_H
/** The bases that convert SI to per unit; the only place where the drive's scale is stored.
 *   psi_b = V_b/omega_b   Z_b = V_b/I_b   L_b = Z_b/omega_b   T_b = 1.5 p psi_b I_b,
 *   so that torque is psi_d i_q - psi_q i_d with no constant.
 * Source   docs/scaling.md (SC-1) ... (SC-5), (SC-10)
 * Units    SI, peak phase quantities, electrical angular frequency
 * Range    finite and positive; periods_per_step 4 ... 40
 * Errors   the generator refuses bases that are not finite and positive; a test recomputes the derived ones
 * Context  start-up, configuration and telemetry only: no interrupt converts to SI */
#include <stdint.h>

typedef struct {
    float voltage_V;           /* V_b, phase peak */
    float current_A;           /* I_b, phase peak: the full scale of the current measurement */
    float omega_rad_s;         /* omega_b, electrical */
    float flux_Vs;             /* psi_b */
    float resistance_ohm;      /* Z_b */
    float inductance_H;        /* L_b */
    float torque_Nm;           /* T_b */
    float period_s;            /* T_s: one PWM period, one control period */
    float step_s;              /* T: one step of the 1 kHz task, periods_per_step T_s */
    uint32_t periods_per_step; /* N: the whole number of periods nearest to 1 ms, 4 ... 40 */
} bases_t;

#endif
