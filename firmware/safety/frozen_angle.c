/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/frozen_angle.h"

#include "fx/q.h"
#include "fx/vec.h"
#include "signal/debounce.h"
#include "signal/mean.h"
#include "types/faults.h"

#define STANDING_ANGLE (1U << 24) /* 1/256 of a turn, 1.4 degrees */
#define UNCERTAIN 8 /* times v_0: the voltage of a leg without current is uncertain by +- the whole dead time */
#define MOVING_STEPS 4 /* after a change: the mean is the present value, without the voltage of the transient */
#define MEAN_SHIFT 2
#define FIRST_SHIFT 10

static bool has_moved(const frozen_angle_config_t *config, const frozen_angle_state_t *state,
                      const frozen_angle_in_t *in)
{
    return in->theta_e - state->theta_e + STANDING_ANGLE > 2U * STANDING_ANGLE ||
           fx_abs_q31(in->i_ref.d - state->i_ref.d) > config->i_0 ||
           fx_abs_q31(in->i_ref.q - state->i_ref.q) > config->i_0;
}

/* Acting voltage without the part that changes the flux (MN-27): a reference may drift slowly without exceeding i_0. */
static dq_q15_t standing_voltage(const frozen_angle_config_t *config, frozen_angle_state_t *state,
                                 const frozen_angle_in_t *in)
{
    const dq_q15_t psi = {mean_follow((q15_t)state->psi.d, in->psi_ref.d, config->answer_rate),
                          mean_follow((q15_t)state->psi.q, in->psi_ref.q, config->answer_rate)};
    const q15_t d = fx_sat_q15(psi.d - state->psi.d), q = fx_sat_q15(psi.q - state->psi.q);
    state->psi = psi;
    return (dq_q15_t){in->u_sum.d - fx_mulhi(config->rate_gain, d * 65536),
                      in->u_sum.q - fx_mulhi(config->rate_gain, q * 65536)};
}

/* (MN-22); true while there is a voltage to compare with. */
static bool update_mean(const frozen_angle_config_t *config, frozen_angle_state_t *state, const frozen_angle_in_t *in)
{
    const dq_q15_t u_sum = standing_voltage(config, state, in);
    state->u_standing = u_sum;
    if (in->behind || has_moved(config, state, in)) {
        state->i_ref = in->i_ref;
        state->theta_e = in->theta_e;
        state->standing = 1; /* the next step begins the mean */
        return false;
    }
    const int shift = (state->standing < MOVING_STEPS) ? 0 : MEAN_SHIFT;
    state->mean_q8.d = mean_step(state->mean_q8.d, u_sum.d * 256, shift);
    state->mean_q8.q = mean_step(state->mean_q8.q, u_sum.q * 256, shift);
    const bool settled = state->standing >= config->settle_steps;
    if (settled) {
        state->first_q8.d = mean_step(state->first_q8.d, state->mean_q8.d, FIRST_SHIFT);
        state->first_q8.q = mean_step(state->first_q8.q, state->mean_q8.q, FIRST_SHIFT);
    } else {
        state->standing++;
        state->first_q8 = state->mean_q8;
    }
    return settled;
}

/* (MN-23); at so small a current that two legs may carry none, nothing has changed. That takes another square root,
 * which is computed only where the voltage has changed. */
static bool has_changed(const frozen_angle_config_t *config, const frozen_angle_state_t *state,
                        const frozen_angle_in_t *in)
{
    const int32_t i_held = 2 * config->i_0;
    const q15_t d = fx_sat_q15((state->mean_q8.d - state->first_q8.d) >> 8);
    const q15_t q = fx_sat_q15((state->mean_q8.q - state->first_q8.q) >> 8);
    return fx_magnitude(d, q) > ((in->i_phase_min > i_held) ? config->v_0 : UNCERTAIN * config->v_0) &&
           fx_magnitude(in->i_ref.d, in->i_ref.q) > 2 * i_held;
}

uint32_t frozen_angle_step(const frozen_angle_config_t *config, frozen_angle_state_t *state,
                           const frozen_angle_in_t *in)
{
    if (!in->acting) {
        if (state->standing != 0U) { /* else it is clear: every step that acts counts here */
            *state = (frozen_angle_state_t){.standing = 0};
        }
        state->psi = in->psi_ref; /* a new compensation begins anew at the same flux */
        return 0;
    }
    const bool changed = update_mean(config, state, in) && has_changed(config, state, in);
    return debounce_step(&state->frozen, changed, config->fault_steps, FAULT_ANGLE_OFFSET);
}
