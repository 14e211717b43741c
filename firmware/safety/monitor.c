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

uint32_t monitor_step(const monitor_config_t *config, monitor_state_t *state, const monitor_in_t *in)
{
    const abc_t i = in->i;
    const int32_t highest = fx_max_s32(fx_abs_q15(i.a), fx_max_s32(fx_abs_q15(i.b), fx_abs_q15(i.c)));
    const int32_t sum = fx_abs_q31(i.a + i.b + i.c);

    uint32_t faults = (highest > config->i_trip) ? FAULT_OVER_CURRENT : 0;
    faults |= confirm(&state->over_voltage, in->v_dc > config->v_max, OVER_VOLTAGE_SAMPLES, FAULT_OVER_VOLTAGE);
    faults |= confirm(&state->under_voltage, in->v_dc < config->v_min, UNDER_VOLTAGE_SAMPLES, FAULT_UNDER_VOLTAGE);
    faults |= confirm(&state->current_sum, sum > config->sum_max, CURRENT_SUM_SAMPLES, FAULT_CURRENT_SUM);
    faults |= confirm(&state->angle, in->angle_jumped, ANGLE_SAMPLES, FAULT_ANGLE);
    return faults;
}
