/* SPDX-License-Identifier: Apache-2.0 */
#include "energy.h"

void energy_electric(energy_t *e, const machine_t *m, const instant_t *from, const instant_t *to, const double u_s[2],
                     const double i_s[2], double h)
{
    double swept = 0.0;
    for (int k = 0; k < 2; k++) {
        e->electrical += 1.5 * h * u_s[k] * i_s[k];
        e->copper += 1.5 * h * m->r_ohm * i_s[k] * i_s[k];
        e->field += 0.75 * (from->im_dq[k] + to->im_dq[k]) * (to->psi_dq[k] - from->psi_dq[k]);
    }
    swept += (from->psi_s[0] + to->psi_s[0]) * (to->psi_s[1] - from->psi_s[1]);
    swept -= (from->psi_s[1] + to->psi_s[1]) * (to->psi_s[0] - from->psi_s[0]);
    e->iron += 0.75 * m->iron_A_per_Vs * swept;
}

void energy_mechanic(energy_t *e, double torque_Nm, double speed_rad_s, double friction_Nm, double h)
{
    e->torque += h * torque_Nm;
    e->torque_shaft += h * (torque_Nm - friction_Nm);
    e->mechanical += h * torque_Nm * speed_rad_s;
}

void energy_voltage(energy_t *e, const double u_s[2], rotation_t mid, double half_rad, double h)
{
    double u_dq[2];
    const double sinc = sinc_of(half_rad);
    to_rotor(mid, u_s, u_dq);
    e->u_dq[0] += h * sinc * u_dq[0];
    e->u_dq[1] += h * sinc * u_dq[1];
}

void energy_mean(const energy_t *sum, double period_s, plant_truth_t *t)
{
    t->u_d_V = sum->u_dq[0] / period_s;
    t->u_q_V = sum->u_dq[1] / period_s;
    t->torque_mean_Nm = sum->torque / period_s;
    t->torque_shaft_mean_Nm = sum->torque_shaft / period_s;
    t->idc_A = sum->charge / period_s;
    t->copper_W = sum->copper / period_s;
    t->iron_W = sum->iron / period_s;
    t->mechanical_W = sum->mechanical / period_s;
    t->electrical_W = sum->electrical / period_s;
    t->inverter_W = (sum->dc - sum->electrical) / period_s;
    t->e_dc_J += sum->dc;
    t->e_electrical_J += sum->electrical;
    t->e_copper_J += sum->copper;
    t->e_iron_J += sum->iron;
    t->e_mechanical_J += sum->mechanical;
    t->e_field_J += sum->field;
}
