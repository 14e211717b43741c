/* SPDX-License-Identifier: Apache-2.0 */
#include "control/torque_limit.h"

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
static q15_t line(derating_line_t at, q15_t x)
{
    return (q15_t)fx_max_s32(fx_mul_gain_q15(at.gain, fx_sub_q15(x, at.end)), 0);
}

static q15_t temperature_factor(derating_line_t at, int16_t dC, bool *seen)
{
    if (dC == TEMPERATURE_UNKNOWN) {
        return *seen ? SENSOR_LOST : Q15_MAX;
    }
    *seen = true;
    return line(at, dC);
}

/* (LM-2); half up in both products, so that the mean has no bias. */
static q15_t loss_step(const torque_limit_config_t *config, torque_limit_state_t *state, const torque_limit_in_t *in)
{
    const q15_t current = fx_magnitude((q15_t)in->i.d, (q15_t)in->i.q);
    const int32_t electrical = fx_mul_q15((q15_t)in->u.d, (q15_t)in->i.d) + fx_mul_q15((q15_t)in->u.q, (q15_t)in->i.q);
    const int32_t now = electrical - fx_mul_q15(in->torque, in->omega) + fx_mul_q15(config->drop, current);
    const q15_t error = fx_sat_q15(now - fx_q15_from_q31(state->loss));
    const q31_t moved = fx_add2_q31(state->loss, fx_mul_q30(config->loss_rate, error));
    state->loss = fx_clamp_q31(moved, 0, LOSS_MAX);
    return fx_q15_from_q31(state->loss);
}

/* p/|w|; an open limit stays open. */
static q15_t torque_of(q15_t limit, int32_t power, q15_t speed)
{
    if (limit == Q15_MAX) {
        return Q15_MAX;
    }
    return fx_div_q15(fx_sat_q15(fx_max_s32(power, 0)), (q15_t)fx_max_s32(speed, 1));
}

/* The smaller of both limits; the reason is noted when it cuts the request. */
typedef struct {
    int32_t wanted; /* magnitude */
    int32_t most;
    uint32_t reasons;
} cut_t;

static void cut(cut_t *by, int32_t limit, uint32_t reason)
{
    const int32_t most = fx_max_s32(limit, 0);
    by->most = fx_min_s32(by->most, most);
    by->reasons |= (by->wanted > most) ? reason : 0U;
}

static void cut_by_factor(cut_t *by, q15_t torque_max, q15_t factor, uint32_t reason)
{
    if (factor < Q15_MAX) {
        cut(by, fx_mul_q15(torque_max, factor), reason);
    }
}

/* What holds for both directions. */
static cut_t common(const torque_limit_config_t *config, torque_limit_state_t *state, const torque_limit_in_t *in)
{
    cut_t by = {.wanted = fx_abs_q15(in->wanted), .most = Q15_MAX};
    cut(&by, config->torque_max, DERATING_REQUEST);
    cut(&by, in->reach, DERATING_REACH);
    cut_by_factor(&by, config->torque_max, temperature_factor(config->inverter, in->inverter_dC,
                                                              &state->inverter_seen), DERATING_INVERTER);
    cut_by_factor(&by, config->torque_max, temperature_factor(config->winding, in->winding_dC, &state->winding_seen),
                  DERATING_WINDING);
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
    cut(&drive, torque_of(limits->power_drive, limits->power_drive - loss, speed), DERATING_POWER);
    cut_by_factor(&drive, config->torque_max, line(config->dc_low, in->v_dc), DERATING_DC_LOW);
    cut_by_factor(&drive, config->torque_max, line(config->speed, speed), DERATING_SPEED);
    cut(&regen, limits->torque_regen, DERATING_REQUEST);
    cut(&regen, torque_of(limits->power_regen, limits->power_regen + loss, speed), DERATING_POWER);
    cut_by_factor(&regen, config->torque_max, line(config->dc_high, in->v_dc), DERATING_DC_HIGH);

    /* Which of the two holds for torque against the rotation (LM-6). */
    const q15_t moving = line(config->moving, speed);
    const int32_t against = drive.most + fx_mul_q15(moving, fx_sat_q15(regen.most - drive.most));
    const bool backwards = in->omega < 0;
    const int32_t high = backwards ? against : drive.most;
    const int32_t low = backwards ? drive.most : against;
    const bool with_rotation = (in->wanted < 0) == backwards || moving == 0;
    return (torque_limit_t){
        .torque = (q15_t)fx_clamp_q31(in->wanted, -low, high),
        .drive = (q15_t)drive.most,
        .regen = (q15_t)against,
        .derating = (uint16_t)(with_rotation ? drive.reasons : regen.reasons),
    };
}
