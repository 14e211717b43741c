/* SPDX-License-Identifier: Apache-2.0 */
#include "control/identify/iron.h"
#include "drive/drive.h"
#include "drive/mrai/mrai_seam.h"
#include "drive/recall.h"

static bool is_at_limit(const identify_state_t *state, identify_index_t index)
{
    return fx_abs_q31(state->kalman.x_q27[index]) >= 4 * IDENTIFY_ONE_Q27;
}

/* 1 - variance/prior variance. */
static q15_t variance_reduction(const identify_state_t *state, identify_index_t index)
{
    return (q15_t)fx_max_s32(Q15_MAX - (state->kalman.p_q30[kalman_p_index(index, index)] >> 15), 0);
}

/* Q31: 0 up to w_min, 1 from 2 w_min on. A reference that changes while the rotor begins to turn would hide a wrong
 * angle from safety/launch_power.h, which compares the power at one reference. */
static q31_t share_of_speed(const identify_config_t *config, q31_t omega)
{
    const int32_t above = fx_abs_q15(fx_q15_from_q31(omega)) - config->omega_min;
    const int32_t share = fx_clamp_q31(above, 0, config->omega_min) * 32768 / config->omega_min;
    return fx_min_s32(share, Q15_MAX) * 65536;
}

/* a of (CR-18) at the tracked speed: that of a window may be wrong when the window is not valid. The identified scale
 * of the loss counts as far as the estimate is trusted. */
static q31_t iron_admittance(const drive_t *drive, q31_t omega, q15_t confidence)
{
    const identify_config_t *config = &drive->motor->identify;
    const q31_t nominal = fx_mul_q31(identify_iron_admittance(config, omega), share_of_speed(config, omega));
    const q31_t scale = identify_value(config, &drive->task.identify, IDENTIFY_IRON);
    return fx_add_q31(nominal, fx_mul_q31(nominal, fx_mul_q31(scale, fx_q31_from_q15(confidence))));
}

/* The values that act on the torque are zero until recalled values have been confirmed (drive/recall.h), or nominal. */
static identification_t robust_identification(const drive_t *drive, const identify_out_t *out, q31_t omega)
{
    const identify_config_t *config = &drive->motor->identify;
    const identify_state_t *state = &drive->task.identify;
    const bool acts = !drive->task.recall.unconfirmed;
    const q15_t confidence = acts ? state->kept.confidence : (q15_t)0;
    return (identification_t){
        .psi_delta = identify_value(config, state, IDENTIFY_FLUX),
        .r_delta = fx_add_q31(state->kept.r_prior - config->r0, identify_value(config, state, IDENTIFY_R)),
        .lq_error = acts ? identify_value(config, state, IDENTIFY_LQ) : 0,
        .iron_admittance = iron_admittance(drive, omega, confidence),
        .torque_variance_q30 = state->torque_variance_q30,
        .psi_d_error = acts ? (q15_t)out->psi_d_error : (q15_t)0,
        .torque_estimated = (q15_t)out->torque,
        .confidence = confidence,
        .psi_quality = variance_reduction(state, IDENTIFY_FLUX),
        .r_quality = variance_reduction(state, IDENTIFY_R),
        .psi_clamped = is_at_limit(state, IDENTIFY_FLUX),
        .r_clamped = is_at_limit(state, IDENTIFY_R),
    };
}

/* One step from the window of the fast ISR and the tables at its magnetising current. */
static void robust_step(drive_t *drive, const snapshot_t *snapshot)
{
    const motor_t *m = drive->motor;
    task_state_t *task = &drive->task;
    const identify_point_t point = identify_point(&m->identify, &snapshot->window, snapshot->sample.point.omega);
    const identify_tables_t tables = {flux_table_step(&m->flux_table, point.i_m),
                                      flux_table_inductances(&m->flux_table, point.i_m)};
    const identify_in_t in = {
        .point = &point,
        .tables = &tables,
        .winding_dC = snapshot->winding_dC,
        .enabled = drive->request.identification && snapshot->sample.acting,
    };
    recall_step(drive, point.omega);
    const identify_out_t out = identify_step(&m->identify, &task->identify, &in);
    drive_trim(drive, (q15_t)snapshot->sample.v_dc);
    task->identifications = task->identifications + 1U;
    task->identification = robust_identification(drive, &out, snapshot->sample.point.omega);
    task->psi_d_error = task->identification.psi_d_error;
}

void drive_identify(drive_t *drive, const snapshot_t *snapshot)
{
    if (snapshot->mrai_is_chosen) {
        mrai_identify(drive, snapshot);
    } else {
        robust_step(drive, snapshot);
    }
}

identify_record_t drive_identified_record(const drive_t *drive)
{
    identify_record_t record;
    uint32_t seen;
    do {
        seen = drive->task.identifications;
        exchange_barrier();
        identify_record_get(&drive->task.identify, &record);
        exchange_barrier();
    } while (drive->task.identifications != seen);
    return record;
}

bool drive_recall(drive_t *drive, const identify_record_t *record)
{
    const bool restored = identify_record_restore(&drive->task.identify, record);
    if (restored) {
        recall_begin(drive);
    }
    return restored;
}

void drive_reset_identification(drive_t *drive)
{
    identify_reset(&drive->motor->identify, &drive->task.identify);
    drive->task.recall.unconfirmed = false;
}
