/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/mrai/mrai_seam.h"
#include "hal/irq.h"

#define OVERRUNS_TO_FAULT 3

/* The interrupt still uses the previous point: this one is dropped, and the law restarts with the next. */
static __attribute__((noinline, cold)) void count_overrun(drive_t *drive)
{
    mrai_mailbox_t *mailbox = &drive->mrai.mailbox;
    mailbox->overruns++;
    mailbox->overruns_in_a_row++;
    if (mailbox->overruns_in_a_row >= OVERRUNS_TO_FAULT) {
        mailbox->overruns_in_a_row = OVERRUNS_TO_FAULT;
        drive_raise_fault(drive, FAULT_OVERRUN);
    }
}

void mrai_offer(drive_t *drive, const sample_t *sample)
{
    mrai_mailbox_t *mailbox = &drive->mrai.mailbox;
    if (__builtin_expect(mailbox->generation != drive->mrai.isr.finished, 0)) {
        count_overrun(drive);
        return;
    }
    mailbox->overruns_in_a_row = 0;
    mailbox->point = sample->point;
    mailbox->acting = sample->acting;
    exchange_barrier();
    mailbox->generation = drive->samples.generation;
    hal_irq_pend_mrai();
}
