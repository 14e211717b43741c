/* SPDX-License-Identifier: Apache-2.0 */
#include "control/torque/limit.h"

#include "fx/codegen.h"
#include "fx/div.h"
#include "fx/q.h"

#define LOSS_MAX Q31(0.25)
#define FACTOR_SENSOR_LOST Q15(0.5)

motor_check_t torque_limit_check(const torque_limit_config_t *config)
{
    if (config->torque_max <= 0 || config->drop < 0 || config->loss_rate <= 0) {
        return MOTOR_CHECK_TORQUE_LIMIT;
    }
    if (config->moving.gain <= 0) {
        return MOTOR_CHECK_DERATING_STANDSTILL;
    }
    if (config->inverter.gain >= 0) {
        return MOTOR_CHECK_DERATING_INVERTER;
    }
    if (config->winding.gain >= 0) {
        return MOTOR_CHECK_DERATING_WINDING;
    }
    if (config->dc_low.gain <= 0) {
        return MOTOR_CHECK_DERATING_DC_LOW;
    }
    if (config->dc_high.gain >= 0) {
        return MOTOR_CHECK_DERATING_DC_HIGH;
    }
    return (config->speed.gain < 0) ? MOTOR_CHECK_OK : MOTOR_CHECK_DERATING_SPEED;
}

/* (x - end)/(start - end), 0 ... 1 (LM-4). */
static int32_t derating_factor(const derating_line_t *at, int32_t x)
{
    return fx_usat_q15_word(fx_mulhi(at->gain, fx_sat_q15_word(x - at->end) * 65536)); /* Q16 * Q31 = Q15 */
}

/* (LM-2). Both products are rounded half up, so that the mean has no bias. */
static int32_t loss_step(const torque_limit_config_t *config, torque_limit_state_t *state, const torque_limit_in_t *in)
{
    const int32_t electrical = fx_mul_q15(in->u.d, in->i.d) + fx_mul_q15(in->u.q, in->i.q);
    const int32_t now = electrical - fx_mul_q15(in->torque_estimated, in->omega) +
                        fx_mul_q15(config->drop, in->current);
    const int32_t error = fx_sat_q15_word(now - fx_q15_from_q31(state->loss));
    const q31_t moved = fx_add2_q31(state->loss, config->loss_rate * error);
    state->loss = fx_clamp_q31(moved, 0, LOSS_MAX);
    return fx_q15_from_q31(state->loss);
}

/* The smallest of the limits so far, and the reason of each limit that the torque exceeds. */
typedef struct {
    int32_t torque; /* magnitude of the arbitrated torque */
    int32_t max;
    uint32_t reasons;
    q15_t rated; /* 1 for a derating factor */
} bound_t;

static void limit_to(bound_t *bound, int32_t limit, uint32_t reason)
{
    const int32_t max = fx_max_s32(limit, 0);
    bound->max = fx_min_s32(bound->max, max);
    if (bound->torque > max) {
        bound->reasons |= reason;
    }
}

/* (power -+ loss)/|w| (LM-3). Q15_MAX means that no limit is set. */
static FX_NOT_INLINED void limit_by_power(bound_t *bound, int32_t limit, int32_t loss, int32_t speed)
{
    if (limit < Q15_MAX) {
        const int32_t power = fx_usat_q15_word(limit - loss);
        limit_to(bound, fx_div_q15(power, fx_max_s32(speed, 1)), DERATING_POWER);
    }
}

static FX_NOT_INLINED void limit_by_factor(bound_t *bound, int32_t factor, uint32_t reason)
{
    if (factor < Q15_MAX) {
        limit_to(bound, fx_mul_q15(bound->rated, factor), reason);
    }
}

static FX_NOT_INLINED void limit_by_line(bound_t *bound, const derating_line_t *at, int32_t x, uint32_t reason)
{
    limit_by_factor(bound, derating_factor(at, x), reason);
}

static FX_NOT_INLINED void limit_by_temperature(bound_t *bound, const derating_line_t *at, int16_t dC, bool *was_known,
                                                uint32_t reason)
{
    if (temperature_is_known(dC)) {
        *was_known = true;
        limit_by_line(bound, at, dC, reason);
    } else if (*was_known || dC == TEMPERATURE_OUT_OF_RANGE) {
        limit_by_factor(bound, FACTOR_SENSOR_LOST, DERATING_SENSOR);
    }
}

/* The limits that do not depend on the direction of power. */
static bound_t limits_of_both_directions(const torque_limit_config_t *config, torque_limit_state_t *state,
                                         const torque_limit_in_t *in)
{
    bound_t bound = {.torque = fx_abs_q15(in->torque_arbitrated), .max = Q15_MAX, .rated = config->torque_max};
    limit_to(&bound, config->torque_max, DERATING_REQUEST);
    limit_to(&bound, in->reach, DERATING_REACH);
    limit_by_temperature(&bound, &config->inverter, in->inverter_dC, &state->inverter_seen, DERATING_INVERTER);
    limit_by_temperature(&bound, &config->winding, in->winding_dC, &state->winding_seen, DERATING_WINDING);
    return bound;
}

torque_limit_t torque_limit_step(const torque_limit_config_t *config, torque_limit_state_t *state,
                                 const torque_limit_in_t *in)
{
    const torque_limits_t *limits = in->limits;
    const q15_t speed = fx_abs_q15(in->omega);
    const int32_t loss = loss_step(config, state, in);
    bound_t drive = limits_of_both_directions(config, state, in);
    bound_t regen = drive;

    limit_to(&drive, limits->torque_drive, DERATING_REQUEST);
    limit_by_power(&drive, limits->power_drive, loss, speed);
    limit_by_line(&drive, &config->dc_low, in->v_dc, DERATING_DC_LOW);
    limit_by_line(&drive, &config->speed, speed, DERATING_SPEED);
    limit_to(&regen, limits->torque_regen, DERATING_REQUEST);
    limit_by_power(&regen, limits->power_regen, -loss, speed);
    limit_by_line(&regen, &config->dc_high, in->v_dc, DERATING_DC_HIGH);

    /* Torque against the rotation: from the driving limit at standstill to the regenerating one (LM-6). */
    const int32_t direction_known = derating_factor(&config->moving, speed);
    const int32_t against_rotation = drive.max + fx_mul_q15(direction_known, regen.max - drive.max);
    const bool negative_speed = in->omega < 0;
    const int32_t high = negative_speed ? against_rotation : drive.max;
    const int32_t low = negative_speed ? drive.max : against_rotation;
    const bool with_rotation = (in->torque_arbitrated < 0) == negative_speed || direction_known == 0;
    return (torque_limit_t){
        .torque_limited = (q15_t)fx_clamp_q31(in->torque_arbitrated, -low, high),
        .drive = (q15_t)drive.max,
        .regen = (q15_t)against_rotation,
        .derating = (uint16_t)(with_rotation ? drive.reasons : regen.reasons),
    };
}
