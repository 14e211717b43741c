/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "calibration/calibration_list.h"
#include "hal/host/commissioned.h"
#include "hal/host/name_list.h"
#include "hal/host/parameters.h"

typedef struct {
    const char *name, *unit;
    int kind;
    const char *text;
} description_t;

#define LINE(name, unit, kind, text) {#name, unit, FLUXTRUE_##kind, text},
#define POINT_LINES(k) NAME_LIST_POINT(LINE, k)
#define CALIBRATION_LINE(name, lo, hi, unit, text) {#name, unit, FLUXTRUE_NUMBER, text "."},

static const description_t descriptions[] = {NAME_LIST(LINE) COMMISSIONED_POINTS(POINT_LINES)
                                                 CALIBRATION_LIST(CALIBRATION_LINE)};

static const description_t *find(const char *name)
{
    for (size_t k = 0; name && k < sizeof descriptions / sizeof descriptions[0]; k++) {
        if (strcmp(descriptions[k].name, name) == 0) {
            return &descriptions[k];
        }
    }
    return NULL;
}

/* Range and value of a new drive; without memory for one they stay NaN. */
static void add_values(fluxtrue_info_t *info, int handle)
{
    fluxtrue_t *fresh = fluxtrue_create();
    if (!fresh) {
        return;
    }
    info->initial = fluxtrue_get_by(fresh, handle);
    if (info->writable != 0) {
        const parameters_range_t range = parameters_range(fresh, handle);
        info->lo = range.lo;
        info->hi = range.hi;
        info->least = range.least;
    }
    fluxtrue_destroy(fresh);
}

int fluxtrue_info(int handle, fluxtrue_info_t *info, int size)
{
    const char *name = fluxtrue_name(handle);
    const description_t *found = find(name);
    if (!found) {
        return FLUXTRUE_UNKNOWN_NAME;
    }
    if (size <= 0) {
        return FLUXTRUE_OUT_OF_RANGE;
    }
    fluxtrue_info_t whole = {.name = name,
                             .unit = found->unit,
                             .help = found->text,
                             .lo = (double)NAN,
                             .hi = (double)NAN,
                             .initial = (double)NAN,
                             .kind = found->kind,
                             .writable = parameters_writable(handle) ? 1 : 0};
    add_values(&whole, handle);
    memcpy(info, &whole, ((size_t)size < sizeof whole) ? (size_t)size : sizeof whole);
    return FLUXTRUE_OK;
}
