/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_HOST_SPUN_H
#define HAL_HOST_SPUN_H
/** Source of the angle and limits of the shaft in SI, for fluxtrue_set() and fluxtrue_get().
 * Source   docs/howto/commission.md
 * Units    in the names
 * Context  host port */
#include "hal/host/fluxtrue.h"

/** X(name): a value that can be set. */
#define SPUN_VALUES(X) X(pole_pairs) X(reversed) X(offset_rad) X(imposed) X(imposed_hz) X(periods) X(rpm)

#define SPUN_VALUE(name) \
    double spun_##name(const fluxtrue_t *drive); \
    void spun_set_##name(fluxtrue_t *drive, double value);

SPUN_VALUES(SPUN_VALUE)

/** Of the sensor since the start. */
double spun_turns(const fluxtrue_t *drive);
/** spin_failure_t */
double spun_failure(const fluxtrue_t *drive);

#endif
