/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_HOST_IDENTIFIED_H
#define HAL_HOST_IDENTIFIED_H
/** Results of the chosen identification in SI, for fluxtrue_get().
 * Source   docs/howto/software-in-the-loop.md
 * Units    in the names
 * Errors   the paper's identification identifies resistance and flux only; the other parameters read as nominal
 * Context  host port */
#include "hal/host/fluxtrue.h"

double identified_psi_f_Vs(const fluxtrue_t *drive);
double identified_r_ohm(const fluxtrue_t *drive);
double identified_drop_V(const fluxtrue_t *drive);
double identified_lq_scale(const fluxtrue_t *drive);
double identified_ld_scale(const fluxtrue_t *drive);
double identified_angle_rad(const fluxtrue_t *drive);
double identified_iron_scale(const fluxtrue_t *drive);
double identified_clamped(const fluxtrue_t *drive);
double identified_confidence(const fluxtrue_t *drive);
double identified_mismatch_share(const fluxtrue_t *drive);
double identified_local_Vs(const fluxtrue_t *drive);

#endif
