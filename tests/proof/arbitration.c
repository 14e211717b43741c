/* SPDX-License-Identifier: Apache-2.0 */
/* The requested torque within the vehicle's limits: ecu/arbitration. */
#include "proof.h"

#include "ecu/arbitration.c"
#include "fx/format.c"

#define RATE_MAX (1 << 29) /* as the header of the file under proof says */

static arbitrate_config_t any_config(void)
{
    arbitrate_config_t c;
    ASSUME(WITHIN(c.slew, 1, RATE_MAX - 1) && WITHIN(c.jerk, 1, c.slew) && WITHIN(c.ramp_out, 1, RATE_MAX - 1));
    ASSUME(c.dead_band >= 0);
    return c;
}

static arbitrate_in_t any_request(void)
{
    arbitrate_in_t in;
    in.run = nondet_bool();
    in.stop = nondet_bool();
    in.ramp_out = nondet_bool();
    ASSUME(in.limit_drive >= 0 && in.limit_regen >= 0);
    return in;
}

void proof_arbitration_target_is_inside_the_limit(void)
{
    const arbitrate_config_t c = any_config();
    const arbitrate_in_t in = any_request();
    const int64_t target = torque_target(&c, &in);
    const bool braking = arbitrate_is_braking(&c, in.omega, in.torque_requested < 0);
    PROVE(magnitude(target) <= (int64_t)(braking ? in.limit_regen : in.limit_drive) * 65536);
    PROVE(magnitude(target) <= magnitude(in.torque_requested) * 65536);
    PROVE(!in.stop || target == 0);
    PROVE(magnitude(in.torque_requested) > c.dead_band || target == 0);
}

void proof_arbitration_rate(void)
{
    const arbitrate_config_t c = any_config();
    q31_t rate;
    int64_t distance;
    ASSUME(WITHIN(rate, 0, c.slew) && WITHIN(distance, 0, INT64_C(1) << 32));
    const q31_t next = next_rate(&c, rate, distance);
    PROVE(WITHIN(next, 1, c.slew));
    PROVE((int64_t)next - rate <= c.jerk);
}

void proof_arbitration_ramps_out(void)
{
    const arbitrate_config_t c = any_config();
    arbitrate_state_t state;
    const int64_t before = state.torque_arbitrated;
    ramp_out(&c, &state);
    const int64_t now = state.torque_arbitrated;
    const int64_t left = magnitude(before) - c.ramp_out;
    PROVE(magnitude(now) == ((left > 0) ? left : 0));
    PROVE(now == 0 || (now < 0) == (before < 0));
}

void proof_arbitration_is_held_at_the_limit(void)
{
    const arbitrate_config_t c = any_config();
    arbitrate_state_t state;
    q15_t limited;
    const int64_t before = state.torque_arbitrated;
    arbitrate_hold(&c, &state, limited);
    PROVE(magnitude(state.torque_arbitrated) <= magnitude(limited) * 65536 + c.jerk + 1);
    PROVE(magnitude(state.torque_arbitrated) <= magnitude(before));
}

void proof_no_torque_unless_running(void)
{
    const arbitrate_config_t c = any_config();
    const arbitrate_in_t in = any_request();
    arbitrate_state_t state;
    ASSUME(magnitude(state.rate) <= c.slew);
    const int64_t before = state.torque_arbitrated;
    const q15_t torque = arbitrate_step(&c, &state, &in);
    PROVE(in.run || (torque == 0 && state.torque_arbitrated == 0 && state.rate == 0));
    PROVE(!in.run || !(in.ramp_out || in.stop) || magnitude(state.torque_arbitrated) <= magnitude(before));
}
