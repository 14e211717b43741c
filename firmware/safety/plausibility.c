/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/plausibility.h"

#include "fx/codegen.h"
#include "fx/q.h"
#include "fx/sqrt.h"
#include "fx/vec.h"
#include "signal/debounce.h"
#include "signal/mean.h"
#include "types/faults.h"

#define RIGHT_PERMILLE 1000
#define REFERENCE_ERROR_PERMILLE 60
#define REFERENCE_STEPS 10U
#define ZERO_STEPS 50
#define EQUAL_MAX 4 /* q15: two values of measure_phases() for the same counts differ by 2 2.2 LSB at most */
#define DEVIATION_UNLIMITED 5 /* per step while the voltage is not limited: confirmed in a fifth of the time */

/* d^2 + q^2, Q30. Comparing squares saves the root. */
static uint32_t squared(int32_t d, int32_t q)
{
    const q15_t x = fx_sat_q15(d), y = fx_sat_q15(q);
    return (uint32_t)fx_mul_q30(x, x) + (uint32_t)fx_mul_q30(y, y);
}

/* (MN-1); samples without a deviation decrease the count. current: the magnitude of the expected one. */
static uint32_t deviation(const plausibility_config_t *config, plausibility_state_t *state, const plausibility_in_t *in,
                          q15_t current)
{
    const dq_q15_t i_ref = state->expected;
    const uint32_t limit = (uint32_t)config->e_0 + ((uint32_t)current >> 3);                /* below 2^15 + 2^12 */
    const bool bad = squared(in->i.d - i_ref.d, in->i.q - i_ref.q) > limit * limit + limit; /* (limit + 1/2)^2 */
    const int32_t step = bad ? (in->voltage_limited ? 1 : DEVIATION_UNLIMITED) : -DEVIATION_UNLIMITED;
    state->deviation = (int16_t)fx_clamp_q31(state->deviation + step, 0, config->deviation_steps);
    return (state->deviation >= config->deviation_steps) ? FAULT_CONTROL : 0;
}

/* (MN-2): only samples in which the reference is large count, not the zero crossings. The two directions of the current
 * count apart, because one open switch stops the current in one of them only. */
static inline FX_INLINED_IF_OPTIMISED bool is_phase_lost(const plausibility_config_t *config, int8_t count[2],
                                                         int32_t alive, int32_t reference, int32_t measured)
{
    if (fx_abs_q31(reference) > alive) {
        const bool negative = reference < 0;
        int8_t *c = &count[negative ? 1 : 0];
        const bool missing = (negative ? -measured : measured) <= config->i_dead;
        *c = (int8_t)fx_clamp_q31(*c + (missing ? 1 : -1), 0, config->lost_steps);
    }
    return count[0] + count[1] >= config->lost_steps;
}

static uint32_t lost_phases(const plausibility_config_t *config, plausibility_state_t *state,
                            const plausibility_in_t *in, q15_t current)
{
    const int32_t behind = fx_mul_gain_q15(config->behind_gain, in->u_behind); /* (MN-43) */
    const int32_t alive = fx_max_s32(config->i_alive, current >> 3) + behind;
    const bool a_lost = is_phase_lost(config, state->lost[0], alive, in->phases_ref.a, in->phases.a);
    const bool b_lost = is_phase_lost(config, state->lost[1], alive, in->phases_ref.b, in->phases.b);
    const bool c_lost = is_phase_lost(config, state->lost[2], alive, in->phases_ref.c, in->phases.c);
    return (a_lost || b_lost || c_lost) ? FAULT_PHASE_LOST : 0U;
}

/* Square of the distance of a deviation from its own mean over 8 steps, Q30. Each axis of the deviation is limited to
 * e_max. */
static uint32_t squared_distance_from_mean(dq_q15_t *mean_x8, dq_q15_t i, dq_q15_t i_ref, int32_t e_max)
{
    const int32_t d = fx_clamp_q31(i.d - i_ref.d, -e_max, e_max), q = fx_clamp_q31(i.q - i_ref.q, -e_max, e_max);
    const dq_q15_t ripple = {d - (mean_x8->d >> 3), q - (mean_x8->q >> 3)};
    *mean_x8 = (dq_q15_t){mean_x8->d + ripple.d, mean_x8->q + ripple.q};
    return squared(ripple.d, ripple.q);
}

/* (MN-11): an open switch removes one half wave of a phase current. In the rotor frame that is an oscillation about the
 * reference. Every other sample of it may be small, so that (MN-1) does not confirm it. If the field turns by half a
 * turn in a step, the samples or the means of the steps may be constant, but not both. */
static uint32_t oscillation(const plausibility_config_t *config, plausibility_state_t *state,
                            const plausibility_in_t *in)
{
    const int32_t e_max = config->ripple_max * 4;
    const uint32_t of_sample = squared_distance_from_mean(&state->sample_x8, in->i, state->expected, e_max);
    const uint32_t of_step = squared_distance_from_mean(&state->step_x8, in->i_mean, state->expected, e_max);
    const int32_t larger = fx_sqrt_q30((of_sample > of_step) ? of_sample : of_step);
    state->ripple_x16 += larger - (state->ripple_x16 >> 4);
    const bool bad = (state->ripple_x16 >> 4) > config->ripple_max;
    return debounce_step(&state->oscillating, bad, config->ripple_steps, FAULT_CONTROL);
}

/* (MN-3): the phase currents sum to zero, so a phase must change by as much as the other two together. It may stay the
 * same while these change in opposite directions, for example in a machine at rest. The phases come from the current
 * vector and the zero sequence, whose rounding changes a value that is repeated. */
static bool is_sensor_stuck(const plausibility_config_t *config, uint8_t *count, int32_t change, int32_t of_others)
{
    const int32_t change_min = config->i_dead >> 2; /* several converter counts: more than noise between two of them */
    if (fx_abs_q31(change) > EQUAL_MAX) {
        *count = 0;
    } else if (fx_abs_q31(of_others) > change_min) {
        *count = (uint8_t)fx_min_s32(*count + 1, config->equal_steps);
    }
    return *count >= config->equal_steps;
}

static uint32_t stuck_sensors(const plausibility_config_t *config, plausibility_state_t *state,
                              const plausibility_in_t *in)
{
    const abc_q15_t i = in->phases;
    const int32_t a = i.a - state->last.a, b = i.b - state->last.b, c = i.c - state->last.c;
    state->last = i;
    const bool a_stuck = is_sensor_stuck(config, &state->equal[0], a, b + c);
    const bool b_stuck = is_sensor_stuck(config, &state->equal[1], b, c + a);
    const bool c_stuck = is_sensor_stuck(config, &state->equal[2], c, a + b);
    return (a_stuck || b_stuck || c_stuck) ? FAULT_CURRENT_STUCK : 0;
}

dq_q15_t plausibility_expected(const plausibility_config_t *config, const plausibility_state_t *state, dq_q15_t i_ref)
{
    return (dq_q15_t){mean_follow((q15_t)state->expected.d, i_ref.d, config->answer_rate),
                      mean_follow((q15_t)state->expected.q, i_ref.q, config->answer_rate)};
}

/* (MN-37), whether the bridge acts or not, because the drive must not start with a wrong reference. */
static uint32_t wrong_reference(plausibility_state_t *state, const plausibility_in_t *in)
{
    const bool wrong = in->known_permille >= 0 &&
                       fx_abs_q31(in->known_permille - RIGHT_PERMILLE) > REFERENCE_ERROR_PERMILLE;
    return debounce_step(&state->reference, wrong, REFERENCE_STEPS, FAULT_INPUT);
}

static int32_t largest_of(abc_q15_t i)
{
    return fx_max_s32(fx_max_s32(fx_abs_q31(i.a), fx_abs_q31(i.b)), fx_abs_q31(i.c));
}

/* (MN-38): the zero of a current sensor can be checked only while no current can flow: before the first start, but not
 * when the drive is enabled again while the machine turns. */
static uint32_t wrong_zero(const plausibility_config_t *config, plausibility_state_t *state,
                           const plausibility_in_t *in)
{
    const int32_t step = (in->at_rest && largest_of(in->phases) > config->zero_error_max) ? 1 : -1;
    state->not_zero = (uint8_t)fx_clamp_q31(state->not_zero + step, 0, ZERO_STEPS);
    return (state->not_zero >= ZERO_STEPS) ? FAULT_INPUT : 0U;
}

uint32_t plausibility_step(const plausibility_config_t *config, plausibility_state_t *state,
                           const plausibility_in_t *in)
{
    const bool hot = in->inverter_dC >= config->inverter_trip_dC || in->winding_dC >= config->winding_trip_dC;
    const bool fast = fx_abs_q15(in->omega) > config->omega_trip;
    uint32_t faults = debounce_step(&state->hot, hot, config->hot_steps, FAULT_TEMPERATURE);
    faults |= debounce_step(&state->fast, fast, config->fast_steps, FAULT_OVER_SPEED) | wrong_reference(state, in) |
              wrong_zero(config, state, in);
    if (!in->acting) {
        *state = (plausibility_state_t){
            .fast = state->fast,
            .hot = state->hot,
            .reference = state->reference,
            .not_zero = state->not_zero,
            .last = state->last,
        };
        return faults;
    }
    faults |= (in->gate_exceeded_steps >= config->gate_exceeded_steps) ? FAULT_TORQUE : 0U;
    state->expected = plausibility_expected(config, state, in->i_ref);
    const q15_t current = fx_magnitude(state->expected.d, state->expected.q);
    return faults | deviation(config, state, in, current) | oscillation(config, state, in) |
           stuck_sensors(config, state, in) | lost_phases(config, state, in, current);
}
