/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SAFETY_FROZEN_ANGLE_H
#define SAFETY_FROZEN_ANGLE_H
/** Finds a rotor that turns although its measured angle stands still. While angle and current reference are constant,
 * the voltage must be constant, too: resistive drop and inverter error depend on the currents only, and any other
 * change of the voltage is induced by a turning rotor.
 *   m: first-order mean of u, four steps, begun anew when either moves or the speed lags
 *   m_0: m when angle and reference came to a standstill; follows in 1024 steps
 *   |m - m_0| > v_0 in a row of steps, 8 v_0 while a phase current is below 2 i_0; no check below |i*| = 4 i_0
 * Source   docs/theory/monitors.md (MN-22), (MN-23), (MN-27)
 * Units    voltages per unit times the periods of a step, currents per unit, angle 2^32 = one turn
 * Range    |u| <= 40 * 2^15; every other argument
 * Rounding 2^-8 of a count of the sum
 * Errors   returns FAULT_ANGLE_OFFSET while it is confirmed; the fast ISR latches it
 * Context  1 kHz task; one square root, no division */
#include <stdbool.h>
#include <stdint.h>

#include "types/frames.h"

typedef struct {
    int32_t v_0;          /* voltage change without a turning rotor, times the periods of a step */
    q16_t rate_gain;      /* change of flux to voltage, times the periods of a step */
    q15_t answer_rate;    /* share of a change of the reference that the flux follows in a step; Q15_MAX: all */
    q15_t i_0;            /* change of the reference that starts again; phase current that fixes its leg's voltage */
    uint8_t settle_steps; /* until the mean has settled */
    uint8_t fault_steps;
} frozen_angle_config_t;

typedef struct {
    dq_q15_t mean_q8, first_q8; /* of the sums */
    dq_q15_t i_ref;
    dq_q15_t psi;        /* of the last step: psi_ref as current control follows it */
    dq_q15_t u_standing; /* of this step: u_sum without the voltage that changes the flux */
    uint32_t theta_e;
    uint8_t standing, frozen; /* steps, saturate */
} frozen_angle_state_t;

typedef struct {
    bool acting;
    bool behind;       /* the tracked speed is behind the rotor's: the comparison begins anew */
    dq_q15_t u_sum;    /* acting voltage, summed over the periods of a step */
    dq_q15_t i_ref;    /* in effect during that step */
    dq_q15_t psi_ref;  /* tables' flux there */
    q15_t i_phase_min; /* the smallest of its phase currents, magnitude */
    uint32_t theta_e;
} frozen_angle_in_t;

uint32_t frozen_angle_step(const frozen_angle_config_t *config, frozen_angle_state_t *state,
                           const frozen_angle_in_t *in);

#endif
