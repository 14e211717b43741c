/* SPDX-License-Identifier: Apache-2.0 */
#include "vecu.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "hal/host/can_host.h"
#include "hal/host/instance.h"
#include "machine_data.h"
#include "nvm_file.h"

#define FNV_START 14695981039346656037ULL
#define FNV_PRIME 1099511628211ULL

/* Not on the heap: a calibration tool finds it by its name, at the address in the ELF file. */
static fluxtrue_t ecu;

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

/* Only a warning: the ECU runs and reports its fault on the bus, as hardware would. */
static void tell_refused_data(void)
{
    const motor_check_t check = drive_motor_check(&ecu.drive);
    char word[64];
    if (check != MOTOR_CHECK_OK && fluxtrue_word("motor_check", (int)check, word, sizeof word) == FLUXTRUE_OK) {
        (void)fprintf(stderr, "motor data refused: %s: %s\n", word, fluxtrue_explanation("motor_check", (int)check));
    }
}

const char *vecu_reset(vecu_t *vecu, uint64_t seed)
{
    sim_destroy(vecu->sim);
    if (vecu->hub != NULL) {
        hub_detach_ecu(vecu->hub);
    }
    fluxtrue_init(&ecu);
    if (vecu->nvm_path != NULL && !nvm_file_load(vecu->nvm_path, &ecu.nvm)) {
        return vecu->nvm_path;
    }
    vecu->nvm_changes = ecu.nvm.changes;
    can_host_attach(&ecu);
    tell_refused_data();
    vecu->sim = sim_create_around(&ecu);
    if (vecu->sim == NULL) {
        return "out of memory";
    }
    const char *bad = plant_set_up(vecu->sim, (vecu->machine != NULL) ? vecu->machine : &machine_data, seed);
    if (bad == NULL) {
        stand_default(&vecu->stand);
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

/* Sets the inputs of the board that the next task reads. */
static void stand_step(vecu_t *vecu)
{
    ecu.board.gate_fault = vecu->stand.gate_fault != 0.0;
    ecu.board.inverter_C = vecu->stand.inverter_C;
    ecu.board.angle_unknown = vecu->stand.angle_unknown != 0.0;
    ecu.board.gates_stuck = vecu->stand.gates_stuck != 0.0;
    ecu.board.task_stuck = vecu->stand.task_stuck != 0.0;
    ecu.board.external_watchdog.supply_does_not_stop = vecu->stand.supply_stuck != 0.0;
    ecu.board.external_watchdog.does_not_switch_off = vecu->stand.watchdog_stuck != 0.0;
}

static void exchange_in(vecu_t *vecu)
{
    can_frame_t frame;
    hub_run(vecu->hub, vecu->now_ns);
    while (hub_receive(vecu->hub, &frame)) {
        (void)can_host_put(&ecu, &frame);
    }
}

static void exchange_out(vecu_t *vecu)
{
    can_frame_t frame;
    while (hub_can_queue(vecu->hub) && can_host_take(&ecu, &frame)) {
        (void)hub_send(vecu->hub, &frame, vecu->now_ns);
    }
}

bool vecu_step(vecu_t *vecu, double *row)
{
    exchange_in(vecu);
    stand_step(vecu);
    const bool written = sim_run(vecu->sim, 1, row, 1) > 0;
    vecu->now_ns += vecu->period_ns;
    if (vecu->nvm_path != NULL && ecu.nvm.changes != vecu->nvm_changes && nvm_file_save(vecu->nvm_path, &ecu.nvm)) {
        vecu->nvm_changes = ecu.nvm.changes;
    }
    hash_word(vecu, ecu.duty.a | (uint32_t)ecu.duty.b << 16);
    hash_word(vecu, ecu.duty.c | (ecu.gates ? 1U << 16 : 0U));
    exchange_out(vecu);
    return written;
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
