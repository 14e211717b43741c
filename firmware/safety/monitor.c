/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/monitor.h"

#include "fx/q.h"

enum { OVER_VOLTAGE_SAMPLES = 2, UNDER_VOLTAGE_SAMPLES = 10, CURRENT_SUM_SAMPLES = 5, ANGLE_SAMPLES = 3 };

/* Counts consecutive bad samples; confirmed from the limit on. */
static uint32_t confirm(uint8_t *count, bool bad, uint8_t limit, uint32_t fault)
{
    *count = bad ? (uint8_t)fx_min_s32(*count + 1, limit) : 0;
    return (*count >= limit) ? fault : 0;
}

/* |x| > limit without taking the absolute value. */
static bool beyond(int32_t x, int32_t limit)
{
    return (uint32_t)(x + limit) > 2U * (uint32_t)limit;
}

uint32_t monitor_step(const monitor_config_t *config, monitor_state_t *state, const monitor_in_t *in)
{
    const abc_t i = in->i;
    const int32_t trip = config->i_trip;
    const bool over_current = beyond(i.a, trip) || beyond(i.b, trip) || beyond(i.c, trip);
    const bool over_voltage = in->v_dc > config->v_max;
    const bool under_voltage = in->v_dc < config->v_min;
    const bool unbalanced = beyond(i.a + i.b + i.c, config->sum_max);
    if (!(over_current || over_voltage || under_voltage || unbalanced || state->attention != 0U)) {
        return 0;
    }
    uint32_t faults = over_current ? FAULT_OVER_CURRENT : 0;
    faults |= confirm(&state->over_voltage, over_voltage, OVER_VOLTAGE_SAMPLES, FAULT_OVER_VOLTAGE);
    faults |= confirm(&state->under_voltage, under_voltage, UNDER_VOLTAGE_SAMPLES, FAULT_UNDER_VOLTAGE);
    faults |= confirm(&state->current_sum, unbalanced, CURRENT_SUM_SAMPLES, FAULT_CURRENT_SUM);
    faults |= confirm(&state->angle, (state->attention & MONITOR_JUMPED) != 0U, ANGLE_SAMPLES, FAULT_ANGLE);
    const bool counts = (state->over_voltage | state->under_voltage | state->current_sum | state->angle) != 0;
    state->attention = counts ? MONITOR_COUNTS : 0;
    return faults;
}
