/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TYPES_VERSION_H
#define TYPES_VERSION_H
/** The version of the project, written in this file only. Everything that reports a version takes it from here: the
 * build (CMakeLists.txt), the image, the library (hal/host/fluxtrue.h), the bus (frame INV_Version) and the Python
 * tools (tools/fluxtrue_tools/version.py).
 *   firmware_version is linked into every image. A tool finds it by its symbol in the ELF file, or by its mark in a
 *   bare memory dump (`tools/fluxtrue target version`).
 * Source   CONTRIBUTING.md, "Release"
 * Range    each number 0 ... 255: the frame has one byte for each
 * Context  constants only */
#include <stdint.h>

#define FLUXTRUE_VERSION_MAJOR 0
#define FLUXTRUE_VERSION_MINOR 1
#define FLUXTRUE_VERSION_PATCH 0

#define FLUXTRUE_VERSION_MARK "fluxtrue-ver"

typedef struct {
    char mark[16]; /* FLUXTRUE_VERSION_MARK, filled up with zeros */
    uint32_t major, minor, patch;
    char text[12]; /* "0.1.0" */
} version_t;

extern const version_t firmware_version;

#endif
