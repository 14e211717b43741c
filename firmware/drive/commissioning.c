/* SPDX-License-Identifier: Apache-2.0 */
#include "control/current/transform.h"
#include "drive/data_check.h"
#include "drive/drive.h"
#include "fx/div.h"

#define DEAD_TIME_MAX Q15(0.125) /* a larger share of the dc voltage is not a plausible voltage error */
#define KNEE_CHANGED Q31(0.8)    /* a measured knee counts if it is wider by a quarter; smaller differences are noise */
#define MISMATCH_MAX Q15(0.25) /* half of the share that makes the confidence fall */

static int32_t product_q30(int32_t a_q30, q15_t b)
{
    return (int32_t)(((int64_t)a_q30 * b) >> 15);
}

/* The curve was measured with the compensation active. The compensated part is added: the inverter's error (CM-2). */
static void add_compensated(const modulate_config_t *config, q15_t v_dc, commission_curve_t *curve)
{
    const int32_t full = config->dead_time_q16 / 2 * v_dc;
    for (unsigned k = 0; k < COMMISSION_LEVELS; k++) {
        const q15_t share = fx_sat_q15(fx_mulhi(config->knee_q17, curve->knot[k])); /* Q17 * Q30 = Q15 */
        curve->v[k] = fx_add_q31(curve->v[k], product_q30(full, share));
    }
    curve->level = fx_add_q31(curve->level, full);
}

/* (CM-5): slope of the straight line that, followed by a constant, approximates the curve. */
static int32_t fitted_knee_q17(const modulate_config_t *config, const commission_curve_t *curve)
{
    const int32_t knee_q17 = fx_div_q31(2, commission_knee(curve) >> 15); /* 2^17 over q15: 2^32 over counts */
    if (knee_q17 >= fx_mul_q31(config->knee_q17, KNEE_CHANGED)) {
        return config->knee_q17;
    }
    return fx_max_s32(knee_q17, config->knee_q17 / COMPENSATION_KNEE_RANGE);
}

static bool is_resistance_plausible(const drive_t *drive, const commission_curve_t *curve)
{
    const q31_t r0 = drive->motor->identify.r0;
    return curve->r > r0 / 4 && curve->r < r0 * INT64_C(3) / 2; /* Q30 against Q31 */
}

/* drive_compensate() refuses an error that is negative or too large. */
static bool evaluate(drive_t *drive, q15_t v_dc)
{
    task_state_t *task = &drive->task;
    commission_curve_t *curve = &task->inverter;
    const modulate_config_t *config = &drive->parameters.modulate;
    const bool fits = commission_fit(&task->commission.data, curve);
    add_compensated(config, v_dc, curve);
    const q31_t dead_time = fx_div_q31(curve->level, v_dc * 32768);
    const compensation_t found = {fx_round_q15(dead_time / 2), fitted_knee_q17(config, curve), true};
    return fits && is_resistance_plausible(drive, curve) && drive_compensate(drive, &found);
}

/* One word for the fast ISR. A smaller bound (MO-11) must be in effect before a larger compensation is. */
void drive_set_dead_time(motor_parameters_t *p, q15_t dead_time)
{
    const uint32_t clear_q30 = motor_clear_q30(p, dead_time);
    if (clear_q30 < p->current_control.clear_q30) {
        p->current_control.clear_q30 = clear_q30;
    }
    exchange_barrier();
    p->modulate.dead_time_q16 = 2 * dead_time;
}

static void change_dead_time(drive_t *drive, q15_t dead_time)
{
    const motor_parameters_t before = drive->parameters;
    drive_set_dead_time(&drive->parameters, dead_time);
    data_check_accept(drive, &before);
}

bool drive_compensate(drive_t *drive, const compensation_t *compensation)
{
    motor_parameters_t *p = &drive->parameters;
    const int32_t dead_time = compensation->dead_time;
    if (dead_time < 0 || dead_time > DEAD_TIME_MAX || compensation->knee_q17 <= 0 ||
        compensation->knee_q17 >= 1 << 30) {
        return false;
    }
    const motor_parameters_t before = *p;
    drive_set_dead_time(p, (q15_t)dead_time);
    p->modulate.knee_side_q17 = fx_mul_q31(compensation->knee_q17, Q31(SQRT3_HALF));
    p->modulate.knee_q17 = compensation->knee_q17;
    data_check_accept(drive, &before);
    drive->task.compensation = *compensation;
    drive->task.trim = (dead_time_trim_state_t){.base = (q15_t)dead_time};
    return true;
}

void drive_trim(drive_t *drive, q15_t v_dc)
{
    task_state_t *task = &drive->task;
    const kalman_t *kalman = &task->identify.kalman;
    const dead_time_trim_in_t in = {
        .sigma = drive->motor->identify.sigma[IDENTIFY_DROP],
        .x_q27 = kalman->x_q27[IDENTIFY_DROP],
        .variance_q30 = kalman->p_q30[kalman_p_index(IDENTIFY_DROP, IDENTIFY_DROP)],
        .v_dc = v_dc,
        .dead_time = (q15_t)(drive->parameters.modulate.dead_time_q16 / 2),
        .period_steps = drive->motor->trim_steps,
        .identifying = drive->request.trim && task->identify.kept.update_valid &&
                       task->identify.kept.mismatch_share <= MISMATCH_MAX,
    };
    const dead_time_trim_t out = dead_time_trim_step(&task->trim, &in);
    if (out.dead_time != in.dead_time) {
        change_dead_time(drive, out.dead_time);
        identify_set(&task->identify, IDENTIFY_DROP, fx_add_q31(kalman->x_q27[IDENTIFY_DROP], out.x_shift_q27));
    }
}

void drive_restore_trim(drive_t *drive, int32_t trim)
{
    const q15_t present = (q15_t)(drive->parameters.modulate.dead_time_q16 / 2);
    change_dead_time(drive, dead_time_trim_restore(&drive->task.trim, present, trim));
}

static void start_if_running(drive_t *drive, const snapshot_t *snapshot, const commission_config_t *config)
{
    task_state_t *task = &drive->task;
    task->commissionings = drive->request.commissionings;
    task->commission = (commission_state_t){.phase = COMMISSION_FAILED, .failure = COMMISSION_STOPPED};
    if (task->run_state == RUN_STATE_RUN && !snapshot->mrai_is_chosen) {
        commission_start(config, &task->commission);
    }
}

void drive_commission(drive_t *drive, const snapshot_t *snapshot)
{
    task_state_t *task = &drive->task;
    const sample_t *sample = &snapshot->sample;
    const identify_window_t *window = &snapshot->window;
    const commission_config_t *config = &drive->motor->commission;
    if (drive->request.commissionings != task->commissionings) {
        start_if_running(drive, snapshot, config);
        return;
    }
    if (!commission_runs(&task->commission)) {
        return;
    }
    const commission_in_t in = {
        .sum_i = window->sum_i,
        .sum_u = window->sum_u,
        .theta = sample->theta_e,
        .omega = sample->point.omega,
        .acting = window->acting && sample->acting && task->run_state == RUN_STATE_RUN,
        .limited = window->limited != 0U,
    };
    commission_step(config, &task->commission, &in);
    if (task->commission.phase != COMMISSION_DONE) {
        return;
    }
    if (evaluate(drive, (q15_t)sample->v_dc)) {
        identify_set(&task->identify, IDENTIFY_DROP, 0); /* the compensation now contains this voltage drop */
    } else {
        task->commission.phase = COMMISSION_FAILED;
        task->commission.failure = COMMISSION_FIT;
    }
}
