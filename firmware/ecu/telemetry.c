/* SPDX-License-Identifier: Apache-2.0 */
#include "ecu/telemetry.h"

#include "drive/drive_si.h"
#include "drive/mrai/mrai_seam.h"
#include "hal/temperature.h"
#include "types/si.h"

#define V_DC_MIN_V 1.0F

static void read_point(const drive_t *drive, const sample_t *sample, telemetry_t *t)
{
    const bases_t *b = &drive->motor->bases;
    const dq_q15_t wanted = drive->request.current_mode ? drive->request.i_ref : drive->task.reference.i_ref;
    const float u_d = si_from_q15(sample->point.u.d, b->voltage_V);
    const float u_q = si_from_q15(sample->point.u.q, b->voltage_V);
    t->id_A = si_from_q15(sample->point.i.d, b->current_A);
    t->iq_A = si_from_q15(sample->point.i.q, b->current_A);
    t->id_ref_A = si_from_q15(wanted.d, b->current_A);
    t->iq_ref_A = si_from_q15(wanted.q, b->current_A);
    t->v_dc_V = si_from_q15(sample->v_dc, b->voltage_V);
    t->i_dc_A = (t->v_dc_V > V_DC_MIN_V) ? 1.5F * (u_d * t->id_A + u_q * t->iq_A) / t->v_dc_V : 0.0F;
}

static void read_status(const drive_t *drive, const sample_t *sample, telemetry_t *t)
{
    const float base = drive->motor->bases.torque_Nm;
    t->torque_estimated_Nm = si_from_q15(drive->task.identification.torque_estimated, base);
    t->torque_commanded_Nm = si_from_q15(drive->task.torque_commanded, base);
    t->speed_rpm = drive_speed_rpm(drive, sample->point.omega);
}

static void read_identification(const drive_t *drive, telemetry_t *t)
{
    t->psi_f_mVs = 1000.0F * drive_psi_f_Vs(drive);
    t->r_mohm = 1000.0F * drive_r_ohm(drive);
    t->table_scale_percent = 100.0F + si_from_q31(drive->task.identification.lq_error, 100.0F);
    t->psi_quality_percent = si_from_q15(drive->task.identification.psi_quality, 100.0F);
    t->r_quality_percent = si_from_q15(drive->task.identification.r_quality, 100.0F);
    t->psi_clamped = drive->task.identification.psi_clamped;
    t->r_clamped = drive->task.identification.r_clamped;
}

static void read_temperatures(telemetry_t *t)
{
    const int16_t winding = hal_temperature_winding_dC();
    const int16_t inverter = hal_temperature_inverter_dC();
    t->winding_valid = temperature_is_known(winding);
    t->inverter_valid = temperature_is_known(inverter);
    t->winding_C = t->winding_valid ? (float)winding / 10.0F : 0.0F;
    t->inverter_C = t->inverter_valid ? (float)inverter / 10.0F : 0.0F;
}

void telemetry_read(const drive_t *drive, const can_tx_t *tx, telemetry_t *telemetry)
{
    const sample_t *sample = sample_box_last(&drive->samples);
    telemetry->scales = &drive->motor->bus_scales;
    if (can_tx_may_send_voltage_or_currents(tx)) {
        read_point(drive, sample, telemetry);
    }
    if (can_tx_may_send_status(tx)) {
        read_status(drive, sample, telemetry);
    }
    if (can_tx_may_send_limits(tx)) {
        telemetry->torque_max_Nm = si_from_q15(drive->task.reference.torque_max, drive->motor->bases.torque_Nm);
    }
    if (can_tx_may_send_identification(tx)) {
        read_identification(drive, telemetry);
    }
    if (can_tx_may_send_temperatures(tx)) {
        read_temperatures(telemetry);
    }
    telemetry->drive_faults = drive->fast.faults;
    telemetry->motor_check = (uint32_t)drive_motor_check(drive);
    telemetry->diagnostics.isr_overruns = mrai_overruns(drive);
    telemetry->motor_name = drive->motor->name;
    telemetry->interface_hash = drive->motor->interface_hash;
}
