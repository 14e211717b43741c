/* SPDX-License-Identifier: Apache-2.0 */
#ifndef MRAI_MRAI_SEAM_H
#define MRAI_MRAI_SEAM_H
/** The interface of the 2014 paper's identification, an optional consumer of the operating point.
 *   The fast ISR calls mrai_offer() in a period in which the law is chosen; the 1 kHz task calls mrai_snapshot(),
 *   mrai_identify(), mrai_reschedule() and mrai_is_stalled(); the second interrupt is mrai_isr() (drive/drive.h). While
 *   the law is not chosen, none of them runs: only the comparison of mrai_had_one_of(), once per window.
 * Source   docs/architecture.md, shared data; docs/decisions/012-seam-of-the-papers-law.md
 * Units    as in control/mrai
 * Errors   a point that comes before the last one is finished is dropped and counted; three in a row are FAULT_OVERRUN
 * Context  stated per function. Without FLUXTRUE_MRAI the law cannot be chosen and the functions are empty */
#include "drive/drive.h"

#if FLUXTRUE_MRAI

static inline motor_check_t mrai_data_check(const motor_t *m)
{
    const bool shift_fits = m->mrai->g_shift >= -15 && m->mrai->g_shift <= 15;
    return shift_fits ? mrai_check(m->mrai) : MOTOR_CHECK_MRAI_GAINS;
}

static inline void mrai_init(drive_t *drive)
{
    drive->mrai_parameters = *drive->motor->mrai;
}

static inline bool mrai_is_chosen(const drive_t *drive)
{
    return drive->request.identification_mode == IDENTIFICATION_PAPER;
}

/** Fast ISR, after the sample has been published as this generation. */
void mrai_offer(drive_t *drive, uint32_t generation);
/** Fast ISR: whether one of the last periods, up to this generation, went to the law. A dropped point is not detected
 * here. If the law was never chosen, the overflow of the generation after 2^32 periods reads as true, too. */
static inline bool mrai_had_one_of(const drive_t *drive, uint32_t generation, uint32_t periods)
{
    return generation - drive->mrai.mailbox.generation < periods;
}

/** 1 kHz task: the law's part of the snapshot, which is undefined while the law is not chosen. */
void mrai_snapshot(const drive_t *drive, snapshot_t *snapshot);
/** 1 kHz task: the result of the law as the drive's identification. */
void mrai_identify(drive_t *drive, const snapshot_t *snapshot);
/** 1 kHz task, after the references: gains for this operating point and for the one just commanded. */
void mrai_reschedule(drive_t *drive, const snapshot_t *snapshot, const operating_point_t *commanded);
/** 1 kHz task: discards the identified parameters. */
void mrai_discard(drive_t *drive);

/** 1 kHz task, once per step: a point waits, and the interrupt has finished none since the last call. */
bool mrai_is_stalled(drive_t *drive);

static inline uint32_t mrai_overruns(const drive_t *drive)
{
    return drive->mrai.mailbox.overruns;
}

#else

static inline motor_check_t mrai_data_check(const motor_t *m)
{
    (void)m;
    return MOTOR_CHECK_OK;
}

static inline void mrai_init(drive_t *drive)
{
    (void)drive;
}

static inline bool mrai_is_chosen(const drive_t *drive)
{
    (void)drive;
    return false;
}

static inline void mrai_offer(drive_t *drive, uint32_t generation)
{
    (void)drive;
    (void)generation;
}

static inline bool mrai_had_one_of(const drive_t *drive, uint32_t generation, uint32_t periods)
{
    (void)drive;
    (void)generation;
    (void)periods;
    return false;
}

static inline void mrai_snapshot(const drive_t *drive, snapshot_t *snapshot)
{
    (void)drive;
    (void)snapshot;
}

static inline void mrai_identify(drive_t *drive, const snapshot_t *snapshot)
{
    (void)drive;
    (void)snapshot;
}

static inline void mrai_reschedule(drive_t *drive, const snapshot_t *snapshot, const operating_point_t *commanded)
{
    (void)drive;
    (void)snapshot;
    (void)commanded;
}

static inline void mrai_discard(drive_t *drive)
{
    (void)drive;
}

static inline bool mrai_is_stalled(drive_t *drive)
{
    (void)drive;
    return false;
}

static inline uint32_t mrai_overruns(const drive_t *drive)
{
    (void)drive;
    return 0;
}

#endif

#endif
