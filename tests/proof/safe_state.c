/* SPDX-License-Identifier: Apache-2.0 */
/* Freewheel or short circuit, and the speed that is known: safety/safe_state. */
#include "proof.h"

#include "fx/format.c"
#include "fx/q.c"
#include "safety/safe_state.c"

static safe_state_config_t any_config(void)
{
    safe_state_config_t c;
    ASSUME(c.psi_f > 0 && c.share_open > 0 && c.share_open < c.share_short);
    return c;
}

static safe_state_state_t any_state(void)
{
    safe_state_state_t s;
    s.short_circuit = nondet_bool();
    ASSUME(s.speed >= 0 && s.steady <= CONFIRMED_STEPS && s.without_current <= CONFIRMED_STEPS);
    ASSUME(s.rectifying <= RECTIFYING_STEPS);
    ASSUME(IS_Q15(s.i_before.d) && IS_Q15(s.i_before.q));
    return s;
}

static safe_state_in_t any_input(void)
{
    safe_state_in_t in;
    in.shorted = nondet_bool();
    in.currents_valid = nondet_bool();
    in.speed_valid = nondet_bool();
    in.over_voltage = nondet_bool();
    in.doubtful = nondet_bool();
    in.rectifying = nondet_bool();
    ASSUME(IS_Q15(in.i.d) && IS_Q15(in.i.q) && IS_Q15(in.i_last_period.d) && IS_Q15(in.i_last_period.q));
    ASSUME(IS_Q15(in.psi_current.d) && IS_Q15(in.psi_current.q));
    return in;
}

void proof_known_speed_is_never_below_a_valid_one(void)
{
    const safe_state_config_t c = any_config();
    safe_state_state_t s = any_state();
    const safe_state_in_t in = any_input();
    follow_speed(&c, &s, &in);
    PROVE(s.speed >= 0);
    PROVE(!in.speed_valid || s.speed >= to_q15(magnitude(in.omega)));
}

void proof_known_speed_falls_no_faster_than_a_rotor(void)
{
    const safe_state_config_t c = any_config();
    safe_state_state_t s = any_state();
    const safe_state_in_t in = any_input();
    const int32_t before = s.speed;
    const uint8_t quiet_before = s.without_current;
    follow_speed(&c, &s, &in);
    const bool at_rest = in.shorted && in.currents_valid && quiet_before + 1 >= CONFIRMED_STEPS;
    PROVE(at_rest || s.speed >= before - FALL_PER_STEP);
}

void proof_unknown_speed_is_kept(void)
{
    const safe_state_config_t c = any_config();
    safe_state_state_t s = any_state();
    const safe_state_in_t in = any_input();
    const safe_state_state_t before = s;
    ASSUME(!in.speed_valid && !in.shorted);
    follow_speed(&c, &s, &in);
    PROVE(s.speed == before.speed || (!before.short_circuit && before.unknown_steps >= UNKNOWN_STEPS));
}

void proof_known_speed_state_stays_in_range(void)
{
    const safe_state_config_t c = any_config();
    safe_state_state_t s = any_state();
    const safe_state_in_t in = any_input();
    ASSUME(s.unknown_steps <= UNKNOWN_STEPS);
    follow_speed(&c, &s, &in);
    PROVE(s.steady <= CONFIRMED_STEPS && s.without_current <= CONFIRMED_STEPS && s.unknown_steps <= UNKNOWN_STEPS);
    PROVE(s.speed >= 0);
    PROVE(IS_Q15(s.i_before.d) && IS_Q15(s.i_before.q));
}

void proof_known_voltage_is_kept_with_a_fault(void)
{
    safe_state_state_t s = any_state();
    const safe_state_in_t in = any_input();
    const q15_t before = s.v_dc;
    const uint8_t rectified = s.rectifying;
    follow_voltage(&s, &in);
    const bool by_diodes = in.rectifying && rectified + 1 >= RECTIFYING_STEPS;
    PROVE(s.v_dc >= in.v_dc);
    PROVE(!in.doubtful || by_diodes || s.v_dc >= before);
    PROVE(s.rectifying <= RECTIFYING_STEPS);
}
