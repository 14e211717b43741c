/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "sim_names.h"
#include "sim_private.h"

static int channel_resolve(const sim_t *sim, const char *name, channel_t *channel)
{
    memset(channel, 0, sizeof *channel);
    if (strlen(name) >= NAME_MAX_LENGTH) {
        return SIM_UNKNOWN_NAME;
    }
    memcpy(channel->name, name, strlen(name));
    channel->index = sim_truth_index(name);
    channel->source = FROM_TRUTH;
    if (channel->index < 0) {
        channel->index = sim_plant_index(name);
        channel->source = FROM_PLANT;
    }
    if (channel->index < 0) {
        channel->source = FROM_CONTROLLER;
        channel->index = sim->controller.handle != NULL ? sim->controller.handle(name) : -1;
        return isnan(sim->controller.get(sim->controller.self, name)) ? SIM_UNKNOWN_NAME : SIM_OK;
    }
    return SIM_OK;
}

int sim_record(sim_t *sim, const char *const *names, int count, int every)
{
    if (count < 0 || count > CHANNELS_MAX || every < 1) {
        return SIM_OUT_OF_RANGE;
    }
    channel_t channel[CHANNELS_MAX];
    for (int i = 0; i < count; i++) {
        int code = channel_resolve(sim, names[i], &channel[i]);
        if (code != SIM_OK) {
            return code;
        }
    }
    if (count > 0) {
        memcpy(sim->channel, channel, (size_t)count * sizeof channel[0]);
    }
    sim->channels = count;
    sim->every = every;
    sim->in_row = 0;
    return SIM_OK;
}

int sim_ramp(sim_t *sim, const char *name, double from, double to)
{
    int index = sim_plant_index(name);
    if (sim->plant == NULL) {
        return SIM_NOT_STARTED;
    }
    if (sim->ramps == RAMPS_MAX || strlen(name) >= NAME_MAX_LENGTH) {
        return SIM_FULL;
    }
    /* Both ends are checked now, the last one first: every value between two allowed values is allowed. */
    int code = sim_set(sim, name, to);
    if (code == SIM_OK) {
        code = sim_set(sim, name, from);
    }
    if (code != SIM_OK) {
        return code;
    }
    ramp_t *ramp = &sim->ramp[sim->ramps++];
    memset(ramp, 0, sizeof *ramp);
    memcpy(ramp->name, name, strlen(name));
    ramp->plant_index = index;
    ramp->from = from;
    ramp->to = to;
    return SIM_OK;
}

static void ramps_apply(sim_t *sim, int period, int periods)
{
    double share = periods > 1 ? (double)period / (double)periods : 0.0;
    for (int i = 0; i < sim->ramps; i++) {
        const ramp_t *ramp = &sim->ramp[i];
        double value = ramp->from + share * (ramp->to - ramp->from);
        if (ramp->plant_index >= 0) {
            sim_plant_write(plant_params(sim->plant), ramp->plant_index, value);
        } else if (period % sim->periods_per_ms == 0) {
            /* both ends were accepted */
            (void)sim->controller.set(sim->controller.self, ramp->name, value);
        }
    }
}

static void period_run(sim_t *sim)
{
    plant_sensors_t sensors;
    plant_sample(sim->plant, &sensors);
    const double in[6] = {sensors.ia_A,  sensors.ib_A,        sensors.ic_A,
                          sensors.vdc_V, sensors.theta_m_rad, sensors.t_winding_C};
    if (sim->controller.gate_fault != NULL) {
        sim->controller.gate_fault(sim->controller.self, sensors.gate_fault != 0);
        sim->gates_on = sim->gates_on && !sensors.gate_fault; /* the timer disables switching without the processor */
    }
    if (sim->controller.known_voltage != NULL) {
        sim->controller.known_voltage(sim->controller.self, sensors.known_share);
    }
    double out[4] = {0.5, 0.5, 0.5, 0.0};
    sim->controller.step(sim->controller.self, in, out);
    if (sim->controller.outputs_lost != NULL && sim->controller.outputs_lost(sim->controller.self)) {
        sim->gates_on = 0; /* for the whole period: the plant takes one state of the bridge in each */
    }
    plant_switches_t on;
    if (sim->controller.switches != NULL && sim->controller.switches(sim->controller.self, &on)) {
        plant_switch(sim->plant, &on);
    }
    plant_advance(sim->plant, sim->duty, sim->gates_on);
    memcpy(sim->duty, out, sizeof sim->duty);
    sim->gates_on = out[3] > 0.5;
}

static bool row_collect(sim_t *sim)
{
    const plant_truth_t *truth = plant_truth(sim->plant);
    for (int i = 0; i < sim->channels; i++) {
        channel_t *channel = &sim->channel[i];
        if (channel->source == FROM_TRUTH && sim_truth_averages(channel->index)) {
            channel->sum = (sim->in_row == 0 ? 0.0 : channel->sum) + sim_truth_read(truth, channel->index);
        }
    }
    sim->in_row++;
    return sim->in_row == sim->every;
}

static double controller_read(const sim_controller_t *controller, const channel_t *channel)
{
    return controller->get_by != NULL ? controller->get_by(controller->self, channel->index)
                                      : controller->get(controller->self, channel->name);
}

static void row_write(sim_t *sim, double *row)
{
    for (int i = 0; i < sim->channels; i++) {
        const channel_t *channel = &sim->channel[i];
        if (channel->source == FROM_CONTROLLER) {
            row[i] = controller_read(&sim->controller, channel);
        } else if (channel->source == FROM_PLANT) {
            row[i] = sim_plant_read(plant_params(sim->plant), channel->index);
        } else if (sim_truth_averages(channel->index)) {
            row[i] = channel->sum / sim->every;
        } else {
            row[i] = sim_truth_read(plant_truth(sim->plant), channel->index);
        }
    }
    sim->in_row = 0;
}

static void ramps_finish(sim_t *sim)
{
    for (int i = 0; i < sim->ramps; i++) {
        (void)sim_set(sim, sim->ramp[i].name, sim->ramp[i].to);
    }
    sim->ramps = 0;
}

int sim_run(sim_t *sim, int periods, double *rows, int capacity_rows)
{
    if (sim->plant == NULL) {
        return SIM_NOT_STARTED;
    }
    if (periods < 0) {
        return SIM_OUT_OF_RANGE;
    }
    if (sim->channels > 0 && (sim->in_row + periods) / sim->every > capacity_rows) {
        return SIM_FULL;
    }
    int written = 0;
    for (int period = 0; period < periods; period++) {
        ramps_apply(sim, period, periods);
        period_run(sim);
        if (sim_failure(sim) != NULL) {
            sim->ramps = 0;
            return SIM_FAILED;
        }
        if (sim->channels > 0 && row_collect(sim)) {
            row_write(sim, rows + (size_t)written * (size_t)sim->channels);
            written++;
        }
    }
    ramps_finish(sim);
    return written;
}
