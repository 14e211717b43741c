/* SPDX-License-Identifier: Apache-2.0 */
#include "exact_machine.h"

#define TURN_RAD 6.283185307179586
#define SUBSTEPS 8
#define DEAD_SHARE 0.02 /* dead time as a share of the period */
#define DROP_V 1.0

static double fraction(double turns)
{
    const double whole = (double)(long long)turns;
    const double rest = turns - whole;
    return (rest < 0.0) ? rest + 1.0 : rest;
}

/* Taylor series up to x^15: the error in the first quadrant is below 1e-11. */
double exact_sin_turns(double turns)
{
    double part = fraction(turns);
    const double sign = (part >= 0.5) ? -1.0 : 1.0;
    part = (part >= 0.5) ? part - 0.5 : part;
    part = (part > 0.25) ? 0.5 - part : part;
    const double x = part * TURN_RAD;
    double term = x, sum = x;
    for (int k = 1; k <= 7; k++) {
        term = -term * x * x / (double)(2 * k * (2 * k + 1));
        sum += term;
    }
    return sign * sum;
}

static double cos_turns(double turns)
{
    return exact_sin_turns(turns + 0.25);
}

static double magnitude(double x)
{
    return (x < 0.0) ? -x : x;
}

/* psi = L i / (1 + |i| / i_sat), solved for i. */
static double current_q(const exact_machine_t *m, double psi_q_Vs)
{
    const double share = psi_q_Vs / m->l_q_H;
    const double left = 1.0 - magnitude(share) / m->i_sat_A;
    return share / ((left < 0.2) ? 0.2 : left);
}

static double current_d(const exact_machine_t *m, double psi_d_Vs)
{
    return (psi_d_Vs - m->psi_f_Vs) / m->l_d_H;
}

static void phase_currents(const exact_machine_t *m, const exact_state_t *s, double i[3])
{
    const double theta_e = s->theta_m_turns * m->pole_pairs;
    const double i_d = current_d(m, s->psi_d_Vs), i_q = current_q(m, s->psi_q_Vs);
    for (int k = 0; k < 3; k++) {
        const double phase = theta_e - (double)k / 3.0;
        i[k] = i_d * cos_turns(phase) - i_q * exact_sin_turns(phase);
    }
}

void exact_machine_sample(const exact_machine_t *m, const exact_state_t *s, double v_dc_V, double winding_C,
                          double in[6])
{
    double i[3];
    phase_currents(m, s, i);
    for (int k = 0; k < 3; k++) {
        in[k] = i[k] * m->gain[k] + m->offset_A[k];
    }
    in[3] = v_dc_V;
    in[4] = fraction(s->theta_m_turns) * TURN_RAD + m->angle_ripple * exact_sin_turns(s->theta_m_turns);
    in[5] = winding_C;
}

void exact_machine_step(const exact_machine_t *m, exact_state_t *s, const double duty[3], bool on, double v_dc_V,
                        double speed_rad_s, double period_s)
{
    const double h = period_s / SUBSTEPS;
    const double omega = speed_rad_s * m->pole_pairs;
    double v[3], i[3];
    phase_currents(m, s, i);
    for (int k = 0; k < 3; k++) {
        v[k] = v_dc_V * duty[k] - (DEAD_SHARE * v_dc_V + DROP_V) * i[k] / (magnitude(i[k]) + 1.0);
    }
    const double v_alpha = (2.0 * v[0] - v[1] - v[2]) / 3.0, v_beta = (v[1] - v[2]) * 0.57735026918962576;
    for (int k = 0; k < SUBSTEPS; k++) {
        const double theta_e = s->theta_m_turns * m->pole_pairs;
        const double cosine = cos_turns(theta_e), sine = exact_sin_turns(theta_e);
        if (on) {
            const double v_d = cosine * v_alpha + sine * v_beta, v_q = cosine * v_beta - sine * v_alpha;
            const double psi_d = s->psi_d_Vs, psi_q = s->psi_q_Vs;
            s->psi_d_Vs = psi_d + h * (v_d - m->r_ohm * current_d(m, psi_d) + omega * psi_q);
            s->psi_q_Vs = psi_q + h * (v_q - m->r_ohm * current_q(m, psi_q) - omega * psi_d);
        } else {
            s->psi_d_Vs = m->psi_f_Vs;
            s->psi_q_Vs = 0.0;
        }
        s->theta_m_turns = fraction(s->theta_m_turns + h * speed_rad_s / TURN_RAD);
    }
}
