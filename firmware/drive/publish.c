/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/publish.h"

#include "drive/mrai/mrai_seam.h"
#include "fx/codegen.h"

#define SILENT_STEPS_MAX 2U /* whole steps without a command: 2 to 3 ms, as task and window are not in step */

/* Without the task the last torque would last until the watchdog resets the processor. Each step the task writes one
 * command, whether the drive runs or not. */
static void check_task(drive_t *drive)
{
    fast_state_t *fast = &drive->fast;
    const uint32_t generation = drive->commands.generation;
    if (generation != fast->command_seen) {
        fast->command_seen = generation;
        fast->silent_steps = 0;
    } else if (command_box_read(&drive->commands)->run != (uint8_t)BRIDGE_OFF) {
        fast->silent_steps++;
        if (fast->silent_steps >= SILENT_STEPS_MAX) {
            drive_raise_fault(drive, FAULT_OVERRUN);
        }
    }
}

/* The generation counts the periods of a step for either identification. */
static void begin_step(drive_t *drive, uint32_t end)
{
    drive->fast.step_end = end;
    check_task(drive);
}

/* A window lacks the periods that went to the paper's law. */
static void hand_over_window(drive_t *drive, uint32_t generation, uint32_t periods)
{
    identify_window_t *window = &drive->fast.window;
    if (mrai_had_one_of(drive, generation, periods)) {
        identify_window_invalidate(window);
    }
    window_box_write(&drive->windows, window);
    identify_window_restart(window);
}

/* A sensor that repeats its angle may have failed: the next period checks it, outside the usual route. Not inlined: a
 * branch that is not taken costs one instruction, the inlined code three conditional ones in every period. */
static FX_NOT_INLINED FX_COLD void leave_usual_route(drive_t *drive)
{
    if (angle_tracker_may_stick(&drive->period.angle_tracker, &drive->fast.angle_tracker)) {
        drive->fast.is_settled = false;
    }
}

static inline void watch_angle(drive_t *drive, uint32_t theta_m)
{
    angle_tracker_state_t *tracker = &drive->fast.angle_tracker;
    const uint32_t before = tracker->theta_m;
    tracker->theta_m = theta_m;
    if (theta_m == before) {
        leave_usual_route(drive);
    }
}

void publish_sample(drive_t *drive, const sample_t *sample)
{
    fast_state_t *fast = &drive->fast;
    watch_angle(drive, sample->theta_m);
    const uint32_t generation = sample_box_publish(&drive->samples);
    const bool completes_step = generation == fast->step_end;
    if (mrai_is_chosen(drive)) {
        mrai_offer(drive, generation);
        if (completes_step) {
            identify_window_invalidate(&fast->window); /* the next one would lack its first sample */
            begin_step(drive, generation + drive->period.periods_per_step);
        }
        return;
    }
    drive->psi_d_error = drive->task.psi_d_error;
    identify_sample_t in = {.i = sample->point.i, .u = sample->point.u, .flux = &sample->point.flux};
    identify_window_add(&fast->window, &in);
    if (completes_step) {
        in.theta = sample->theta_e; /* not read in the other periods */
        const uint32_t periods = drive->period.periods_per_step;
        identify_window_end(&fast->window, &in);
        hand_over_window(drive, generation, periods);
        begin_step(drive, generation + periods);
    }
}
