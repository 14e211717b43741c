/* SPDX-License-Identifier: Apache-2.0 */
#include "plant.h"

#include "energy.h"
#include "inverter.h"
#include "machine.h"
#include "mechanics.h"
#include "sensors.h"

#include <stdlib.h>
#include <string.h>

#define TWO_PI 6.28318530717958647693
/* The drivers' line is active at the first sample; what the second one enables acts a period later. */
#define LATCHED_PERIODS 2

struct plant {
    plant_params_t params;
    machine_t machine;
    inverter_t inverter;
    mechanics_t mechanics;
    double theta_e_rad; /* of rotor: three functions of a period need the same angle */
    rotation_t rotor;
    sensors_t sensors;
    plant_switches_t on;
    double link_V; /* of the capacitor */
    int gate_fault;
    int latched;        /* periods in which no controller could have enabled switching again */
    int hardware_short; /* held by the board */
    plant_truth_t truth;
};

/* Constant within a period. */
typedef struct {
    const double *duty;
    int switching;
    double battery_V;
    double short_circuit_A; /* through both switches of a leg, mean over the period */
} bridge_t;

static rotation_t rotor_angle(plant_t *plant)
{
    const double theta_e = plant->params.pole_pairs * plant->mechanics.theta_m_rad;
    if (theta_e != plant->theta_e_rad) {
        plant->theta_e_rad = theta_e;
        plant->rotor = (rotation_t){cos(theta_e), sin(theta_e)};
    }
    return plant->rotor;
}

static double vdc_at(const plant_params_t *p, double time_s)
{
    if (p->vdc_ripple_V == 0.0) {
        return p->vdc_V;
    }
    return p->vdc_V + p->vdc_ripple_V * sin(TWO_PI * p->vdc_ripple_hz * time_s);
}

/* Without a capacitor the bridge is connected to the battery. */
static double bridge_V(const plant_t *plant, double time_s)
{
    const plant_params_t *p = &plant->params;
    const int at_battery = p->dc_link_F == 0.0 || (plant->on.contactor && !p->contactor_open);
    return at_battery ? vdc_at(p, time_s) : plant->link_V;
}

/* Applies changed parameters; returns the rotor's electrical angle. */
static rotation_t update(plant_t *plant)
{
    const plant_params_t *p = &plant->params;
    if (p->imposed_speed) {
        plant->mechanics.speed_rad_s = p->speed_rad_s;
    }
    const rotation_t rotor = rotor_angle(plant);
    machine_update(&plant->machine, p, rotor, p->pole_pairs * plant->mechanics.speed_rad_s);
    return rotor;
}

static void instant_truth(plant_t *plant, rotation_t rotor)
{
    const machine_t *m = &plant->machine;
    plant_truth_t *t = &plant->truth;
    double i_dq[2], i_s[2];
    machine_current(m, i_dq);
    to_stationary(rotor, i_dq, i_s);
    to_phases(i_s, t->i_abc_A);
    t->i_d_A = i_dq[0];
    t->i_q_A = i_dq[1];
    t->i_dm_A = m->im_dq[0];
    t->i_qm_A = m->im_dq[1];
    t->psi_d_Vs = m->psi_dq[0];
    t->psi_q_Vs = m->psi_dq[1];
    t->torque_Nm = machine_torque(m);
    t->speed_rad_s = plant->mechanics.speed_rad_s;
    t->speed_rpm = t->speed_rad_s * 60.0 / TWO_PI;
    t->theta_m_rad = plant->mechanics.theta_m_rad;
    t->theta_e_rad = wrap_angle(t->theta_m_rad * plant->params.pole_pairs);
    t->r_ohm = m->r_ohm;
    t->psi_f_Vs = m->flux.psi_f_Vs;
    t->vdc_V = bridge_V(plant, t->time_s);
    t->inversion_failures = m->failures;
}

plant_t *plant_create(const plant_params_t *params, const plant_map_t *map)
{
    if (plant_params_bad_field(params, map != NULL) != NULL) {
        return NULL;
    }
    plant_t *plant = calloc(1, sizeof *plant);
    if (plant == NULL) {
        return NULL;
    }
    plant->params = *params;
    plant->on = (plant_switches_t){.contactor = 1, .gate_supply = 1};
    plant->link_V = params->vdc_start_V;
    plant->rotor = (rotation_t){1.0, 0.0}; /* at theta_e_rad = 0 */
    machine_create(&plant->machine, params, map);
    sensors_create(&plant->sensors, params);
    plant_set_state(plant, 0.0, 0.0, params->theta_m_rad, params->speed_rad_s);
    return plant;
}

void plant_destroy(plant_t *plant)
{
    free(plant);
}

plant_params_t *plant_params(plant_t *plant)
{
    return &plant->params;
}

const plant_truth_t *plant_truth(const plant_t *plant)
{
    return &plant->truth;
}

void plant_set_state(plant_t *plant, double id_A, double iq_A, double theta_m_rad, double speed_rad_s)
{
    const double time_s = plant->truth.time_s, im_dq[2] = {id_A, iq_A};
    if (plant->params.imposed_speed) {
        plant->params.speed_rad_s = speed_rad_s;
    }
    mechanics_set(&plant->mechanics, theta_m_rad, speed_rad_s);
    const rotation_t rotor = update(plant);
    machine_set_current(&plant->machine, im_dq, rotor);
    memset(&plant->truth, 0, sizeof plant->truth);
    plant->truth.time_s = time_s;
    instant_truth(plant, rotor);
}

void plant_sample(plant_t *plant, plant_sensors_t *sensors)
{
    instant_truth(plant, update(plant));
    sensors_sample(&plant->sensors, &plant->params, &plant->truth, sensors);
    sensors->gate_fault = plant->gate_fault || plant->params.drivers_block;
}

/* now: the instant at its start, then at its end, where the next one starts. */
static void substep(plant_t *plant, rotation_t *rotor, instant_t *now, double vdc_V, double short_circuit_A, double h,
                    energy_t *sum)
{
    const plant_params_t *p = &plant->params;
    machine_t *m = &plant->machine;
    const instant_t from = *now;
    const double mid_rad_s = mechanics_mid_speed(&plant->mechanics, p, from.torque_Nm, h);
    const double half_rad = 0.5 * h * p->pole_pairs * mid_rad_s;
    const rotation_t half = rotation_of(half_rad), mid = rotation_add(*rotor, half), end = rotation_add(mid, half);
    double u_s[2], i_dq[2], i_end[2], i_s[2], i_abc[3];

    machine_current(m, i_dq);
    inverter_voltage(&plant->inverter, m, vdc_V, h, *rotor, end, u_s, i_end);
    i_dq[0] = 0.5 * (i_dq[0] + i_end[0]);
    i_dq[1] = 0.5 * (i_dq[1] + i_end[1]);
    to_stationary(mid, i_dq, i_s);
    to_phases(i_s, i_abc);
    machine_step(m, u_s, i_s, h, end);

    *now = energy_instant(m);
    const double torque_Nm = 0.5 * (from.torque_Nm + now->torque_Nm);
    mechanics_step(&plant->mechanics, p, mid_rad_s, torque_Nm, h);
    energy_voltage(sum, u_s, mid, half_rad, h);
    energy_electric(sum, m, &from, now, u_s, i_s, h);
    energy_mechanic(sum, torque_Nm, mid_rad_s, mechanics_friction(p, mid_rad_s), h);
    const double charge_As = h * (inverter_dc_current(&plant->inverter, i_abc) + short_circuit_A);
    sum->dc += vdc_V * charge_As;
    sum->charge += charge_As;
    plant->truth.e_short_circuit_J += vdc_V * h * short_circuit_A;
    *rotor = end;
}

/* The board's own safe state (PL-26): all lower switches on, from when the voltage is too high until the request ends.
 * It has a supply of its own. */
static int hardware_short(plant_t *plant)
{
    const double level_V = plant->params.hardware_safe_V;
    const int above = level_V > 0.0 && plant->link_V > level_V;
    plant->hardware_short = plant->on.hardware_safe && (plant->hardware_short || above);
    return plant->hardware_short;
}

/* Applies it from the next substep on. */
static void hardware_apply(plant_t *plant, bridge_t *bridge)
{
    static const double lower_on[3] = {0.0, 0.0, 0.0};
    if (hardware_short(plant) && bridge->duty != lower_on) {
        bridge->duty = lower_on;
        bridge->switching = 1;
        inverter_set(&plant->inverter, &plant->params, bridge->duty, 1, plant->link_V);
    }
}

/* Advances the capacitor by a substep and updates the legs, whose voltage errors depend on its voltage. */
static double link_substep(plant_t *plant, const bridge_t *bridge, double vdc_V, double charge_As, double h)
{
    const plant_params_t *p = &plant->params;
    if (p->dc_link_F == 0.0) {
        return vdc_V;
    }
    plant->link_V = dc_link_step(p, &plant->on, vdc_V, bridge->battery_V, charge_As / h, h,
                                 &plant->truth.e_avalanche_J);
    if (plant->link_V != vdc_V) {
        inverter_set(&plant->inverter, p, bridge->duty, bridge->switching, plant->link_V);
    }
    return plant->link_V;
}

void plant_switch(plant_t *plant, const plant_switches_t *on)
{
    if (plant->params.imposed_bridge != PLANT_BRIDGE_OBEYS) {
        return; /* contactor and supply stay as they are, too */
    }
    plant->on = *on;
    plant->truth.gate_supply = on->gate_supply ? 1.0 : 0.0;
}

/* One switch of a leg is shorted and the other is switched on (PL-25). If the pulse lasts longer than desaturation_s,
 * the gate driver detects the desaturation and the timer's fault input switches all six off. */
static double short_circuit(plant_t *plant, bridge_t *bridge)
{
    const plant_params_t *p = &plant->params;
    const double on_s = inverter_short_circuit(p, bridge->duty, bridge->switching) / p->pwm_hz;
    plant->gate_fault = bridge->switching && !p->desaturation_open && on_s > p->desaturation_s;
    if (!plant->gate_fault) {
        return p->short_circuit_A * on_s * p->pwm_hz;
    }
    bridge->switching = 0;
    plant->latched = LATCHED_PERIODS;
    return p->short_circuit_A * fmax(p->desaturation_s * p->pwm_hz, inverter_short_circuit(p, bridge->duty, 0));
}

/* An imposed state finds the timer's latch as a controller would (PL-31); a controller's gates come with it. */
static int switching(plant_t *plant, int gates_on, double duty[3])
{
    const plant_params_t *p = &plant->params;
    const int is_latched = plant->latched > 0 && p->imposed_bridge != PLANT_BRIDGE_OBEYS;
    plant->latched -= plant->latched > 0;
    return inverter_gates(p, gates_on && plant->on.gate_supply, duty) && !is_latched;
}

/* Held for the period in the stationary frame, as the voltage of the duties is. */
static void series_source(plant_t *plant, rotation_t rotor)
{
    const plant_params_t *p = &plant->params;
    const double half_rad = 0.5 * p->pole_pairs * plant->mechanics.speed_rad_s / p->pwm_hz;
    const double u_dq[2] = {p->series_d_V, p->series_q_V};
    to_stationary(rotation_add(rotor, rotation_of(half_rad)), u_dq, plant->inverter.series_V);
}

void plant_advance(plant_t *plant, const double wanted[3], int gates_on)
{
    const plant_params_t *p = &plant->params;
    const double period_s = 1.0 / p->pwm_hz;
    const int n = p->substeps < 10 ? 10 : p->substeps;
    const double middle_s = plant->truth.time_s + 0.5 * period_s;
    const int b = p->phases_swapped ? 2 : 1;
    double duty[3] = {wanted[0], wanted[b], wanted[3 - b]};
    bridge_t bridge = {duty, switching(plant, gates_on, duty), vdc_at(p, middle_s), 0.0};
    bridge.short_circuit_A = short_circuit(plant, &bridge);
    double vdc_V = bridge_V(plant, middle_s);
    energy_t sum = {0};
    rotation_t rotor = update(plant);
    instant_t now = energy_instant(&plant->machine);
    series_source(plant, rotor);
    inverter_set(&plant->inverter, p, duty, bridge.switching, vdc_V);
    hardware_apply(plant, &bridge);
    for (int k = 0; k < n; k++) {
        const double before_As = sum.charge;
        substep(plant, &rotor, &now, vdc_V, bridge.short_circuit_A, period_s / n, &sum);
        vdc_V = link_substep(plant, &bridge, vdc_V, sum.charge - before_As, period_s / n);
        hardware_apply(plant, &bridge);
    }
    energy_mean(&sum, period_s, &plant->truth);
    plant->truth.time_s += period_s;
    instant_truth(plant, rotor_angle(plant));
}
