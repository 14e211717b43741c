/* SPDX-License-Identifier: Apache-2.0 */
#include "plant_params.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

void plant_params_default(plant_params_t *params)
{
    memset(params, 0, sizeof *params);
    params->winding_C = 20.0;
    params->rotor_C = 20.0;
    params->magnet_scale = 1.0;
    params->lq_scale = 1.0;
    params->ld_slope_scale = 1.0;
    params->cross_saturation_scale = 1.0;
    params->precharge_s = 0.02; /* assumed: charged to 95 % in 60 ms, discharged to 5 % in 0.3 s */
    params->discharge_s = 0.1;
    params->avalanche_V = 1e6;        /* none */
    params->short_circuit_A = 2000.0; /* assumed: the transistors of a module limit their current */
    params->desaturation_s = 3e-6;    /* assumed: they withstand it for some microseconds */
    params->substeps = 10;
    params->adc_bits = 12;
    for (int x = 0; x < 3; x++) {
        params->current_gain[x] = 1.0;
    }
    params->vdc_least_V = 1.0;
    params->vdc_gain = 1.0;
    params->converter_reference = 1.0;
    params->known_voltage_gain = 1.0;
    params->resolver_pole_pairs = 1.0;
    params->imposed_speed = 1;
    params->inertia_kgm2 = 1.0;
    params->stribeck_rad_s = 1.0;
    params->seed = 1;
}

static int above_zero(double x)
{
    return isfinite(x) && x > 0.0;
}

static int not_below_zero(double x)
{
    return isfinite(x) && x >= 0.0;
}

static const char *bad_machine(const plant_params_t *p, int has_map)
{
    const struct {
        const char *name;
        int ok;
    } check[] = {
        {"pole_pairs", above_zero(p->pole_pairs) && p->pole_pairs == floor(p->pole_pairs)},
        {"r_ohm_20", not_below_zero(p->r_ohm_20)},
        {"r_temp_coeff_per_K", isfinite(p->r_temp_coeff_per_K)},
        {"winding_C", isfinite(p->winding_C) && p->r_temp_coeff_per_K * (p->winding_C - 20.0) > -1.0}, /* R > 0 */
        {"ld_H", has_map || above_zero(p->ld_H)},
        {"lq_H", has_map || above_zero(p->lq_H)},
        {"psi_f_Vs", has_map || isfinite(p->psi_f_Vs)},
        {"magnet_scale", not_below_zero(p->magnet_scale)},
        {"magnet_temp_coeff_per_K", isfinite(p->magnet_temp_coeff_per_K)},
        {"rotor_C", isfinite(p->rotor_C)},
        {"lq_scale", above_zero(p->lq_scale)},
        {"ld_slope_scale", above_zero(p->ld_slope_scale)},
        {"cross_saturation_scale", isfinite(p->cross_saturation_scale)},
        {"iron_k_h", not_below_zero(p->iron_k_h)},
        {"iron_k_e", not_below_zero(p->iron_k_e)},
        {"iron_k_excess", not_below_zero(p->iron_k_excess)},
        {"speed_rad_s", isfinite(p->speed_rad_s)},
        {"theta_m_rad", isfinite(p->theta_m_rad)},
        {"inertia_kgm2", p->imposed_speed || above_zero(p->inertia_kgm2)},
        {"load_Nm", isfinite(p->load_Nm)},
        {"viscous_Nms", not_below_zero(p->viscous_Nms)},
        {"coulomb_Nm", not_below_zero(p->coulomb_Nm)},
        {"stiction_Nm", not_below_zero(p->stiction_Nm)},
        {"stribeck_rad_s", above_zero(p->stribeck_rad_s)},
    };
    for (size_t k = 0; k < sizeof check / sizeof check[0]; k++) {
        if (!check[k].ok) {
            return check[k].name;
        }
    }
    return NULL;
}

static const char *bad_sensor(const plant_params_t *p)
{
    for (int x = 0; x < 3; x++) {
        if (!isfinite(p->current_gain[x])) {
            return "current_gain";
        }
        if (!isfinite(p->current_offset_A[x])) {
            return "current_offset_A";
        }
    }
    if (!isfinite(p->vdc_gain)) {
        return "vdc_gain";
    }
    if (!isfinite(p->vdc_offset_V)) {
        return "vdc_offset_V";
    }
    if (!above_zero(p->converter_reference)) {
        return "converter_reference";
    }
    if (!not_below_zero(p->known_voltage_gain)) {
        return "known_voltage_gain";
    }
    if (!isfinite(p->angle_delay_s)) {
        return "angle_delay_s";
    }
    if (p->angle_spike_every < 0) {
        return "angle_spike_every";
    }
    if (p->angle_spike_samples < 0) {
        return "angle_spike_samples";
    }
    return isfinite(p->angle_spike_rad) ? NULL : "angle_spike_rad";
}

static const char *bad_electronics(const plant_params_t *p)
{
    const struct {
        const char *name;
        int ok;
    } check[] = {
        {"vdc_V", above_zero(p->vdc_V)},
        {"vdc_ripple_V", isfinite(p->vdc_ripple_V) && fabs(p->vdc_ripple_V) < p->vdc_V},
        {"vdc_ripple_hz", not_below_zero(p->vdc_ripple_hz)},
        {"vdc_start_V", not_below_zero(p->vdc_start_V)},
        {"vdc_least_V", above_zero(p->vdc_least_V)},
        {"dc_link_F", not_below_zero(p->dc_link_F)},
        {"precharge_s", above_zero(p->precharge_s)},
        {"discharge_s", above_zero(p->discharge_s)},
        {"dc_load_ohm", not_below_zero(p->dc_load_ohm)},
        {"avalanche_V", above_zero(p->avalanche_V)},
        {"pwm_hz", above_zero(p->pwm_hz)},
        {"dead_time_s", not_below_zero(p->dead_time_s) && p->dead_time_s * p->pwm_hz < 0.5},
        {"device_drop_V", not_below_zero(p->device_drop_V)},
        {"leg_knee_A", not_below_zero(p->leg_knee_A)},
        {"short_circuit_A", above_zero(p->short_circuit_A)},
        {"desaturation_s", not_below_zero(p->desaturation_s)},
        {"substeps", p->substeps >= 10 && p->substeps <= 100000},
        {"current_full_scale_A", above_zero(p->current_full_scale_A)},
        {"adc_bits", p->adc_bits >= 1 && p->adc_bits <= 24},
        {"current_noise_A_rms", not_below_zero(p->current_noise_A_rms)},
        {"vdc_full_scale_V", above_zero(p->vdc_full_scale_V)},
        {"angle_offset_rad", isfinite(p->angle_offset_rad)},
        {"angle_h1_rad", isfinite(p->angle_h1_rad) && isfinite(p->angle_h1_phase)},
        {"angle_h2_rad", isfinite(p->angle_h2_rad) && isfinite(p->angle_h2_phase)},
        {"resolver_pole_pairs", above_zero(p->resolver_pole_pairs)},
        {"angle_bits", p->angle_bits >= 0 && p->angle_bits <= 24},
    };
    for (size_t k = 0; k < sizeof check / sizeof check[0]; k++) {
        if (!check[k].ok) {
            return check[k].name;
        }
    }
    return bad_sensor(p);
}

const char *plant_params_bad_field(const plant_params_t *params, int has_map)
{
    const char *bad = bad_machine(params, has_map);
    if (bad == NULL && !not_below_zero(params->hardware_safe_V)) {
        bad = "hardware_safe_V";
    }
    const int bridge = params->imposed_bridge;
    if (bad == NULL && (bridge < PLANT_BRIDGE_OBEYS || bridge > PLANT_BRIDGE_UPPER_ON)) {
        bad = "imposed_bridge";
    }
    if (bad == NULL && !isfinite(params->series_d_V)) {
        bad = "series_d_V";
    }
    if (bad == NULL && !isfinite(params->series_q_V)) {
        bad = "series_q_V";
    }
    return bad != NULL ? bad : bad_electronics(params);
}
