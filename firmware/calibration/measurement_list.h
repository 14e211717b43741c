/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CALIBRATION_MEASUREMENT_LIST_H
#define CALIBRATION_MEASUREMENT_LIST_H
/** The values that a calibration tool may record, one snapshot per step of the task while it is connected.
 *   X(name, type, base, expression, text); the physical value is raw * base / 2^15, or raw itself without a base
 *   (NONE) and where the base is a list of words (FAULT, MOTOR_CHECK). d is the drive.
 * Source   docs/howto/xcp.md
 * Units    a name ends in its unit
 * Context  calibration/measurements.c fills it, ecu/a2l_records.c describes it to tools */

/* What the freeze frame keeps: written in every step. */
#define MEASUREMENT_KEPT_LIST(X) \
    X(i_d_A, S16, CURRENT, MEASURED(d).point.i.d, "Current along the magnet") \
    X(i_q_A, S16, CURRENT, MEASURED(d).point.i.q, "Current across the magnet") \
    X(u_d_V, S16, VOLTAGE, (d)->fast.u_next.d, "Voltage of the next period, d") \
    X(u_q_V, S16, VOLTAGE, (d)->fast.u_next.q, "Voltage of the next period, q") \
    X(v_dc_V, S16, VOLTAGE, MEASURED(d).v_dc, "Measured dc voltage") \
    X(torque_commanded_Nm, S16, TORQUE, (d)->task.torque_commanded, "Limited torque after slew") \
    X(torque_estimated_Nm, S16, TORQUE, (d)->task.identification.torque_estimated, "Estimated air-gap torque") \
    X(speed_rpm, F32, NONE, drive_speed_rpm(d, MEASURED(d).point.omega), "Speed of the rotor") \
    X(psi_f_Vs, F32, NONE, drive_psi_f_Vs(d), "Identified magnet flux") \
    X(r_ohm, F32, NONE, drive_r_ohm(d), "Identified resistance") \
    X(fault_word, U32, FAULT, (d)->fast.faults, "Latched faults, one bit each") \
    X(motor_check, U8, MOTOR_CHECK, drive_motor_check(d), "What the fault config stands for")

/* Written while a tool is connected. */
#define MEASUREMENT_RECORDED_LIST(X) \
    X(i_d_ref_A, S16, CURRENT, (d)->task.reference.i_ref.d, "Reference of i_d") \
    X(i_q_ref_A, S16, CURRENT, (d)->task.reference.i_ref.q, "Reference of i_q") \
    X(torque_arbitrated_Nm, S16, TORQUE, (d)->request.torque_arbitrated, "Requested torque after limits and slew") \
    X(torque_limited_Nm, S16, TORQUE, (d)->task.allowed.torque_limited, "Arbitrated torque within its limits") \
    X(torque_corrected_Nm, S16, TORQUE, (d)->task.torque_corrected, "Commanded torque after the torque loop") \
    X(psi_quality, S16, ONE, (d)->task.identification.psi_quality, "Quality of the identified flux") \
    X(r_quality, S16, ONE, (d)->task.identification.r_quality, "Quality of the identified resistance") \
    X(processor_dC, S16, NONE, hal_temperature_processor_dC(), "Processor, tenths of a degree; -32768: unknown") \
    X(mrai_overruns, U32, NONE, mrai_overruns(d), "Periods in which the identification was late")

#define MEASUREMENT_LIST(X) MEASUREMENT_KEPT_LIST(X) MEASUREMENT_RECORDED_LIST(X)

#endif
