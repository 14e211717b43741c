/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_HOST_COMMISSIONED_H
#define HAL_HOST_COMMISSIONED_H
/** The inverter's voltage error as measured at standstill, in SI, for fluxtrue_set() and fluxtrue_get().
 * Source   docs/howto/commission.md
 * Units    in the names; phase is commission_phase_t
 * Context  host port */
#include "hal/host/fluxtrue.h"

#define COMMISSIONED_POINTS(X) X(0) X(1) X(2) X(3) X(4) X(5) X(6) X(7) X(8) X(9)
#define COMMISSIONED_POINT(k) \
    double commissioned_##k##_A(const fluxtrue_t *drive); \
    double commissioned_##k##_V(const fluxtrue_t *drive);

double commissioned_phase(const fluxtrue_t *drive);
void commissioned_start(fluxtrue_t *drive, double value);
double commissioned_failure(const fluxtrue_t *drive);
double commissioned_r_ohm(const fluxtrue_t *drive);
/** Whether driving moves the compensation. */
double commissioned_trims(const fluxtrue_t *drive);
void commissioned_set_trim(fluxtrue_t *drive, double value);
double commissioned_level_V(const fluxtrue_t *drive);
double commissioned_knee_A(const fluxtrue_t *drive);
COMMISSIONED_POINTS(COMMISSIONED_POINT)

#endif
