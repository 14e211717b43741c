/* SPDX-License-Identifier: Apache-2.0 */
#ifndef LOOP_RUNNER_SIM_PRIVATE_H
#define LOOP_RUNNER_SIM_PRIVATE_H
/** Shared by the files of the runner. Context: host. */
#include "plant/plant.h"
#include "sim.h"
#include "sim_controller.h"

enum { CHANNELS_MAX = 64, RAMPS_MAX = 8, NAME_MAX_LENGTH = 48 };

typedef enum { FROM_TRUTH, FROM_PLANT, FROM_CONTROLLER } source_t;

typedef struct {
    source_t source;
    int index; /* of a controller's channel: its handle, if the controller has handles */
    double sum;
    char name[NAME_MAX_LENGTH];
} channel_t;

typedef struct {
    int plant_index; /* -1: the controller's */
    double from, to;
    char name[NAME_MAX_LENGTH];
} ramp_t;

struct sim {
    sim_controller_t controller;
    plant_params_t params;
    plant_map_t *map;
    plant_t *plant;
    double duty[3];
    int gates_on;
    int periods_per_ms;
    channel_t channel[CHANNELS_MAX];
    int channels, every, in_row;
    ramp_t ramp[RAMPS_MAX];
    int ramps;
};

#endif
