/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SAFETY_TORQUE_MONITOR_H
#define SAFETY_TORQUE_MONITOR_H
/** Monitors torque and angle from the voltages: independent of the tables' torque and of the identification, which the
 * control uses.
 *   speed   w = w_t + l, l = lag_gain (w_t - w_t of the last step): the tracked speed without its lag
 *   torque  p = u.i - r |i|^2 - d psi.i/dt = t w;   dev = p - t* w, first-order mean over 4 ms
 *           too much: sign(t* w) dev > |w| (t_0 + |t*|/8) + (v_0 + |d psi/dt|/2 + r_error |i|) (|i| + i_0) + |l t*|,
 *           or against the request by as much
 *   angle   e = u - r i - d psi/dt - j w psi(i), with the mean voltage of the step and the flux in its middle
 *           e_q shows a magnet that is too weak or too strong, e_d a wrong angle
 *           |e_d| > |w| (psi_f/5 + |psi_q|/8) + |l psi_q| + v,  or e_q sign(w) outside
 *           |w| psi_f (-0.5 ... 0.35) -+ (|l psi_d| + v),
 *           v = v_0/2 + v_noise + r |i| + c/2 + max(c - v_0, 0), c = |d psi/dt|; inactive while |w| psi_f/5 < v_0/2
 *   r     at the winding's temperature; without one, of the middle of its range; r_error, an eighth of it and half of
 *         that range, allows r_error |i| more
 *   confirmed by 20 ms in a row for the torque, 5 ms for the angle
 * Source   docs/theory/monitors.md (MN-6) ... (MN-10), (MN-26), (MN-32), (MN-41), (MN-44)
 * Units    per unit
 * Range    every argument; saturates
 * Rounding 1 LSB q15, against thresholds of hundreds
 * Errors   returns the set of faults that are confirmed now; the fast ISR latches them
 * Context  1 kHz task; no division */
#include <stdbool.h>
#include <stdint.h>

#include "safety/torque_types.h"
#include "safety/winding_types.h"
#include "types/frames.h"
#include "types/temperature.h"

typedef struct {
    q31_t deviation;
    dq_q15_t psi;               /* of the last step */
    dq_q15_halfword_t residual; /* e of the last step, 0 while it is not known */
    q15_t omega;                /* tracked, of the last step */
    uint8_t torque, angle, settling;
} torque_monitor_state_t;

typedef struct {
    bool acting;
    dq_q15_t u, i, psi;     /* acting voltage, current and the tables' flux there */
    dq_q15_t u_mean;        /* acting voltage, mean of the last step; u if there is none */
    q15_t omega;            /* tracked: lags behind the rotor */
    q15_t torque;           /* commanded, as the closed loop follows it */
    winding_resistance_t r; /* torque_monitor_resistance() of this step */
    q15_t current;          /* magnitude of i */
} torque_monitor_in_t;

/** (MN-32); a reading beyond the range of the winding's temperature counts as the end of the range. */
winding_resistance_t torque_monitor_resistance(const torque_monitor_config_t *config, int16_t winding_dC);
/** Lag of the tracked speed behind the rotor's beyond the apparent lag that one count of the sensor causes, else 0
 * (MN-41). Before torque_monitor_step() with the same speed. */
q15_t torque_monitor_lag(const torque_monitor_config_t *config, const torque_monitor_state_t *state, q15_t tracked);
/** The rotational voltage of flux psi that the tracked speed does not contain with this lag. Above v_lag it disturbs
 * the monitors frozen_angle.h and launch_power.h. */
q15_t torque_monitor_missing_voltage(q15_t lag, dq_q15_t psi);
uint32_t torque_monitor_step(const torque_monitor_config_t *config, torque_monitor_state_t *state,
                             const torque_monitor_in_t *in);

#endif
