/* SPDX-License-Identifier: Apache-2.0 */
#include "ecu/arbitration.h"

#define Q31_PER_Q15 65536

bool arbitrate_is_braking(const arbitrate_config_t *config, q31_t omega, bool torque_is_negative)
{
    return fx_abs_q31(omega) > config->omega_standstill && (omega < 0) != torque_is_negative;
}

static q31_t torque_target(const arbitrate_config_t *config, const arbitrate_in_t *in)
{
    const q15_t limit = arbitrate_is_braking(config, in->omega, in->torque_requested < 0) ? in->limit_regen
                                                                                          : in->limit_drive;
    if (in->stop || fx_abs_q15(in->torque_requested) <= config->dead_band) {
        return 0;
    }
    return fx_clamp_q15(in->torque_requested, fx_neg_q15(limit), limit) * Q31_PER_Q15;
}

/* Whether a step with this rate, and braking by jerk from then on, ends before the target. The distance is
 * r + (r - j) + (r - 2 j) ... = r (r + j)/(2 j). */
static bool stops_in_time(q31_t rate, q31_t jerk, int64_t distance)
{
    return (int64_t)rate * ((int64_t)rate + jerk) <= 2 * (int64_t)jerk * distance;
}

/* The rate's magnitude for this step, from the one before. */
static q31_t next_rate(const arbitrate_config_t *config, q31_t rate, int64_t distance)
{
    const q31_t increased = (config->slew - rate > config->jerk) ? rate + config->jerk : config->slew;
    if (stops_in_time(increased, config->jerk, distance)) {
        return increased;
    }
    const q31_t kept = stops_in_time(rate, config->jerk, distance) ? rate : rate - config->jerk;
    return (kept > config->jerk) ? kept : config->jerk; /* a smaller rate might never reach the target */
}

static void ramp_to(const arbitrate_config_t *config, arbitrate_state_t *state, q31_t target)
{
    const int64_t error = (int64_t)target - state->torque_arbitrated;
    const int64_t distance = (error < 0) ? -error : error;
    const bool wrong_direction = (state->rate < 0) != (error < 0);
    const q31_t rate = next_rate(config, wrong_direction ? 0 : fx_abs_q31(state->rate), distance);
    if (rate >= distance) {
        *state = (arbitrate_state_t){.torque_arbitrated = target};
        return;
    }
    state->rate = (error < 0) ? -rate : rate;
    state->torque_arbitrated = fx_add_q31(state->torque_arbitrated, state->rate);
}

/* Without the arithmetic of 64 bits in most steps. */
static void approach(const arbitrate_config_t *config, arbitrate_state_t *state, q31_t target)
{
    if (target == state->torque_arbitrated) {
        state->rate = 0;
    } else {
        ramp_to(config, state, target);
    }
}

static void ramp_out(const arbitrate_config_t *config, arbitrate_state_t *state)
{
    const q31_t max = config->ramp_out;
    const q31_t now = state->torque_arbitrated;
    state->torque_arbitrated = fx_sub_q31(now, fx_clamp_q31(now, -max, max));
    state->rate = 0;
}

void arbitrate_hold(const arbitrate_config_t *config, arbitrate_state_t *state, q15_t torque_limited)
{
    const q31_t max = fx_add_q31(fx_abs_q15(torque_limited) * Q31_PER_Q15, config->jerk);
    if (fx_abs_q31(state->torque_arbitrated) > max) {
        const bool outwards = (state->rate < 0) == (state->torque_arbitrated < 0);
        /* A rate towards zero follows a smaller request: a change of the limit does not reset it. */
        *state = (arbitrate_state_t){.torque_arbitrated = fx_clamp_q31(state->torque_arbitrated, -max, max),
                                     .rate = outwards ? 0 : state->rate};
    }
}

q15_t arbitrate_step(const arbitrate_config_t *config, arbitrate_state_t *state, const arbitrate_in_t *in)
{
    if (!in->run) {
        *state = (arbitrate_state_t){0};
    } else if (in->ramp_out) {
        ramp_out(config, state);
    } else {
        approach(config, state, torque_target(config, in));
    }
    return fx_q15_from_q31(state->torque_arbitrated);
}
