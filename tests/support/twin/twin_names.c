/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "twin/twin_private.h"

typedef double (*read_t)(const twin_t *twin);
typedef void (*write_t)(twin_t *twin, double value);

typedef struct {
    const char *name;
    read_t read;
    write_t write; /* NULL: read only */
    double lo, hi;
} entry_t;

#define READ(id, expression) \
    static double get_##id(const twin_t *t) \
    { \
        return (double)(expression); \
    }
#define WRITE(id, statement) \
    static void set_##id(twin_t *t, double x) \
    { \
        statement; \
    }

READ(torque_requested, t->torque_requested)
WRITE(torque_requested, t->torque_requested = x)
READ(enable, t->enable)
WRITE(enable, t->enable = x != 0.0)
READ(torque_loop, t->torque_loop)
WRITE(torque_loop, t->torque_loop = x != 0.0)
READ(identification, t->identification)
WRITE(identification, t->identification = x != 0.0)
READ(identification_mode, t->robust)
WRITE(identification_mode, t->robust = x >= 0.5)
READ(current_mode, t->current_mode)
WRITE(current_mode, t->current_mode = x != 0.0)
READ(id_ref, t->i_ref.d)
WRITE(id_ref, t->id_command = x)
READ(iq_ref, t->i_ref.q)
WRITE(iq_ref, t->iq_command = x)
READ(slew, t->motor.torque_slew_Nm / t->motor.step_s)
WRITE(slew, t->motor.torque_slew_Nm = x * t->motor.step_s)
READ(observer_m, t->motor.observer_m)
WRITE(observer_m, t->motor.observer_m = x)
READ(flux_bandwidth, t->motor.flux_bandwidth_rad_s)
WRITE(flux_bandwidth, t->motor.flux_bandwidth_rad_s = x)
READ(resistance_bandwidth, t->motor.resistance_bandwidth_rad_s)
WRITE(resistance_bandwidth, t->motor.resistance_bandwidth_rad_s = x)
READ(compensation, t->compensation)
WRITE(compensation, t->compensation = x)
READ(nothing, 0.0 * t->v_dc)
READ(torque_estimated, t->torque_estimated)
READ(psi_f, t->motor.psi_f_Vs + (t->robust ? t->identify.kalman.x[2] * t->motor.identify_sigma[2] : t->mrai.psi_delta))
READ(r, t->robust ? t->identify.r_prior + t->identify.kalman.x[0] * t->motor.identify_sigma[0]
                  : t->motor.r_ohm_20 + t->mrai.r_delta)
READ(confidence, t->robust ? t->identify.confidence : 1.0)
READ(lq_scale, t->robust ? 1.0 + t->identify.kalman.x[3] * t->motor.identify_sigma[3] : 1.0)
READ(id, t->sample.i.d)
READ(iq, t->sample.i.q)
READ(ud, t->applied.d)
READ(uq, t->applied.q)
READ(speed, t->sample.omega / t->motor.pole_pairs * 9.5492965855137201)
READ(psi_quality, t->quality.psi_quality)
READ(r_quality, t->quality.r_quality)
READ(fault_word, t->fault_word)
READ(voltage_limited, t->current.limited || t->modulation_limited)
READ(v_dc, t->v_dc)
READ(voltage_trim, t->trim)
READ(torque_correction, t->torque_state.correction)
READ(torque_max, t->reference.torque_max)
READ(torque_commanded, t->torque_commanded)
READ(loop_bandwidth, t->motor.torque_ki / t->motor.step_s)
WRITE(loop_bandwidth, t->motor.torque_ki = x * t->motor.step_s)
READ(run_state, t->run_state)

READ(fault_reset, t->fault_reset)
WRITE(fault_reset, t->fault_reset = x != 0.0)

static void set_identification_reset(twin_t *t, double x)
{
    if (x != 0.0) {
        t->mrai.psi_delta = 0.0;
        t->mrai.r_delta = 0.0;
        t->quality = (twin_mrai_quality_t){0};
        twin_identify_reset(&t->motor, &t->identify);
        twin_mrai_reset(&t->mrai, &t->sample);
    }
}

static const entry_t entries[] = {
    {"torque_requested_Nm", get_torque_requested, set_torque_requested, -1e4, 1e4},
    {"enable", get_enable, set_enable, 0.0, 1.0},
    {"torque_loop", get_torque_loop, set_torque_loop, 0.0, 1.0},
    {"identification", get_identification, set_identification, 0.0, 1.0},
    {"identification_mode", get_identification_mode, set_identification_mode, 0.0, 1.0},
    {"fault_reset", get_fault_reset, set_fault_reset, 0.0, 1.0},
    {"current_mode", get_current_mode, set_current_mode, 0.0, 1.0},
    {"id_ref_A", get_id_ref, set_id_ref, -1e4, 1e4},
    {"iq_ref_A", get_iq_ref, set_iq_ref, -1e4, 1e4},
    {"torque_slew_Nm_per_s", get_slew, set_slew, 0.0, 1e9},
    {"observer_m", get_observer_m, set_observer_m, 2.0, 4.0},
    {"flux_bandwidth_rad_s", get_flux_bandwidth, set_flux_bandwidth, 0.0, 1e4},
    {"resistance_bandwidth_rad_s", get_resistance_bandwidth, set_resistance_bandwidth, 0.0, 1e4},
    {"torque_loop_bandwidth_rad_s", get_loop_bandwidth, set_loop_bandwidth, 0.0, 500.0},
    {"dead_time_compensation", get_compensation, set_compensation, 0.0, 1.5},
    {"identification_reset", get_nothing, set_identification_reset, 0.0, 1.0},
    {"torque_estimated_Nm", get_torque_estimated, NULL, 0.0, 0.0},
    {"torque_commanded_Nm", get_torque_commanded, NULL, 0.0, 0.0},
    {"psi_f_Vs", get_psi_f, NULL, 0.0, 0.0},
    {"r_ohm", get_r, NULL, 0.0, 0.0},
    {"torque_confidence", get_confidence, NULL, 0.0, 0.0},
    {"lq_scale", get_lq_scale, NULL, 0.0, 0.0},
    {"id_A", get_id, NULL, 0.0, 0.0},
    {"iq_A", get_iq, NULL, 0.0, 0.0},
    {"ud_V", get_ud, NULL, 0.0, 0.0},
    {"uq_V", get_uq, NULL, 0.0, 0.0},
    {"speed_rpm", get_speed, NULL, 0.0, 0.0},
    {"psi_quality", get_psi_quality, NULL, 0.0, 0.0},
    {"r_quality", get_r_quality, NULL, 0.0, 0.0},
    {"fault_word", get_fault_word, NULL, 0.0, 0.0},
    {"voltage_limited", get_voltage_limited, NULL, 0.0, 0.0},
    {"vdc_V", get_v_dc, NULL, 0.0, 0.0},
    {"voltage_trim_V", get_voltage_trim, NULL, 0.0, 0.0},
    {"torque_correction", get_torque_correction, NULL, 0.0, 0.0},
    {"torque_max_Nm", get_torque_max, NULL, 0.0, 0.0},
    {"run_state", get_run_state, NULL, 0.0, 0.0},
};

static const entry_t *find(const char *name)
{
    for (size_t n = 0; n < sizeof entries / sizeof entries[0]; n++) {
        if (strcmp(entries[n].name, name) == 0) {
            return &entries[n];
        }
    }
    return NULL;
}

int twin_set(twin_t *twin, const char *name, double value)
{
    const entry_t *entry = find(name);
    if (entry == NULL) {
        return TWIN_UNKNOWN_NAME;
    }
    if (entry->write == NULL) {
        return TWIN_READ_ONLY;
    }
    if (!((value >= entry->lo) && (value <= entry->hi))) {
        return TWIN_OUT_OF_RANGE;
    }
    entry->write(twin, value);
    return TWIN_OK;
}

double twin_get(const twin_t *twin, const char *name)
{
    const entry_t *entry = find(name);
    return (entry == NULL) ? NAN : entry->read(twin);
}
