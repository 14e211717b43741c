/* SPDX-License-Identifier: Apache-2.0 */
#include "mirror.h"

#include <stdio.h>
#include <string.h>

#include "layout.h"

#define HOST_PART(part) {#part, offsetof(drive_t, part), 0, sizeof(((drive_t *)0)->part)},
// NOLINTNEXTLINE(bugprone-macro-parentheses): the terms of a sum
#define ONE(part) +1

static const mirror_part_t host_parts[] = {LAYOUT_INPUTS(HOST_PART) LAYOUT_STATE(HOST_PART)};

static const char *layout_read(mirror_t *mirror, const char *path)
{
    uint32_t image_layout[MIRROR_PARTS_MAX][2];
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return "the layout of the target's data cannot be opened";
    }
    const size_t got = fread(image_layout, sizeof image_layout[0], MIRROR_PARTS_MAX, file);
    (void)fclose(file);
    if (got != (size_t)mirror->parts) {
        return "the layout of the target's data does not have the expected number of parts";
    }
    for (int i = 0; i < mirror->parts; i++) {
        mirror->part[i].image_offset = image_layout[i][0];
        if (image_layout[i][1] != mirror->part[i].size) {
            return "the sizes of the drive's data differ between target and host";
        }
        if (i < mirror->inputs && image_layout[i][0] % sizeof(uint32_t) != 0U) {
            return "an input of the drive does not begin at a word of the target's memory";
        }
    }
    return NULL;
}

const char *mirror_open(mirror_t *mirror, emu_t *emu, const char *layout_file)
{
    memset(mirror, 0, sizeof *mirror);
    mirror->emu = emu;
    mirror->inputs = 0 LAYOUT_INPUTS(ONE);
    mirror->parts = (int)(sizeof host_parts / sizeof host_parts[0]);
    memcpy(mirror->part, host_parts, sizeof host_parts);
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

static uint8_t *host_address(const mirror_t *mirror, const fluxtrue_t *host, int i)
{
    return (uint8_t *)(uintptr_t)&host->drive + mirror->part[i].host_offset;
}

static void copy_from_image(mirror_t *mirror, int first, int last)
{
    for (int i = first; i < last; i++) {
        const mirror_part_t *part = &mirror->part[i];
        (void)emu_read(mirror->emu, mirror->base + part->image_offset, host_address(mirror, mirror->host, i),
                       part->size);
    }
}

bool mirror_same_motor(mirror_t *mirror)
{
    uint8_t in_image[256];
    for (int i = 1; i < mirror->inputs; i++) {
        const mirror_part_t *part = &mirror->part[i];
        if (part->size > sizeof in_image ||
            !emu_read(mirror->emu, mirror->base + part->image_offset, in_image, part->size) ||
            memcmp(in_image, host_address(mirror, mirror->host, i), part->size) != 0) {
            return false;
        }
    }
    return true;
}

void mirror_pull(mirror_t *mirror)
{
    if (mirror->pulled_at != emu_now(mirror->emu)) {
        copy_from_image(mirror, mirror->waiting ? mirror->inputs : 0, mirror->parts);
        mirror->pulled_at = emu_now(mirror->emu);
    }
}

int mirror_set(mirror_t *mirror, const char *name, double value)
{
    if (!mirror->waiting) {
        copy_from_image(mirror, 0, mirror->inputs);
        mirror->found = mirror->host->drive;
    }
    const int code = fluxtrue_set(mirror->host, name, value);
    mirror->waiting = mirror->waiting || code == FLUXTRUE_OK;
    return code;
}

/* Size of the unit that is compared and written as a whole. A unit smaller than a member could mix two values of it; a
 * unit with several members would write back an old value of those that the image has changed meanwhile. The image
 * writes to words of the parameters and of their complements, and to members of the request that are alone in a word.
 * With the bus it also writes the limits, which are half words, and enable, a byte that shares even its half word with
 * a flag that is set from here. */
static uint32_t unit_at(uint32_t offset, uint32_t rest)
{
    if (offset >= offsetof(drive_t, request.enable) && offset < offsetof(drive_t, request.faults)) {
        return sizeof(uint8_t);
    }
    const bool half = offset >= offsetof(drive_t, request.limits) && offset < offsetof(drive_t, request.enable);
    return half || rest < sizeof(uint32_t) ? sizeof(uint16_t) : sizeof(uint32_t);
}

_Static_assert(sizeof(bool) == 1 && sizeof(identification_mode_t) == 1, "the flags of the request are bytes");
_Static_assert(offsetof(drive_t, request.enable) % sizeof(uint32_t) == 0U, "the flags begin at a word");
_Static_assert(offsetof(drive_t, request.limits) % sizeof(uint32_t) == 0U, "the limits begin at a word");
#define EVEN(part) \
    _Static_assert(sizeof(((drive_t *)0)->part) % sizeof(uint16_t) == 0U, "no single byte at the end of a part");
LAYOUT_INPUTS(EVEN)

/* Writes what was set. The rest is the image's: what was copied while an activity ran is old by now, and may have been
 * half written. */
static void part_push(mirror_t *mirror, int i)
{
    const mirror_part_t *part = &mirror->part[i];
    const uint8_t *wanted = host_address(mirror, mirror->host, i);
    const uint8_t *found = (const uint8_t *)&mirror->found + part->host_offset;
    uint32_t size;
    for (uint32_t at = 0; at < part->size; at += size) {
        size = unit_at(part->host_offset + at, part->size - at);
        if (memcmp(&wanted[at], &found[at], size) != 0) {
            (void)emu_write(mirror->emu, mirror->base + part->image_offset + at, &wanted[at], size);
        }
    }
}

bool mirror_push(mirror_t *mirror)
{
    if (!mirror->waiting || emu_active_vector(mirror->emu) != 0) {
        return false;
    }
    for (int i = 0; i < mirror->inputs; i++) {
        part_push(mirror, i);
    }
    copy_from_image(mirror, 0, mirror->inputs);
    mirror->waiting = false;
    return true;
}

double mirror_get(mirror_t *mirror, const char *name)
{
    mirror_pull(mirror);
    return fluxtrue_get(mirror->host, name);
}

/* Padding bytes have no defined value and are cleared. This is done part by part, because for the whole drive gcc 12
 * clears wrong bytes. */
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
    const drive_t image = drive_plain(&mirror->host->drive), compared = drive_plain(&other->drive);
    for (int i = mirror->inputs; i < mirror->parts; i++) {
        const mirror_part_t *part = &mirror->part[i];
        const uint8_t *a = (const uint8_t *)&image + part->host_offset,
                      *b = (const uint8_t *)&compared + part->host_offset;
        for (size_t at = 0; at < part->size; at++) {
            if (a[at] != b[at]) {
                (void)snprintf(where, size, "%s + %zu (0x%02x instead of 0x%02x)", part->name, at, a[at], b[at]);
                return true;
            }
        }
    }
    return false;
}
