/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TYPES_FEATURES_H
#define TYPES_FEATURES_H
/** Parts of the firmware that a build may leave out: 1 in, 0 out.
 * Source   CMake's options of the same names
 * Units    none
 * Range    0 or 1
 * Errors   none
 * Context  compile time */

/** The 2014 paper's identification: drive/mrai, control/mrai and the second interrupt. */
#ifndef FLUXTRUE_MRAI
#define FLUXTRUE_MRAI 1
#endif

#endif
