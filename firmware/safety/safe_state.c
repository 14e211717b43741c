/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/safe_state.h"

#include "signal/debounce.h"

#define FALL_PER_STEP Q15(0.004) /* of the speed base: from there to standstill in 250 steps */
#define CONFIRMED_STEPS 20
#define FALL_SHIFT 6 /* of the known dc voltage: 64 steps */
#define RECTIFYING_STEPS 10 /* the dc link ends every current of the windings sooner (SS-10) */
#define RELEASE_STEPS 200 /* several time constants of a shorted machine */
#define UNKNOWN_STEPS 20000U /* 18 to 22.5 s: a step is 0.89 to 1.125 ms */

/* Q30; below 2^31 + 1 for every argument. */
static uint32_t squared(int32_t d, int32_t q)
{
    return (uint32_t)fx_mul_q30((q15_t)d, (q15_t)d) + (uint32_t)fx_mul_q30((q15_t)q, (q15_t)q);
}

/* Whether a vector has moved by less than a part of its length. */
static bool is_steady(dq_q15_t now, dq_q15_t before, int32_t part)
{
    return squared(fx_sat_q15(now.d - before.d), fx_sat_q15(now.q - before.q)) < squared(now.d / part, now.q / part);
}

/* The currents of the short circuit are too small for a machine that turns (SS-7), whatever angle is measured. */
static bool is_at_rest(const safe_state_config_t *config, safe_state_state_t *state, const safe_state_in_t *in)
{
    const bool none = in->shorted && in->currents_valid &&
                      squared(in->psi_current.d, in->psi_current.q) < squared(config->psi_f / 8, 0);
    return debounce_holds(&state->without_current, none, CONFIRMED_STEPS);
}

/* Whether the measured speed may be used now. In the short circuit the currents must stand still in the rotor's
 * frame (SS-6): from step to step, and within a period. Without the latter, an angle that is frozen would not be found
 * at an electrical frequency of 1 kHz. */
static bool is_speed_known(safe_state_state_t *state, const safe_state_in_t *in)
{
    const bool checked = in->shorted && in->currents_valid;
    const bool steady = checked && is_steady(in->i, (dq_q15_t){state->i_before.d, state->i_before.q}, 4) &&
                        is_steady(in->i, in->i_last_period, 8);
    const bool agreed = debounce_holds(&state->steady, steady, CONFIRMED_STEPS);
    state->i_before = (dq_q15_halfword_t){(q15_t)in->i.d, (q15_t)in->i.q};
    return in->speed_valid && (!checked || agreed);
}

static void follow_speed(const safe_state_config_t *config, safe_state_state_t *state, const safe_state_in_t *in)
{
    const q15_t measured = in->speed_valid ? fx_abs_q15(in->omega) : (q15_t)0;
    const q15_t fallen = (q15_t)fx_max_s32(state->speed - FALL_PER_STEP, measured);
    const bool at_rest = is_at_rest(config, state, in), known = is_speed_known(state, in);
    if (at_rest) {
        state->speed = measured;
    } else if (known) {
        state->speed = fallen;
        state->unknown_steps = 0;
    } else if (in->speed_valid) {
        state->speed = (q15_t)fx_max_s32(state->speed, measured);
    } else if (!state->short_circuit && !in->shorted) {
        const bool long_enough = state->unknown_steps >= UNKNOWN_STEPS;
        state->unknown_steps = long_enough ? (uint16_t)UNKNOWN_STEPS : (uint16_t)(state->unknown_steps + 1U);
        state->speed = long_enough ? fallen : state->speed;
    }
}

/* (SS-19). A sensor that reads almost nothing causes an under-voltage fault within 1 ms; the known voltage falls by 2 %
 * until then. One that reads 20 or 30 % too little is found after up to 91 ms or not at all: the known voltage follows.
 * After a fault the diodes show the truth: a link whose voltage is really below the back-EMF draws a current. */
static void follow_voltage(safe_state_state_t *state, const safe_state_in_t *in)
{
    const bool rectifies = debounce_holds(&state->rectifying, in->rectifying, RECTIFYING_STEPS);
    if (in->v_dc >= state->v_dc || rectifies) {
        state->v_dc = in->v_dc;
    } else if (!in->doubtful) {
        state->v_dc = (q15_t)(state->v_dc + ((in->v_dc - state->v_dc) >> FALL_SHIFT));
    }
}

/* (SS-2), with the upper level of one decision: whether the back-EMF exceeds it, or the lower one if it did before or
 * the speed is not valid. */
static bool exceeds(const safe_state_config_t *config, const safe_state_state_t *state, q16_t upper, bool lower_level)
{
    const q16_t share = lower_level ? upper - (config->share_short - config->share_open) : upper;
    return state->line_emf > fx_mul_gain_q15_word(share, state->v_dc);
}

bool safe_state_step(const safe_state_config_t *config, safe_state_state_t *state, const safe_state_in_t *in)
{
    follow_speed(config, state, in);
    follow_voltage(state, in);
    const q15_t psi = fx_sat_q15(config->psi_f + fx_max_s32(in->psi_d_error, 0));
    state->line_emf = fx_mul_gain_q15(Q16(2.0 * SQRT3_HALF), fx_mul_q15(state->speed, psi));
    const q16_t conducting = fx_min_s32(config->share_short, Q16(1.0));
    state->rectifies = exceeds(config, state, conducting, state->rectifies || !in->speed_valid);
    state->short_circuit = exceeds(config, state, config->share_short, state->short_circuit || !in->speed_valid);
    const bool low = in->over_voltage && in->v_dc <= config->v_release;
    const bool released = debounce_holds(&state->low, low, RELEASE_STEPS);
    return state->short_circuit || (in->over_voltage && !released);
}
