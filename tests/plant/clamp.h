/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PLANT_CLAMP_H
#define PLANT_CLAMP_H
/** x within lo ... hi; NaN stays NaN. Any unit.
 * Context  simulation only */
static inline double clamp(double x, double lo, double hi)
{
    return x < lo ? lo : (x > hi ? hi : x);
}

#endif
