/* SPDX-License-Identifier: Apache-2.0 */
#include <stddef.h>
#include <string.h>

#include "drive/mrai/mrai_seam.h"
#include "hal/host/commissioned.h"
#include "hal/host/identified.h"
#include "hal/host/instance.h"
#include "hal/host/limits.h"
#include "hal/host/parameters.h"
#include "hal/host/per_unit.h"
#include "hal/host/pulsed.h"
#include "hal/host/spun.h"
#include "hal/host/stations.h"

/* The bases are floats. */
static double pu15(int32_t x, float base)
{
    return per_unit_si_from_q15(x, (double)base);
}

static double pu31(q31_t x, float base)
{
    return per_unit_si_from_q31(x, (double)base);
}

static q15_t to_pu15(double x, float base)
{
    return per_unit_q15_from_si(x, (double)base);
}

static const bases_t *bases(const fluxtrue_t *d)
{
    return &d->drive.motor->bases;
}

static const sample_t *sample(const fluxtrue_t *d)
{
    return &d->drive.samples.slot[d->drive.samples.generation % SAMPLE_SLOTS];
}

#define GETTER(name, expression) \
    static double get_##name(const fluxtrue_t *d) \
    { \
        return (double)(expression); \
    }

GETTER(enable, d->drive.request.enable)
GETTER(torque_loop, d->drive.request.torque_loop)
GETTER(identification, d->drive.request.identification)
GETTER(identification_mode, d->drive.request.identification_mode)
/* 1 until the task has processed the reset. */
GETTER(fault_reset, d->drive.request.fault_resets != d->drive.task.fault_resets_asked)
GETTER(identification_reset, d->drive.request.identification_resets != d->drive.task.identification_resets)
GETTER(current_mode, d->drive.request.current_mode)
GETTER(torque_max, pu15(d->drive.task.reference.torque_max, bases(d)->torque_Nm))
GETTER(derating, d->drive.task.derating)
GETTER(voltage_trim, pu31(d->drive.task.voltage_reserve.trim, bases(d)->voltage_V))
GETTER(torque_correction, pu31(d->drive.task.torque_loop.correction, 1.0F))
GETTER(psi_quality, pu15(d->drive.task.identification.psi_quality, 1.0F))
GETTER(r_quality, pu15(d->drive.task.identification.r_quality, 1.0F))
GETTER(psi_clamped, d->drive.task.identification.psi_clamped)
GETTER(r_clamped, d->drive.task.identification.r_clamped)
GETTER(id, pu15(sample(d)->point.i.d, bases(d)->current_A))
GETTER(iq, pu15(sample(d)->point.i.q, bases(d)->current_A))
GETTER(i_zero, (double)sample(d)->zero_q28 / 268435456.0 * (double)bases(d)->current_A)
GETTER(ud, pu15(d->drive.fast.u_next.d, bases(d)->voltage_V))
GETTER(uq, pu15(d->drive.fast.u_next.q, bases(d)->voltage_V))
GETTER(v_dc, pu15(sample(d)->v_dc, bases(d)->voltage_V))
GETTER(fault_word, d->drive.fast.faults)
GETTER(motor_check, drive_motor_check(&d->drive))
GETTER(voltage_limited, sample(d)->voltage_limited)
GETTER(table_clamped, flux_table_outside(&d->drive.motor->flux_table, sample(d)->point.i))
GETTER(overruns, mrai_overruns(&d->drive))
GETTER(run_state, d->drive.task.run_state)
GETTER(winding, d->winding_C)
GETTER(memory_recalled, d->memory.recalled)
GETTER(memory_saves, d->memory.saves)

static double get_speed(const fluxtrue_t *d)
{
    const double omega_rad_s = pu31(sample(d)->point.omega, bases(d)->omega_rad_s);
    return omega_rad_s / d->drive.motor->angle_tracker.pole_pairs * 60.0 / 6.283185307179586;
}

/* In current mode the requested reference, else the output of the current reference. */
static dq_q15_t reference_of(const fluxtrue_t *d)
{
    return d->drive.request.current_mode ? d->drive.request.i_ref : d->drive.task.reference.i_ref;
}

GETTER(id_ref, pu15(reference_of(d).d, bases(d)->current_A))
GETTER(iq_ref, pu15(reference_of(d).q, bases(d)->current_A))

static void set_enable(fluxtrue_t *d, double x)
{
    d->drive.request.enable = x != 0.0;
}

static void set_torque_loop(fluxtrue_t *d, double x)
{
    d->drive.request.torque_loop = x != 0.0;
}

static void set_identification(fluxtrue_t *d, double x)
{
    d->drive.request.identification = x != 0.0;
}

static void set_identification_mode(fluxtrue_t *d, double x)
{
    d->drive.request.identification_mode = (x >= 0.5) ? IDENTIFICATION_ROBUST : IDENTIFICATION_PAPER;
}

static void set_fault_reset(fluxtrue_t *d, double x)
{
    d->drive.request.fault_resets += (x != 0.0) ? 1U : 0U;
}

static void set_current_mode(fluxtrue_t *d, double x)
{
    d->drive.request.current_mode = x != 0.0;
}

static void set_id_ref(fluxtrue_t *d, double x)
{
    d->drive.request.i_ref.d = to_pu15(x, bases(d)->current_A);
}

static void set_iq_ref(fluxtrue_t *d, double x)
{
    d->drive.request.i_ref.q = to_pu15(x, bases(d)->current_A);
}

static void set_identification_reset(fluxtrue_t *d, double x)
{
    d->drive.request.identification_resets += (x != 0.0) ? 1U : 0U;
}

#define POINT_NAME(k) \
    {"inverter_" #k "_A", commissioned_##k##_A, NULL, 0, 0}, {"inverter_" #k "_V", commissioned_##k##_V, NULL, 0, 0},

/* The range of torque and current is that of the motor: see bound_of() in access.c. */
const parameter_t parameters[] = {
    {"torque_requested_Nm", stations_requested_Nm, stations_set_requested_Nm, -INFINITY, INFINITY},
    {"enable", get_enable, set_enable, 0.0, 1.0},
    {"torque_loop", get_torque_loop, set_torque_loop, 0.0, 1.0},
    {"identification", get_identification, set_identification, 0.0, 1.0},
    {"identification_mode", get_identification_mode, set_identification_mode, FLUXTRUE_MRAI ? 0.0 : 1.0, 1.0},
    {"trim", commissioned_trims, commissioned_set_trim, 0.0, 1.0},
    {"fault_reset", get_fault_reset, set_fault_reset, 0.0, 1.0},
    {"identification_reset", get_identification_reset, set_identification_reset, 0.0, 1.0},
    {"current_mode", get_current_mode, set_current_mode, 0.0, 1.0},
    {"id_ref_A", get_id_ref, set_id_ref, -INFINITY, INFINITY},
    {"iq_ref_A", get_iq_ref, set_iq_ref, -INFINITY, INFINITY},
    {"inverter_C", limits_get_inverter, limits_set_inverter, -100.0, 500.0},
    {"known_voltage_share", limits_get_known_share, limits_set_known_share, 0.0, 5.0},
    {"machine_monitors", limits_get_machine_monitors, limits_set_machine_monitors, 0.0, 1.0},
    {"torque_limit_drive_Nm", limits_get_torque_drive, limits_set_torque_drive, 0.0, 1e9},
    {"torque_limit_regen_Nm", limits_get_torque_regen, limits_set_torque_regen, 0.0, 1e9},
    {"power_limit_drive_W", limits_get_power_drive, limits_set_power_drive, 0.0, 1e9},
    {"power_limit_regen_W", limits_get_power_regen, limits_set_power_regen, 0.0, 1e9},
    {"torque_arbitrated_Nm", stations_arbitrated_Nm, NULL, 0, 0},
    {"torque_limited_Nm", stations_limited_Nm, NULL, 0, 0},
    {"torque_commanded_Nm", stations_commanded_Nm, NULL, 0, 0},
    {"torque_corrected_Nm", stations_corrected_Nm, NULL, 0, 0},
    {"torque_estimated_Nm", stations_estimated_Nm, NULL, 0, 0},
    {"torque_max_Nm", get_torque_max, NULL, 0, 0},
    {"voltage_trim_V", get_voltage_trim, NULL, 0, 0},
    {"derating", get_derating, NULL, 0, 0},
    {"torque_correction", get_torque_correction, NULL, 0, 0},
    {"psi_f_Vs", identified_psi_f_Vs, NULL, 0, 0},
    {"r_ohm", identified_r_ohm, NULL, 0, 0},
    {"psi_quality", get_psi_quality, NULL, 0, 0},
    {"r_quality", get_r_quality, NULL, 0, 0},
    {"drop_V", identified_drop_V, NULL, 0, 0},
    {"lq_scale", identified_lq_scale, NULL, 0, 0},
    {"ld_scale", identified_ld_scale, NULL, 0, 0},
    {"angle_error_rad", identified_angle_rad, NULL, 0, 0},
    {"iron_scale", identified_iron_scale, NULL, 0, 0},
    {"parameter_clamped", identified_clamped, NULL, 0, 0},
    {"torque_confidence", identified_confidence, NULL, 0, 0},
    {"mismatch_share", identified_mismatch_share, NULL, 0, 0},
    {"local_flux_Vs", identified_local_Vs, NULL, 0, 0},
    {"psi_clamped", get_psi_clamped, NULL, 0, 0},
    {"r_clamped", get_r_clamped, NULL, 0, 0},
    {"id_A", get_id, NULL, 0, 0},
    {"iq_A", get_iq, NULL, 0, 0},
    {"i_zero_A", get_i_zero, NULL, 0, 0},
    {"ud_V", get_ud, NULL, 0, 0},
    {"uq_V", get_uq, NULL, 0, 0},
    {"vdc_V", get_v_dc, NULL, 0, 0},
    {"speed_rpm", get_speed, NULL, 0, 0},
    {"fault_word", get_fault_word, NULL, 0, 0},
    {"motor_check", get_motor_check, NULL, 0, 0},
    {"voltage_limited", get_voltage_limited, NULL, 0, 0},
    {"table_clamped", get_table_clamped, NULL, 0, 0},
    {"mrai_overruns", get_overruns, NULL, 0, 0},
    {"run_state", get_run_state, NULL, 0, 0},
    {"winding_C", get_winding, NULL, 0, 0},
    {"commission", commissioned_phase, commissioned_start, 0.0, 1.0},
    {"commission_failure", commissioned_failure, NULL, 0, 0},
    {"commission_r_ohm", commissioned_r_ohm, NULL, 0, 0},
    {"compensation_V", commissioned_level_V, NULL, 0, 0},
    {"compensation_knee_A", commissioned_knee_A, NULL, 0, 0},
    {"pulses", pulsed_phase, pulsed_start, 0.0, 1.0},
    {"pulses_failure", pulsed_failure, NULL, 0, 0},
    {"pulses_agreed", pulsed_agreed, pulsed_agree, 0.0, 1.0},
    {"pulses_vd", pulsed_vd, pulsed_set_vd, 0.0, 0.7},
    {"pulses_vq", pulsed_vq, pulsed_set_vq, 0.0, 0.7},
    {"pulses_first", pulsed_first, pulsed_set_first, 0.0, 1.0},
    {"pulses_id_low_A", pulsed_id_low_A, pulsed_set_id_low_A, -INFINITY, INFINITY},
    {"pulses_id_high_A", pulsed_id_high_A, pulsed_set_id_high_A, -INFINITY, INFINITY},
    {"pulses_iq_low_A", pulsed_iq_low_A, pulsed_set_iq_low_A, -INFINITY, INFINITY},
    {"pulses_iq_high_A", pulsed_iq_high_A, pulsed_set_iq_high_A, -INFINITY, INFINITY},
    {"pulses_angle_rad", pulsed_angle_rad, pulsed_set_angle_rad, 0.0, 0.7853981633974483},
    {"pulses_delay", pulsed_delay, pulsed_set_delay, 0.0, 20000.0},
    {"pulses_reversals", pulsed_reversals, pulsed_set_reversals, 0.0, 1000.0},
    {"pulses_periods", pulsed_periods, pulsed_set_periods, 0.0, 20000.0},
    {"theta_e_rad", pulsed_theta_rad, NULL, 0, 0},
    {"sensor_turns", spun_turns, NULL, 0, 0},
    {"angle_pole_pairs", spun_pole_pairs, spun_set_pole_pairs, 1.0, 50.0},
    {"angle_reversed", spun_reversed, spun_set_reversed, 0.0, 1.0},
    {"angle_offset_rad", spun_offset_rad, spun_set_offset_rad, -6.283185307179586, 6.283185307179586},
    {"angle_imposed", spun_imposed, spun_set_imposed, 0.0, 1.0},
    {"imposed_hz", spun_imposed_hz, spun_set_imposed_hz, -1000.0, 1000.0},
    {"spin_periods", spun_periods, spun_set_periods, 0.0, 1000000.0},
    {"spin_rpm", spun_rpm, spun_set_rpm, 0.0, 1000000.0},
    {"spin_failure", spun_failure, NULL, 0, 0},
    COMMISSIONED_POINTS(POINT_NAME){"memory_recalled", get_memory_recalled, NULL, 0, 0},
    {"memory_saves", get_memory_saves, NULL, 0, 0},
};

const int parameters_count = (int)(sizeof parameters / sizeof parameters[0]);
