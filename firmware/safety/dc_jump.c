/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/dc_jump.h"

#include "fx/div.h"
#include "fx/q.h"

enum { SETTLED = 4, WAIT = 3, FOUND = 8 }; /* steps: before the jump; after it, not compared; after it, all compared */

static dq_q15_t rotational_voltage(const dc_jump_config_t *config, const dc_jump_in_t *in)
{
    const q15_t psi_d = (q15_t)((in->psi.d + in->psi_last.d) >> 1); /* a mean of two Q15 numbers is one */
    const q15_t psi_q = (q15_t)((in->psi.q + in->psi_last.q) >> 1);
    return (dq_q15_t){fx_sat_q15(fx_mul_gain_q15(config->r, (q15_t)in->i.d) - fx_mul_q15(in->omega, psi_q)),
                      fx_sat_q15(fx_mul_gain_q15(config->r, (q15_t)in->i.q) + fx_mul_q15(in->omega, psi_d))};
}

static q15_t without_change(const dc_jump_config_t *config, int32_t u, int32_t change)
{
    return fx_sat_q15(u - fx_mul_gain_q15(config->rate_gain, fx_sat_q15(change)));
}

static q31_t dot_q28(dq_q15_t a, dq_q15_t b)
{
    return (fx_mul_q30((q15_t)a.d, (q15_t)b.d) >> 2) + (fx_mul_q30((q15_t)a.q, (q15_t)b.q) >> 2);
}

/* (MN-53) */
static bool legs_are_known(const dc_jump_config_t *config, dq_q15_t i)
{
    return dot_q28(i, i) > fx_mul_q30(config->i_0, config->i_0) >> 2;
}

/* (MN-45); 0: the rotational voltage is too small, or opposed, or the duties do not determine the voltage. */
static q15_t half_kappa(const dc_jump_config_t *config, const dc_jump_in_t *in)
{
    if (!legs_are_known(config, in->i)) {
        return 0;
    }
    const dq_q15_t w = rotational_voltage(config, in);
    const dq_q15_t e = {without_change(config, in->u.d, in->psi.d - in->psi_last.d),
                        without_change(config, in->u.q, in->psi.q - in->psi_last.q)};
    const q31_t squared = dot_q28(w, w);
    if (squared >> 2 <= fx_mul_q30(config->v_0, config->v_0)) { /* (4 v_0)^2 is 4 v_0^2 in Q28: may not fit 32 bits */
        return 0;
    }
    return (q15_t)fx_max_s32(fx_div_q31(dot_q28(e, w) >> 1, squared) >> 16, 0);
}

static bool has_moved(const dc_jump_config_t *config, const dc_jump_state_t *state, const dc_jump_in_t *in)
{
    return fx_abs_q31(in->omega - state->omega) > fx_abs_q15(state->omega) >> 6 ||
           fx_abs_q31(in->torque - state->torque) > config->t_0 >> 2;
}

static void begin(dc_jump_state_t *state, const dc_jump_in_t *in, q15_t kappa)
{
    *state = (dc_jump_state_t){in->v_dc, kappa, in->omega, in->torque, 1, 0};
}

/* (MN-46) */
static bool is_jump(const dc_jump_state_t *state, q15_t v_dc)
{
    return 32 * fx_abs_q31(v_dc - state->v_dc) > 3 * state->v_dc;
}

/* (MN-47) */
static bool is_of_sensor(const dc_jump_state_t *state, q15_t v_dc, q15_t kappa)
{
    const int32_t seen = (kappa - state->half_kappa) * state->v_dc;
    const int32_t expected = (v_dc - state->v_dc) * state->half_kappa;
    return fx_abs_q31(seen / 4 - expected / 4) < fx_abs_q31(expected) / 8;
}

static void follow(dc_jump_state_t *state, q15_t v_dc, q15_t kappa)
{
    state->v_dc = v_dc;
    state->half_kappa = (q15_t)(state->half_kappa + (kappa - state->half_kappa) / 4);
    state->before = (uint8_t)fx_min_s32((int32_t)state->before + 1, SETTLED);
}

/* What the jump interrupts must have been steady, and what follows it must be of the sensor. */
static bool continues(const dc_jump_state_t *state, bool jump, q15_t v_dc, q15_t kappa)
{
    if (!jump) {
        return state->after == 0U;
    }
    return state->before == (uint8_t)SETTLED && (state->after < (uint8_t)WAIT || is_of_sensor(state, v_dc, kappa));
}

static void compare(dc_jump_state_t *state, const dc_jump_in_t *in, q15_t kappa)
{
    const bool jump = is_jump(state, in->v_dc);
    if (!continues(state, jump, in->v_dc, kappa)) {
        begin(state, in, kappa);
    } else if (jump) {
        state->after = (uint8_t)fx_min_s32((int32_t)state->after + 1, FOUND);
    } else {
        follow(state, in->v_dc, kappa);
    }
}

bool dc_jump_step(const dc_jump_config_t *config, dc_jump_state_t *state, const dc_jump_in_t *in)
{
    const q15_t kappa = in->acting ? half_kappa(config, in) : (q15_t)0;
    if (kappa == 0) {
        *state = (dc_jump_state_t){0};
    } else if (has_moved(config, state, in)) {
        begin(state, in, kappa);
    } else {
        compare(state, in, kappa);
    }
    return state->after == (uint8_t)FOUND;
}
