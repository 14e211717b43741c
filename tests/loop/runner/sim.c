/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <stdlib.h>

#include "sim_names.h"
#include "sim_private.h"

sim_t *sim_create_with(sim_controller_t controller)
{
    sim_t *sim = controller.self != NULL ? calloc(1, sizeof *sim) : NULL;
    if (sim == NULL) {
        if (controller.self != NULL) {
            controller.destroy(controller.self);
        }
        return NULL;
    }
    sim->controller = controller;
    plant_params_default(&sim->params);
    sim->every = 1;
    return sim;
}

void sim_destroy(sim_t *sim)
{
    if (sim == NULL) {
        return;
    }
    plant_destroy(sim->plant);
    plant_map_destroy(sim->map);
    sim->controller.destroy(sim->controller.self);
    free(sim);
}

const char *sim_failure(const sim_t *sim)
{
    if (sim->plant != NULL && plant_truth(sim->plant)->inversion_failures > 0) {
        return "the simulation left the range of numbers (no current for the plant's flux linkage): "
               "a value of the plant or its load is impossible";
    }
    return sim->controller.failure != NULL ? sim->controller.failure(sim->controller.self) : NULL;
}

int sim_map(sim_t *sim, const double *id_A, int nd, const double *iq_A, int nq, const double *psi_d_Vs,
            const double *psi_q_Vs)
{
    if (sim->plant != NULL) {
        return SIM_READ_ONLY; /* the plant uses its map */
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
        return sim->controller.set(sim->controller.self, name, value);
    }
    plant_params_t trial = *params_of(sim);
    if (!isfinite(value)) {
        return SIM_OUT_OF_RANGE;
    }
    sim_plant_write(&trial, index, value);
    /* Before the start the other fields may still be missing: sim_start() checks all of them. */
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
    return sim->controller.get(sim->controller.self, name);
}

const char *sim_name(int index)
{
    return sim_names_at(index);
}
