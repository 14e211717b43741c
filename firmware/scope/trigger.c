/* SPDX-License-Identifier: Apache-2.0 */
#include "scope/trigger.h"

#define SEARCHED_AT_ONCE 5U /* half of a step at 10 kHz */

/* Reached where sign * value + offset >= 0. */
typedef struct {
    column_t values;
    int32_t sign, offset;
} condition_t;

static bool is_edge(const capture_t *capture)
{
    return capture->config.trigger == TRIGGER_RISING || capture->config.trigger == TRIGGER_FALLING;
}

/* Before an edge, the other side of the level is waited for first: x < 0 is the same as -x - 1 >= 0. */
static void set_ready(capture_t *capture, bool ready)
{
    if (ready != capture->ready) {
        capture->ready = ready;
        capture->awaited_sign = (int8_t)-capture->awaited_sign;
        capture->awaited_offset = -capture->awaited_offset - 1;
    }
}

void trigger_reset(capture_t *capture)
{
    const capture_config_t *config = &capture->config;
    const bool downwards = config->trigger == TRIGGER_FALLING || config->trigger == TRIGGER_BELOW;
    capture->awaited_sign = downwards ? -1 : 1;
    capture->awaited_offset = downwards ? config->level : -config->level;
    capture->ready = true;
    set_ready(capture, !is_edge(capture));
    capture->search = SEARCH_ANY;
}

static inline condition_t awaited(const capture_t *capture, column_t values)
{
    return (condition_t){values, capture->awaited_sign, capture->awaited_offset};
}

/* Negative: the value does not reach the condition. */
static inline int32_t beyond(const condition_t *condition, const uint8_t *value)
{
    return condition->sign * value_at(value) + condition->offset;
}

/* The samples before the first that reaches the condition. */
static FX_NOT_INLINED uint32_t count_until(const condition_t *condition, uint32_t from, uint32_t count)
{
    const size_t stride = condition->values.stride;
    const uint8_t *value = &condition->values.from[from * stride];
    uint32_t k = from;
    while (k < count && beyond(condition, value) < 0) {
        value = &value[stride];
        k++;
    }
    return k;
}

/* Passes over the samples that must lie before the trigger; the last one counts, because an edge may follow it. */
static uint32_t pass_over(capture_t *capture, column_t values, uint32_t count)
{
    const capture_config_t *config = &capture->config;
    const uint32_t over = lesser(count, (uint32_t)config->before - lesser(capture->filled, config->before));
    if (over > 0U && is_edge(capture)) {
        set_ready(capture, false);
        const condition_t other_side = awaited(capture, values);
        set_ready(capture, count_until(&other_side, over - 1U, over) < over);
    }
    return over;
}

static uint32_t search(capture_t *capture, column_t values, uint32_t from, uint32_t count)
{
    uint32_t k = from;
    if (!capture->ready) {
        const condition_t other_side = awaited(capture, values);
        k = count_until(&other_side, from, count);
        set_ready(capture, k < count);
    }
    const condition_t reached = awaited(capture, values);
    return count_until(&reached, k, count);
}

/* Number of samples from the next one until the trigger that a command or a fault has requested. */
static uint32_t until_asked(const capture_t *capture)
{
    const uint32_t divisor = capture->config.divisor;
    const int32_t periods = (int32_t)(capture->asked_for - capture->next);
    return (periods <= 0) ? 0U : ((uint32_t)periods + divisor - 1U) / divisor;
}

static uint32_t until_trigger(capture_t *capture, column_t values, uint32_t count)
{
    const uint32_t over = pass_over(capture, values, count);
    const uint32_t until = (capture->config.trigger >= TRIGGER_RISING) ? search(capture, values, over, count) : count;
    return capture->asked ? lesser(until, until_asked(capture)) : until;
}

/* What is waited for from now on, if nothing else can end the search. */
static capture_search_t search_of(const capture_t *capture)
{
    const capture_config_t *config = &capture->config;
    if (capture->asked) {
        return SEARCH_ANY;
    }
    if (capture->filled < config->before) {
        return SEARCH_LATER;
    }
    if (config->trigger < TRIGGER_RISING) {
        return SEARCH_NOT;
    }
    if (is_of_step(capture->trigger_place)) {
        return SEARCH_STEP;
    }
    return (config->divisor == 1U) ? SEARCH_PERIODS : SEARCH_SAMPLES;
}

/* Not inlined: the other searches need fewer registers. */
static FX_NOT_INLINED uint32_t search_any(capture_t *capture, const sample_t *next, uint32_t count)
{
    const uint32_t until = until_trigger(capture, column_of_trigger(capture, next), count);
    capture->filled = (uint16_t)lesser(capture->filled + until, capture->config.samples);
    capture->search = (uint8_t)search_of(capture);
    return until;
}

/* If a search has ended before the sample `found`, there is the trigger, or only the other side of an edge's level. */
static uint32_t search_on(capture_t *capture, const sample_t *next, uint32_t found, uint32_t count)
{
    return (found == count || capture->ready) ? found : search_any(capture, next, count);
}

static uint32_t search_samples(capture_t *capture, const sample_t *next, uint32_t count)
{
    const condition_t condition = awaited(capture, column_of_trigger(capture, next));
    return search_on(capture, next, count_until(&condition, 0, count), count);
}

/* A value of the step is the same in all of its periods. */
static inline uint32_t search_step(capture_t *capture, const sample_t *next, uint32_t count)
{
    const condition_t condition = awaited(capture, column_of_step(capture, capture->trigger_place));
    return (beyond(&condition, condition.values.from) < 0) ? count : search_on(capture, next, 0, count);
}

/* All of these samples lie before the trigger, and the last one that must do so is not among them. */
static inline uint32_t search_later(capture_t *capture, const sample_t *next, uint32_t count)
{
    const uint32_t filled = capture->filled + count;
    if (filled >= capture->config.before) {
        return search_any(capture, next, count);
    }
    capture->filled = (uint16_t)filled;
    return count;
}

/* In the samples of successive periods. The conjunction of several differences is negative if all are: they are
 * searched with one branch. */
static inline FX_INLINED_IF_OPTIMISED uint32_t search_periods(capture_t *capture, const sample_t *next, uint32_t count)
{
    const column_t values = {(const uint8_t *)next + capture->trigger_place, sizeof(sample_t)};
    const condition_t condition = awaited(capture, values);
    const uint8_t *value = values.from;
    uint32_t left = count;
    for (; left >= SEARCHED_AT_ONCE; left -= SEARCHED_AT_ONCE) {
        int32_t signs = beyond(&condition, value);
        FX_UNROLLED
        for (uint32_t j = 1; j < SEARCHED_AT_ONCE; j++) {
            signs &= beyond(&condition, &value[j * sizeof(sample_t)]);
        }
        if (signs >= 0) {
            break;
        }
        value = &value[SEARCHED_AT_ONCE * sizeof(sample_t)];
    }
    while (left > 0U) {
        if (beyond(&condition, value) >= 0) {
            return search_on(capture, next, count - left, count);
        }
        value = &value[sizeof(sample_t)];
        left--;
    }
    return count;
}

/* Not inlined: the search in the samples of every period needs fewer registers without it. */
static FX_NOT_INLINED uint32_t search_otherwise(capture_t *capture, const sample_t *next, uint32_t count)
{
    if (capture->search >= (uint8_t)SEARCH_LATER) {
        return (capture->search == (uint8_t)SEARCH_LATER) ? search_later(capture, next, count) : count;
    }
    if (capture->search == (uint8_t)SEARCH_STEP) {
        return search_step(capture, next, count);
    }
    return (capture->search == (uint8_t)SEARCH_SAMPLES) ? search_samples(capture, next, count)
                                                        : search_any(capture, next, count);
}

uint32_t trigger_search(capture_t *capture, const sample_t *next, uint32_t count)
{
    return (capture->search == (uint8_t)SEARCH_PERIODS) ? search_periods(capture, next, count)
                                                        : search_otherwise(capture, next, count);
}
