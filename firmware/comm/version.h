/* SPDX-License-Identifier: Apache-2.0 */
#ifndef COMM_VERSION_H
#define COMM_VERSION_H
/** What the version frame says. A test holds the first three to the build's project version.
 * Source   CMakeLists.txt; firmware/comm/fluxtrue.dbc
 * Context  constants only */

#define FLUXTRUE_MAJOR 0U
#define FLUXTRUE_MINOR 1U
#define FLUXTRUE_PATCH 0U
#define INTERFACE_VERSION 1U /* counted up when a signal of the DBC changes its meaning or place */

#endif
