/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_HOST_PULSED_H
#define HAL_HOST_PULSED_H
/** The voltage pulses at standstill in SI, for fluxtrue_set() and fluxtrue_get().
 * Source   docs/howto/commission.md
 * Units    in the names; voltages as a share of the largest voltage; phase is pulses_phase_t
 * Context  host port */
#include "hal/host/fluxtrue.h"

/** X(name): a value that is set before the pulses are started. */
#define PULSED_VALUES(X) \
    X(vd) X(vq) X(first) X(id_low_A) X(id_high_A) X(iq_low_A) X(iq_high_A) X(angle_rad) X(delay) X(reversals) X(periods)

#define PULSED_VALUE(name) \
    double pulsed_##name(const fluxtrue_t *drive); \
    void pulsed_set_##name(fluxtrue_t *drive, double value);

PULSED_VALUES(PULSED_VALUE)

double pulsed_phase(const fluxtrue_t *drive);
void pulsed_start(fluxtrue_t *drive, double value);
double pulsed_failure(const fluxtrue_t *drive);
/** The consent to pulses. As on the bus, it begins only with switching disabled. */
double pulsed_agreed(const fluxtrue_t *drive);
void pulsed_agree(fluxtrue_t *drive, double value);
/** Electrical angle of the last sample. */
double pulsed_theta_rad(const fluxtrue_t *drive);

#endif
