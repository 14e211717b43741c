/* SPDX-License-Identifier: Apache-2.0 */
/* The monitors of every period, safety/monitor, for all motor data that motor_check() accepts. */
#include "proof.h"

#include "drive/motor.c"
#include "safety/monitor.c"

/* The harnesses below assume this of the data; the first one shows that motor_check() guarantees it. */
static bool is_guaranteed(const monitor_config_t *c)
{
    return WITHIN(c->i_trip, 1, Q15(0.8) - 1) && c->v_min < c->v_max &&
           WITHIN(c->zero_sequence_max, 1, c->sum_max / 3) && WITHIN(c->sum_max, 3, 3 * Q15_MAX);
}

static monitor_config_t accepted_config(void)
{
    monitor_config_t c;
    ASSUME(is_guaranteed(&c));
    return c;
}

static monitor_in_t any_sample(void)
{
    monitor_in_t in;
    ASSUME(IS_Q15(in.i.a) && IS_Q15(in.i.b) && IS_Q15(in.i.c) && IS_MAGNITUDE(in.v_dc));
    return in;
}

/* Whether a condition that holds in every sample is reported in the one that completes its count, and otherwise not. */
static bool is_counted(bool reported, bool condition, uint8_t count_before, unsigned samples)
{
    return reported == (condition && count_before + 1U >= samples);
}

void proof_monitor_data_are_checked(void)
{
    motor_t m;
    ASSUME(monitors_check(&m) == MOTOR_CHECK_OK);
    PROVE(is_guaranteed(&m.monitor));
}

void proof_over_current(void)
{
    const monitor_config_t c = accepted_config();
    const monitor_in_t in = any_sample();
    monitor_state_t state;
    const uint32_t faults = monitor_step(&c, &state, &in);
    const bool beyond = magnitude(in.i.a) > c.i_trip || magnitude(in.i.b) > c.i_trip || magnitude(in.i.c) > c.i_trip;
    PROVE(((faults & FAULT_OVER_CURRENT) != 0U) == beyond);
}

void proof_over_voltage(void)
{
    const monitor_config_t c = accepted_config();
    const monitor_in_t in = any_sample();
    monitor_state_t state;
    const uint8_t before = state.over_voltage;
    const uint32_t faults = monitor_step(&c, &state, &in);
    PROVE(is_counted((faults & FAULT_OVER_VOLTAGE) != 0U, in.v_dc > c.v_max, before, 2));
    PROVE(in.v_dc <= c.v_max || state.pending != 0U);
}

void proof_under_voltage(void)
{
    const monitor_config_t c = accepted_config();
    const monitor_in_t in = any_sample();
    monitor_state_t state;
    const uint8_t before = state.under_voltage;
    const uint32_t faults = monitor_step(&c, &state, &in);
    PROVE(is_counted((faults & FAULT_UNDER_VOLTAGE) != 0U, in.v_dc < c.v_min, before, 10));
    PROVE(in.v_dc >= c.v_min || state.pending != 0U);
}

void proof_current_sum(void)
{
    const monitor_config_t c = accepted_config();
    const monitor_in_t in = any_sample();
    monitor_state_t state;
    const uint8_t before = state.current_sum;
    const uint32_t faults = monitor_step(&c, &state, &in);
    const bool unbalanced = magnitude((int64_t)in.i.a + in.i.b + in.i.c) > c.sum_max;
    PROVE(is_counted((faults & FAULT_CURRENT_SUM) != 0U, unbalanced, before, 5));
}

void proof_normal_sample_is_reported_by_none(void)
{
    const monitor_config_t c = accepted_config();
    const monitor_in_t in = any_sample();
    monitor_state_t state = {0};
    const bool normal = magnitude(in.i.a) <= c.i_trip && magnitude(in.i.b) <= c.i_trip &&
                        magnitude(in.i.c) <= c.i_trip && magnitude((int64_t)in.i.a + in.i.b + in.i.c) <= c.sum_max &&
                        in.v_dc >= c.v_min && in.v_dc <= c.v_max;
    PROVE(!normal || monitor_step(&c, &state, &in) == 0U);
}
