/* SPDX-License-Identifier: Apache-2.0 */
/* Compiled for the target: offset and size of every part, read by mirror.c from section .layout. */
#include "layout.h"

#include <stddef.h>
#include <stdint.h>

#include "drive/drive.h"

#define PLACE(part) {offsetof(drive_t, part), sizeof(((drive_t *)0)->part)},

extern const uint32_t layout[][2];
__attribute__((section(".layout"), used)) const uint32_t layout[][2] = {LAYOUT_INPUTS(PLACE) LAYOUT_STATE(PLACE)};
