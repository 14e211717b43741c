/* SPDX-License-Identifier: Apache-2.0 */
#include "stand.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

typedef struct {
    const char *name;
    size_t offset;
    double lo, hi;
} stand_field_t;

static const stand_field_t fields[] = {
    {"board.battery_V", offsetof(stand_t, dc.battery_V), 0.0, 2000.0},
    {"board.capacitance_F", offsetof(stand_t, dc.capacitance_F), 1e-6, 1.0},
    {"board.precharge_s", offsetof(stand_t, dc.precharge_s), 1e-3, 1e3},
    {"board.discharge_s", offsetof(stand_t, dc.discharge_s), 1e-3, 1e3},
    {"board.precharge_open", offsetof(stand_t, dc.precharge_open), 0.0, 1.0},
    {"board.discharge_open", offsetof(stand_t, dc.discharge_open), 0.0, 1.0},
    {"board.contactor_open", offsetof(stand_t, dc.contactor_open), 0.0, 1.0},
    {"board.inverter_C", offsetof(stand_t, inverter_C), -100.0, 300.0},
    {"board.gate_fault", offsetof(stand_t, gate_fault), 0.0, 1.0},
};
enum { FIELDS = (int)(sizeof fields / sizeof fields[0]) };

void stand_default(stand_t *stand, double battery_V)
{
    *stand = (stand_t){.inverter_C = 40.0};
    dc_link_params_default(&stand->dc, battery_V);
}

static const stand_field_t *find(const char *name)
{
    for (int i = 0; i < FIELDS; i++) {
        if (strcmp(fields[i].name, name) == 0) {
            return &fields[i];
        }
    }
    return NULL;
}

bool stand_set(stand_t *stand, const char *name, double value)
{
    const stand_field_t *f = find(name);
    if (f == NULL || !(value >= f->lo && value <= f->hi)) {
        return false;
    }
    memcpy((char *)stand + f->offset, &value, sizeof value);
    return true;
}

double stand_get(const stand_t *stand, const char *name)
{
    const stand_field_t *f = find(name);
    double value = (double)NAN;
    if (f != NULL) {
        memcpy(&value, (const char *)stand + f->offset, sizeof value);
    }
    return value;
}

const char *stand_name(int index)
{
    return index >= 0 && index < FIELDS ? fields[index].name : NULL;
}
