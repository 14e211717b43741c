/* SPDX-License-Identifier: Apache-2.0 */
/* The side of a switch that conducts always: safety/shorted_switch. */
#include "proof.h"

#include "fx/div.h"
#include "fx/format.c"
#include "fx/q.c"

/* Any share that two currents of opposite signs can have. */
q15_t fx_div_q15(int32_t num, int32_t den)
{
    PROVE(IS_Q15(num) && IS_Q15(den) && den > 0);
    q15_t share;
    ASSUME(IS_Q15(share));
    return share;
}

#include "safety/shorted_switch.c"

static shorted_switch_in_t any_input(void)
{
    shorted_switch_in_t in;
    ASSUME(IS_Q15(in.i_last.a) && IS_Q15(in.i_last.b) && IS_Q15(in.i_last.c));
    ASSUME(IS_Q15(in.i.a) && IS_Q15(in.i.b) && IS_Q15(in.i.c));
    ASSUME(IS_Q15(in.v_dc) && in.v_dc >= 0);
    ASSUME(in.i_min > 0 && WITHIN(in.turn_gain, 0, 1 << 28));
    return in;
}

void proof_a_shorted_switch_carries_the_current_that_shows_it(void)
{
    const shorted_switch_in_t in = any_input();
    const shorted_switch_t found = shorted_switch_find(&in);
    const bool out = in.i.a > in.i_min || in.i.b > in.i_min || in.i.c > in.i_min;
    const bool into = in.i.a < -in.i_min || in.i.b < -in.i_min || in.i.c < -in.i_min;
    PROVE(found != SHORTED_SWITCH_UPPER || out);
    PROVE(found != SHORTED_SWITCH_LOWER || into);
}

void proof_one_direction_shows_no_shorted_switch(void)
{
    const shorted_switch_in_t in = any_input();
    const bool a = in.i.a > in.i_min || in.i.a<-in.i_min, b = in.i.b> in.i_min || in.i.b < -in.i_min;
    ASSUME(!(a && b) && in.i.c <= in.i_min && in.i.c >= -in.i_min);
    PROVE(shorted_switch_find(&in) == SHORTED_SWITCH_NONE);
}
