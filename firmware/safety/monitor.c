/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/monitor.h"

#include "fx/q.h"
#include "signal/debounce.h"

enum { OVER_VOLTAGE_SAMPLES = 2, UNDER_VOLTAGE_SAMPLES = 10, CURRENT_SUM_SAMPLES = 5 };
/* Added to the angle's count for an implausible sample: a disturbance may last 5 ms, single samples be rare (MN-21). */
enum { ANGLE_JUMP = 4, ANGLE_FIRST_JUMP = 40 };
/* The link's voltage rises by less than this part of v_max in a period (MN-50). */
enum { LINK_RISE_PART = 6 };

/* |x| > limit by one unsigned comparison. */
static bool exceeds(int32_t x, int32_t limit)
{
    return (uint32_t)(x + limit) > 2U * (uint32_t)limit;
}

static uint32_t count_angle_jumps(const monitor_config_t *config, monitor_state_t *state, bool jumped)
{
    const bool first = (state->pending & MONITOR_ANGLE_LOST) == 0U;
    const int32_t change = jumped ? (first ? ANGLE_FIRST_JUMP : ANGLE_JUMP) : -1;
    state->angle = (uint16_t)fx_clamp_q31(state->angle + change, 0, config->angle_count_max);
    return (state->angle >= config->angle_count_max) ? FAULT_ANGLE : 0U;
}

static uint8_t pending(const monitor_state_t *state, bool jumped)
{
    const bool counting = (state->over_voltage | state->under_voltage | state->current_sum | state->angle) != 0U;
    return (uint8_t)((counting ? MONITOR_COUNTING : 0) | (jumped ? MONITOR_ANGLE_LOST : 0));
}

uint32_t monitor_step(const monitor_config_t *config, monitor_state_t *state, const monitor_in_t *in)
{
    const abc_q15_t i = in->i;
    const int32_t trip = config->i_trip;
    const bool over_current = exceeds(i.a, trip) || exceeds(i.b, trip) || exceeds(i.c, trip);
    const bool over_voltage = in->v_dc > config->v_max;
    const bool under_voltage = in->v_dc < config->v_min;
    const bool unbalanced = exceeds(i.a + i.b + i.c, config->sum_max);
    if (!(over_current || over_voltage || under_voltage || unbalanced || state->pending != 0U)) {
        return 0;
    }
    uint32_t faults = over_current ? FAULT_OVER_CURRENT : 0;
    const bool jumped = (state->pending & MONITOR_ANGLE_JUMP) != 0U;
    faults |= debounce_step(&state->over_voltage, over_voltage, OVER_VOLTAGE_SAMPLES, FAULT_OVER_VOLTAGE);
    faults |= debounce_step(&state->under_voltage, under_voltage, UNDER_VOLTAGE_SAMPLES, FAULT_UNDER_VOLTAGE);
    faults |= debounce_step(&state->current_sum, unbalanced, CURRENT_SUM_SAMPLES, FAULT_CURRENT_SUM);
    faults |= count_angle_jumps(config, state, jumped);
    state->pending = pending(state, jumped);
    return faults;
}

bool monitor_is_over_voltage_expected(const monitor_config_t *config, int32_t v_dc, int32_t last, int32_t before)
{
    return v_dc > config->v_max && 2 * last - before > config->v_max;
}

bool monitor_is_rise_of_sensor(const monitor_config_t *config, int32_t last, int32_t before)
{
    return before >= config->v_min && LINK_RISE_PART * (last - before) > config->v_max;
}
