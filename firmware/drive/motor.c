/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/motor.h"

#include "control/current/transform.h"
#include "drive/mrai/mrai_seam.h"

#define CIRCLE_CLEAR_Q30 1007681536 /* (31/32)^2 */

/* (SC-10). With so many periods per step the sums of a window do not overflow. */
static bool step_valid(const bases_t *b)
{
    return b->periods_per_step >= 4U && b->periods_per_step <= 40U && b->step_s > 0.8e-3F && b->step_s < 1.25e-3F;
}

/* v_ratio is stored three times: itself, its inverse (Q15 * Q16 = Q31) and sqrt(3)/2 of it. 1/2 < v_ratio < 0.7. */
static bool ratio_valid(const motor_t *m)
{
    const int32_t ratio_q31 = m->parameters.modulate.alpha_q31;
    const uint32_t one_q31 = (uint32_t)(ratio_q31 >> 16) * (m->parameters.current_control.per_ratio_q31 >> 15);
    const int32_t error = m->parameters.modulate.side_q31 - fx_mul_q31(ratio_q31, Q31(SQRT3_HALF));
    return ratio_q31 > Q31(0.5) && ratio_q31 < Q31(0.7) && one_q31 - 0x7FF80000U < 0x100000U && error > -16 &&
           error < 16;
}

/* A sample that the short check accepts must not exceed any trip level: i_normal + sum_max/3 <= i_trip. */
static bool normal_current_valid(const monitor_config_t *c)
{
    const int32_t max = c->i_trip - c->zero_sequence_max - 1;
    return max >= 0 && c->i_normal_squared_q30 >= 0 && c->i_normal_squared_q30 <= max * max;
}

static motor_check_t monitors_check(const motor_t *m)
{
    const monitor_config_t *c = &m->monitor;
    if (c->i_trip <= 0 || c->i_trip >= Q15(0.8)) {
        return MOTOR_CHECK_OVER_CURRENT_LEVEL;
    }
    if (c->v_min >= c->v_max) {
        return MOTOR_CHECK_DC_VOLTAGE_LEVELS;
    }
    if (c->zero_sequence_max <= 0 || c->zero_sequence_max > c->sum_max / 3 || c->sum_max > 3 * Q15_MAX) {
        return MOTOR_CHECK_CURRENT_SUM_LEVEL;
    }
    if (!normal_current_valid(c)) {
        return MOTOR_CHECK_NORMAL_CURRENT_LEVEL;
    }
    if (m->safe_state.psi_f <= 0) {
        return MOTOR_CHECK_SAFE_STATE_FLUX;
    }
    const bool ordered = m->safe_state.share_open > 0 && m->safe_state.share_open < m->safe_state.share_short;
    return ordered ? MOTOR_CHECK_OK : MOTOR_CHECK_SAFE_STATE_LEVELS;
}

/* (MO-11): the largest difference between two phases is sqrt(3) v_ratio |v|; current control may limit from 31/32 on.
 * 1/v_ratio is Q15 in two factors, below 2 each. */
uint32_t motor_clear_q30(const motor_parameters_t *p, int32_t dead_time)
{
    const int32_t span = 2 * ((p->modulate.longest_q31 >> 16) - dead_time);
    const int64_t per_ratio = p->current_control.per_ratio_q31 >> 16;
    const int64_t max_q30 = (((span > 0) ? span * span / 3 : 0) * per_ratio >> 15) * per_ratio >> 15;
    return (uint32_t)((max_q30 < CIRCLE_CLEAR_Q30) ? max_q30 : CIRCLE_CLEAR_Q30);
}

static bool knee_valid(const modulate_config_t *c)
{
    return c->knee_q17 > 0 && c->knee_q17 < (1 << 30) && c->knee_side_q17 > 0 && c->knee_side_q17 < (1 << 30);
}

static motor_check_t modulate_check(const motor_t *m)
{
    const modulate_config_t *c = &m->parameters.modulate;
    if (c->longest_q31 <= Q31(0.25) || c->longest_q31 > c->nearer_rail_q31 || c->nearer_rail_q31 > Q31(0.5)) {
        return MOTOR_CHECK_SHORTEST_PULSE;
    }
    if (c->dead_time_q16 < 0 || c->dead_time_q16 >= Q16(0.2)) {
        return MOTOR_CHECK_DEAD_TIME;
    }
    if (!knee_valid(c)) {
        return MOTOR_CHECK_CURRENT_KNEE;
    }
    const uint32_t clear_max_q30 = motor_clear_q30(&m->parameters, c->dead_time_q16 / 2);
    return (m->parameters.current_control.clear_q30 <= clear_max_q30) ? MOTOR_CHECK_OK : MOTOR_CHECK_CLEAR_VOLTAGE;
}

static bool turning_gains_valid(const turning_control_config_t *c)
{
    return c->per_period_q29 > 0 && c->approach_q32 > 0 && c->feedback_q32 > 0 && c->integral_q32 > 0 &&
           c->drop_q29 >= 0 && c->knee_turns_q27 > 0;
}

/* The target divides by sigma in Q16. */
#define SIGMA_MIN_Q24 256

/* A tracker with a turn_shift may run only on the route of the law for a field that turns far. That law uses the usual
 * one as its voltage limit, which must then have no gains. */
static bool turning_valid(const motor_t *m)
{
    const turning_control_config_t *c = &m->turning_control;
    const current_control_config_t *limits = &m->parameters.current_control;
    if (!turning_control_used(c)) {
        return m->angle_tracker.turn_shift == 0U && limits->sigma_q24 >= SIGMA_MIN_Q24;
    }
    return turning_gains_valid(c) && limits->sigma_q24 == 0 && limits->integral_gain == 0 &&
           m->angle_tracker.turn_shift <= 1U;
}

static motor_check_t control_check(const motor_t *m)
{
    const current_control_config_t *c = &m->parameters.current_control;
    const voltage_reserve_config_t *v = &m->voltage_reserve;
    if (c->setpoint_weight <= 0 || c->integral_gain < 0 || c->integral_gain >= Q15(0.5) || c->tracking_gain_q34 < 0 ||
        !turning_valid(m)) {
        return MOTOR_CHECK_CURRENT_CONTROL_GAINS;
    }
    if (!ratio_valid(m)) {
        return MOTOR_CHECK_VOLTAGE_RATIO;
    }
    if ((uint32_t)m->monitor.v_min <= c->per_ratio_q31 >> 22) {
        return MOTOR_CHECK_UNDER_VOLTAGE_LEVEL;
    }
    if (v->v_ratio <= 0 || v->trim_min > 0 || v->trim_max < 0) {
        return MOTOR_CHECK_VOLTAGE_RESERVE;
    }
    if (m->parameters.torque_loop.authority <= 0 || m->parameters.torque_loop.torque_min <= 0) {
        return MOTOR_CHECK_TORQUE_LOOP;
    }
    return (m->torque_max > 0) ? MOTOR_CHECK_OK : MOTOR_CHECK_TORQUE_MAX;
}

/* Tables before the values that depend on them; MOTOR_CHECK_OK is zero. */
motor_check_t motor_check(const motor_t *m)
{
    const motor_check_t parts[] = {
        step_valid(&m->bases) ? MOTOR_CHECK_OK : MOTOR_CHECK_TASK_STEP,
        flux_table_check(&m->flux_table),
        current_reference_check(&m->current_reference),
        torque_limit_check(&m->torque_limit),
        monitors_check(m),
        control_check(m),
        modulate_check(m),
        mrai_data_check(m),
        identify_check(&m->identify),
    };
    for (unsigned n = 0; n < sizeof parts / sizeof *parts; n++) {
        if (parts[n] != MOTOR_CHECK_OK) {
            return parts[n];
        }
    }
    return MOTOR_CHECK_OK;
}
