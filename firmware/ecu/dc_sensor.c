/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/mrai/mrai_seam.h"
#include "drive/step_mean.h"
#include "ecu/ecu_private.h"

#define I_UNDETERMINED Q15(0.02) /* of the full scale of the current: below it two legs may carry none (MN-53) */

/* Of the newest period and the last window, which ends in it or shortly before. Both are read in place: the fast ISR
 * writes their slots again a window later at the earliest. Without the sums of a step the mean voltage is that of the
 * period. The flux of the last step is that of the torque monitor, which runs after this. */
static dc_jump_in_t read_inputs(const drive_t *drive)
{
    const sample_t *sample = sample_box_last(&drive->samples);
    const identify_window_t *window = window_box_at(&drive->windows);
    const bool has_sums = !mrai_is_chosen(drive) && window->acting;
    return (dc_jump_in_t){
        .acting = sample->acting && !drive_bypasses_torque_path(drive),
        .u = has_sums ? step_mean_of(drive, window->sum_u) : sample->point.u,
        .i = sample->point.i,
        .psi = {sample->point.flux.psi_d, sample->point.flux.psi_q},
        .psi_last = drive->task.torque_monitor.psi,
        .omega = fx_q15_from_q31(sample->point.omega),
        .torque = drive->task.torque_commanded,
        .v_dc = (q15_t)sample->v_dc,
    };
}

void ecu_check_dc_sensor(ecu_t *ecu)
{
    drive_t *drive = &ecu->drive;
    const torque_monitor_config_t *monitor = &drive->motor->torque_monitor;
    const dc_jump_config_t config = {
        .r = monitor->r >> 15,
        .rate_gain = monitor->rate_gain,
        .v_0 = monitor->v_0,
        .t_0 = monitor->t_0,
        .i_0 = (q15_t)fx_max_s32(monitor->i_0, I_UNDETERMINED),
    };
    const dc_jump_in_t in = read_inputs(drive);
    if (dc_jump_step(&config, &ecu->dc_jump, &in)) {
        drive->request.faults |= FAULT_INPUT;
    }
}
