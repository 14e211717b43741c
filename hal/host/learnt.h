/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_HOST_LEARNT_H
#define HAL_HOST_LEARNT_H
/** What the identification that is selected has learnt, in SI, for fluxtrue_get().
 * Source   docs/howto/software-in-the-loop.md
 * Units    in the names
 * Errors   the paper's identification knows resistance and flux only: the rest reads as its table value
 * Context  host port */
#include "hal/host/fluxtrue.h"

double learnt_psi_f_Vs(const fluxtrue_t *drive);
double learnt_r_ohm(const fluxtrue_t *drive);
double learnt_drop_V(const fluxtrue_t *drive);
double learnt_lq_scale(const fluxtrue_t *drive);
double learnt_ld_scale(const fluxtrue_t *drive);
double learnt_angle_rad(const fluxtrue_t *drive);
double learnt_iron_scale(const fluxtrue_t *drive);
double learnt_clamped(const fluxtrue_t *drive);
double learnt_confidence(const fluxtrue_t *drive);
double learnt_contradiction(const fluxtrue_t *drive);
double learnt_local_Vs(const fluxtrue_t *drive);

#endif
