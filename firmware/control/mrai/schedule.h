/* SPDX-License-Identifier: Apache-2.0 */
#ifndef MRAI_SCHEDULE_H
#define MRAI_SCHEDULE_H
/** Gates, speed and current normalisation and quality of the identification: the slow half of control/mrai/mrai.h.
 *   flux gate        |w| >= w_min and |i| >= i_min: without current the dead time swallows any voltage
 *   resistance gate  the same, |w| <= w_r_max, and the flux has settled: its drift is that of an error below 1 %
 *   quality          first-order filter towards 1 - |drift|/drift_full while the gate is open, towards 0 while
 *                    closed or clamped; drift = change of the identified parameter per step: what is still to do
 * Source   docs/theory/mrai.md (MR-12) ... (MR-18)
 * Units    as in control/mrai/mrai.h; quality 0 ... 1 in q15
 * Errors   reciprocal of a gated quantity only: bounded
 * Context  1 kHz task */
#include "control/mrai/mrai.h"

typedef struct {
    q15_t psi_quality, r_quality;
    q31_t psi_last, r_last; /* identified values at the last step */
} mrai_quality_t;

typedef struct {
    const operating_point_t *sample; /* latest operating point */
    /* The one just commanded: i and flux count. The gain must suit both, as a step takes less than a task. */
    const operating_point_t *next;
    const mrai_state_t *identifier;
    bool enabled; /* identification wanted and the bridge on */
} mrai_schedule_in_t;

mrai_schedule_t mrai_schedule_step(const mrai_config_t *config, mrai_quality_t *quality, const mrai_schedule_in_t *in);

#endif
