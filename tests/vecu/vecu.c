/* SPDX-License-Identifier: Apache-2.0 */
#include "vecu.h"

#include <math.h>
#include <string.h>

#include "hal/host/instance.h"
#include "machine_data.h"

#define FNV_START 14695981039346656037ULL
#define FNV_PRIME 1099511628211ULL

/* Not on the heap: with a program at a fixed address a calibration tool finds it where the ELF file says. */
static fluxtrue_t the_ecu;

static const char *plant_set_up(sim_t *sim, uint64_t seed)
{
    const machine_data_t *m = &machine_data;
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
    return sim_start(sim);
}

const char *vecu_reset(vecu_t *vecu, uint64_t seed)
{
    sim_destroy(vecu->sim);
    fluxtrue_init(&the_ecu);
    vecu->sim = sim_create_around(&the_ecu);
    if (vecu->sim == NULL) {
        return "out of memory";
    }
    const char *bad = plant_set_up(vecu->sim, seed);
    if (bad == NULL) {
        vecu->period_ns = (uint64_t)llround(1e9 / sim_get(vecu->sim, "plant.pwm_hz"));
        vecu->seed = seed;
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

static void hash_word(vecu_t *vecu, uint32_t word)
{
    for (int i = 0; i < 4; i++) {
        vecu->duty_hash = (vecu->duty_hash ^ (word >> (8 * i) & 0xFFU)) * FNV_PRIME;
    }
}

bool vecu_step(vecu_t *vecu, double *row)
{
    hub_run(vecu->hub, vecu->now_ns);
    const bool written = sim_run(vecu->sim, 1, row, 1) > 0;
    vecu->now_ns += vecu->period_ns;
    hash_word(vecu, the_ecu.duty.a | (uint32_t)the_ecu.duty.b << 16);
    hash_word(vecu, the_ecu.duty.c | (the_ecu.gates ? 1U << 16 : 0U));
    return written;
}

uint64_t vecu_take_hash(vecu_t *vecu)
{
    const uint64_t hash = vecu->duty_hash;
    vecu->duty_hash = FNV_START;
    return hash;
}
