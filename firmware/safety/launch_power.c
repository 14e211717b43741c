/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/launch_power.h"

#include "fx/q.h"
#include "fx/vec.h"
#include "signal/debounce.h"
#include "signal/mean.h"
#include "types/faults.h"

#define FAST_ANGLE (1U << 26) /* 1/64 of a turn in a step: above this the monitor of the back-EMF takes over */
#define MOVING_STEPS 4      /* after a change: the mean is the present value, without the voltage of the transient */
#define MEAN_SHIFT 2
#define FIRST_SHIFT 12
#define EARLY_STEPS 16 /* after the means have settled: with noise, m_0 becomes a mean over EARLY_SHIFT */
#define EARLY_SHIFT 3
#define NOISE_SHIFT 4
#define STANDING_STEPS 32 /* without a movement by i_0: the reference stands */
#define SLOW_STEPS 4      /* between two movements of a reference that is followed */
#define HALF_ROOT_Q8 181
#define VAGUE_Q8 384 /* r_0 of 1.5 thresholds */
#define ROUNDING 1   /* both powers and the threshold are whole counts, rounded down */
#define NOISE_LIMIT UINT16_MAX
#define NOISE_MAX 8 /* times v_1: largest noise of one step, as the currents may change without the reference */

/* Half the product of a sum and a q15 number. */
static int32_t times(int32_t sum, int32_t x)
{
    return fx_mulhi(sum, x * 65536);
}

static bool has_turned(const launch_power_state_t *state, const launch_power_in_t *in)
{
    return in->theta_e - state->theta_e + FAST_ANGLE > 2U * FAST_ANGLE;
}

/* By how much, on the axis on which it has moved more. */
static int32_t moved_by(const launch_power_state_t *state, const launch_power_in_t *in)
{
    return fx_max_s32(fx_abs_q31(in->i_ref.d - state->i_ref.d), fx_abs_q31(in->i_ref.q - state->i_ref.q));
}

/* The loss of the sum of a step in a resistance, for a product of currents in q30; Q8. */
static int32_t loss_q8(const launch_power_config_t *config, q16_t r, int32_t i_squared)
{
    return (fx_mulhi(r * 16384, i_squared) >> 6) * (int32_t)config->periods;
}

/* (MN-57): the legs keep their voltage, so that m_0 is in proportion to the current but for the resistance. */
static void follow_reference(const launch_power_config_t *config, launch_power_state_t *state,
                             const launch_power_in_t *in, q15_t before)
{
    const int32_t now = fx_magnitude(in->i_ref.d, in->i_ref.q);
    const int32_t change = now - before;
    const int32_t share = change * 32768 / before;
    const int32_t doubt = (loss_q8(config, in->r.error, now * fx_abs_q31(change)) >> 8) +
                          times(config->v_1, fx_abs_q31(change));
    state->first_power_q8 += 2 * times(state->first_power_q8, share) + loss_q8(config, in->r.r, now * change);
    state->first_noise_q8 += 2 * times(state->first_noise_q8, share) + doubt * HALF_ROOT_Q8;
    state->first_noise_q8 = fx_min_s32(state->first_noise_q8, NOISE_LIMIT * 256);
    state->i_ref = (dq_q15_halfword_t){(q15_t)in->i_ref.d, (q15_t)in->i_ref.q};
}

/* The power that neither the tables' torque nor the flux accounts for (MN-28). */
static int32_t other_power(const launch_power_in_t *in, int32_t omega)
{
    const q15_t torque = fx_sat_q15((fx_mul_q30((q15_t)in->psi_ref.d, (q15_t)in->i_ref.q) >> 15) -
                                    (fx_mul_q30((q15_t)in->psi_ref.q, (q15_t)in->i_ref.d) >> 15));
    return times(in->u_standing.d, in->i_ref.d) + times(in->u_standing.q, in->i_ref.q) - times(omega, torque);
}

/* How fast m_0 follows. An error of m_0 by the noise of its time would last. */
static int first_shift(const launch_power_config_t *config, const launch_power_state_t *state, int32_t loss_max)
{
    const bool early = state->steady < config->settle_steps + EARLY_STEPS;
    return (early && 2 * (state->noise_q8 >> 8) > loss_max) ? EARLY_SHIFT : FIRST_SHIFT;
}

/* (MN-39) */
static void update_noise(const launch_power_config_t *config, launch_power_state_t *state, int32_t power,
                         int32_t loss_max)
{
    if (state->steady < MOVING_STEPS) {
        return; /* a voltage that changes the currents is not noise */
    }
    const int32_t deviation = power - (state->power_q8 >> 8);
    const bool above = deviation > 0;
    const int32_t limited = fx_min_s32(fx_abs_q31(deviation), fx_min_s32(NOISE_MAX * loss_max, NOISE_LIMIT));
    const int32_t noise_q8 = (above != state->above) ? limited * 256 : 0; /* noise changes its sign, a fault does not */
    const bool settled = state->steady >= config->settle_steps;
    state->above = above;
    state->noise_q8 = mean_step(state->noise_q8, noise_q8, settled ? NOISE_SHIFT : MEAN_SHIFT);
    const int shift = first_shift(config, state, loss_max);
    const int32_t of_first_q8 = (shift == EARLY_SHIFT) ? state->noise_q8 / 2 : state->noise_q8;
    state->first_noise_q8 = settled ? mean_step(state->first_noise_q8, of_first_q8, shift) : state->noise_q8;
}

/* r_0 may be much more than noise after a reference that has moved far, or where much noise has ceased: a comparison
 * that begins anew has a lower threshold. */
static bool is_vague(const launch_power_state_t *state, int32_t loss_max)
{
    return state->first_noise_q8 > fx_max_s32(2 * state->noise_q8, VAGUE_Q8 * loss_max);
}

/* A reference that has moved slowly, with enough current before to be followed. */
static bool can_follow(const launch_power_config_t *config, const launch_power_state_t *state, q15_t before,
                       int32_t way)
{
    return way > config->i_0 && way <= 2 * config->i_0 && state->since >= SLOW_STEPS && before > config->i_min;
}

/* True if the means begin anew. before: the current at the last movement. */
static bool begins_anew(const launch_power_config_t *config, launch_power_state_t *state, const launch_power_in_t *in,
                        q15_t before, int32_t loss_max)
{
    const int32_t way = moved_by(state, in);
    const bool moved = way > config->i_0;
    const bool vague = state->since == STANDING_STEPS && is_vague(state, loss_max);
    const bool follows = can_follow(config, state, before, way);
    state->since = (moved || vague) ? 1U : (uint8_t)fx_min_s32(state->since + 1, STANDING_STEPS);
    if (vague || in->behind || has_turned(state, in)) {
        return true;
    }
    if (follows) {
        follow_reference(config, state, in, before);
    }
    return moved && !follows;
}

/* True while there is a power to compare with. */
static bool update_means(const launch_power_config_t *config, launch_power_state_t *state, const launch_power_in_t *in)
{
    const q15_t before = fx_magnitude(state->i_ref.d, state->i_ref.q);
    const int32_t loss_max = times(config->v_1, before);
    const bool anew = begins_anew(config, state, in, before, loss_max);
    const int32_t omega = fx_mulhi((int32_t)(in->theta_e - state->theta_e), config->turn_gain);
    state->theta_e = in->theta_e;
    if (anew) {
        state->i_ref = (dq_q15_halfword_t){(q15_t)in->i_ref.d, (q15_t)in->i_ref.q};
        state->steady = 1; /* the next step begins the means */
        return false;
    }
    const int shift = (state->steady < MOVING_STEPS) ? 0 : MEAN_SHIFT;
    const int32_t power = other_power(in, omega);
    update_noise(config, state, power, loss_max);
    state->power_q8 = mean_step(state->power_q8, power * 256, shift);
    state->omega_q8 = mean_step(state->omega_q8, omega * 256, shift);
    const bool settled = state->steady >= config->settle_steps;
    const int first = first_shift(config, state, loss_max);
    if (state->steady < config->settle_steps + EARLY_STEPS) {
        state->steady++;
    }
    if (settled) {
        state->first_power_q8 = mean_step(state->first_power_q8, state->power_q8, first);
        state->first_omega_q8 = mean_step(state->first_omega_q8, state->omega_q8, first);
    } else {
        state->first_power_q8 = state->power_q8;
        state->first_omega_q8 = state->omega_q8;
    }
    return settled;
}

/* What noise may change m - m_0 by: the variances of both means add up. Halves, which are q15; 2 sqrt(2) in Q7. */
static int32_t noise_of_change(const launch_power_state_t *state)
{
    return (362 * fx_magnitude(state->noise_q8 >> 9, state->first_noise_q8 >> 9)) >> 7;
}

/* (MN-29); the threshold with the noise needs a square root and is compared only where the one without is exceeded. */
static bool is_wrong(const launch_power_config_t *config, const launch_power_state_t *state,
                     const launch_power_in_t *in)
{
    const q15_t current = fx_magnitude(in->i_ref.d, in->i_ref.q);
    const int32_t omega = fx_abs_q31(state->omega_q8 - state->first_omega_q8) >> 8;
    const int32_t psi = config->psi_share + (fx_abs_q15(in->psi_ref.q) >> 3);
    const int32_t of_tables = times(2 * times(omega, psi), current);
    const int32_t change = fx_abs_q31((state->power_q8 - state->first_power_q8) >> 8);
    return current > config->i_min && change > times(config->v_1, current) + of_tables + ROUNDING &&
           change > noise_of_change(state) + of_tables;
}

uint32_t launch_power_step(const launch_power_config_t *config, launch_power_state_t *state,
                           const launch_power_in_t *in)
{
    if (!in->acting) {
        *state = (launch_power_state_t){.theta_e = in->theta_e};
        return 0;
    }
    if (!in->measured || state->waited) {
        state->waited = !in->measured;
        state->steady = in->behind ? 0U : state->steady; /* as after (AT-18): the currents followed the prediction */
        state->theta_e = in->theta_e;
        return 0;
    }
    const bool wrong = update_means(config, state, in) && is_wrong(config, state, in);
    return debounce_step(&state->wrong, wrong, config->fault_steps, FAULT_ANGLE_OFFSET);
}
