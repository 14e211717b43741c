/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/switch_off.h"

#define RAMP_STEPS 8U
#define STEPS 10U /* with those in which the currents settle */
#define BISECTIONS 15

/* The current at which it cancels the flux of the magnets, by bisection: psi_d rises with i_d. */
static int32_t short_circuit_i_d(const drive_t *drive, const snapshot_t *snapshot)
{
    int32_t low = -i_d_limit_step(&drive->motor->i_d_limit, snapshot->psi_d_error, snapshot->winding_dC), high = 0;
    for (int k = 0; k < BISECTIONS; k++) {
        const int32_t middle = (low + high) / 2;
        const flux_point_t flux = flux_table_step(&drive->motor->flux_table, (dq_q15_t){middle, 0});
        const bool below = flux.psi_d + snapshot->psi_d_error < 0;
        low = below ? middle : low;
        high = below ? high : middle;
    }
    return high;
}

bool switch_off_may_switch(const drive_t *drive, const snapshot_t *snapshot)
{
    const bool has_angle = snapshot->angle_absolute || drive_imposes_angle(drive);
    return !drive->held && has_angle && !drive_has_ended_movement(drive);
}

/* Whether the currents are controlled at a speed at which disabled switching would rectify. */
static bool controls_at_speed(const drive_t *drive, const snapshot_t *snapshot, run_state_t wanted)
{
    const task_state_t *task = &drive->task;
    const bool begins = drive->request.may_hold && !movement_is_agreed(&task->movement) &&
                        switch_off_may_switch(drive, snapshot);
    return (task->run_state == RUN_STATE_RUN || begins) && wanted != RUN_STATE_FAULT && task->safe_state.rectifies &&
           !drive_bypasses_torque_path(drive);
}

/* Whether currents flow that can still be moved to those of the short circuit. */
static bool can_move(const task_state_t *task, uint32_t faults)
{
    return task->run_state == RUN_STATE_RUN && task->safe_state.short_circuit && faults != 0U &&
           (faults & ~FAULTS_CONTROLLED) == 0U;
}

run_state_t switch_off_step(drive_t *drive, const snapshot_t *snapshot, run_state_t wanted, uint32_t *faults)
{
    task_state_t *task = &drive->task;
    switch_off_t *off = &task->switch_off;
    const bool controls = controls_at_speed(drive, snapshot, wanted);
    off->holds = controls && wanted == RUN_STATE_OFF && *faults == 0U; /* (SS-12) */
    if (!controls || !can_move(task, *faults) || off->steps == STEPS) {
        off->steps = 0;
        return off->holds ? RUN_STATE_RUN : wanted;
    }
    if (off->steps == 0U) {
        off->from = task->i_ref;
        off->i_d = short_circuit_i_d(drive, snapshot);
    }
    off->steps++;
    *faults = 0;
    return RUN_STATE_RUN;
}

dq_q15_t switch_off_reference(const drive_t *drive)
{
    const switch_off_t *off = &drive->task.switch_off;
    const int32_t done = fx_min_s32(off->steps, RAMP_STEPS), left = (int32_t)RAMP_STEPS - done;
    return (dq_q15_t){(off->i_d * done + off->from.d * left) / (int32_t)RAMP_STEPS,
                      off->from.q * left / (int32_t)RAMP_STEPS};
}
