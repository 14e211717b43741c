/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_DATA_CHECK_H
#define DRIVE_DATA_CHECK_H
/** Finds changes by errors of the memory in data that no function, or only a few, may write.
 *   drive->motor           three copies, one of them complemented; the majority is restored before each step
 *   period, parameters,    each word has its complement; a few words are compared in each step, all of them within
 *   mrai_parameters        DATA_CHECK_ROUND_MAX steps
 *   state kept for long    seals of the identification and of the angle correction
 *   options of the request one word, where only one owner writes them: the ECU
 *   window                 the fast ISR must complete windows while it runs
 * A function that changes the parameters takes a copy of them first and passes it to data_check_accept(), which renews
 * the complements of the words that differ: damage in other words is still found.
 * Source   docs/theory/data-integrity.md (DI-1), (DI-2)
 * Units    words of 32 bits; steps of the task
 * Errors   FAULT_CONFIG with MOTOR_CHECK_LIVE_DATA, until the next start, because other data may have changed, too
 * Context  1 kHz task, and before the interrupts start */
#include "drive/drive.h"

#define DATA_CHECK_ROUND_MAX 20U

/** Accepts the words that differ from `before` as changed on purpose: renews their complements. */
void data_check_accept(drive_t *drive, const motor_parameters_t *before);
#if FLUXTRUE_MRAI
void data_check_accept_mrai(drive_t *drive, const mrai_config_t *before);
#endif
/** Accepts the options of the request as changed on purpose. */
void data_check_accept_options(drive_t *drive);
/** Compares the options: called by their owner in each step. A difference makes this step's data_check_step() fail. */
void data_check_check_options(drive_t *drive);
/** Restores the pointer to the motor data; first in each step. */
void data_check_restore_pointer(drive_t *drive);
/** Compares the words of this step; returns its faults. */
uint32_t data_check_step(drive_t *drive);

#endif
