/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CURRENT_MODULATE_PHASES_H
#define CURRENT_MODULATE_PHASES_H
/** Polarity of the phase currents in the acting period, which both modulate.c and modulate_applied.c need.
 *   sign_x = sat(i_x / i_knee), i_ab = rot(theta + 1.5 w T_s) i_dq
 * Source   docs/theory/modulation.md (MO-6)
 * Units    q15, 1.0 beyond the knee
 * Range    any current
 * Rounding 1 LSB
 * Errors   saturates by design: the polarity is constant beyond the knee
 * Context  fast ISR; included by modulate.c and modulate_applied.c only */
#include "control/current/modulate.h"
#include "control/current/transform.h"
#include "fx/codegen.h"
#include "fx/q.h"

#define DUTY_ONE 32768

/* 1.0 beyond the knee (MO-6). */
static inline abc_q15_t polarity(const modulate_config_t *config, fx_pair_t i, fx_pair_t at)
{
    const ab_q30_t x = {fx_difference2(i, at), fx_dot2_cross(i, at)};
    int32_t knee_q17 = config->knee_q17;
    int32_t knee_side_q17 = config->knee_side_q17;
    fx_both_loaded(&knee_q17, &knee_side_q17);
    const int32_t alpha = fx_mulhi(knee_q17, x.alpha); /* Q17 * Q30 = Q15, below 2^29 */
    const abc_t phases = inverse_clarke(alpha, fx_mulhi(knee_side_q17, x.beta));
    return (abc_q15_t){fx_sat_q15_word(phases.a), fx_sat_q15_word(phases.b), fx_sat_q15_word(phases.c)};
}

#endif
