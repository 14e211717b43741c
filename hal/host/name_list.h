/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_HOST_NAME_LIST_H
#define HAL_HOST_NAME_LIST_H
/** Unit, kind and meaning of the names of fluxtrue_set() and fluxtrue_get(), for fluxtrue_info(). Calibration values
 *   have theirs in calibration/calibration_list.h.
 *   X(name, unit, kind, text)
 * Source   docs/howto/software-in-the-loop.md
 * Units    ASCII: Nm, ohm, degC
 * Context  hal/host/describe.c; a test finds a name without a line here */

#define NAME_LIST(X) \
    X(torque_requested_Nm, "Nm", NUMBER, "Requested torque.") \
    X(enable, "", SWITCH, "1 enables switching.") \
    X(torque_loop, "", SWITCH, "1 closes the torque loop on the estimated torque.") \
    X(identification, "", SWITCH, "1 lets the identification change its parameters.") \
    X(identification_mode, "", SWITCH, "1: robust identification; 0: that of the 2014 paper.") \
    X(trim, "", SWITCH, "1 lets the dead-time compensation follow the robust identification.") \
    X(fault_reset, "", SWITCH, "1 clears the faults while enable is 0; reads 1 until the reset is processed.") \
    X(identification_reset, "", SWITCH, "1 resets the identification; reads 1 until the reset is processed.") \
    X(current_mode, "", SWITCH, "1 takes id_ref_A and iq_ref_A as current references, without the torque path.") \
    X(id_ref_A, "A", NUMBER, "Current reference in d; can be set for current mode.") \
    X(iq_ref_A, "A", NUMBER, "Current reference in q; can be set for current mode.") \
    X(inverter_C, "degC", NUMBER, "Temperature of the inverter.") \
    X(known_voltage_share, "", NUMBER, "Reading of a known voltage; 1: the converters' reference is right.") \
    X(machine_monitors, "", SWITCH, "0 disables the monitors that need a machine at the terminals.") \
    X(torque_limit_drive_Nm, "Nm", NUMBER, "Largest torque that may drive.") \
    X(torque_limit_regen_Nm, "Nm", NUMBER, "Largest torque that may regenerate.") \
    X(power_limit_drive_W, "W", NUMBER, "Largest power that may be drawn from the dc link.") \
    X(power_limit_regen_W, "W", NUMBER, "Largest power that may be fed back to the dc link.") \
    X(torque_arbitrated_Nm, "Nm", NUMBER, "Torque after arbitration; without a bus the requested torque.") \
    X(torque_limited_Nm, "Nm", NUMBER, "Torque after the limits.") \
    X(torque_commanded_Nm, "Nm", NUMBER, "Torque after the slew-rate limit.") \
    X(torque_corrected_Nm, "Nm", NUMBER, "Torque after the torque loop: input of the current reference.") \
    X(torque_estimated_Nm, "Nm", NUMBER, "Torque estimated by the identification.") \
    X(torque_max_Nm, "Nm", NUMBER, "Largest torque that the machine, as identified, can make now.") \
    X(voltage_trim_V, "V", NUMBER, "Change of the planned voltage by the voltage reserve.") \
    X(derating, "", BITS, "Reasons for less than the requested torque.") \
    X(torque_correction, "", NUMBER, "Relative correction of the commanded torque by the torque loop.") \
    X(psi_f_Vs, "Vs", NUMBER, "Identified magnet flux.") \
    X(r_ohm, "ohm", NUMBER, "Identified resistance of a phase.") \
    X(psi_quality, "", NUMBER, "Quality of the identified flux, 0 to 1.") \
    X(r_quality, "", NUMBER, "Quality of the identified resistance, 0 to 1.") \
    X(drop_V, "V", NUMBER, "Identified voltage along the current that is not compensated.") \
    X(lq_scale, "", NUMBER, "Identified scale of psi_q.") \
    X(ld_scale, "", NUMBER, "Identified scale of psi_d without the magnet.") \
    X(angle_error_rad, "rad", NUMBER, "Identified error of the electrical angle.") \
    X(iron_scale, "", NUMBER, "Identified scale of the iron loss.") \
    X(parameter_clamped, "", SWITCH, "1 while an identified parameter is at its limit.") \
    X(torque_confidence, "", NUMBER, "Share of its authority that the torque loop may use, 0 to 1.") \
    X(mismatch_share, "", NUMBER, "Share of recent updates that the model cannot explain.") \
    X(local_flux_Vs, "Vs", NUMBER, "Magnitude of the flux error of this operating point.") \
    X(psi_clamped, "", SWITCH, "1 while the identified flux is at its limit.") \
    X(r_clamped, "", SWITCH, "1 while the identified resistance is at its limit.") \
    X(id_A, "A", NUMBER, "Measured current in d.") \
    X(iq_A, "A", NUMBER, "Measured current in q.") \
    X(i_zero_A, "A", NUMBER, "Mean of the measured phase currents; without errors of the sensors it is zero.") \
    X(ud_V, "V", NUMBER, "Voltage in d that acts in the next period.") \
    X(uq_V, "V", NUMBER, "Voltage in q that acts in the next period.") \
    X(vdc_V, "V", NUMBER, "Measured dc voltage.") \
    X(speed_rpm, "rpm", NUMBER, "Mechanical speed.") \
    X(fault_word, "", BITS, "Latched faults.") \
    X(motor_check, "", CHOICE, "Check of the motor data that failed.") \
    X(voltage_limited, "", SWITCH, "1 while the voltage circle limits the voltage.") \
    X(table_clamped, "", SWITCH, "1 while the current is outside the flux tables.") \
    X(mrai_overruns, "", COUNT, "Periods that the identification of the paper had to leave out.") \
    X(run_state, "", CHOICE, "State of the drive.") \
    X(winding_C, "degC", NUMBER, "Measured temperature of the winding.") \
    X(commission, "", CHOICE, "Phase of the commissioning; 1 starts it.") \
    X(commission_failure, "", CHOICE, "Reason for which the commissioning failed.") \
    X(commission_r_ohm, "ohm", NUMBER, "Resistance measured by the commissioning.") \
    X(compensation_V, "V", NUMBER, "Compensated voltage error of a phase at the present dc voltage.") \
    X(compensation_knee_A, "A", NUMBER, "Current from which the compensated voltage error is constant.") \
    X(pulses, "", CHOICE, "Phase of the voltage pulses at standstill; 1 starts them.") \
    X(pulses_failure, "", CHOICE, "Reason for which the voltage pulses ended early.") \
    X(pulses_agreed, "", SWITCH, "Consent to voltage pulses, as of the bus; begins only with switching disabled.") \
    X(pulses_vd, "", NUMBER, "Voltage of the pulses in d, as a share of the largest voltage.") \
    X(pulses_vq, "", NUMBER, "Voltage of the pulses in q, as a share of the largest voltage.") \
    X(pulses_first, "", NUMBER, "Share of its bound at which the first half wave of the current in q ends.") \
    X(pulses_id_low_A, "A", NUMBER, "Lower bound of the current in d: the voltage turns positive.") \
    X(pulses_id_high_A, "A", NUMBER, "Upper bound of the current in d: the voltage turns negative.") \
    X(pulses_iq_low_A, "A", NUMBER, "Lower bound of the current in q: the voltage turns positive.") \
    X(pulses_iq_high_A, "A", NUMBER, "Upper bound of the current in q: the voltage turns negative.") \
    X(pulses_angle_rad, "rad", NUMBER, "Electrical angle by which the rotor may move during the pulses.") \
    X(pulses_delay, "", COUNT, "Periods before the voltage in q begins.") \
    X(pulses_reversals, "", COUNT, "Reversals of the voltage, in q if it has one, after which the pulses end.") \
    X(pulses_periods, "", COUNT, "Periods after which the pulses end in any case.") \
    X(theta_e_rad, "rad", NUMBER, "Electrical angle of the last sample.") \
    X(sensor_turns, "", NUMBER, "Turns of the angle sensor since the start.") \
    X(angle_pole_pairs, "", NUMBER, "Electrical turns for each turn of the angle sensor.") \
    X(angle_reversed, "", SWITCH, "1: the angle sensor counts against the electrical direction.") \
    X(angle_offset_rad, "rad", NUMBER, "Electrical angle at the sensor's zero.") \
    X(angle_imposed, "", SWITCH, "1 imposes the electrical angle instead of following the sensor.") \
    X(imposed_hz, "", NUMBER, "Electrical frequency of the imposed angle.") \
    X(spin_periods, "", COUNT, "Periods until switching is disabled unless this is set again; 0: no limit.") \
    X(spin_rpm, "rpm", NUMBER, "Speed of the sensor at which switching is disabled.") \
    X(spin_failure, "", CHOICE, "Why the movement of the shaft was ended.") \
    X(memory_recalled, "", SWITCH, "1: this drive has started with a record of its flash.") \
    X(memory_saves, "", COUNT, "Records saved in the flash since the start.")

/** Of a point of the measured voltage error. */
#define NAME_LIST_POINT(X, k) \
    X(inverter_##k##_A, "A", NUMBER, "Current of a point of the measured voltage error.") \
    X(inverter_##k##_V, "V", NUMBER, "Voltage error at the current of the same number.")

#endif
