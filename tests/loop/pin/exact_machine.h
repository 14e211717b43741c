/* SPDX-License-Identifier: Apache-2.0 */
#ifndef LOOP_PIN_EXACT_MACHINE_H
#define LOOP_PIN_EXACT_MACHINE_H
/** A machine for tests that compare bits: the same result on every computer and with every compiler.
 *   psi_d = psi_f + L_d i_d, psi_q = L_q i_q / (1 + |i_q| / i_sat), d(psi)/dt = v - R i - omega J psi
 *   dead time and device drop reduce the voltage of each phase against the direction of its current
 *   Only additions, multiplications, divisions and comparisons of doubles, which IEEE 754 defines to the last bit; the
 *   sine is a polynomial of this file. Accuracy is measured with tests/plant, not with this machine.
 * Units    SI
 * Errors   none
 * Context  compile without contraction of products and sums */
#include <stdbool.h>

typedef struct {
    double psi_f_Vs, l_d_H, l_q_H, i_sat_A, r_ohm, pole_pairs;
    double gain[3]; /* of the current sensors */
    double offset_A[3];
    double angle_ripple; /* of the angle sensor, first harmonic, rad mechanical */
} exact_machine_t;

typedef struct {
    double psi_d_Vs, psi_q_Vs, theta_m_turns;
} exact_state_t;

double exact_sin_turns(double turns);

/** Sensor values in the order of fluxtrue_step(). */
void exact_machine_sample(const exact_machine_t *m, const exact_state_t *s, double v_dc_V, double winding_C,
                          double in[6]);

/** One period at constant duties. on: the bridge switches; otherwise no current flows. */
void exact_machine_step(const exact_machine_t *m, exact_state_t *s, const double duty[3], bool on, double v_dc_V,
                        double speed_rad_s, double period_s);

#endif
