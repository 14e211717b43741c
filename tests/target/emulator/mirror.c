/* SPDX-License-Identifier: Apache-2.0 */
#include "mirror.h"

#include <stdio.h>
#include <string.h>

#include "layout.h"

#define HERE(part) {#part, offsetof(drive_t, part), 0, sizeof(((drive_t *)0)->part)},
// NOLINTNEXTLINE(bugprone-macro-parentheses): the terms of a sum
#define ONE(part) +1

static const mirror_part_t parts_here[] = {LAYOUT_INPUTS(HERE) LAYOUT_STATE(HERE)};

static const char *layout_read(mirror_t *mirror, const char *path)
{
    uint32_t there[MIRROR_PARTS_MAX][2];
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return "the layout of the target's data cannot be opened";
    }
    const size_t got = fread(there, sizeof there[0], MIRROR_PARTS_MAX, file);
    (void)fclose(file);
    if (got != (size_t)mirror->parts) {
        return "the layout of the target's data has another number of parts";
    }
    for (int i = 0; i < mirror->parts; i++) {
        mirror->part[i].there = there[i][0];
        if (there[i][1] != mirror->part[i].size) {
            return "target and host disagree about the size of the drive's data";
        }
    }
    return NULL;
}

const char *mirror_open(mirror_t *mirror, emu_t *emu, const char *layout_file)
{
    memset(mirror, 0, sizeof *mirror);
    mirror->emu = emu;
    mirror->inputs = 0 LAYOUT_INPUTS(ONE);
    mirror->parts = (int)(sizeof parts_here / sizeof parts_here[0]);
    memcpy(mirror->part, parts_here, sizeof parts_here);
    mirror->base = emu_symbol(emu, LAYOUT_SYMBOL);
    mirror->pulled_at = UINT64_MAX;
    mirror->host = fluxtrue_create();
    if (mirror->base == 0) {
        return "the image has no symbol " LAYOUT_SYMBOL;
    }
    return mirror->host == NULL ? "out of memory" : layout_read(mirror, layout_file);
}

void mirror_close(mirror_t *mirror)
{
    fluxtrue_destroy(mirror->host);
}

static uint8_t *here(const mirror_t *mirror, const fluxtrue_t *host, int i)
{
    return (uint8_t *)(uintptr_t)&host->drive + mirror->part[i].here;
}

static void copy_from_image(mirror_t *mirror, int first, int last)
{
    for (int i = first; i < last; i++) {
        const mirror_part_t *part = &mirror->part[i];
        (void)emu_read(mirror->emu, mirror->base + part->there, here(mirror, mirror->host, i), part->size);
    }
}

bool mirror_same_motor(mirror_t *mirror)
{
    uint8_t there[256];
    for (int i = 1; i < mirror->inputs; i++) {
        const mirror_part_t *part = &mirror->part[i];
        if (part->size > sizeof there || !emu_read(mirror->emu, mirror->base + part->there, there, part->size) ||
            memcmp(there, here(mirror, mirror->host, i), part->size) != 0) {
            return false;
        }
    }
    return true;
}

void mirror_pull(mirror_t *mirror)
{
    if (mirror->pulled_at != emu_now(mirror->emu)) {
        if (!mirror->waiting) {
            copy_from_image(mirror, 0, LAYOUT_TRIMMED);
        }
        copy_from_image(mirror, mirror->inputs, mirror->parts);
        mirror->pulled_at = emu_now(mirror->emu);
    }
}

int mirror_set(mirror_t *mirror, const char *name, double value)
{
    if (!mirror->waiting) {
        copy_from_image(mirror, 0, LAYOUT_TRIMMED); /* the rest of the calibration is changed by this side only */
    }
    const int code = fluxtrue_set(mirror->host, name, value);
    mirror->waiting = mirror->waiting || code == FLUXTRUE_OK;
    return code;
}

bool mirror_push(mirror_t *mirror)
{
    if (!mirror->waiting || emu_active_vector(mirror->emu) != 0) {
        return false;
    }
    for (int i = 0; i < mirror->inputs; i++) {
        const mirror_part_t *part = &mirror->part[i];
        (void)emu_write(mirror->emu, mirror->base + part->there, here(mirror, mirror->host, i), part->size);
    }
    mirror->waiting = false;
    return true;
}

double mirror_get(mirror_t *mirror, const char *name)
{
    mirror_pull(mirror);
    return fluxtrue_get(mirror->host, name);
}

/* Bytes between the fields have no value. Part by part: for the drive as a whole gcc 12 clears wrong bytes. */
#define CLEAR(part) __builtin_clear_padding(&copy.part);
drive_t drive_plain(const drive_t *drive)
{
    drive_t copy;
    memcpy(&copy, drive, sizeof copy);
#ifdef __has_builtin
#if __has_builtin(__builtin_clear_padding)
    LAYOUT_STATE(CLEAR)
#endif
#endif
    return copy;
}

bool mirror_differs(mirror_t *mirror, const fluxtrue_t *other, char *where, size_t size)
{
    mirror_pull(mirror);
    const drive_t there = drive_plain(&mirror->host->drive), here_ = drive_plain(&other->drive);
    for (int i = mirror->inputs; i < mirror->parts; i++) {
        const mirror_part_t *part = &mirror->part[i];
        const uint8_t *a = (const uint8_t *)&there + part->here, *b = (const uint8_t *)&here_ + part->here;
        for (size_t at = 0; at < part->size; at++) {
            if (a[at] != b[at]) {
                (void)snprintf(where, size, "%s + %zu (0x%02x instead of 0x%02x)", part->name, at, a[at], b[at]);
                return true;
            }
        }
    }
    return false;
}
