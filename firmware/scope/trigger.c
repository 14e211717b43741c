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

void trigger_reset(capture_t *capture)
{
    const capture_config_t *config = &capture->config;
    const bool downwards = config->trigger == TRIGGER_FALLING || config->trigger == TRIGGER_BELOW;
    capture->trigger_sign = downwards ? -1 : 1;
    capture->trigger_offset = downwards ? config->level : -config->level;
    capture->ready = !is_edge(capture);
    capture->search = SEARCH_ANY;
}

static condition_t condition(const capture_t *capture, column_t values)
{
    return (condition_t){values, capture->trigger_sign, capture->trigger_offset};
}

/* x < 0 is the same as -x - 1 >= 0. */
static condition_t negated(const condition_t *condition)
{
    return (condition_t){condition->values, -condition->sign, -condition->offset - 1};
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

/* The same in the samples of successive periods, from the first. The conjunction of several differences is negative if
 * all are: they are searched with one branch. */
static inline FX_INLINED_IF_OPTIMISED uint32_t count_until_in_periods(const condition_t *condition, uint32_t count)
{
    const uint8_t *value = condition->values.from;
    uint32_t left = count;
    for (; left >= SEARCHED_AT_ONCE; left -= SEARCHED_AT_ONCE) {
        int32_t signs = beyond(condition, value);
        FX_UNROLLED
        for (uint32_t j = 1; j < SEARCHED_AT_ONCE; j++) {
            signs &= beyond(condition, &value[j * sizeof(sample_t)]);
        }
        if (signs >= 0) {
            break;
        }
        value = &value[SEARCHED_AT_ONCE * sizeof(sample_t)];
    }
    while (left > 0U && beyond(condition, value) < 0) {
        value = &value[sizeof(sample_t)];
        left--;
    }
    return count - left;
}

/* Passes over the samples that must lie before the trigger; the last one counts, because an edge may follow it. */
static uint32_t pass_over(capture_t *capture, const condition_t *reached, uint32_t count)
{
    const capture_config_t *config = &capture->config;
    const uint32_t over = lesser(count, (uint32_t)config->before - lesser(capture->filled, config->before));
    if (over > 0U && is_edge(capture)) {
        capture->ready = count_until(reached, over - 1U, over) == over;
    }
    return over;
}

static uint32_t search(capture_t *capture, const condition_t *reached, uint32_t from, uint32_t count)
{
    uint32_t k = from;
    if (!capture->ready) {
        const condition_t below = negated(reached);
        k = count_until(&below, from, count);
        capture->ready = k < count;
    }
    return count_until(reached, k, count);
}

/* Number of samples from the next one until the trigger that a command or a fault has requested. */
static uint32_t until_asked(const capture_t *capture)
{
    const uint32_t divisor = capture->config.divisor;
    const int32_t periods = (int32_t)(capture->asked_for - capture->next);
    return (periods <= 0) ? 0U : ((uint32_t)periods + divisor - 1U) / divisor;
}

static uint32_t until_trigger(capture_t *capture, const condition_t *reached, uint32_t count)
{
    const uint32_t over = pass_over(capture, reached, count);
    const uint32_t until = (capture->config.trigger >= TRIGGER_RISING) ? search(capture, reached, over, count) : count;
    return capture->asked ? lesser(until, until_asked(capture)) : until;
}

/* Whether from now on only a level in the samples is waited for. */
static capture_search_t search_of(const capture_t *capture)
{
    const capture_config_t *config = &capture->config;
    if (!capture->ready || capture->asked || capture->filled < config->before || config->trigger < TRIGGER_RISING ||
        capture->trigger_place >= sizeof(sample_t)) {
        return SEARCH_ANY;
    }
    return (config->divisor == 1U) ? SEARCH_PERIODS : SEARCH_LEVEL;
}

/* Not inlined: the search for a level needs fewer registers. */
static FX_NOT_INLINED uint32_t search_any(capture_t *capture, const sample_t *next, uint32_t count)
{
    const condition_t reached = condition(capture, column_of_trigger(capture, next));
    const uint32_t until = until_trigger(capture, &reached, count);
    capture->filled = (uint16_t)lesser(capture->filled + until, capture->config.samples);
    capture->search = (uint8_t)search_of(capture);
    return until;
}

static FX_NOT_INLINED uint32_t search_level(const capture_t *capture, const sample_t *next, uint32_t count)
{
    const condition_t reached = condition(capture, column_of_trigger(capture, next));
    return count_until(&reached, 0, count);
}

uint32_t trigger_search(capture_t *capture, const sample_t *next, uint32_t count)
{
    if (capture->search == (uint8_t)SEARCH_PERIODS) {
        const column_t values = {(const uint8_t *)next + capture->trigger_place, sizeof(sample_t)};
        const condition_t reached = condition(capture, values);
        return count_until_in_periods(&reached, count);
    }
    return (capture->search == (uint8_t)SEARCH_LEVEL) ? search_level(capture, next, count)
                                                      : search_any(capture, next, count);
}
