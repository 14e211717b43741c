/* SPDX-License-Identifier: Apache-2.0 */
#ifndef MRAI_SCHEDULE_H
#define MRAI_SCHEDULE_H
/** The slow part of control/mrai/mrai.h: when each law adapts, its normalised gain, and the quality of the result.
 *   flux gate        adapts while |w| >= w_min and |i| >= i_min: with little current the voltage error of the dead time
 *                    exceeds the voltage of the flux error
 *   resistance gate  adapts while the flux does, |w| <= w_r_max, and the flux has settled: its drift is that of an
 *                    error below 1 %
 *   quality          first-order filter towards 1 - |drift|/drift_full while the parameter adapts, towards 0 while it
 *                    does not or is clamped; drift = change of the identified parameter per step
 * Source   docs/theory/mrai.md (MR-12) ... (MR-18)
 * Units    as in control/mrai/mrai.h; quality 0 ... 1 in q15
 * Errors   none: it divides only by quantities that a gate condition keeps away from zero
 * Context  1 kHz task */
#include "control/mrai/mrai.h"

typedef struct {
    q15_t psi_quality, r_quality;
    q31_t psi_last, r_last; /* identified values at the last step */
} mrai_quality_t;

typedef struct {
    const operating_point_t *sample; /* latest operating point */
    /* Operating point just commanded; only i and flux are used. The smaller gain of both points is taken, because the
     * currents move from one to the other within a step. */
    const operating_point_t *next;
    const mrai_state_t *identifier;
    bool enabled; /* identification wanted and the bridge on */
} mrai_schedule_in_t;

mrai_schedule_t mrai_schedule_step(const mrai_config_t *config, mrai_quality_t *quality, const mrai_schedule_in_t *in);

#endif
