/* SPDX-License-Identifier: Apache-2.0 */
#include "app/drive.h"
#include "hal/temperature.h"

static bool at_limit(const identify_state_t *state, identify_index_t index)
{
    return fx_abs_q31(state->filter.x[index]) >= 4 * IDENTIFY_ONE_Q27;
}

/* Share of the prior's variance that is gone. */
static q15_t known(const identify_state_t *state, identify_index_t index)
{
    return (q15_t)fx_max_s32(Q15_MAX - (state->filter.p[identify_pair(index, index)] >> 15), 0);
}

static void report_robust(drive_t *drive)
{
    const identify_config_t *config = &drive->motor.identify;
    task_state_t *task = &drive->task;
    const identify_state_t *state = &task->identify;
    task->torque_estimate = task->identified.torque;
    task->learnt = (learnt_t){
        .psi_delta = identify_value(config, state, IDENTIFY_FLUX),
        .r_delta = fx_add_q31(state->r_prior - config->r0, identify_value(config, state, IDENTIFY_R)),
        .psi_clamped = at_limit(state, IDENTIFY_FLUX),
        .r_clamped = at_limit(state, IDENTIFY_R),
    };
    task->quality.psi_quality = known(state, IDENTIFY_FLUX);
    task->quality.r_quality = known(state, IDENTIFY_R);
}

/* Ten periods summed by the fast ISR, the tables at their magnetising current, and what follows from both. */
static void robust(drive_t *drive, const view_t *view)
{
    const motor_t *m = &drive->motor;
    task_state_t *task = &drive->task;
    const identify_point_t point = identify_point(&m->identify, &view->window, view->sample.mrai.omega);
    const identify_tables_t tables = {flux_table_step(&m->flux_table, point.i_m),
                                      flux_table_inductances(&m->flux_table, point.i_m)};
    const identify_in_t in = {
        .point = &point,
        .tables = &tables,
        .temperature_known = view->winding_dC != HAL_TEMPERATURE_UNKNOWN,
        .winding_dC = view->winding_dC,
        .enabled = drive->request.identification && view->sample.acting,
    };
    task->identified = identify_step(&m->identify, &task->identify, &in);
    drive_trim(drive, (q15_t)view->sample.v_dc);
    task->identifications = task->identifications + 1U;
    report_robust(drive);
}

static void report_paper(drive_t *drive, const view_t *view)
{
    const mrai_state_t *mrai = &view->mrai;
    drive->task.torque_estimate = torque_estimate_mean(&drive->task.torque_mean, &view->torque);
    drive->task.learnt = (learnt_t){mrai->psi_delta, mrai->r_delta, mrai_flux_clamped(&drive->motor.mrai, mrai),
                                    mrai_resistance_clamped(&drive->motor.mrai, mrai)};
}

void drive_identify(drive_t *drive, const view_t *view)
{
    if (drive->request.identification_mode == IDENTIFICATION_ROBUST) {
        robust(drive, view);
    } else {
        report_paper(drive, view);
    }
}

identify_memory_t drive_learnt(const drive_t *drive)
{
    identify_memory_t memory;
    uint32_t seen;
    do {
        seen = drive->task.identifications;
        exchange_barrier();
        memory = identify_memory_get(&drive->task.identify);
        exchange_barrier();
    } while (drive->task.identifications != seen);
    return memory;
}

bool drive_recall(drive_t *drive, const identify_memory_t *memory)
{
    return identify_memory_restore(&drive->task.identify, memory);
}
