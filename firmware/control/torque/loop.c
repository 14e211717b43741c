/* SPDX-License-Identifier: Apache-2.0 */
#include "control/torque/loop.h"

#include "fx/div.h"
#include "fx/q.h"

#define LIMITED_DECAY_BITS 2 /* at a limit a correction above 0 decays at a quarter of the loop's own rate */

/* Q15 * Q15 = Q30 -> Q31: the integrator keeps every bit of its step. */
static q31_t product_q31(int32_t a, int32_t b)
{
    return fx_add2_q31(0, a * b);
}

/* T_m models the response of the closed current loop to T*, so that e contains only the tables' error (TL-4). The
 * estimate is the mean over the last step and is compared with the model's value before this step. */
static int32_t model_error(const torque_loop_config_t *config, torque_loop_state_t *state, const torque_loop_in_t *in)
{
    const int32_t model = fx_q15_from_q31(state->model);
    const int32_t ahead = fx_sat_q15_word(in->torque_commanded - model);
    state->model = fx_add_q31(state->model, product_q31(config->model_rate, ahead));
    return fx_sat_q15_word(model - in->torque_estimated);
}

/* e/max(|T*|, T_min) with the sign of T*: positive asks for more torque in the commanded direction (TL-5). */
static int32_t relative_error(const torque_loop_config_t *config, const torque_loop_in_t *in, int32_t magnitude,
                              int32_t error)
{
    const int32_t signed_error = (in->torque_commanded < 0) ? fx_sat_q15_word(-error) : error;
    return fx_div_q15(signed_error, fx_max_s32(magnitude, config->torque_min));
}

/* ki x: what x loses in a step at the loop's own rate. */
static q31_t decay(const torque_loop_config_t *config, q31_t correction)
{
    return fx_mul_q31(fx_q31_from_q15(config->ki), correction);
}

/* The correction before its authority limits it. magnitude: |T*|. */
static q31_t integrate(const torque_loop_config_t *config, const torque_loop_in_t *in, q31_t correction,
                       int32_t magnitude, int32_t error)
{
    if (!in->enabled) {
        /* Decays to zero, so that disabling the loop causes no step of torque (TL-8). */
        return fx_sub_q31(correction, decay(config, correction));
    }
    if (magnitude < config->torque_min >> 1) {
        return correction; /* (TL-5): a small T* would turn an offset of the estimate into a large ratio */
    }
    const int32_t relative = relative_error(config, in, magnitude, error);
    const q31_t moved = fx_add_q31(correction, product_q31(config->ki, relative));
    if (!in->limited) {
        return moved;
    }
    /* At a limit a correction above 0 has no effect; kept, it would be too much torque after the limit (TL-7). */
    const q31_t kept = correction - (decay(config, correction) >> LIMITED_DECAY_BITS);
    return fx_min_s32(moved, fx_max_s32(kept, 0));
}

q15_t torque_loop_step(const torque_loop_config_t *config, torque_loop_state_t *state, const torque_loop_in_t *in)
{
    const int32_t magnitude = fx_abs_q15(in->torque_commanded);
    const int32_t error = model_error(config, state, in);
    const int32_t authority = fx_mul_q15(config->authority, in->confidence);
    const q31_t bound = authority * 65536;
    const q31_t correction = fx_clamp_q31(integrate(config, in, state->correction, magnitude, error), -bound, bound);
    state->correction = correction;
    state->saturated = fx_abs_q31(correction) == bound;

    const int32_t proportional = in->enabled ? fx_mul_q15(config->kp, error) : 0;
    const int32_t integral = fx_mul_q15(fx_q15_from_q31(correction), in->torque_commanded);
    const int32_t max = fx_mul_q15(authority, magnitude);
    return fx_sat_q15(in->torque_commanded + fx_clamp_q31(integral + proportional, -max, max));
}
