/* SPDX-License-Identifier: Apache-2.0 */
#include "app/hand_over.h"

#include "hal/irq.h"

#define OVERRUNS_TO_FAULT 3

__attribute__((noinline, cold)) bool hand_over_late(drive_t *drive, uint32_t unfinished)
{
    fast_state_t *fast = &drive->fast;
    fast->settled = false;
    fast->overruns++;
    fast->overruns_in_a_row++;
    if (fast->overruns_in_a_row >= OVERRUNS_TO_FAULT) {
        fast->overruns_in_a_row = OVERRUNS_TO_FAULT;
        drive_raise_fault(drive, FAULT_OVERRUN);
    }
    return unfinished > 1U;
}

void hand_over(drive_t *drive, const sample_t *sample, uint32_t next)
{
    fast_state_t *fast = &drive->fast;
    sample_box_publish(&drive->samples, next);
    if (__builtin_expect(drive->request.identification_mode != IDENTIFICATION_ROBUST, 0)) {
        identify_window_spoil(&fast->window); /* it would have a gap */
        hal_irq_pend_mrai();
        return;
    }
    drive->slow.psi_delta_q15 = drive->task.identified.psi_delta;
    drive->slow.finished = next;
    const identify_sample_t in = {
        .i = sample->mrai.i,
        .u = sample->mrai.u,
        .flux = &sample->mrai.flux,
        .theta = sample->theta_e,
    };
    if (__builtin_expect(identify_window_step(&fast->window, &in), 0)) {
        window_box_write(&drive->windows, &fast->window);
        identify_window_restart(&fast->window);
    }
}
