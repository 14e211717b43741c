/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/pulses.h"

#include "fx/div.h"

/* The pulses begin towards the bound that is further from zero: then the current enters a band that lies on one side of
 * zero at once. */
static int32_t first_sign(const pulses_axis_config_t *config)
{
    return (config->high >= -config->low) ? 1 : -1;
}

static void begin(const pulses_config_t *config, pulses_state_t *state, dq_q15_t i, uint32_t theta)
{
    *state = (pulses_state_t){
        .phase = PULSES_PULSE,
        .theta_start = theta,
        .d = {.i = i.d},
        .q = {.i = i.q},
        .number = config->number,
    };
}

/* i_next: current at the time when the voltage computed now begins to act; until then the previous one acts. */
static void predict(pulses_axis_t *axis, int32_t i)
{
    const int32_t slope = axis->sign_before * (i - axis->i);
    axis->growth = fx_max_s32(slope - axis->slope, 0);
    axis->slope = fx_max_s32(slope, 0);
    axis->i = i;
    axis->i_next = i + axis->sign * axis->slope;
    axis->sign_before = axis->sign;
}

/* One more period in this direction must not lead beyond the bound. */
static int32_t next_sign(const pulses_axis_t *axis, int32_t low, int32_t high)
{
    const int32_t change = axis->slope + axis->growth;
    if (axis->sign > 0 && axis->i_next + change >= high) {
        return -1;
    }
    return (axis->i_next - change <= low) ? 1 : axis->sign;
}

/* The first half wave ends at a share of the bound. */
static int32_t bound_q(const pulses_config_t *config, const pulses_state_t *state, int32_t bound)
{
    return (state->reversals == 0U) ? fx_mul_q15(config->first, bound) : bound;
}

/* The last half wave ends when the sum of i_q will be zero after the return to zero, as long as the rise. */
static bool ends_in_balance(const pulses_config_t *config, const pulses_state_t *state)
{
    const int32_t sign = state->q.sign;
    return state->reversals + 1U == config->reversals && state->reversals != 0U &&
           sign * (state->sum + state->half_wave) >= 0 && sign * state->half_wave > 0;
}

static void add_impulse(pulses_state_t *state)
{
    const int32_t i = state->q.i;
    const bool same_sign = (i ^ state->half_wave) >= 0;
    state->half_wave = same_sign ? state->half_wave + i : i;
    state->sum += i;
}

static int32_t next_sign_q(const pulses_config_t *config, const pulses_state_t *state)
{
    if (state->q.sign == 0) {
        return first_sign(&config->q);
    }
    if (ends_in_balance(config, state)) {
        return -state->q.sign;
    }
    return next_sign(&state->q, bound_q(config, state, config->q.low), bound_q(config, state, config->q.high));
}

static bool has_reversed(const pulses_axis_t *axis)
{
    return axis->sign * axis->sign_before < 0;
}

/* Signs for the next period; counts the reversals. */
static void reverse(const pulses_config_t *config, pulses_state_t *state)
{
    pulses_axis_t *d = &state->d;
    d->sign = (d->sign == 0) ? first_sign(&config->d) : next_sign(d, config->d.low, config->d.high);
    if (state->periods >= config->delay) {
        add_impulse(state);
        state->q.sign = next_sign_q(config, state);
    }
    if (has_reversed((config->q.v != 0) ? &state->q : d)) {
        state->reversals++;
    }
}

static bool is_too_large(const pulses_config_t *config, const pulses_state_t *state)
{
    return (uint32_t)(state->d.i * state->d.i) + (uint32_t)(state->q.i * state->q.i) > config->square_max;
}

static bool has_moved(const pulses_config_t *config, const pulses_state_t *state, uint32_t theta)
{
    const uint32_t moved = theta - state->theta_start;
    return moved > config->angle_max && 0U - moved > config->angle_max;
}

static bool is_at_end(const pulses_config_t *config, pulses_state_t *state, uint32_t theta)
{
    if (is_too_large(config, state)) {
        state->failure = PULSES_CURRENT;
    } else if (has_moved(config, state, theta)) {
        state->failure = PULSES_MOVED;
    } else if (state->periods >= config->periods_max) {
        state->failure = PULSES_TIME;
    } else {
        return state->reversals >= config->reversals;
    }
    return true;
}

static int32_t towards_zero(int32_t i)
{
    return (i > 0) ? -1 : 1;
}

static dq_q15_t pulse(const pulses_config_t *config, pulses_state_t *state, uint32_t theta)
{
    reverse(config, state);
    if (is_at_end(config, state, theta)) {
        state->phase = PULSES_BACK;
        state->d.sign = towards_zero(state->d.i_next);
        state->q.sign = towards_zero(state->q.i_next);
    }
    state->periods++;
    return (dq_q15_t){state->d.sign * config->d.v, state->q.sign * config->q.v};
}

/* One axis on its way to zero: in the last period the voltage is reduced so that the current ends at zero. */
static int32_t axis_to_zero(pulses_axis_t *axis, int32_t v)
{
    if (axis->sign * axis->i_next >= 0) {
        axis->sign = 0;
        return 0;
    }
    const int32_t left = fx_abs_q31(axis->i_next);
    const int32_t voltage = axis->sign * v;
    if (left >= axis->slope) {
        return voltage;
    }
    axis->sign = 0;
    return fx_mul_q31(fx_div_q31(left, axis->slope), voltage);
}

static dq_q15_t return_to_zero(const pulses_config_t *config, pulses_state_t *state)
{
    const dq_q15_t v = {axis_to_zero(&state->d, config->d.v), axis_to_zero(&state->q, config->q.v)};
    if (v.d == 0 && v.q == 0) {
        state->phase = (state->failure == PULSES_GOOD) ? PULSES_DONE : PULSES_FAILED;
    }
    return v;
}

dq_q15_t pulses_step(const pulses_config_t *config, pulses_state_t *state, dq_q15_t i, uint32_t theta)
{
    if (state->number != config->number) {
        begin(config, state, i, theta);
    }
    predict(&state->d, i.d);
    predict(&state->q, i.q);
    if (state->phase == PULSES_PULSE) {
        return pulse(config, state, theta);
    }
    return (state->phase == PULSES_BACK) ? return_to_zero(config, state) : (dq_q15_t){0, 0};
}

current_control_out_t pulses_voltage(dq_q15_t v, q31_t ratio, int32_t v_dc)
{
    return (current_control_out_t){
        .u = {fx_mulhi(ratio, v.d * v_dc) >> 14, fx_mulhi(ratio, v.q * v_dc) >> 14}, /* Q31 * Q30 = Q29 */
        .v = fx_pair(v.d, v.q),
    };
}
