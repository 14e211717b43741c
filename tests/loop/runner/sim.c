/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <stdlib.h>

#include "sim_names.h"
#include "sim_private.h"

sim_t *sim_create(int controller)
{
    if (controller != SIM_FIRMWARE && controller != SIM_TWIN) {
        return NULL;
    }
    sim_t *sim = calloc(1, sizeof *sim);
    if (sim == NULL) {
        return NULL;
    }
    if (controller == SIM_TWIN) {
        sim->twin = twin_create();
    } else {
        sim->firmware = fluxtrue_create();
    }
    if (sim->twin == NULL && sim->firmware == NULL) {
        free(sim);
        return NULL;
    }
    plant_params_default(&sim->params);
    sim->every = 1;
    return sim;
}

sim_t *sim_create_around(fluxtrue_t *firmware)
{
    sim_t *sim = calloc(1, sizeof *sim);
    if (sim != NULL) {
        sim->firmware = firmware;
        sim->borrowed = 1;
        plant_params_default(&sim->params);
        sim->every = 1;
    }
    return sim;
}

void sim_destroy(sim_t *sim)
{
    if (sim == NULL) {
        return;
    }
    plant_destroy(sim->plant);
    plant_map_destroy(sim->map);
    if (sim->twin != NULL) {
        twin_destroy(sim->twin);
    } else if (!sim->borrowed) {
        fluxtrue_destroy(sim->firmware);
    }
    free(sim);
}

int sim_map(sim_t *sim, const double *id_A, int nd, const double *iq_A, int nq,
            const double *psi_d_Vs, const double *psi_q_Vs)
{
    if (sim->plant != NULL) {
        return SIM_READ_ONLY; /* the plant holds on to its map */
    }
    plant_map_t *map = plant_map_create(id_A, nd, iq_A, nq, psi_d_Vs, psi_q_Vs);
    if (map == NULL) {
        return SIM_OUT_OF_RANGE;
    }
    plant_map_destroy(sim->map);
    sim->map = map;
    return SIM_OK;
}

const char *sim_start(sim_t *sim)
{
    if (sim->plant != NULL) {
        return "plant (it has been started)";
    }
    const char *bad = plant_params_bad_field(&sim->params, sim->map != NULL);
    if (bad != NULL) {
        return bad;
    }
    sim->plant = plant_create(&sim->params, sim->map);
    if (sim->plant == NULL) {
        return "plant (out of memory)";
    }
    int periods = (int)lround(sim->params.pwm_hz * 1e-3);
    sim->periods_per_ms = periods < 1 ? 1 : periods;
    return NULL;
}

int sim_controller_set(sim_t *sim, const char *name, double value)
{
    return sim->twin != NULL ? twin_set(sim->twin, name, value)
                             : fluxtrue_set(sim->firmware, name, value);
}

double sim_controller_get(const sim_t *sim, const char *name)
{
    return sim->twin != NULL ? twin_get(sim->twin, name) : fluxtrue_get(sim->firmware, name);
}

static const plant_params_t *params_of(const sim_t *sim)
{
    return sim->plant != NULL ? plant_params(sim->plant) : &sim->params;
}

static plant_params_t *live_params(sim_t *sim)
{
    return sim->plant != NULL ? plant_params(sim->plant) : &sim->params;
}

int sim_set(sim_t *sim, const char *name, double value)
{
    if (sim_truth_index(name) >= 0) {
        return SIM_READ_ONLY;
    }
    int index = sim_plant_index(name);
    if (index < 0) {
        return sim_controller_set(sim, name, value);
    }
    plant_params_t trial = *params_of(sim);
    if (!isfinite(value)) {
        return SIM_OUT_OF_RANGE;
    }
    sim_plant_write(&trial, index, value);
    /* Before the start the other fields may still be missing: sim_start() looks at all of them. */
    if (sim->plant != NULL && plant_params_bad_field(&trial, sim->map != NULL) != NULL) {
        return SIM_OUT_OF_RANGE;
    }
    sim_plant_write(live_params(sim), index, value);
    return SIM_OK;
}

double sim_get(const sim_t *sim, const char *name)
{
    int index = sim_plant_index(name);
    if (index >= 0) {
        return sim_plant_read(params_of(sim), index);
    }
    index = sim_truth_index(name);
    if (index >= 0) {
        return sim->plant != NULL ? sim_truth_read(plant_truth(sim->plant), index) : (double)NAN;
    }
    return sim_controller_get(sim, name);
}

const char *sim_name(int index)
{
    return sim_names_at(index);
}
