/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_RECALL_H
#define DRIVE_RECALL_H
/** Checks whether the values that a start has recalled describe this machine. The identification begins with them, but
 * neither the torque loop nor the references use them before measured windows have confirmed them.
 *   confirmed  in RECALL_AGREED updates in a row the residuals of both axes are those of a flux error of at most a
 *              quarter of noise_flux, |e| <= |w| noise_flux/4, at torque_min (identify/config.h) or more, and the last
 *              of them at a second speed: at least 3/2 or at most 2/3 of that of the first agreement, or with torque in
 *              the other direction. One speed is enough where resistance and voltage drop, which can hide a wrong flux,
 *              explain no more than that bound, and from twice the local corner on
 *   rejected   if RECALL_TRIALS updates at half of the local corner's speed or more have not confirmed them, or after
 *              RECALL_GATE_EXCEEDED updates in a row beyond the innovation gate, which is before (MN-12) reports a
 *              wrong angle: the identification restarts from its priors
 * Source   docs/theory/identification.md (ID-22), (ID-23)
 * Units    residuals per unit of voltage, Q30
 * Range    every speed and residual
 * Errors   none
 * Context  1 kHz task, before the step of the identification; recall_begin() before the task starts */
#include "drive/drive.h"

#define RECALL_AGREED 3U
#define RECALL_TRIALS 50U
#define RECALL_GATE_EXCEEDED 3U

/** The recalled values have to be confirmed from now on. */
void recall_begin(drive_t *drive);
/** omega: of the window, q31. */
void recall_step(drive_t *drive, q31_t omega);

#endif
