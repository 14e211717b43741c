/* SPDX-License-Identifier: Apache-2.0 */
#ifndef EMULATOR_MIRROR_H
#define EMULATOR_MIRROR_H
/** Access to the drive in the emulated memory by the names of the software-in-the-loop library: a drive_t on the host
 * is kept equal to the one in the image, part by part, and fluxtrue_get() and fluxtrue_set() work on it. Setting writes
 * the request (or the calibration) into the image's memory, as a debugger would: no CAN command is needed. Only what
 * was set is written, because the image writes to the same parts: to the request, and to the dead time that it trims.
 * Source   layout.h
 * Errors   mirror_open() returns NULL, or a text that says what is wrong
 * Context  emulator only; between two runs */
#include "emu.h"
#include "hal/host/instance.h"

enum { MIRROR_PARTS_MAX = 16 };

typedef struct {
    const char *name;
    uint32_t host_offset, image_offset, size;
} mirror_part_t;

typedef struct {
    emu_t *emu;
    fluxtrue_t *host;
    drive_t found; /* the host's before the first of the values that wait was set */
    uint32_t base;
    mirror_part_t part[MIRROR_PARTS_MAX];
    int inputs, parts;
    uint64_t pulled_at;
    bool waiting; /* something was set and is not in the image yet */
} mirror_t;

const char *mirror_open(mirror_t *mirror, emu_t *emu, const char *layout_file);
void mirror_close(mirror_t *mirror);
/** True if the image has the calibration of this library, that is, if both were built for the same motor. */
bool mirror_same_motor(mirror_t *mirror);
/** A copy whose padding bytes are 0. */
drive_t drive_plain(const drive_t *drive);
void mirror_pull(mirror_t *mirror);
/** Takes effect with the next mirror_push() at which no activity is running: an activity reads some inputs late. */
int mirror_set(mirror_t *mirror, const char *name, double value);
/** True when something has been written into the image's memory. */
bool mirror_push(mirror_t *mirror);
double mirror_get(mirror_t *mirror, const char *name);
/** True when the image's state differs from another drive's; where: the first byte, as part, offset and both values. */
bool mirror_differs(mirror_t *mirror, const fluxtrue_t *other, char *where, size_t size);

#endif
