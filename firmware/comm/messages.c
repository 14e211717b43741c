/* SPDX-License-Identifier: Apache-2.0 */
#include "comm/messages.h"

#include "bus/signals.h"
#include "types/version.h"

#define FNV_START 2166136261U
#define FNV_PRIME 16777619U

bool message_inv_status(const telemetry_t *t, uint8_t *data)
{
    struct bus_inv_status_t m = {0};
    bus_inv_status_put_state(&m, t->state);
    const bool finite = bus_inv_status_put_torque_estimated(&m, t->torque_estimated_Nm, t->scales) &&
                        bus_inv_status_put_torque_commanded(&m, t->torque_commanded_Nm, t->scales) &&
                        bus_inv_status_put_speed(&m, t->speed_rpm, t->scales);
    /* MCDC_EXCL C2: pack refuses only less than eight bytes, and the length is constant */
    return finite && bus_inv_status_pack(data, &m, MESSAGE_LENGTH) == (int)MESSAGE_LENGTH;
}

bool message_inv_dc_link(const telemetry_t *t, uint8_t *data)
{
    struct bus_inv_dc_link_t m = {0};
    bus_inv_dc_link_put_derating_reason(&m, t->derating_reason);
    bus_inv_dc_link_put_refused_reason(&m, t->refused_reason);
    bus_inv_dc_link_put_refused_count(&m, t->refused_count);
    const bool finite = bus_inv_dc_link_put_dc_voltage(&m, t->v_dc_V, t->scales) &&
                        bus_inv_dc_link_put_dc_current(&m, t->i_dc_A, t->scales);
    /* MCDC_EXCL C2: pack refuses only less than eight bytes, and the length is constant */
    return finite && bus_inv_dc_link_pack(data, &m, MESSAGE_LENGTH) == (int)MESSAGE_LENGTH;
}

bool message_inv_currents(const telemetry_t *t, uint8_t *data)
{
    struct bus_inv_currents_t m = {0};
    const bool finite = bus_inv_currents_put_id(&m, t->id_A, t->scales) &&
                        bus_inv_currents_put_iq(&m, t->iq_A, t->scales) &&
                        bus_inv_currents_put_id_ref(&m, t->id_ref_A, t->scales) &&
                        bus_inv_currents_put_iq_ref(&m, t->iq_ref_A, t->scales);
    /* MCDC_EXCL C2: pack refuses only less than eight bytes, and the length is constant */
    return finite && bus_inv_currents_pack(data, &m, MESSAGE_LENGTH) == (int)MESSAGE_LENGTH;
}

bool message_inv_identification(const telemetry_t *t, uint8_t *data)
{
    struct bus_inv_identification_t m = {0};
    bus_inv_identification_put_psi_clamped(&m, t->psi_clamped);
    bus_inv_identification_put_resistance_clamped(&m, t->r_clamped);
    const bool finite = bus_inv_identification_put_psi_f(&m, t->psi_f_mVs, t->scales) &&
                        bus_inv_identification_put_resistance(&m, t->r_mohm, t->scales) &&
                        bus_inv_identification_put_psi_quality(&m, t->psi_quality_percent) &&
                        bus_inv_identification_put_resistance_quality(&m, t->r_quality_percent) &&
                        bus_inv_identification_put_table_scale(&m, t->table_scale_percent);
    /* MCDC_EXCL C2: pack refuses only less than eight bytes, and the length is constant */
    return finite && bus_inv_identification_pack(data, &m, MESSAGE_LENGTH) == (int)MESSAGE_LENGTH;
}

bool message_inv_temperatures(const telemetry_t *t, uint8_t *data)
{
    struct bus_inv_temperatures_t m = {0};
    bus_inv_temperatures_put_winding_valid(&m, t->winding_valid);
    bus_inv_temperatures_put_inverter_valid(&m, t->inverter_valid);
    const bool finite = bus_inv_temperatures_put_winding(&m, t->winding_C) &&
                        bus_inv_temperatures_put_inverter(&m, t->inverter_C);
    /* MCDC_EXCL C2: pack refuses only less than eight bytes, and the length is constant */
    return finite && bus_inv_temperatures_pack(data, &m, MESSAGE_LENGTH) == (int)MESSAGE_LENGTH;
}

bool message_inv_limits(const telemetry_t *t, uint8_t *data)
{
    struct bus_inv_limits_t m = {0};
    bus_inv_limits_put_request_limit(&m, t->request_limit);
    const bool finite = bus_inv_limits_put_torque_max(&m, t->torque_max_Nm, t->scales);
    /* MCDC_EXCL C2: pack refuses only less than eight bytes, and the length is constant */
    return finite && bus_inv_limits_pack(data, &m, MESSAGE_LENGTH) == (int)MESSAGE_LENGTH;
}

bool message_inv_faults(const telemetry_t *t, uint8_t *data)
{
    struct bus_inv_faults_t m = {0};
    bus_inv_faults_put_drive_faults(&m, t->drive_faults);
    bus_inv_faults_put_ecu_faults(&m, t->ecu_faults);
    bus_inv_faults_put_first_fault(&m, t->first_fault);
    bus_inv_faults_put_fault_count(&m, t->fault_count);
    return bus_inv_faults_pack(data, &m, MESSAGE_LENGTH) == (int)MESSAGE_LENGTH;
}

bool message_inv_configuration(const telemetry_t *t, uint8_t *data)
{
    struct bus_inv_configuration_t m = {0};
    bus_inv_configuration_put_motor_check(&m, t->motor_check);
    bus_inv_configuration_put_interface_hash(&m, t->interface_hash);
    return bus_inv_configuration_pack(data, &m, MESSAGE_LENGTH) == (int)MESSAGE_LENGTH;
}

bool message_inv_diag_protection(const telemetry_t *t, uint8_t *data)
{
    struct bus_inv_diag_protection_t m = {0};
    bus_inv_diag_protection_put_crc_errors(&m, t->diagnostics.crc_errors);
    bus_inv_diag_protection_put_repeated(&m, t->diagnostics.repeated);
    bus_inv_diag_protection_put_jumps(&m, t->diagnostics.jumps);
    bus_inv_diag_protection_put_length_errors(&m, t->diagnostics.length_errors);
    return bus_inv_diag_protection_pack(data, &m, MESSAGE_LENGTH) == (int)MESSAGE_LENGTH;
}

bool message_inv_diag_receive(const telemetry_t *t, uint8_t *data)
{
    struct bus_inv_diag_receive_t m = {0};
    bus_inv_diag_receive_put_range_errors(&m, t->diagnostics.range_errors);
    bus_inv_diag_receive_put_id_errors(&m, t->diagnostics.id_errors);
    bus_inv_diag_receive_put_time_outs(&m, t->diagnostics.time_outs);
    bus_inv_diag_receive_put_accepted(&m, t->diagnostics.accepted & UINT16_MAX);
    return bus_inv_diag_receive_pack(data, &m, MESSAGE_LENGTH) == (int)MESSAGE_LENGTH;
}

bool message_inv_diag_bus(const telemetry_t *t, uint8_t *data)
{
    struct bus_inv_diag_bus_t m = {0};
    bus_inv_diag_bus_put_lost_frames(&m, t->diagnostics.lost_frames);
    bus_inv_diag_bus_put_not_sent(&m, t->diagnostics.not_sent);
    bus_inv_diag_bus_put_ignored(&m, t->diagnostics.ignored);
    bus_inv_diag_bus_put_bus_off(&m, t->diagnostics.bus_off);
    bus_inv_diag_bus_put_skipped_commands(&m, t->diagnostics.skipped);
    return bus_inv_diag_bus_pack(data, &m, MESSAGE_LENGTH) == (int)MESSAGE_LENGTH;
}

bool message_inv_diag_task(const telemetry_t *t, uint8_t *data)
{
    struct bus_inv_diag_task_t m = {0};
    bus_inv_diag_task_put_isr_overruns(&m, t->diagnostics.isr_overruns);
    bus_inv_diag_task_put_task_overruns(&m, t->diagnostics.task_overruns);
    bus_inv_diag_task_put_reset_cause(&m, t->diagnostics.reset_cause);
    bus_inv_diag_task_put_watchdog_held(&m, t->diagnostics.watchdog_held);
    const bool finite = bus_inv_diag_task_put_stack_unused(&m, (float)t->diagnostics.stack_unused_bytes);
    /* MCDC_EXCL C1,C2: a converted integer is finite, and pack refuses only less than eight bytes */
    return finite && bus_inv_diag_task_pack(data, &m, MESSAGE_LENGTH) == (int)MESSAGE_LENGTH;
}

static uint32_t hash(const char *name)
{
    uint32_t h = FNV_START;
    for (; *name != '\0'; name++) {
        h = (h ^ (uint8_t)*name) * FNV_PRIME;
    }
    return h;
}

bool message_inv_version(const telemetry_t *t, uint8_t *data)
{
    struct bus_inv_version_t m = {0};
    bus_inv_version_put_major(&m, FLUXTRUE_VERSION_MAJOR);
    bus_inv_version_put_minor(&m, FLUXTRUE_VERSION_MINOR);
    bus_inv_version_put_patch(&m, FLUXTRUE_VERSION_PATCH);
    bus_inv_version_put_interface(&m, INTERFACE_VERSION);
    bus_inv_version_put_motor_id(&m, hash(t->motor_name));
    return bus_inv_version_pack(data, &m, MESSAGE_LENGTH) == (int)MESSAGE_LENGTH;
}
