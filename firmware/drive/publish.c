/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/publish.h"

#include "drive/mrai/mrai_seam.h"

void publish_sample(drive_t *drive, const sample_t *sample)
{
    fast_state_t *fast = &drive->fast;
    sample_box_publish(&drive->samples);
    if (__builtin_expect(mrai_is_chosen(drive), 0)) {
        identify_window_invalidate(&fast->window); /* this period is missing in it */
        mrai_offer(drive, sample);
        return;
    }
    drive->psi_d_error = drive->task.psi_d_error;
    const identify_sample_t in = {
        .i = sample->point.i,
        .u = sample->point.u,
        .flux = &sample->point.flux,
        .theta = sample->theta_e,
    };
    if (__builtin_expect(identify_window_step(&fast->window, &in), 0)) {
        window_box_write(&drive->windows, &fast->window);
        identify_window_restart(&fast->window, drive->motor->bases.periods_per_step);
    }
}
