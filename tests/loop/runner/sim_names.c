/* SPDX-License-Identifier: Apache-2.0 */
#include "sim_names.h"

#include <stddef.h>
#include <stdint.h>
#include <string.h>

typedef enum { KIND_DOUBLE, KIND_INT, KIND_U64 } kind_t;
typedef struct {
    const char *name;
    size_t offset;
    kind_t kind;
} field_t;

/* clang-format off */
#define REAL(f) {"plant." #f, offsetof(plant_params_t, f), KIND_DOUBLE}
#define FLAG(f) {"plant." #f, offsetof(plant_params_t, f), KIND_INT}
#define REAL3(f)                                                                                   \
    {"plant." #f "_a", offsetof(plant_params_t, f), KIND_DOUBLE},                                  \
    {"plant." #f "_b", offsetof(plant_params_t, f) + sizeof(double), KIND_DOUBLE},                 \
    {"plant." #f "_c", offsetof(plant_params_t, f) + 2u * sizeof(double), KIND_DOUBLE}
#define FLAG3(f)                                                                                   \
    {"plant." #f "_a", offsetof(plant_params_t, f), KIND_INT},                                     \
    {"plant." #f "_b", offsetof(plant_params_t, f) + sizeof(int), KIND_INT},                       \
    {"plant." #f "_c", offsetof(plant_params_t, f) + 2u * sizeof(int), KIND_INT}
#define FLAG6(f, first, x) {"plant." #f "_" x, offsetof(plant_params_t, f) + (first) * sizeof(int), KIND_INT}
#define SWITCHES(f)                                                                                \
    FLAG6(f, 0u, "upper_a"), FLAG6(f, 1u, "upper_b"), FLAG6(f, 2u, "upper_c"),                     \
    FLAG6(f, 3u, "lower_a"), FLAG6(f, 4u, "lower_b"), FLAG6(f, 5u, "lower_c")

static const field_t plant_fields[] = {
    REAL(pole_pairs), FLAG(phases_swapped), REAL(r_ohm_20), REAL(r_temp_coeff_per_K), REAL(winding_C), REAL(ld_H),
    REAL(lq_H), REAL(psi_f_Vs), REAL(magnet_scale), REAL(magnet_temp_coeff_per_K), REAL(rotor_C),
    REAL(lq_scale), REAL(ld_slope_scale), REAL(cross_saturation_scale), REAL(iron_k_h),
    REAL(iron_k_e), REAL(iron_k_excess), FLAG(magnet_step_keeps_current), REAL(vdc_V), REAL(vdc_ripple_V),
    REAL(vdc_ripple_hz), REAL(vdc_start_V), REAL(vdc_least_V), REAL(dc_link_F), REAL(precharge_s),
    REAL(discharge_s), REAL(dc_load_ohm),
    REAL(avalanche_V), FLAG(precharge_open), FLAG(discharge_open), FLAG(contactor_open), REAL(hardware_safe_V),
    REAL(pwm_hz), REAL(dead_time_s), REAL(device_drop_V), REAL(leg_knee_A), FLAG(substeps),
    FLAG(ideal_inverter), REAL(series_d_V), REAL(series_q_V),
    FLAG3(phase_open), SWITCHES(switch_open), SWITCHES(switch_shorted),
    REAL(short_circuit_A), REAL(desaturation_s), FLAG(desaturation_open), FLAG(drivers_block), FLAG(imposed_bridge),
    REAL(current_full_scale_A), FLAG(adc_bits),
    REAL3(current_gain), REAL3(current_offset_A), REAL(current_noise_A_rms),
    FLAG(current_quantise), FLAG3(current_stuck), FLAG3(current_open), REAL(converter_reference),
    REAL(known_voltage_gain), REAL(vdc_full_scale_V), REAL(vdc_gain), REAL(vdc_offset_V), FLAG(vdc_quantise),
    FLAG(angle_reversed), REAL(angle_offset_rad), REAL(angle_h1_rad),
    REAL(angle_h1_phase), REAL(angle_h2_rad), REAL(angle_h2_phase), REAL(resolver_pole_pairs),
    FLAG(angle_bits), REAL(angle_delay_s), FLAG(angle_stuck), FLAG(angle_sine_stuck),
    FLAG(angle_cosine_stuck), FLAG(angle_length_check), FLAG(angle_spike_every), FLAG(angle_spike_samples),
    REAL(angle_spike_rad), FLAG(imposed_speed),
    REAL(speed_rad_s), REAL(theta_m_rad), REAL(inertia_kgm2), REAL(load_Nm), REAL(viscous_Nms),
    REAL(coulomb_Nm), REAL(stiction_Nm), REAL(stribeck_rad_s),
    {"plant.seed", offsetof(plant_params_t, seed), KIND_U64},
};
/* clang-format on */
enum { PLANT_FIELDS = (int)(sizeof plant_fields / sizeof plant_fields[0]) };

typedef struct {
    const char *name;
    size_t offset;
    bool averages;
} truth_field_t;

/* clang-format off */
#define MEAN(f) {"truth." #f, offsetof(plant_truth_t, f), true}
#define LAST(f) {"truth." #f, offsetof(plant_truth_t, f), false}

static const truth_field_t truth_fields[] = {
    LAST(time_s), MEAN(i_d_A), MEAN(i_q_A), MEAN(i_dm_A), MEAN(i_qm_A), MEAN(psi_d_Vs),
    MEAN(psi_q_Vs), MEAN(torque_Nm), MEAN(speed_rad_s), MEAN(speed_rpm), LAST(theta_m_rad),
    LAST(theta_e_rad), MEAN(r_ohm), MEAN(psi_f_Vs), MEAN(vdc_V), MEAN(u_d_V), MEAN(u_q_V),
    MEAN(torque_mean_Nm), MEAN(torque_shaft_mean_Nm), MEAN(idc_A), MEAN(copper_W), MEAN(iron_W),
    MEAN(mechanical_W), MEAN(electrical_W), MEAN(inverter_W), LAST(e_dc_J), LAST(e_electrical_J),
    LAST(e_copper_J), LAST(e_iron_J), LAST(e_mechanical_J), LAST(e_field_J), LAST(e_avalanche_J),
    LAST(e_short_circuit_J), LAST(gate_supply),
};
/* clang-format on */
enum { TRUTH_FIELDS = (int)(sizeof truth_fields / sizeof truth_fields[0]) };

int sim_plant_index(const char *name)
{
    for (int i = 0; i < PLANT_FIELDS; i++) {
        if (strcmp(name, plant_fields[i].name) == 0) {
            return i;
        }
    }
    return -1;
}

int sim_truth_index(const char *name)
{
    for (int i = 0; i < TRUTH_FIELDS; i++) {
        if (strcmp(name, truth_fields[i].name) == 0) {
            return i;
        }
    }
    return -1;
}

const char *sim_names_at(int index)
{
    if (index < 0 || index >= PLANT_FIELDS + TRUTH_FIELDS) {
        return NULL;
    }
    return index < PLANT_FIELDS ? plant_fields[index].name : truth_fields[index - PLANT_FIELDS].name;
}

void sim_plant_write(plant_params_t *params, int index, double value)
{
    char *at = (char *)params + plant_fields[index].offset;
    if (plant_fields[index].kind == KIND_DOUBLE) {
        memcpy(at, &value, sizeof value);
    } else if (plant_fields[index].kind == KIND_INT) {
        int flag = (int)value;
        memcpy(at, &flag, sizeof flag);
    } else {
        uint64_t word = (uint64_t)value;
        memcpy(at, &word, sizeof word);
    }
}

double sim_plant_read(const plant_params_t *params, int index)
{
    const char *at = (const char *)params + plant_fields[index].offset;
    double value;
    int flag;
    uint64_t word;
    switch (plant_fields[index].kind) {
    case KIND_DOUBLE:
        memcpy(&value, at, sizeof value);
        return value;
    case KIND_INT:
        memcpy(&flag, at, sizeof flag);
        return flag;
    default:
        memcpy(&word, at, sizeof word);
        return (double)word;
    }
}

double sim_truth_read(const plant_truth_t *truth, int index)
{
    double value;
    memcpy(&value, (const char *)truth + truth_fields[index].offset, sizeof value);
    return value;
}

bool sim_truth_averages(int index)
{
    return truth_fields[index].averages;
}
