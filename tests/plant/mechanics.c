/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics.h"

#include <math.h>

#define TWO_PI 6.28318530717958647693

double wrap_angle(double angle_rad)
{
    const double wrapped = angle_rad - TWO_PI * floor(angle_rad / TWO_PI);
    return wrapped < TWO_PI && wrapped >= 0.0 ? wrapped : 0.0;
}

static double acceleration(const plant_params_t *p, double torque_Nm, double speed_rad_s)
{
    return (torque_Nm - p->load_Nm - p->viscous_Nms * speed_rad_s) / p->inertia_kgm2;
}

void mechanics_set(mechanics_t *m, double theta_m_rad, double speed_rad_s)
{
    m->theta_m_rad = wrap_angle(theta_m_rad);
    m->speed_rad_s = speed_rad_s;
}

double mechanics_mid_speed(const mechanics_t *m, const plant_params_t *p, double torque_Nm, double h)
{
    if (p->imposed_speed) {
        return m->speed_rad_s;
    }
    return m->speed_rad_s + 0.5 * h * acceleration(p, torque_Nm, m->speed_rad_s);
}

void mechanics_step(mechanics_t *m, const plant_params_t *p, double mid_rad_s, double torque_Nm, double h)
{
    m->theta_m_rad = wrap_angle(m->theta_m_rad + h * mid_rad_s);
    if (!p->imposed_speed) {
        m->speed_rad_s += h * acceleration(p, torque_Nm, mid_rad_s);
    }
}
