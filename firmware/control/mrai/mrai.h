/* SPDX-License-Identifier: Apache-2.0 */
#ifndef MRAI_MRAI_H
#define MRAI_MRAI_H
/** Model reference adaptive identification of stator resistance and magnet flux.
 *   Full-order observer in flux linkage, poles at -S/2 +- jS/2, S = m R_0 (1/L_d + 1/L_q), carried as its error
 *   e = (2 (psi_d(i) - psi_d~), psi_q(i) - psi_q~). The derivative enters as the change of the tables' flux, which is
 *   exact with saturation and cross coupling. The only inductances in the equations are those of S.
 *     e_d += 2 (dpsi_d - T_s (u_d + w psi_q - R^ i_d)) + s2 (e_q - e_d)
 *     e_q += dpsi_q - T_s (u_q - w (psi_d + dpsi) - R^ i_q) - s2 (e_d + e_q),   s2 = S T_s/2
 *   with the means over the period's two ends in the bracket.
 *   Adaptation, proportional and integral, normalised so that k_psi, k_r are bandwidths at every speed and current:
 *     dpsi -= 2 k_psi s2 e_q/w,   dR -= 2 k_r s2 (2 i_d e_d + i_q e_q)/n,  n = 4 i_d^2 + i_q^2
 * Source   docs/theory/mrai.md (MR-1) ... (MR-24); the 2014 paper's (3), (6), (7), (8), (11), in flux linkage
 * Units    per unit; dpsi is the deviation from the table's psi_f0, dR from R_0 (20 C)
 * Range    |w| < 1, |i| < 1, errors clamped to 4 pu of flux, s2 e to 1/16 in the laws; results clamped to
 *          [psi_min, psi_max], [r_min, r_max]
 * Rounding state LSB 2^-27 pu (errors), 2^-31 pu (parameters); steps rounded half up where they accumulate
 * Errors   mrai_..._clamped() reports a limit; while a gate condition is not met, the parameter is held and the
 *          observer continues
 * Context  MRAI ISR, each period, below the current ISR; mrai_schedule_step() in the 1 kHz task; no division in the
 *          step */
#include <stdbool.h>
#include <stdint.h>

#include "types/features.h"
#include "types/motor_check.h"
#include "types/operating_point.h"

#if !FLUXTRUE_MRAI
#error "A build without the paper's law includes nothing of it."
#endif

/** In the order of use: what every period reads comes first. */
typedef struct {
    q31_t pole_gain;               /* 4 m R_0 2^g_shift: s2 = pole_gain g/4, below 1/4 */
    int32_t flux_proportional_q24; /* k_P/k_I of the flux law, in periods, < 128 */
    q31_t psi_delta_min, psi_delta_max;
    q31_t r_delta_min, r_delta_max;
    int32_t resistance_proportional_q24; /* k_P/k_I of the resistance law, in periods, < 128 */
    q31_t r0;                            /* nominal resistance in the observer and its poles */
    q31_t period;                        /* omega_b T_s: volts per unit to flux per unit and period */
    q31_t flux_gain;                     /* 2 k_psi/omega_b */
    q31_t resistance_gain;               /* 2 k_r/omega_b */
    q15_t omega_min;                     /* no adaptation below this speed */
    q15_t omega_r_max;                   /* resistance held above this speed */
    q15_t i_min;                         /* no adaptation below this magnitude of current */
    q31_t sinc_gain;                     /* (omega_b T_s)^2/24: 1/sinc(w T_s/2) - 1 = sinc_gain w^2 */
    q31_t psi_drift_full;                /* drift of dpsi per 1 kHz step that means quality 0: 5 % psi_f k_psi 1 ms */
    q31_t r_drift_full;                  /* drift of dR per 1 kHz step that means quality 0: 20 % R_0 k_r 1 ms */
    q15_t quality_rate;                  /* of the quality filters, per 1 kHz step */
    int16_t g_shift;                     /* the flux table stores g/2^g_shift */
} mrai_config_t;

/** Slowly varying factors: written by the 1 kHz task, read by the MRAI ISR through a double buffer. */
typedef struct {
    int32_t flux_step_q28;       /* 2 k_psi/(omega_b w), signed like w; 0 holds the flux */
    int32_t resistance_step_q26; /* 2 k_r/(omega_b n); 0 holds the resistance */
    int32_t minus_voltage_d_q28; /* of the d equation: twice that of the q equation */
    int32_t minus_voltage_q28;   /* -omega_b T_s/sinc(w T_s/2) */
} mrai_schedule_t;

typedef struct {
    int32_t e_d_q27, e_q_q27;                 /* observer error, flux */
    int32_t predicted_d_q27, predicted_q_q27; /* terms of the next error that are known: e - psi, half of the
                                       * rotational and resistive voltage, the voltage of the period */
    q31_t psi_delta, r_delta;                 /* integral parts: the identified parameters */
} mrai_state_t;

motor_check_t mrai_check(const mrai_config_t *config);
void mrai_step(const mrai_config_t *config, const mrai_schedule_t *schedule, mrai_state_t *state,
               const operating_point_t *in);
/** Before and after the step of the sample at which the observer starts: the error is then 0, the identified parameters
 * are as before. */
void mrai_start_before_step(mrai_state_t *state);
void mrai_start_after_step(mrai_state_t *state);

/** The identified flux, rounded; its limits prevent an overflow. */
static inline int32_t mrai_psi_delta_q15(const mrai_state_t *state)
{
    return (state->psi_delta + 0x8000) >> 16;
}

/** The parameter is at its limit. */
static inline bool mrai_flux_clamped(const mrai_config_t *config, const mrai_state_t *state)
{
    return state->psi_delta <= config->psi_delta_min || state->psi_delta >= config->psi_delta_max;
}

static inline bool mrai_resistance_clamped(const mrai_config_t *config, const mrai_state_t *state)
{
    return state->r_delta <= config->r_delta_min || state->r_delta >= config->r_delta_max;
}

#endif
