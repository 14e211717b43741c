/* SPDX-License-Identifier: Apache-2.0 */
#include "scope/capture.h"

#include "fx/codegen.h"
#include "scope/columns.h"
#include "scope/copy.h"
#include "scope/trigger.h"

#define USABLE (SAMPLE_SLOTS - 4U) /* the fast ISR may complete 4 periods until a step's samples have been copied */

bool capture_config_is_valid(const capture_config_t *config)
{
    if (config->signals == 0U || config->signals > CAPTURE_SIGNALS_MAX) {
        return false;
    }
    for (uint8_t k = 0; k < config->signals; k++) {
        if (config->signal[k] >= CAPTURE_SIGNALS) {
            return false;
        }
    }
    return config->trigger < TRIGGERS && config->trigger_signal < CAPTURE_SIGNALS && config->divisor > 0U &&
           config->before < config->samples && (uint32_t)config->samples * config->signals <= CAPTURE_MEMORY;
}

static FX_NOT_INLINED FX_COLD void begin(capture_t *capture, const capture_config_t *config, capture_state_t state)
{
    const uint16_t number = (uint16_t)(capture->number + 1U);
    *capture = (capture_t){.config = *config,
                           .state = (uint8_t)state,
                           .number = number,
                           .values = capture->values,
                           .coming = capture->coming,
                           .recording = CAPTURE_RECORDS};
    columns_find(capture);
    copy_reset(capture);
}

void capture_arm(capture_t *capture, const capture_config_t *config, uint32_t newest)
{
    begin(capture, config, CAPTURE_ARMED);
    trigger_reset(capture);
    capture->next = newest + 1U;
}

void capture_freeze(capture_t *capture, const capture_config_t *config, uint32_t period, uint32_t newest)
{
    const uint32_t since = newest + 1U - period; /* the period may be the one after the newest */
    const uint32_t reach = USABLE - lesser(since, USABLE);
    const uint32_t before = lesser(lesser(config->before, reach), period - 1U); /* the first period has the number 1 */
    begin(capture, config, CAPTURE_TRIGGERED);
    capture->frozen = 1U;
    capture->next = period - before;
    capture->before = (uint16_t)before;
    capture->remaining = (uint16_t)(config->samples - config->before + before);
    capture->taken = capture->remaining;
    capture->trigger_period = period;
}

void capture_trigger(capture_t *capture, uint32_t period)
{
    if (capture->state == CAPTURE_ARMED) {
        capture->asked = true;
        capture->search = SEARCH_ANY;
        capture->asked_for = period;
    }
}

void capture_stop(capture_t *capture)
{
    capture->state = CAPTURE_IDLE;
    capture->recording = CAPTURE_RECORDS_NOT;
}

static FX_NOT_INLINED FX_COLD void begin_after(capture_t *capture)
{
    const capture_config_t *config = &capture->config;
    const uint32_t before = lesser(capture->filled, config->before);
    capture->state = CAPTURE_TRIGGERED;
    capture->before = (uint16_t)before;
    capture->remaining = (uint16_t)(config->samples - before);
    capture->taken = config->samples;
    capture->first = (uint16_t)(capture->at - before + ((capture->at < before) ? config->samples : 0U));
    capture->trigger_period = capture->next;
}

/* Samples that lie side by side in the ring and in the memory. */
static FX_NOT_INLINED void begin_run(capture_t *capture)
{
    const uint32_t slots = SAMPLE_SLOTS - 1U - capture->next % SAMPLE_SLOTS;
    capture->at = (uint16_t)((capture->at == capture->config.samples) ? 0U : capture->at);
    capture->run = (uint16_t)lesser(slots / capture->config.divisor + 1U,
                                    (uint32_t)capture->config.samples - capture->at);
    copy_move(capture);
}

static void take(capture_t *capture, int16_t *memory, const sample_t *next, uint32_t count)
{
    const capture_config_t *config = &capture->config;
    copy_samples(capture, memory, next, count);
    capture->next += count * config->divisor;
    capture->at = (uint16_t)(capture->at + count);
    capture->run = (uint16_t)(capture->run - count);
}

/* A tool may read the memory as soon as the state says so: what the hardware copies in this step is complete in the
 * next one. */
static FX_NOT_INLINED FX_COLD void end(capture_t *capture)
{
    if (copy_is_pending(capture)) {
        if (capture->recording == (uint8_t)CAPTURE_RECORDS) {
            capture->recording = CAPTURE_ENDS;
            capture->next -= capture->config.divisor; /* a period that has passed: the next step comes here, too */
        }
    } else {
        capture->recording = CAPTURE_RECORDS_NOT;
        capture->state = CAPTURE_DONE;
    }
}

static void count_triggered(capture_t *capture, uint32_t count)
{
    capture->remaining = (uint16_t)(capture->remaining - count);
    if (capture->remaining == 0U) {
        end(capture);
    }
}

static FX_NOT_INLINED void record(capture_t *capture, int16_t *memory, const sample_t *slot, uint32_t newest)
{
    const bool armed = capture->state == CAPTURE_ARMED;
    if (capture->run == 0U) {
        begin_run(capture);
    }
    const uint32_t readable = lesser((newest - capture->next) / capture->config.divisor + 1U, capture->run);
    const sample_t *next = &slot[capture->next % SAMPLE_SLOTS];
    const uint32_t count = armed ? trigger_search(capture, next, readable) : lesser(readable, capture->remaining);
    if (count > 0U) { /* else the trigger is the next sample */
        take(capture, memory, next, count);
    }
    if (!armed) {
        count_triggered(capture, count);
    } else if (count < readable) {
        begin_after(capture);
    }
}

/* The ring no longer contains the next period: the capture ends early, or the search begins again. */
static FX_NOT_INLINED FX_COLD void skip_lost_periods(capture_t *capture, uint32_t newest)
{
    capture->lost++;
    if (capture->state == CAPTURE_ARMED) {
        capture->filled = 0;
        trigger_reset(capture);
        capture->next = newest;
        capture->run = 0;
    } else {
        capture->taken = (uint16_t)(capture->taken - capture->remaining);
        end(capture);
    }
}

void capture_step(capture_t *capture, int16_t *memory, const sample_t *slot, uint32_t newest)
{
    copy_begin(capture);
    while ((int32_t)(newest - capture->next) >= 0) {
        if (capture->recording != (uint8_t)CAPTURE_RECORDS) {
            if (capture->recording == (uint8_t)CAPTURE_ENDS) {
                end(capture);
            }
            break;
        }
        if (newest - capture->next >= USABLE) {
            skip_lost_periods(capture, newest);
        } else {
            record(capture, memory, slot, newest);
        }
    }
    copy_end(capture);
}
