/* SPDX-License-Identifier: Apache-2.0 */
/* Duties and the limit of the voltage: control/current/modulate and current_control, for all motor data that
 * motor_check() accepts. */
#include "proof.h"

#include "control/current/modulate.c"

#include "control/current/current_control.c"
#include "drive/motor.c"
#include "fx/circle_table.c"

static bool is_guaranteed(const modulate_config_t *c)
{
    return c->longest_q31 > Q31(0.25) && c->longest_q31 <= c->nearer_rail_q31 && c->nearer_rail_q31 <= Q31(0.5) &&
           WITHIN(c->dead_time_q16, 0, Q16(0.2) - 1) && WITHIN(c->knee_q17, 1, (1 << 30) - 1) &&
           WITHIN(c->knee_side_q17, 1, (1 << 30) - 1);
}

static modulate_config_t accepted_config(void)
{
    modulate_config_t c;
    ASSUME(is_guaranteed(&c));
    return c;
}

void proof_modulation_data_are_checked(void)
{
    motor_t m;
    ASSUME(modulate_check(&m) == MOTOR_CHECK_OK);
    PROVE(is_guaranteed(&m.parameters.modulate));
}

void proof_duty_is_one_that_the_bridge_can_make(void)
{
    const modulate_config_t c = accepted_config();
    const pulse_limits_t limits = {c.longest_q31, c.nearer_rail_q31, HALF_Q31 + ROUND_Q31};
    int32_t x;
    uint32_t limited = 0;
    const uint32_t duty = limit_pulse(limits, x, &limited);
    /* The shortest pulse, in the duty's format, rounded. */
    const uint32_t shortest = ((uint32_t)(HALF_Q31 - c.longest_q31) + ROUND_Q31) >> 16;
    PROVE(duty <= DUTY_ONE);
    PROVE(duty == 0U || duty + 1U >= shortest);
    PROVE(duty == DUTY_ONE || DUTY_ONE - duty + 1U >= shortest);
}

void proof_duty_is_limited_only_beyond_the_pulse(void)
{
    const modulate_config_t c = accepted_config();
    const pulse_limits_t limits = {c.longest_q31, c.nearer_rail_q31, HALF_Q31 + ROUND_Q31};
    int32_t x;
    uint32_t limited = 0;
    const int64_t duty = limit_pulse(limits, x, &limited);
    const int64_t wanted = ((int64_t)x + HALF_Q31 + ROUND_Q31) >> 16;
    PROVE(limited != 0U || duty == wanted);
    PROVE((limited != 0U) == (x >= c.longest_q31 || x < -(int64_t)c.longest_q31));
    PROVE(limited == 0U || (x < 0 ? duty <= 16384 : duty >= 16384));
}

void proof_middle_phase(void)
{
    abc_q29_t x;
    ASSUME(WITHIN(x.a, -(1 << 30), (1 << 30) - 1) && WITHIN(x.b, -(1 << 30), (1 << 30) - 1) &&
           WITHIN(x.c, -(1 << 30), (1 << 30) - 1));
    const int32_t y = plus_middle(0, x) / 2;
    PROVE(y == x.a || y == x.b || y == x.c);
    PROVE((y >= x.a) + (y >= x.b) + (y >= x.c) >= 2);
    PROVE((y <= x.a) + (y <= x.b) + (y <= x.c) >= 2);
}

/* What a voltage of one axis leaves to the other, by the table. */
static int32_t left_by(int32_t v)
{
    return fx_circle_table[(v ^ (v >> 31)) >> 7];
}

void proof_voltage_circle(void)
{
    dq_q15_t v;
    int32_t error_d, omega;
    ASSUME(WITHIN(v.d, -(1 << 30), 1 << 30) && WITHIN(v.q, -(1 << 30), 1 << 30) && IS_Q15(omega));
    const dq_q15_t limited = limit_to_circle(v, error_d, omega);
    PROVE(IS_Q15(limited.d) && IS_Q15(limited.q));
    PROVE(limited.q <= left_by(limited.d) && limited.q >= -left_by(limited.d) - 1);
    const int32_t left = left_by(fx_sat_q15_word(v.q));
    const int32_t least = ((v.q ^ (v.q >> 31)) < V_Q_FAR) ? V_D_MIN : V_D_LEAST;
    const int32_t d_max = (left > least) ? left : least;
    PROVE(error_d <= 0 || (limited.d <= d_max && limited.d >= -d_max - 1));
    const int32_t d = fx_sat_q15_word(v.d);
    PROVE(error_d <= 0 || d > d_max || d < -d_max - 1 || limited.d == d);
    PROVE((v.d >= 0) == (limited.d >= 0));
}

void proof_voltage_circle_changes_nothing_inside(void)
{
    dq_q15_t v;
    int32_t error_d, omega;
    ASSUME(IS_Q15(v.d) && IS_Q15(v.q) && IS_Q15(omega));
    const dq_q15_t limited = limit_to_circle(v, error_d, omega);
    const bool inside = v.q <= left_by(v.d) && v.q >= -left_by(v.d) && v.d <= left_by(v.q) && v.d >= -left_by(v.q);
    PROVE(!inside || (limited.d == v.d && limited.q == v.q));
}

void proof_integrator_stays_in_range(void)
{
    current_control_state_t s, next;
    int32_t gain, turn, d, q;
    ASSUME(WITHIN(s.s_d_q30, -(1 << 30), (1 << 30) - 1) && WITHIN(s.s_q_q30, -(1 << 30), (1 << 30) - 1));
    ASSUME(WITHIN(gain, 0, Q15(0.5) - 1) && WITHIN(turn, -gain, gain) && IS_Q15(d) && IS_Q15(q));
    integrate(&next, s, fx_pair(turn, gain), fx_pair(d, q));
    PROVE(WITHIN(next.s_d_q30, -(1 << 30), (1 << 30) - 1) && WITHIN(next.s_q_q30, -(1 << 30), (1 << 30) - 1));
    PROVE(d != 0 || q != 0 || (next.s_d_q30 == s.s_d_q30 && next.s_q_q30 == s.s_q_q30));
}

void proof_reciprocal_of_the_dc_voltage(void)
{
    current_control_config_t c;
    int32_t v_dc;
    ASSUME(IS_MAGNITUDE(v_dc));
    const int32_t per_v_max_q25 = reciprocal_v_max(&c, v_dc);
    PROVE(per_v_max_q25 >= 0 && per_v_max_q25 <= 0x7FFFFFFF);
    PROVE(v_dc != 0 || per_v_max_q25 == 0);
}
