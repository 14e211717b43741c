/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SAFETY_LAUNCH_POWER_H
#define SAFETY_LAUNCH_POWER_H
/** Finds a wrong angle when the rotor begins to turn. At standstill all electrical power is loss, and the loss depends
 * on the currents only. While the current reference is constant, the power may change only by that of the torque that
 * the tables give; while it moves slowly, also by what the resistance takes.
 *   p = u.i* - w t, u without the voltage that changes the flux, w from the angles at both ends of the step
 *   m, n: first-order means of p and w, four steps, begun anew when the reference moves by i_0 within 4 steps, by
 *   more than 2 i_0 at once, or by i_0 from a current up to i_min
 *   m_0, n_0: m and n when they had settled; follow in 4096 steps, at first with much noise in 8
 *   r: mean over 16 steps of |p - m| where p - m has changed its sign, else 0, of each step at most 8 |i*| v_1: the
 *   noise of the current sensors; r_0 follows it as m_0 follows m, in the 8 steps to half of r. Until the means have
 *   settled r is a mean over 4 steps and r_0 = r; the first 4 steps after they have begun anew are not counted
 *   a reference that moves by i_0 slowly, from i to i': m_0 += m_0 (i' - i)/i + r i' (i' - i), and
 *   r_0 += r_0 (i' - i)/i + |i' - i| (r_error i' + v_1)/sqrt(2); begun anew where it has not moved by i_0
 *   for 32 steps, with r_0 > 2 r and r_0 > 1.5 |i*| v_1
 *   |m - m_0| > max(|i*| v_1 + 1 count, sqrt(2 r^2 + 2 r_0^2)) + |i*| |n - n_0|(psi_f/5 + |psi_q|/8) in a row of
 *   steps; no check below |i*| = i_min
 * Source   docs/theory/monitors.md (MN-28), (MN-29), (MN-39), (MN-57)
 * Units    voltages and speeds per unit times the periods of a step, angle 2^32 = one turn
 * Range    |u| <= 43 * 2^15, as of 40 periods and 1/(w_b T_s) = 3; 4 i_0 <= i_min; every other argument
 *          begins anew when the angle moves by 1/64 of a turn in a step
 * Rounding 2^-8 of a count of the sum; m_0, n_0 and r_0 up to 16 counts below (signal/mean.h)
 * Errors   returns FAULT_ANGLE_OFFSET while it is confirmed; the fast ISR latches it
 * Context  1 kHz task; one square root for each vector length; a division when a slow reference has moved by i_0 */
#include <stdbool.h>
#include <stdint.h>

#include "safety/winding_types.h"
#include "types/frames.h"

typedef struct {
    int32_t turn_gain; /* change of the angle in a step to speed */
    int32_t v_1;       /* in-phase voltage that the inverter's error and the angle's resolution may change */
    q15_t psi_share;   /* psi_f/5 */
    q15_t i_0;         /* movement of the reference that is followed or begins anew */
    q15_t i_min;
    uint8_t periods;      /* of a step */
    uint8_t settle_steps; /* until the means have settled */
    uint8_t fault_steps;
} launch_power_config_t;

typedef struct {
    int32_t power_q8, first_power_q8;
    int32_t omega_q8, first_omega_q8;
    dq_q15_halfword_t i_ref;
    int32_t noise_q8, first_noise_q8; /* of the power */
    uint32_t theta_e;                 /* of the last step */
    bool above : 1;                   /* p - m was positive in the last step */
    bool waited : 1;                  /* theta_e is older than a step */
    uint8_t steady, wrong;            /* steps, saturate */
    uint8_t since;                    /* steps since the reference moved, saturates */
} launch_power_state_t;

typedef struct {
    bool acting;
    bool behind;             /* the tracked speed is: the comparison begins anew */
    bool measured;           /* the angle is the sensor's; else the comparison waits */
    dq_q15_t u_standing;     /* acting voltage without that of the flux, summed over the periods of a step */
    dq_q15_t i_ref, psi_ref; /* in effect during that step, and the tables' flux there */
    uint32_t theta_e;        /* at its end */
    winding_resistance_t r;  /* at the present temperature */
} launch_power_in_t;

uint32_t launch_power_step(const launch_power_config_t *config, launch_power_state_t *state,
                           const launch_power_in_t *in);

#endif
