/* SPDX-License-Identifier: Apache-2.0 */
#include "types/version.h"

#define TEXT(number) #number
#define JOIN(major, minor, patch) TEXT(major) "." TEXT(minor) "." TEXT(patch)

// NOLINTNEXTLINE(misc-redundant-expression): two of the numbers may be equal
_Static_assert(FLUXTRUE_VERSION_MAJOR <= UINT8_MAX && FLUXTRUE_VERSION_MINOR <= UINT8_MAX &&
                   FLUXTRUE_VERSION_PATCH <= UINT8_MAX,
               "each number of the version must fit into one byte of the frame INV_Version");

const version_t firmware_version = {
    .mark = FLUXTRUE_VERSION_MARK,
    .major = FLUXTRUE_VERSION_MAJOR,
    .minor = FLUXTRUE_VERSION_MINOR,
    .patch = FLUXTRUE_VERSION_PATCH,
    .text = JOIN(FLUXTRUE_VERSION_MAJOR, FLUXTRUE_VERSION_MINOR, FLUXTRUE_VERSION_PATCH),
};
