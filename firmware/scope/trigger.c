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
}

static condition_t condition(const capture_t *capture, const capture_source_t *source)
{
    return (condition_t){column_of_trigger(capture, source), capture->trigger_sign, capture->trigger_offset};
}

/* x < 0 is the same as -x - 1 >= 0. */
static condition_t negated(condition_t condition)
{
    return (condition_t){condition.values, -condition.sign, -condition.offset - 1};
}

/* Negative: the value does not reach the condition. */
static inline int32_t beyond(const condition_t *condition, const uint8_t *value)
{
    return condition->sign * value_at(value) + condition->offset;
}

/* The samples before the first that reaches the condition. The conjunction of several differences is negative if all
 * are: they are searched with one branch. */
static uint32_t count_until(const condition_t *condition, uint32_t from, uint32_t count)
{
    const size_t stride = condition->values.stride;
    const uint8_t *value = &condition->values.from[from * stride];
    uint32_t k = from;
    while (k + SEARCHED_AT_ONCE <= count) {
        int32_t signs = beyond(condition, value);
        FX_UNROLLED
        for (uint32_t j = 1; j < SEARCHED_AT_ONCE; j++) {
            signs &= beyond(condition, &value[j * stride]);
        }
        if (signs >= 0) {
            break;
        }
        value = &value[SEARCHED_AT_ONCE * stride];
        k += SEARCHED_AT_ONCE;
    }
    while (k < count && beyond(condition, value) < 0) {
        value = &value[stride];
        k++;
    }
    return k;
}

static uint32_t search(capture_t *capture, const capture_source_t *source, uint32_t count)
{
    const condition_t reached = condition(capture, source);
    uint32_t from = 0;
    if (!capture->ready) {
        const condition_t below = negated(reached);
        from = count_until(&below, 0, count);
        capture->ready = from < count;
    }
    return count_until(&reached, from, count);
}

/* Passes over samples without searching them; the last one is kept, because an edge may follow it. */
static void skip(capture_t *capture, const capture_source_t *source, uint32_t count)
{
    if (is_edge(capture)) {
        const condition_t reached = condition(capture, source);
        capture->ready = count_until(&reached, count - 1U, count) == count;
    }
}

/* Number of samples from the next one until the trigger that a command or a fault has requested. */
static uint32_t until_asked(const capture_t *capture)
{
    const uint32_t divisor = capture->config.divisor;
    const int32_t periods = (int32_t)(capture->asked_for - capture->next);
    return (periods <= 0) ? 0U : ((uint32_t)periods + divisor - 1U) / divisor;
}

uint32_t trigger_search(capture_t *capture, const capture_source_t *source, uint32_t count, bool *found)
{
    const capture_config_t *config = &capture->config;
    uint32_t until = count;
    *found = false;
    if (capture->filled < config->before) {
        until = lesser(count, (uint32_t)config->before - capture->filled);
        skip(capture, source, until);
    } else if (config->trigger >= TRIGGER_RISING) {
        until = search(capture, source, count);
        *found = until < count;
    }
    const uint32_t asked = capture->asked ? until_asked(capture) : count;
    if (asked < count && asked <= until) {
        until = asked;
        *found = true;
    }
    return until;
}
