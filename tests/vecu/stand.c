/* SPDX-License-Identifier: Apache-2.0 */
#include "stand.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

/* Assumed: 500 uF, and semiconductors that begin to conduct (avalanche) at twice the battery's voltage. */
#define CAPACITANCE_F 500e-6
#define AVALANCHE_PER_BATTERY 2.0

typedef struct {
    const char *name;
    size_t offset;
    double lo, hi;
} stand_field_t;

static const stand_field_t fields[] = {
    {"board.inverter_C", offsetof(stand_t, inverter_C), -100.0, 300.0},
    {"board.gate_fault", offsetof(stand_t, gate_fault), 0.0, 1.0},
    {"board.angle_unknown", offsetof(stand_t, angle_unknown), 0.0, 1.0},
    {"board.gates_stuck", offsetof(stand_t, gates_stuck), 0.0, 1.0},
    {"board.supply_stuck", offsetof(stand_t, supply_stuck), 0.0, 1.0},
    {"board.watchdog_stuck", offsetof(stand_t, watchdog_stuck), 0.0, 1.0},
    {"board.task_stuck", offsetof(stand_t, task_stuck), 0.0, 1.0},
};
enum { FIELDS = (int)(sizeof fields / sizeof fields[0]) };

void stand_default(stand_t *stand)
{
    *stand = (stand_t){.inverter_C = 40.0};
}

bool stand_dc_link(sim_t *sim)
{
    const double avalanche_V = AVALANCHE_PER_BATTERY * sim_get(sim, "plant.vdc_V");
    return sim_set(sim, "plant.dc_link_F", CAPACITANCE_F) == SIM_OK &&
           sim_set(sim, "plant.vdc_start_V", 0.0) == SIM_OK && sim_set(sim, "plant.avalanche_V", avalanche_V) == SIM_OK;
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
