/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PLANT_MECHANICS_H
#define PLANT_MECHANICS_H
/** Rotor: imposed speed, or inertia with an active load.
 *   J dw/dt = T - T_load - B w - T_dry(w) sgn w,  dtheta/dt = w;  at rest up to T_dry(0) is held
 * Source   docs/theory/plant.md (PL-15), (PL-16), (PL-30)
 * Units    rad/s and rad, mechanical
 * Rounding second order in the substep (mid-point speed, trapezoidal torque)
 * Context  simulation only */
#include "plant_params.h"

typedef struct {
    double speed_rad_s, theta_m_rad; /* theta in [0, 2 pi) */
} mechanics_t;

void mechanics_set(mechanics_t *m, double theta_m_rad, double speed_rad_s);

/** Speed in the middle of the next substep. */
double mechanics_mid_speed(const mechanics_t *m, const plant_params_t *p, double torque_Nm, double h);

/** Completes a substep: mid_rad_s is the speed in its middle, torque_Nm its mean air-gap torque. */
void mechanics_step(mechanics_t *m, const plant_params_t *p, double mid_rad_s, double torque_Nm, double h);

/** Torque of viscous and dry friction against a speed; a rotor at rest has none. */
double mechanics_friction(const plant_params_t *p, double speed_rad_s);

/** To [0, 2 pi). */
double wrap_angle(double angle_rad);

#endif
