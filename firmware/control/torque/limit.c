/* SPDX-License-Identifier: Apache-2.0 */
#include "control/torque/limit.h"

#include "fx/div.h"
#include "fx/q.h"
#include "fx/vec.h"

#define LOSS_MAX Q31(0.25)
#define SENSOR_LOST Q15(0.5)

bool torque_limit_valid(const torque_limit_config_t *config)
{
    return config->torque_max > 0 && config->drop >= 0 && config->loss_rate > 0 && config->moving.gain > 0 &&
           config->inverter.gain < 0 && config->winding.gain < 0 && config->dc_low.gain > 0 &&
           config->dc_high.gain < 0 && config->speed.gain < 0;
}

/* (x - end)/(start - end), 0 ... 1 (LM-4). */
static q15_t line(const derating_line_t *at, q15_t x)
{
    return (q15_t)fx_max_s32(fx_mul_gain_q15(at->gain, fx_sub_q15(x, at->end)), 0);
}

/* (LM-2); half up in both products, so that the mean has no bias. */
static q15_t loss_step(const torque_limit_config_t *config, torque_limit_state_t *state, const torque_limit_in_t *in)
{
    const q15_t current = fx_magnitude((q15_t)in->i.d, (q15_t)in->i.q);
    const int32_t electrical = fx_mul_q15((q15_t)in->u.d, (q15_t)in->i.d) + fx_mul_q15((q15_t)in->u.q, (q15_t)in->i.q);
    const int32_t now = electrical - fx_mul_q15(in->torque_estimated, in->omega) + fx_mul_q15(config->drop, current);
    const q15_t error = fx_sat_q15(now - fx_q15_from_q31(state->loss));
    const q31_t moved = fx_add2_q31(state->loss, fx_mul_q30(config->loss_rate, error));
    state->loss = fx_clamp_q31(moved, 0, LOSS_MAX);
    return fx_q15_from_q31(state->loss);
}

/* The smaller of both limits; the reason is noted when it cuts the request. */
typedef struct {
    int32_t wanted; /* magnitude of the arbitrated torque */
    int32_t most;
    uint32_t reasons;
    q15_t rated; /* what a factor is taken of */
} cut_t;

static void cut(cut_t *by, int32_t limit, uint32_t reason)
{
    const int32_t most = fx_max_s32(limit, 0);
    by->most = fx_min_s32(by->most, most);
    by->reasons |= (by->wanted > most) ? reason : 0U;
}

/* p/|w|; an open limit stays open. */
static __attribute__((noinline)) void cut_by_power(cut_t *by, q15_t limit, int32_t loss, q15_t speed)
{
    if (limit < Q15_MAX) {
        const q15_t power = fx_sat_q15(fx_max_s32(limit - loss, 0));
        cut(by, fx_div_q15(power, (q15_t)fx_max_s32(speed, 1)), DERATING_POWER);
    }
}

static void cut_by_factor(cut_t *by, q15_t factor, uint32_t reason)
{
    if (factor < Q15_MAX) {
        cut(by, fx_mul_q15(by->rated, factor), reason);
    }
}

static __attribute__((noinline)) void derate(cut_t *by, const derating_line_t *at, q15_t x, uint32_t reason)
{
    cut_by_factor(by, line(at, x), reason);
}

static __attribute__((noinline)) void derate_hot(cut_t *by, const derating_line_t *at, int16_t dC, bool *seen,
                                                 uint32_t reason)
{
    if (dC != TEMPERATURE_UNKNOWN) {
        *seen = true;
        derate(by, at, dC, reason);
    } else if (*seen) {
        cut_by_factor(by, SENSOR_LOST, reason);
    }
}

/* What holds for both directions. */
static cut_t common(const torque_limit_config_t *config, torque_limit_state_t *state, const torque_limit_in_t *in)
{
    cut_t by = {.wanted = fx_abs_q15(in->torque_arbitrated), .most = Q15_MAX, .rated = config->torque_max};
    cut(&by, config->torque_max, DERATING_REQUEST);
    cut(&by, in->reach, DERATING_REACH);
    derate_hot(&by, &config->inverter, in->inverter_dC, &state->inverter_seen, DERATING_INVERTER);
    derate_hot(&by, &config->winding, in->winding_dC, &state->winding_seen, DERATING_WINDING);
    return by;
}

torque_limit_t torque_limit_step(const torque_limit_config_t *config, torque_limit_state_t *state,
                                 const torque_limit_in_t *in)
{
    const torque_limits_t *limits = in->limits;
    const q15_t speed = fx_abs_q15(in->omega);
    const q15_t loss = loss_step(config, state, in);
    cut_t drive = common(config, state, in);
    cut_t regen = drive;

    cut(&drive, limits->torque_drive, DERATING_REQUEST);
    cut_by_power(&drive, limits->power_drive, loss, speed);
    derate(&drive, &config->dc_low, in->v_dc, DERATING_DC_LOW);
    derate(&drive, &config->speed, speed, DERATING_SPEED);
    cut(&regen, limits->torque_regen, DERATING_REQUEST);
    cut_by_power(&regen, limits->power_regen, -loss, speed);
    derate(&regen, &config->dc_high, in->v_dc, DERATING_DC_HIGH);

    /* Which of the two holds for torque against the rotation (LM-6). */
    const q15_t moving = line(&config->moving, speed);
    const int32_t against = drive.most + fx_mul_q15(moving, fx_sat_q15(regen.most - drive.most));
    const bool backwards = in->omega < 0;
    const int32_t high = backwards ? against : drive.most;
    const int32_t low = backwards ? drive.most : against;
    const bool with_rotation = (in->torque_arbitrated < 0) == backwards || moving == 0;
    return (torque_limit_t){
        .torque_limited = (q15_t)fx_clamp_q31(in->torque_arbitrated, -low, high),
        .drive = (q15_t)drive.most,
        .regen = (q15_t)against,
        .derating = (uint16_t)(with_rotation ? drive.reasons : regen.reasons),
    };
}
