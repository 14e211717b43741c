/* SPDX-License-Identifier: Apache-2.0 */
#include "control/torque/loop.h"

#include "fx/div.h"
#include "fx/q.h"

/* Q15 * Q15 = Q30 -> Q31: the integrator keeps every bit of its step. */
static q31_t product_q31(q15_t a, q15_t b)
{
    return fx_add2_q31(0, fx_mul_q30(a, b));
}

/* T_m models the response of the closed current loop to T*, so that e contains only the tables' error (TL-4). The
 * estimate is the mean over the last step and is compared with the model's value before this step. */
static q15_t model_error(const torque_loop_config_t *config, torque_loop_state_t *state, const torque_loop_in_t *in)
{
    const q15_t model = fx_q15_from_q31(state->model);
    state->model = fx_add_q31(state->model, product_q31(config->model_rate, fx_sub_q15(in->torque_commanded, model)));
    return fx_sub_q15(model, in->torque_estimated);
}

/* e/max(|T*|, T_min) with the sign of T*: positive asks for more torque in the commanded direction (TL-5). */
static q15_t relative_error(const torque_loop_config_t *config, q15_t torque_commanded, q15_t error)
{
    const q15_t signed_error = (torque_commanded < 0) ? fx_neg_q15(error) : error;
    const q15_t scale = (q15_t)fx_max_s32(fx_abs_q15(torque_commanded), config->torque_min);
    return fx_div_q15(signed_error, scale);
}

q15_t torque_loop_step(const torque_loop_config_t *config, torque_loop_state_t *state, const torque_loop_in_t *in)
{
    const q15_t error = model_error(config, state, in);
    const q15_t authority = fx_mul_q15(config->authority, in->confidence);
    const q31_t bound = fx_q31_from_q15(authority);

    if (!in->enabled) {
        /* Decays to zero, so that disabling the loop causes no step of torque (TL-8). */
        state->correction = fx_sub_q31(state->correction, fx_mul_q31(fx_q31_from_q15(config->ki), state->correction));
    } else if (fx_abs_q15(in->torque_commanded) >=
               config->torque_min /
                   2) { /* (TL-5): a small T* would turn an offset of the estimate into a large ratio */
        const q15_t relative = relative_error(config, in->torque_commanded, error);
        /* At a limit the correction must not rise above 0 or above its present value (TL-7). */
        const q31_t moved = fx_add_q31(state->correction, product_q31(config->ki, relative));
        const q31_t max = (in->limited && relative >= 0) ? fx_max_s32(state->correction, 0) : Q31_MAX;
        state->correction = fx_min_s32(moved, max);
    }
    state->saturated = state->correction >= bound || state->correction <= -bound;
    state->correction = fx_clamp_q31(state->correction, -bound, bound);

    const q15_t proportional = in->enabled ? fx_mul_q15(config->kp, error) : 0;
    const int32_t integral = fx_mul_q15(fx_q15_from_q31(state->correction), in->torque_commanded);
    const int32_t max = fx_mul_q15(authority, fx_abs_q15(in->torque_commanded));
    return fx_sat_q15(in->torque_commanded + fx_clamp_q31(integral + proportional, -max, max));
}
