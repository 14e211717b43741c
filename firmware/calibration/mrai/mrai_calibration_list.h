/* SPDX-License-Identifier: Apache-2.0 */
#ifndef MRAI_MRAI_CALIBRATION_LIST_H
#define MRAI_MRAI_CALIBRATION_LIST_H
/** The values of the 2014 paper's law among those of calibration/calibration_list.h, in the same form.
 * Source   docs/howto/xcp.md; docs/theory/mrai.md
 * Range    as in calibration/calibration_list.h
 * Context  a build without FLUXTRUE_MRAI has none */
#include "types/features.h"

#if FLUXTRUE_MRAI
#define MRAI_CALIBRATION_LIST(X) \
    X(observer_m, 2.0F, 4.0F, "", "Pole placement m of the observer") \
    X(flux_bandwidth_rad_s, 0.0F, 500.0F, "rad/s", "Bandwidth of the flux identification") \
    X(resistance_bandwidth_rad_s, 0.0F, 150.0F, "rad/s", "Bandwidth of the resistance identification")
#else
#define MRAI_CALIBRATION_LIST(X)
#endif

#endif
