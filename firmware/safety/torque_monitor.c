/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/torque_monitor.h"

#include "fx/q.h"
#include "fx/vec.h"
#include "signal/debounce.h"
#include "types/faults.h"

#define TOLERANCE 8          /* an eighth of the resistance: of the winding, the sensor and the skin effect */
#define PSI_WEAK Q15(0.5)    /* largest plausible loss of magnet flux, of psi_f */
#define PSI_STRONG Q15(0.35) /* largest plausible gain */
#define PSI_D_AXIS Q15(0.2)  /* e_d allowed, of the magnet's back-EMF */

static q15_t dot(dq_q15_t a, dq_q15_t b)
{
    return fx_sat_q15((fx_mul_q30((q15_t)a.d, (q15_t)b.d) >> 15) + (fx_mul_q30((q15_t)a.q, (q15_t)b.q) >> 15));
}

/* The speed without the tracker's lag, and its remaining error (MN-26). */
typedef struct {
    q15_t omega, doubt;
} speed_t;

static q15_t lag_of(const torque_monitor_config_t *config, const torque_monitor_state_t *state, q15_t tracked)
{
    return fx_mul_gain_q15(config->lag_gain, fx_sat_q15(tracked - state->omega));
}

static speed_t follow_speed(const torque_monitor_config_t *config, const torque_monitor_state_t *state, q15_t tracked)
{
    const q15_t lag = lag_of(config, state, tracked);
    return (speed_t){fx_add_q15(tracked, lag), fx_abs_q15(lag)};
}

q15_t torque_monitor_lag(const torque_monitor_config_t *config, const torque_monitor_state_t *state, q15_t tracked)
{
    const int32_t lag = lag_of(config, state, tracked);
    return (q15_t)(lag - fx_clamp_q31(lag, -config->lag_noise, config->lag_noise));
}

q15_t torque_monitor_missing_voltage(q15_t lag, dq_q15_t psi)
{
    return (lag == 0) ? 0 : fx_mul_q15(fx_abs_q15(lag), fx_magnitude(psi.d, psi.q));
}

static q31_t resistance_at(const torque_monitor_config_t *config, int32_t dC)
{
    return config->r + config->r_per_dC * (dC - 200); /* 20 C */
}

winding_resistance_t torque_monitor_resistance(const torque_monitor_config_t *config, int16_t winding_dC)
{
    const int32_t min_dC = config->winding_min_dC, max_dC = config->winding_max_dC;
    if (temperature_is_known(winding_dC)) {
        const q31_t known = resistance_at(config, fx_clamp_q31(winding_dC, min_dC, max_dC));
        return (winding_resistance_t){known >> 15, known / TOLERANCE >> 15};
    }
    const q31_t middle = resistance_at(config, (min_dC + max_dC) / 2);
    const q31_t half_range = resistance_at(config, max_dC) - middle;
    return (winding_resistance_t){middle >> 15, (half_range + middle / TOLERANCE) >> 15};
}

/* Present speed and resistance of the machine, each with its largest error, and the magnitude of its current. */
typedef struct {
    speed_t speed;
    winding_resistance_t r;
    q15_t current;
} machine_t;

/* d psi/dt from the tables: the power that changes the field is not shaft power (MN-6). */
static dq_q15_t flux_rate(const torque_monitor_config_t *config, const torque_monitor_state_t *state, dq_q15_t psi)
{
    return (dq_q15_t){fx_mul_gain_q15(config->rate_gain, fx_sat_q15(psi.d - state->psi.d)),
                      fx_mul_gain_q15(config->rate_gain, fx_sat_q15(psi.q - state->psi.q))};
}

/* Torque beyond the commanded one or against its direction; too little torque is no hazard (MN-7), (MN-8). */
static bool is_torque_excessive(const torque_monitor_config_t *config, torque_monitor_state_t *state,
                                const torque_monitor_in_t *in, const machine_t *now, dq_q15_t emf, dq_q15_t rate)
{
    const int32_t commanded = fx_mul_q15(in->torque, now->speed.omega);
    const int32_t error = dot(emf, in->i) - commanded;
    const q15_t step = fx_sat_q15(error - fx_q15_from_q31(state->deviation));
    state->deviation = fx_add2_q31(state->deviation, fx_mul_q30(config->mean_rate, step));
    const int32_t mean = fx_q15_from_q31(state->deviation);

    const q15_t allowed = fx_sat_q15(config->t_0 + (fx_abs_q15(in->torque) >> 3));
    const int32_t of_torque = fx_mul_q15(allowed, fx_abs_q15(now->speed.omega));
    if (fx_abs_q31(mean) < of_torque) { /* in most steps; the limit is at least this */
        return false;
    }
    /* The tables' slope is not exact, and the flux does not change uniformly during the step. */
    const q15_t drop_error = fx_mul_gain_q15(now->r.error, now->current);
    const q15_t v_error = fx_sat_q15(config->v_0 + (fx_abs_q31(rate.d) + fx_abs_q31(rate.q)) / 2 + drop_error);
    const int32_t limit = of_torque + fx_mul_q15(v_error, fx_add_q15(now->current, config->i_0)) +
                          fx_mul_q15(fx_abs_q15(in->torque), now->speed.doubt);
    if (fx_abs_q31(commanded) < fx_mul_q15(config->t_0, fx_abs_q15(now->speed.omega))) {
        return fx_abs_q31(mean) > limit; /* near zero torque both directions count */
    }
    return (commanded < 0) ? (mean < -limit || mean > limit - commanded) : (mean > limit || mean < -limit - commanded);
}

/* The back-EMF does not fit the angle (MN-9), (MN-10). */
static bool is_angle_implausible(const torque_monitor_config_t *config, const torque_monitor_in_t *in,
                                 const machine_t *now, dq_q15_t residual, dq_q15_t rate)
{
    const q15_t speed_abs = fx_abs_q15(now->speed.omega);
    const int32_t e_d = residual.d, e_q = residual.q;
    const int32_t e_magnet = (now->speed.omega < 0) ? -e_q : e_q;
    const int32_t emf_nominal = fx_mul_q15(speed_abs, config->psi_f);
    const int32_t d_share = fx_mul_q15(PSI_D_AXIS, emf_nominal);
    if (d_share < config->v_0 >> 1) {
        return false; /* at low speed the inverter's voltage error hides the back-EMF */
    }
    const int32_t strongest = fx_mul_q15(PSI_STRONG, emf_nominal), weakest = -fx_mul_q15(PSI_WEAK, emf_nominal);
    if (fx_abs_q31(e_d) < d_share && e_magnet < strongest && e_magnet > weakest) {
        return false; /* in most steps, also without the errors that are allowed in addition */
    }
    /* Doubled resistance; half of the flux rate for noise, and all of it beyond v_0, because a real change may have
     * ended before the sample. */
    const int32_t flux_rate_abs = fx_abs_q31(rate.d) + fx_abs_q31(rate.q);
    const int32_t v_error = (config->v_0 >> 1) + config->v_noise + fx_mul_gain_q15(now->r.r, now->current) +
                            flux_rate_abs / 2 + fx_max_s32(flux_rate_abs - config->v_0, 0);
    const q15_t psi_d = fx_abs_q15(in->psi.d), psi_q = fx_abs_q15(in->psi.q);
    const int32_t d_limit = d_share + (fx_mul_q15(speed_abs, psi_q) >> 3) + fx_mul_q15(now->speed.doubt, psi_q) +
                            v_error;
    const int32_t q_error = v_error + fx_mul_q15(now->speed.doubt, psi_d);
    return fx_abs_q31(e_d) > d_limit || e_magnet > strongest + q_error || e_magnet < weakest - q_error;
}

uint32_t torque_monitor_step(const torque_monitor_config_t *config, torque_monitor_state_t *state,
                             const torque_monitor_in_t *in)
{
    if (!in->acting || state->settling < config->settle_steps) {
        const uint8_t settling = in->acting ? (uint8_t)(state->settling + 1U) : 0U;
        *state = (torque_monitor_state_t){.psi = in->psi, .omega = in->omega, .settling = settling};
        return 0;
    }
    const dq_q15_t rate = flux_rate(config, state, in->psi);
    const machine_t now = {.speed = follow_speed(config, state, in->omega), .r = in->r, .current = in->current};
    const dq_q15_t psi_mean = {(in->psi.d + state->psi.d) / 2, (in->psi.q + state->psi.q) / 2};
    state->psi = in->psi;
    state->omega = in->omega;
    /* The part of the voltage that does not turn the rotor: drop of the resistance, and change of the flux. */
    const dq_q15_t other = {fx_mul_gain_q15(now.r.r, (q15_t)in->i.d) + rate.d,
                            fx_mul_gain_q15(now.r.r, (q15_t)in->i.q) + rate.q};
    const dq_q15_t emf = {fx_sat_q15(in->u.d - other.d), fx_sat_q15(in->u.q - other.q)};
    const bool torque_bad = is_torque_excessive(config, state, in, &now, emf, rate);
    const dq_q15_t residual = {
        fx_sat_q15(in->u_mean.d - other.d) + fx_mul_q15(now.speed.omega, (q15_t)psi_mean.q),
        fx_sat_q15(in->u_mean.q - other.q) - fx_mul_q15(now.speed.omega, (q15_t)psi_mean.d),
    };
    state->residual = (dq_q15_halfword_t){fx_sat_q15(residual.d), fx_sat_q15(residual.q)};
    const bool angle_bad = is_angle_implausible(config, in, &now, residual, rate);
    return debounce_step(&state->torque, torque_bad, config->torque_steps, FAULT_TORQUE) |
           debounce_step(&state->angle, angle_bad, config->angle_steps, FAULT_ANGLE_OFFSET);
}
