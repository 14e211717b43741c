/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics.h"

#include <math.h>

#define TWO_PI 6.28318530717958647693

double wrap_angle(double angle_rad)
{
    if (angle_rad > 0.0 && angle_rad < TWO_PI) {
        return angle_rad; /* as below, to the bit */
    }
    const double wrapped = angle_rad - TWO_PI * floor(angle_rad / TWO_PI);
    return wrapped < TWO_PI && wrapped >= 0.0 ? wrapped : 0.0;
}

static double acceleration(const plant_params_t *p, double torque_Nm, double speed_rad_s)
{
    return (torque_Nm - p->load_Nm - p->viscous_Nms * speed_rad_s) / p->inertia_kgm2;
}

static double dry_friction(const plant_params_t *p, double speed_rad_s)
{
    const double x = speed_rad_s / p->stribeck_rad_s;
    return p->coulomb_Nm + fmax(p->stiction_Nm - p->coulomb_Nm, 0.0) * exp(-x * x);
}

/* The speed after h. Dry friction (PL-30) takes speed away down to zero and holds the rotor there; it is implicit in
 * the sign of the speed, so that a rotor at rest does not oscillate about zero from step to step. */
static double speed_after(const plant_params_t *p, double from_rad_s, double torque_Nm, double at_rad_s, double h)
{
    const double free_rad_s = from_rad_s + h * acceleration(p, torque_Nm, at_rad_s);
    if (p->coulomb_Nm == 0.0 && p->stiction_Nm == 0.0) {
        return free_rad_s;
    }
    const double most_rad_s = h * dry_friction(p, at_rad_s) / p->inertia_kgm2;
    return fabs(free_rad_s) <= most_rad_s ? 0.0 : free_rad_s - copysign(most_rad_s, free_rad_s);
}

double mechanics_friction(const plant_params_t *p, double speed_rad_s)
{
    const double viscous_Nm = p->viscous_Nms * speed_rad_s;
    if (speed_rad_s == 0.0 || (p->coulomb_Nm == 0.0 && p->stiction_Nm == 0.0)) {
        return viscous_Nm;
    }
    return viscous_Nm + copysign(dry_friction(p, speed_rad_s), speed_rad_s);
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
    return speed_after(p, m->speed_rad_s, torque_Nm, m->speed_rad_s, 0.5 * h);
}

void mechanics_step(mechanics_t *m, const plant_params_t *p, double mid_rad_s, double torque_Nm, double h)
{
    m->theta_m_rad = wrap_angle(m->theta_m_rad + h * mid_rad_s);
    if (!p->imposed_speed) {
        m->speed_rad_s = speed_after(p, m->speed_rad_s, torque_Nm, mid_rad_s, h);
    }
}
