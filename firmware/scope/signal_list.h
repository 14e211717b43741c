/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SCOPE_SIGNAL_LIST_H
#define SCOPE_SIGNAL_LIST_H
/** The signals that the scope can capture; no other memory can be named. One half word each: a Q15 number, the upper
 *   half of a Q31 number or of an angle.
 *   X(name, base, place, text); the physical value is raw * base / 2^15. The place is one of
 *     PERIOD(field)  of sample_t: a value of every PWM period
 *     UPPER(field)   the upper half of such a word
 *     STEP(field)    of scope_step_values_t: a value of the 1 kHz task, constant between two of its commands
 * Source   docs/howto/scope.md
 * Units    a name ends in its unit
 * Context  scope/columns.c finds them, ecu/a2l_records.c describes them to tools */

#define SCOPE_SIGNAL_LIST(X) \
    X(i_d_A, CURRENT, PERIOD(point.i.d), "Current along the magnet") \
    X(i_q_A, CURRENT, PERIOD(point.i.q), "Current across the magnet") \
    X(u_d_V, VOLTAGE, PERIOD(point.u.d), "Commanded voltage that acts in this period, d") \
    X(u_q_V, VOLTAGE, PERIOD(point.u.q), "Commanded voltage that acts in this period, q") \
    X(v_dc_V, VOLTAGE, PERIOD(v_dc), "Measured dc voltage") \
    X(omega_rad_s, OMEGA, UPPER(point.omega), "Electrical speed") \
    X(theta_e_deg, ANGLE, UPPER(theta_e), "Electrical angle") \
    X(i_zero_A, ZERO, UPPER(zero_q28), "Mean of the phase currents") \
    X(i_alpha_A, CURRENT, PERIOD(i_ab), "Current, alpha") \
    X(i_beta_A, CURRENT, UPPER(i_ab), "Current, beta") \
    X(psi_d_Vs, FLUX, PERIOD(point.flux.psi_d), "Flux linkage of the tables, d") \
    X(psi_q_Vs, FLUX, PERIOD(point.flux.psi_q), "Flux linkage of the tables, q") \
    X(theta_m_deg, ANGLE, UPPER(theta_m), "Mechanical angle") \
    X(i_d_ref_A, CURRENT, STEP(i_d_ref), "Reference of i_d") \
    X(i_q_ref_A, CURRENT, STEP(i_q_ref), "Reference of i_q") \
    X(torque_commanded_Nm, TORQUE, STEP(torque_commanded), "Limited torque after slew") \
    X(torque_corrected_Nm, TORQUE, STEP(torque_corrected), "Commanded torque after the torque loop") \
    X(torque_estimated_Nm, TORQUE, STEP(torque_estimated), "Estimated air-gap torque") \
    X(psi_error_Vs, FLUX, STEP(psi_error), "Identified error of psi_d that is fed forward")

/** Those of the freeze frame, which tools also capture unless others are chosen. */
#define SCOPE_USUAL_SIGNALS \
    { \
        CAPTURE_i_d_A, CAPTURE_i_q_A, CAPTURE_u_d_V, CAPTURE_u_q_V, CAPTURE_v_dc_V, CAPTURE_omega_rad_s, \
            CAPTURE_theta_e_deg, CAPTURE_i_zero_A \
    }

#endif
