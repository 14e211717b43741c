/* SPDX-License-Identifier: Apache-2.0 */
/* Limits of the torque: control/torque/limit and i_d_limit, for all data that motor_check() accepts. */
#include "proof.h"

#include "control/torque/i_d_limit.h"
#include "control/torque/limit.c"
#include "fx/format.c"
#include "fx/q.c"

/* The functions that limit.c calls, with any result that their headers allow. */
q15_t fx_magnitude(int32_t x, int32_t y)
{
    q15_t length;
    (void)x, (void)y;
    ASSUME(length >= 0);
    return length;
}

q15_t fx_div_q15(int32_t num, int32_t den)
{
    q15_t quotient;
    ASSUME(num < 0 || den <= 0 || quotient >= 0);
    ASSUME(num != 0 || den == 0 || quotient == 0);
    return quotient;
}

static bound_t any_bound(void)
{
    bound_t bound;
    ASSUME(WITHIN(bound.torque, 0, INT16_MAX) && WITHIN(bound.max, 0, INT16_MAX) && bound.rated > 0);
    return bound;
}

void proof_a_limit_never_raises_another(void)
{
    bound_t bound = any_bound();
    int32_t limit;
    uint32_t reason;
    const bound_t before = bound;
    limit_to(&bound, limit, reason);
    PROVE(bound.max <= before.max && bound.max >= 0);
    PROVE(bound.max <= limit || (limit < 0 && bound.max == 0));
    PROVE((before.reasons & ~bound.reasons) == 0U);
    PROVE(bound.torque <= limit || bound.torque == 0 || (bound.reasons & reason) == reason);
}

void proof_a_power_limit_never_raises_another(void)
{
    bound_t bound = any_bound();
    q15_t limit, speed;
    int32_t loss;
    ASSUME(IS_Q15(loss) && speed >= 0);
    const bound_t before = bound;
    limit_by_power(&bound, limit, loss, speed);
    PROVE(bound.max <= before.max && bound.max >= 0);
    PROVE(limit > 0 || loss < 0 || bound.max == 0);
    PROVE(limit < Q15_MAX || bound.max == before.max);
}

void proof_a_derating_factor_is_between_0_and_1(void)
{
    derating_line_t line;
    q15_t x;
    const int32_t factor = derating_factor(&line, x);
    PROVE(WITHIN(factor, 0, INT16_MAX));
    PROVE(x != line.end || factor == 0);
}

void proof_beyond_the_line_no_torque_is_left(void)
{
    derating_line_t line;
    bound_t bound = any_bound();
    q15_t x;
    ASSUME(line.gain < 0 && x >= line.end);
    limit_by_line(&bound, &line, x, 1U);
    PROVE(bound.max == 0);
}

void proof_a_lost_temperature_limits_to_half(void)
{
    derating_line_t line;
    bound_t bound = any_bound();
    bool was_known = nondet_bool();
    int16_t dC;
    ASSUME(!temperature_is_known(dC));
    const bool known_before = was_known;
    limit_by_temperature(&bound, &line, dC, &was_known, 1U);
    PROVE(was_known == known_before);
    PROVE(!(known_before || dC == TEMPERATURE_OUT_OF_RANGE) || bound.max <= bound.rated / 2 + 1);
}

void proof_torque_inside_both_limits(void)
{
    torque_limit_t limit;
    q15_t torque;
    const bool backwards = nondet_bool();
    ASSUME(limit.drive >= 0 && limit.regen >= 0);
    const q15_t y = torque_limit_clamp(&limit, torque, backwards);
    PROVE(y <= (backwards ? limit.regen : limit.drive) && y >= -(backwards ? limit.drive : limit.regen));
    PROVE(magnitude(y) <= magnitude(torque) && (y == 0 || (y < 0) == (torque < 0)));
}

void proof_i_d_limit(void)
{
    i_d_limit_config_t c;
    q15_t psi_d_error;
    int16_t winding_dC;
    ASSUME(WITHIN(c.i_20, 0, 1 << 20) && c.slope >= 0 && c.slope <= (1 << 24) && c.i_max >= 0);
    const q15_t i_d_max = i_d_limit_step(&c, psi_d_error, winding_dC);
    PROVE(i_d_max >= 0 && i_d_max <= c.i_max);
}
