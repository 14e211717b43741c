/* SPDX-License-Identifier: Apache-2.0 */
/* The virtual ECU with the emulated processor: a second implementation of vecu.h, with which the bus, the bench channel
 * and the program of tests/vecu serve the image that would be flashed. The environment names image and layout
 * (FLUXTRUE_IMAGE, FLUXTRUE_LAYOUT). A sent frame takes its time on the bus twice: in the controller's model and on the
 * hub's bus. */
#include "vecu.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "can_port.h"
#include "emulated.h"
#include "machine_data.h"

#define FNV_START 14695981039346656037ULL
#define FNV_PRIME 1099511628211ULL

static can_port_t port;

static void on_sent(void *user, const can_port_frame_t *sent, uint64_t now)
{
    (void)now;
    const vecu_t *vecu = user;
    can_frame_t frame = {.id = sent->id, .extended = sent->extended, .length = sent->length};
    memcpy(frame.data, sent->data, sizeof frame.data);
    (void)hub_send(vecu->hub, &frame, vecu->now_ns);
}

static const char *plant_set_up(sim_t *sim, const machine_data_t *m, uint64_t seed)
{
    for (const machine_value_t *v = m->values; v->name != NULL; v++) {
        if (sim_set(sim, v->name, v->value) != SIM_OK) {
            return v->name;
        }
    }
    if (sim_set(sim, "plant.seed", (double)seed) != SIM_OK) {
        return "plant.seed";
    }
    if (m->nd > 0 && sim_map(sim, m->id_A, m->nd, m->iq_A, m->nq, m->psi_d_Vs, m->psi_q_Vs) != SIM_OK) {
        return "flux map";
    }
    return stand_dc_link(sim) ? sim_start(sim) : "dc link";
}

static const char *processor_start(vecu_t *vecu)
{
    static char reason[512];
    const char *image = getenv("FLUXTRUE_IMAGE"), *layout = getenv("FLUXTRUE_LAYOUT");
    if (image == NULL || layout == NULL) {
        return "FLUXTRUE_IMAGE and FLUXTRUE_LAYOUT must name files (tools/fluxtrue emulate --serve does)";
    }
    vecu->sim = sim_create_emulated(image, layout, EMU_FAST, reason, sizeof reason);
    if (vecu->sim == NULL) {
        return reason;
    }
    port = (can_port_t){on_sent, vecu};
    emu_can_port(sim_emulator(vecu->sim), &port);
    (void)sim_set(vecu->sim, "emulator.board", 1.0);
    return plant_set_up(vecu->sim, (vecu->machine != NULL) ? vecu->machine : &machine_data, vecu->seed);
}

const char *vecu_reset(vecu_t *vecu, uint64_t seed)
{
    sim_destroy(vecu->sim);
    vecu->sim = NULL;
    vecu->seed = seed;
    const char *bad = processor_start(vecu);
    if (bad == NULL) {
        stand_default(&vecu->stand);
        vecu->period_ns = (uint64_t)llround(1e9 / sim_get(vecu->sim, "plant.pwm_hz"));
        vecu->duty_hash = FNV_START;
        vecu->resets++;
    }
    return bad;
}

void vecu_destroy(vecu_t *vecu)
{
    sim_destroy(vecu->sim);
    vecu->sim = NULL;
}

static void stand_step(vecu_t *vecu)
{
    (void)sim_set(vecu->sim, "emulator.gate_fault", vecu->stand.gate_fault != 0.0 ? 1.0 : 0.0);
    (void)sim_set(vecu->sim, "emulator.inverter_C", vecu->stand.inverter_C);
}

static void exchange_in(vecu_t *vecu)
{
    can_frame_t frame;
    hub_run(vecu->hub, vecu->now_ns);
    while (hub_receive(vecu->hub, &frame)) {
        can_port_frame_t in = {.id = frame.id, .extended = frame.extended, .length = frame.length};
        memcpy(in.data, frame.data, sizeof in.data);
        can_frame_arrives(sim_emulator(vecu->sim), &in);
    }
}

static void hash_word(vecu_t *vecu, uint32_t word)
{
    for (int i = 0; i < 4; i++) {
        vecu->duty_hash = (vecu->duty_hash ^ (word >> (8 * i) & 0xFFU)) * FNV_PRIME;
    }
}

static void hash_bridge(vecu_t *vecu)
{
    emu_bridge_t bridge;
    emu_bridge(sim_emulator(vecu->sim), &bridge);
    for (int x = 0; x < 3; x++) {
        hash_word(vecu, (uint32_t)lround(bridge.duty[x] * 65536.0) | (bridge.gates ? 1U << 31 : 0U));
    }
}

bool vecu_step(vecu_t *vecu, double *row)
{
    exchange_in(vecu);
    stand_step(vecu);
    const int written = sim_run(vecu->sim, 1, row, 1);
    if (written == SIM_FAILED) {
        (void)fprintf(stderr, "error: %s\n", sim_failure(vecu->sim));
        exit(EXIT_FAILURE);
    }
    vecu->now_ns += vecu->period_ns;
    hash_bridge(vecu);
    return written > 0;
}

bool vecu_set(vecu_t *vecu, const char *name, double value)
{
    if (strncmp(name, "board.", 6) == 0) {
        return stand_set(&vecu->stand, name, value);
    }
    return strncmp(name, "plant.", 6) == 0 && sim_set(vecu->sim, name, value) == SIM_OK;
}

double vecu_get(const vecu_t *vecu, const char *name)
{
    return strncmp(name, "board.", 6) == 0 ? stand_get(&vecu->stand, name) : sim_get(vecu->sim, name);
}

uint64_t vecu_take_hash(vecu_t *vecu)
{
    const uint64_t hash = vecu->duty_hash;
    vecu->duty_hash = FNV_START;
    return hash;
}
