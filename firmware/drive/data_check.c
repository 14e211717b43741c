/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/data_check.h"

#include <stddef.h>
#include <string.h>

#include "fx/codegen.h"

#define WORDS_PER_STEP 4U
#define STEPS_WITHOUT_WINDOW 4U /* whole steps without a window; the fast ISR completes one window in each step */

#define WORDS (DATA_CHECK_PERIOD_WORDS + DATA_CHECK_PARAMETERS_WORDS + DATA_CHECK_MRAI_WORDS)
#define LAST (WORDS - WORDS_PER_STEP) /* first word of a round's last step */
#define LIVE offsetof(drive_t, period)
#define COMPLEMENTS offsetof(drive_t, data_check.period)

_Static_assert(offsetof(drive_t, parameters) == LIVE + sizeof(period_data_t), "one after the other");
_Static_assert(offsetof(drive_t, data_check.parameters) == COMPLEMENTS + sizeof(period_data_t), "in the same order");
#if FLUXTRUE_MRAI
_Static_assert(offsetof(drive_t, mrai_parameters) == offsetof(drive_t, parameters) + sizeof(motor_parameters_t),
               "then");
_Static_assert(offsetof(drive_t, data_check.mrai_parameters) ==
                   offsetof(drive_t, data_check.parameters) + sizeof(motor_parameters_t),
               "in the same order");
_Static_assert(sizeof(mrai_config_t) % sizeof(uint32_t) == 0U, "whole words");
#endif
_Static_assert(WORDS <= WORDS_PER_STEP * DATA_CHECK_ROUND_MAX, "a round in time");
_Static_assert(sizeof(motor_parameters_t) % sizeof(uint32_t) == 0U, "whole words");
_Static_assert(sizeof(period_data_t) % sizeof(uint32_t) == 0U, "whole words");

static uint32_t word_at(const void *data, uint32_t n)
{
    uint32_t word;
    (void)memcpy(&word, (const uint8_t *)data + n * sizeof word, sizeof word);
    return word;
}

_Static_assert(offsetof(request_t, trim) - offsetof(request_t, current_mode) == 3U, "four flags, one after the other");

static uint32_t options_of(const request_t *request)
{
    uint32_t flags;
    (void)memcpy(&flags, (const uint8_t *)request + offsetof(request_t, current_mode), sizeof flags);
    return flags ^ (uint32_t)request->identification_mode;
}

void data_check_accept_options(drive_t *drive)
{
    drive->data_check.options = options_of(&drive->request);
}

void data_check_check_options(drive_t *drive)
{
    drive->data_check.damaged |= drive->data_check.options != options_of(&drive->request);
}

void data_check_start(drive_t *drive)
{
    data_check_t *data_check = &drive->data_check;
    data_check_accept_options(drive);
    data_check->motor = drive->motor;
    data_check->motor_complement = ~(uintptr_t)drive->motor;
    for (uint32_t n = 0; n < WORDS; n++) {
        const uint32_t complement = ~word_at((const uint8_t *)drive + LIVE, n);
        (void)memcpy((uint8_t *)drive + COMPLEMENTS + n * sizeof complement, &complement, sizeof complement);
    }
}

static void accept(const void *now, const void *before, uint32_t complements[], uint32_t words)
{
    for (uint32_t n = 0; n < words; n++) {
        const uint32_t word = word_at(now, n);
        if (word != word_at(before, n)) {
            complements[n] = ~word;
        }
    }
}

void data_check_accept(drive_t *drive, const motor_parameters_t *before)
{
    accept(&drive->parameters, before, drive->data_check.parameters, DATA_CHECK_PARAMETERS_WORDS);
}

#if FLUXTRUE_MRAI
void data_check_accept_mrai(drive_t *drive, const mrai_config_t *before)
{
    accept(&drive->mrai_parameters, before, drive->data_check.mrai_parameters, DATA_CHECK_MRAI_WORDS);
}
#endif

void data_check_restore_pointer(drive_t *drive)
{
    data_check_t *data_check = &drive->data_check;
    if (drive->motor != data_check->motor && (uintptr_t)data_check->motor == ~data_check->motor_complement) {
        drive->motor = data_check->motor;
    }
}

/* The words of this step. The last step of a round compares the last words, some of them perhaps again. */
static bool words_match(drive_t *drive)
{
    data_check_t *data_check = &drive->data_check;
    const uint8_t *live = (const uint8_t *)drive + LIVE;
    const uint8_t *complements = (const uint8_t *)drive + COMPLEMENTS;
    const uint32_t first = (data_check->at < LAST) ? data_check->at : LAST;
    uint32_t differing_bits = UINT32_MAX; /* of word and complement: all of them */
    FX_UNROLLED
    for (uint32_t n = 0; n < WORDS_PER_STEP; n++) {
        differing_bits &= word_at(live, first + n) ^ word_at(complements, first + n);
    }
    data_check->at = (first == LAST) ? 0U : first + WORDS_PER_STEP;
    return differing_bits == UINT32_MAX;
}

/* The fast ISR records at the end of each step which command it has seen. If it runs without doing so, the stored end
 * of the step is damaged: the identification would keep using the last window, and the task would not be monitored. */
static bool windows_complete(drive_t *drive)
{
    data_check_t *data_check = &drive->data_check;
    const uint32_t periods = drive->samples.generation;
    if (drive->fast.command_seen != data_check->windows) {
        data_check->windows = drive->fast.command_seen;
        data_check->periods = periods;
    }
    return periods - data_check->periods <= STEPS_WITHOUT_WINDOW * drive->motor->bases.periods_per_step;
}

uint32_t data_check_step(drive_t *drive)
{
    const bool seals_match = !drive->task.identify.damaged && !drive->task.angle_harmonics.damaged;
    const bool good = words_match(drive) && windows_complete(drive) && seals_match;
    drive->data_check.damaged |= !good;
    return drive->data_check.damaged ? FAULT_CONFIG : 0U;
}
