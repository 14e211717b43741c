/* SPDX-License-Identifier: Apache-2.0 */
#ifndef LOOP_RUNNER_SIM_NAMES_H
#define LOOP_RUNNER_SIM_NAMES_H
/** The plant's parameters and truth by name. Context: host. */
#include <stdbool.h>

#include "plant/plant.h"

/** Index of "plant.<field>" or "truth.<field>"; -1: no such name. */
int sim_plant_index(const char *name);
int sim_truth_index(const char *name);
/** Both lists one after the other; NULL outside. */
const char *sim_names_at(int index);

void sim_plant_write(plant_params_t *params, int index, double value);
double sim_plant_read(const plant_params_t *params, int index);
double sim_truth_read(const plant_truth_t *truth, int index);
/** False for values whose mean over periods has no meaning: time, angles, integrals. */
bool sim_truth_averages(int index);

#endif
