/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/after_reset.h"

void before_reset(const drive_t *drive, before_reset_t *before)
{
    const uint32_t faults = drive->fast.faults;
    *before = (before_reset_t){
        .speed = drive->task.safe_state.speed,
        .v_dc = (q15_t)sample_box_last(&drive->samples)->v_dc,
        .psi_d_error = drive->psi_d_error,
        .armed = drive->task.armed && (faults & FAULT_CONFIG) == 0U,
        .speed_valid = (faults & (FAULT_ANGLE | FAULT_INPUT)) == 0U,
    };
}

q15_t after_reset_v_dc(const motor_t *m, uint32_t count)
{
    return (q15_t)measure_v_dc(&m->measure.v_dc, count);
}

/* (SS-14). A rotor does not lose half of its speed during a reset, but a broken sensor may read a standstill. */
static q15_t present_speed(const before_reset_t *before, q15_t speed)
{
    return (before->speed_valid && speed >= before->speed / 2) ? speed : before->speed;
}

/* Uses the lower threshold of (SS-2), and the lower of the dc voltages before and after the reset: the rectified
 * back-EMF may have raised the present one. */
static bool decide(const motor_t *m, safe_state_state_t *state, const before_reset_t *before, q15_t speed, q15_t v_dc)
{
    const safe_state_in_t in = {
        .omega = present_speed(before, speed),
        .psi_d_error = before->psi_d_error,
        .v_dc = (q15_t)fx_min_s32(v_dc, before->v_dc),
        .speed_valid = true,
    };
    state->short_circuit = true;
    state->rectifies = true;
    return safe_state_step(&m->safe_state, state, &in);
}

bool after_reset_needs_short_circuit(const motor_t *m, const before_reset_t *before, q15_t speed, q15_t v_dc)
{
    safe_state_state_t state = {0};
    return before->armed && decide(m, &state, before, speed, v_dc);
}

/* The back-EMF follows from the speed; contactor and gate supply stay on for it from the first step. */
void after_reset_hold(drive_t *drive, const before_reset_t *before, q15_t speed)
{
    drive->task.armed = true;
    (void)decide(drive->motor, &drive->task.safe_state, before, speed, before->v_dc);
    command_box_write(&drive->commands, (command_t){.safe = SAFE_SHORT_CIRCUIT});
}
