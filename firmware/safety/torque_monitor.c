/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/torque_monitor.h"

#include "fx/q.h"
#include "fx/vec.h"
#include "types/faults.h"

enum { TORQUE_SAMPLES = 20, ANGLE_SAMPLES = 5, SETTLE_SAMPLES = 5 };

#define MEAN Q15(0.25)
#define PSI_WEAK Q15(0.5)    /* of psi_f: a magnet has never lost that much */
#define PSI_STRONG Q15(0.35)
#define PSI_ASIDE Q15(0.2)

static uint32_t confirm(uint8_t *count, bool bad, uint8_t limit, uint32_t fault)
{
    *count = bad ? (uint8_t)fx_min_s32(*count + 1, limit) : 0;
    return (*count >= limit) ? fault : 0;
}

static q15_t dot(dq_t a, dq_t b)
{
    return fx_sat_q15((fx_mul_q30((q15_t)a.d, (q15_t)b.d) >> 15) + (fx_mul_q30((q15_t)a.q, (q15_t)b.q) >> 15));
}

/* Voltage that changes the flux, from the tables: the field's power is not the shaft's (MN-6). */
static dq_t changing(const torque_monitor_config_t *config, const torque_monitor_state_t *state, dq_t psi)
{
    return (dq_t){fx_mul_gain_q15(config->rate_gain, fx_sat_q15(psi.d - state->psi.d)),
                  fx_mul_gain_q15(config->rate_gain, fx_sat_q15(psi.q - state->psi.q))};
}

/* Too much, or against the request; too little is no hazard (MN-7), (MN-8). */
static bool too_much(const torque_monitor_config_t *config, torque_monitor_state_t *state,
                     const torque_monitor_in_t *in, dq_t emf, dq_t change)
{
    const int32_t error = dot(emf, in->i) - fx_mul_q15(in->torque, in->omega);
    const q15_t step = fx_sat_q15(error - fx_q15_from_q31(state->deviation));
    state->deviation = fx_add2_q31(state->deviation, fx_mul_q30(MEAN, step));
    const int32_t mean = fx_q15_from_q31(state->deviation);

    const q15_t current = fx_magnitude((q15_t)in->i.d, (q15_t)in->i.q);
    const q15_t allowed = fx_sat_q15(config->t_0 + (fx_abs_q15(in->torque) >> 3));
    /* The tables' slope is not exact, nor was the change the same all through the millisecond. */
    const q15_t unsure = fx_sat_q15(config->v_0 + (fx_abs_q31(change.d) + fx_abs_q31(change.q)) / 2);
    const int32_t power =
        fx_mul_q15(allowed, fx_abs_q15(in->omega)) + fx_mul_q15(unsure, fx_add_q15(current, config->i_0));
    const int32_t asked = fx_mul_q15(in->torque, in->omega);
    if (fx_abs_q31(asked) < fx_mul_q15(config->t_0, fx_abs_q15(in->omega))) {
        return fx_abs_q31(mean) > power; /* around no torque either sign is too much */
    }
    return (asked < 0) ? (mean < -power || mean > power - asked) : (mean > power || mean < -power - asked);
}

/* (MN-9), (MN-10) */
static bool turned(const torque_monitor_config_t *config, const torque_monitor_in_t *in, dq_t emf, dq_t change)
{
    const q15_t speed = fx_abs_q15(in->omega);
    const int32_t e_d = emf.d + fx_mul_q15(in->omega, (q15_t)in->psi.q);
    const int32_t e_q = emf.q - fx_mul_q15(in->omega, (q15_t)in->psi.d);
    const int32_t along = (in->omega < 0) ? -e_q : e_q;
    const int32_t psi_f = fx_mul_q15(speed, config->psi_f);
    const int32_t magnet = fx_mul_q15(PSI_ASIDE, (q15_t)psi_f);
    if (magnet < config->v_0 >> 1) {
        return false; /* so slow that the inverter's own error hides the back-EMF */
    }
    const q15_t current = fx_magnitude((q15_t)in->i.d, (q15_t)in->i.q);
    /* A winding twice as hot; noise in the change of flux, and all of a change that is no noise: it may have been over
     * before the sample. */
    const int32_t moved = fx_abs_q31(change.d) + fx_abs_q31(change.q);
    const int32_t unsure = (config->v_0 >> 1) + fx_mul_gain_q15(config->r, current) + moved / 2 +
                           fx_max_s32(moved - config->v_0, 0);
    const int32_t aside = magnet + (fx_mul_q15(speed, fx_abs_q15((q15_t)in->psi.q)) >> 3) + unsure;
    return fx_abs_q31(e_d) > aside || along > fx_mul_q15(PSI_STRONG, (q15_t)psi_f) + unsure ||
           along < -fx_mul_q15(PSI_WEAK, (q15_t)psi_f) - unsure;
}

uint32_t torque_monitor_step(const torque_monitor_config_t *config, torque_monitor_state_t *state,
                             const torque_monitor_in_t *in)
{
    if (!in->acting || state->settling < SETTLE_SAMPLES) {
        const uint8_t settled = in->acting ? (uint8_t)(state->settling + 1U) : 0U;
        *state = (torque_monitor_state_t){.psi = in->psi, .settling = settled};
        return 0;
    }
    const dq_t change = changing(config, state, in->psi);
    state->psi = in->psi;
    const q15_t drop_d = fx_mul_gain_q15(config->r, (q15_t)in->i.d);
    const q15_t drop_q = fx_mul_gain_q15(config->r, (q15_t)in->i.q);
    const dq_t emf = {fx_sat_q15(in->u.d - drop_d - change.d), fx_sat_q15(in->u.q - drop_q - change.q)};
    return confirm(&state->torque, too_much(config, state, in, emf, change), TORQUE_SAMPLES, FAULT_TORQUE) |
           confirm(&state->angle, turned(config, in, emf, change), ANGLE_SAMPLES, FAULT_ANGLE_OFFSET);
}
