/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/mrai/mrai_seam.h"
#include "fx/codegen.h"
#include "hal/irq.h"

#define OVERRUNS_TO_FAULT 3U /* periods since the last point that was not dropped */

/* The interrupt still uses the previous point: this one is dropped, and the law restarts with the next. */
static FX_NOT_INLINED FX_COLD void count_overrun(drive_t *drive, uint32_t generation)
{
    mrai_mailbox_t *mailbox = &drive->mrai.mailbox;
    mailbox->overruns++;
    identify_window_invalidate(&drive->fast.window); /* mrai_had_one_of() does not count this period */
    if (generation - mailbox->generation >= OVERRUNS_TO_FAULT) {
        drive_raise_fault(drive, FAULT_OVERRUN);
    }
}

void mrai_offer(drive_t *drive, uint32_t generation)
{
    mrai_mailbox_t *mailbox = &drive->mrai.mailbox;
    if (mailbox->generation != drive->mrai.isr.finished) {
        count_overrun(drive, generation);
        return;
    }
    mailbox->generation = generation;
    hal_irq_pend_mrai();
}
