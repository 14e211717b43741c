/* SPDX-License-Identifier: Apache-2.0 */
/* A movement of the shaft in the drive: its frame in the fast ISR, and its step in the 1 kHz task. */
#include "drive/drive.h"

/* With MOVEMENT_CONNECTED alone a small torque may brake the rotor; the second level does not check it meanwhile. */
static bool has_request(const drive_t *drive)
{
    const int32_t largest = drive_is_moving(drive) ? 0 : drive->motor->torque_max / 8;
    return fx_abs_q31(drive->request.torque_arbitrated) > largest;
}

void drive_move(drive_t *drive, const snapshot_t *snapshot)
{
    task_state_t *task = &drive->task;
    if (drive->request.movement.movement == (uint8_t)MOVEMENT_NONE && task->movement.phase == MOVEMENT_PHASE_IDLE) {
        return; /* as in almost every step: movement_step() would change nothing */
    }
    const movement_in_t in = {
        .runs = task->run_state == RUN_STATE_RUN,
        .has_failed = task->run_state == RUN_STATE_FAULT || snapshot->mrai_is_chosen,
        .has_request = has_request(drive),
        .theta_m = snapshot->sample.theta_m,
        .omega = drive->frame_angle.omega_sensor,
    };
    movement_step(&drive->motor->movement, drive->motor->angle_tracker.pole_pairs, &task->movement, &drive->frame,
                  &drive->request.movement, &in);
}

uint8_t drive_bridge_mode(const drive_t *drive, bool runs)
{
    if (!runs) {
        return (uint8_t)BRIDGE_OFF;
    }
    if (movement_is_agreed(&drive->task.movement)) {
        return drive_is_pulsing(drive) ? (uint8_t)BRIDGE_MOVED_PULSES : (uint8_t)BRIDGE_MOVED;
    }
    return drive_is_pulsing(drive) ? (uint8_t)BRIDGE_PULSES : (uint8_t)BRIDGE_CONTROL;
}

/* Nothing is identified, because the angle is not that of the motor data. */
int32_t drive_take_frame(drive_t *drive, const command_t *command, sample_t *sample, int32_t own_step)
{
    if ((command->run & (uint8_t)BRIDGE_MOVED) == 0U) {
        return own_step;
    }
    const movement_sensor_t sensor = {sample->theta_m, own_step, sample->point.omega};
    const movement_frame_motion_t motion = movement_frame_step(&drive->frame, &drive->frame_angle, &sensor);
    sample->theta_e = motion.theta_e;
    sample->point.omega = motion.omega;
    identify_window_invalidate(&drive->fast.window);
    return motion.step;
}
