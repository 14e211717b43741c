/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PLANT_ROTOR_H
#define PLANT_ROTOR_H
/** Rotations between the stationary and the rotor frame; an angle is represented by its cosine and sine.
 *   x_s = e^{j theta} x_dq
 * Source   docs/theory/plant.md (PL-9)
 * Rounding rotation_of() within 1e-16 of libm up to 0.3 rad, libm above
 * Context  simulation only */
#include <math.h>

typedef struct {
    double c, s;
} rotation_t;

static inline rotation_t rotation_of(double angle)
{
    if (fabs(angle) > 0.3) {
        return (rotation_t){cos(angle), sin(angle)};
    }
    const double x = angle * angle; /* Taylor to x^6: the next term is below 3e-17 */
    const double c = x * (1.0 / 56.0) * (1.0 - x * (1.0 / 90.0) * (1.0 - x * (1.0 / 132.0)));
    const double s = x * (1.0 / 42.0) * (1.0 - x * (1.0 / 72.0) * (1.0 - x * (1.0 / 110.0)));
    return (rotation_t){1.0 - x * 0.5 * (1.0 - x * (1.0 / 12.0) * (1.0 - x * (1.0 / 30.0) * (1.0 - c))),
                        angle * (1.0 - x * (1.0 / 6.0) * (1.0 - x * (1.0 / 20.0) * (1.0 - s)))};
}

/* sin(angle)/angle: the length of the mean of a unit vector that rotates from -angle to +angle. */
static inline double sinc_of(double angle)
{
    if (fabs(angle) > 0.3) {
        return sin(angle) / angle;
    }
    const double x = angle * angle;
    const double s = x * (1.0 / 42.0) * (1.0 - x * (1.0 / 72.0) * (1.0 - x * (1.0 / 110.0)));
    return 1.0 - x * (1.0 / 6.0) * (1.0 - x * (1.0 / 20.0) * (1.0 - s));
}

static inline rotation_t rotation_add(rotation_t a, rotation_t b)
{
    return (rotation_t){a.c * b.c - a.s * b.s, a.s * b.c + a.c * b.s};
}

static inline void to_stationary(rotation_t t, const double dq[2], double ab[2])
{
    const double d = dq[0], q = dq[1];
    ab[0] = t.c * d - t.s * q;
    ab[1] = t.s * d + t.c * q;
}

static inline void to_rotor(rotation_t t, const double ab[2], double dq[2])
{
    const double a = ab[0], b = ab[1];
    dq[0] = t.c * a + t.s * b;
    dq[1] = t.c * b - t.s * a;
}

/* The three phase axes in the stationary frame. */
#define PHASE_B_SIN 0.86602540378443864676
static const double phase_axis[3][2] = {{1.0, 0.0}, {-0.5, PHASE_B_SIN}, {-0.5, -PHASE_B_SIN}};

static inline void to_phases(const double ab[2], double abc[3])
{
    for (int x = 0; x < 3; x++) {
        abc[x] = phase_axis[x][0] * ab[0] + phase_axis[x][1] * ab[1];
    }
}

static inline void from_phases(const double abc[3], double ab[2])
{
    ab[0] = (2.0 * abc[0] - abc[1] - abc[2]) * (1.0 / 3.0);
    ab[1] = (abc[1] - abc[2]) * (2.0 / 3.0 * PHASE_B_SIN);
}

#endif
