/* SPDX-License-Identifier: Apache-2.0 */
#ifndef MRAI_MRAI_DATA_H
#define MRAI_MRAI_DATA_H
/** All data of a drive that only the 2014 paper's identification needs, by writer.
 * Source   docs/architecture.md, shared data; docs/theory/mrai.md
 * Units    as in control/mrai
 * Errors   none: values only
 * Context  part of drive_t; a build without FLUXTRUE_MRAI has none of it */
#include "control/mrai/schedule.h"
#include "control/mrai/torque_estimate.h"

/** Which sample's operating point the MRAI interrupt is to use. Writer: fast ISR, only after the interrupt has finished
 * the previous one (generation == finished). The interrupt reads the sample in place: its slot is written again 64
 * periods later, and when three of them have come before the interrupt finished, overrun is latched. */
typedef struct {
    volatile uint32_t generation; /* of the sample */
    uint32_t overruns;            /* periods whose point was dropped because the previous one was not finished */
} mrai_mailbox_t;

/** Writer: MRAI interrupt. */
typedef struct {
    mrai_state_t law;
    torque_sum_t torque;
    uint32_t identification_resets; /* of the request, as far as carried out */
    volatile uint32_t finished;     /* generation of the last point processed */
} mrai_isr_state_t;

/** Gains. Writer: 1 kHz task. Reader: MRAI interrupt, which the task never interrupts. */
typedef struct {
    mrai_schedule_t slot[2];
    volatile uint32_t generation;
} schedule_box_t;

/** Writer: 1 kHz task. */
typedef struct {
    mrai_quality_t quality;
    torque_mean_t torque_mean;
    uint32_t finished_seen; /* generation of the last point processed, at the last mrai_is_stalled() */
} mrai_task_state_t;

typedef struct {
    mrai_mailbox_t mailbox;
    mrai_isr_state_t isr;
    mrai_task_state_t task;
    schedule_box_t schedules;
} mrai_data_t;

/** Copy for the 1 kHz task, from the same moment as the rest of its snapshot. */
typedef struct {
    mrai_state_t law;
    torque_sum_t torque;
} mrai_snapshot_t;

#endif
