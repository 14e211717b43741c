/* SPDX-License-Identifier: Apache-2.0 */
#include "scope/scope.h"

#include "fx/codegen.h"

static const capture_config_t freeze_frame = {
    .signals = 8,
    .signal = SCOPE_USUAL_SIGNALS,
    .trigger = TRIGGER_FAULT,
    .divisor = 1,
    .samples = SCOPE_FREEZE_SAMPLES,
    .before = SCOPE_FREEZE_BEFORE,
};

static uint16_t get_u16(const uint8_t *at)
{
    return (uint16_t)(at[0] | at[1] << 8);
}

static scope_result_t select_signal(capture_config_t *setup, uint8_t position, uint8_t signal)
{
    if (position >= CAPTURE_SIGNALS_MAX || signal >= CAPTURE_SIGNALS) {
        return SCOPE_OUT_OF_RANGE;
    }
    setup->signal[position] = signal;
    return SCOPE_OK;
}

static scope_result_t set_up(capture_config_t *setup, const uint8_t *command)
{
    const uint16_t divisor = get_u16(&command[2]);
    if (command[1] == 0U || command[1] > CAPTURE_SIGNALS_MAX || divisor == 0U || command[4] >= TRIGGERS ||
        command[5] >= CAPTURE_SIGNALS) {
        return SCOPE_OUT_OF_RANGE;
    }
    setup->signals = command[1];
    setup->divisor = divisor;
    setup->trigger = command[4];
    setup->trigger_signal = command[5];
    return SCOPE_OK;
}

static scope_result_t set_samples(capture_config_t *setup, const uint8_t *command)
{
    const uint16_t samples = get_u16(&command[1]);
    const uint16_t before = get_u16(&command[3]);
    if (samples > CAPTURE_MEMORY || before >= samples) {
        return SCOPE_OUT_OF_RANGE;
    }
    setup->samples = samples;
    setup->before = before;
    setup->level = (int16_t)get_u16(&command[5]);
    return SCOPE_OK;
}

static scope_step_values_t step_values(const drive_t *drive)
{
    const task_state_t *task = &drive->task;
    return (scope_step_values_t){
        .i_d_ref = (int16_t)task->i_ref.d,
        .i_q_ref = (int16_t)task->i_ref.q,
        .torque_commanded = task->torque_commanded,
        .torque_corrected = task->torque_corrected,
        .torque_estimated = (int16_t)task->identification.torque_estimated,
        .psi_error = task->psi_d_error,
    };
}

static scope_result_t arm(scope_t *scope, const drive_t *drive)
{
    if (scope->capture.state != CAPTURE_IDLE) {
        return SCOPE_BUSY;
    }
    if (!capture_config_is_valid(&scope->setup)) {
        return SCOPE_OUT_OF_RANGE;
    }
    capture_arm(&scope->capture, &scope->setup, drive->samples.generation);
    scope->capture.coming = step_values(drive);
    return SCOPE_OK;
}

static uint8_t length_of(uint8_t command)
{
    switch (command) {
    case SCOPE_SELECT:
        return 3;
    case SCOPE_SETUP:
        return 6;
    case SCOPE_SAMPLES:
        return 7;
    default:
        return 1;
    }
}

scope_result_t scope_command(scope_t *scope, const drive_t *drive, const uint8_t *command, uint8_t length)
{
    if (length == 0U || length < length_of(command[0])) {
        return SCOPE_TOO_SHORT;
    }
    switch (command[0]) {
    case SCOPE_SELECT:
        return select_signal(&scope->setup, command[1], command[2]);
    case SCOPE_SETUP:
        return set_up(&scope->setup, command);
    case SCOPE_SAMPLES:
        return set_samples(&scope->setup, command);
    case SCOPE_ARM:
        return arm(scope, drive);
    case SCOPE_TRIGGER:
        capture_trigger(&scope->capture, drive->samples.generation + 1U);
        return SCOPE_OK;
    case SCOPE_STOP:
        capture_stop(&scope->capture);
        return SCOPE_OK;
    default:
        return SCOPE_UNKNOWN;
    }
}

/* A capture that has been triggered is kept. */
static void begin_fault(capture_t *capture, uint32_t period, uint32_t newest)
{
    if (capture->state == CAPTURE_ARMED && capture->config.trigger == TRIGGER_FAULT) {
        capture_trigger(capture, period);
    } else if (capture->state == CAPTURE_ARMED || capture->state == CAPTURE_IDLE) {
        capture_freeze(capture, &freeze_frame, period, newest);
    }
}

static void end_fault(capture_t *capture)
{
    if (capture->frozen != 0U) {
        capture_stop(capture);
    }
}

FX_NOT_INLINED FX_COLD void scope_follow_fault(scope_t *scope, const drive_t *drive, bool fault)
{
    const uint32_t newest = drive->samples.generation; /* read once: a freeze frame may use the whole ring */
    if (fault) {
        begin_fault(&scope->capture, (drive->fast.faults != 0U) ? drive->fast.fault_period : newest, newest);
    } else {
        end_fault(&scope->capture);
    }
}

/* The periods copied here ran with the task's last command but one, whose values are kept for them. The command that
 * the task has just written acts from the next period on.
 * Not inlined: a step in which nothing is to be done then saves no registers. */
FX_NOT_INLINED void scope_record(scope_t *scope, const drive_t *drive)
{
    if (scope->capture.uses_step) {
        scope->capture.values = scope->capture.coming;
        scope->capture.coming = step_values(drive);
    }
    capture_step(&scope->capture, scope->memory, drive->samples.slot, drive->samples.generation);
}
