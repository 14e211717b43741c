/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/short_circuit.h"

#include "control/current/measure.h"
#include "control/current/transform.h"
#include "fx/codegen.h"
#include "hal/pwm.h"
#include "safety/shorted_switch.h"
#include "types/faults.h"

#define CHANGES_MAX 2U /* the first may have been without need: a constant part of the currents looks the same */
#define SEARCH_PERIODS 2U /* for a shorted switch, (SS-30) */
#define DUTY_MIDDLE 16384U
#define DUTY_UPPER 32768U

/* The gate drivers have ended the short circuit by this side. */
static short_circuit_side_t side_after(short_circuit_side_t side)
{
    if (side == SHORT_CIRCUIT_LOWER) {
        return SHORT_CIRCUIT_LAST_UPPER;
    }
    return (side == SHORT_CIRCUIT_UPPER) ? SHORT_CIRCUIT_LAST_LOWER : SHORT_CIRCUIT_NONE;
}

/* With a gate fault the sides are tried instead: a shorted switch does not make the short circuit incomplete. */
static bool is_searched(const fast_state_t *fast)
{
    return fast->short_circuit.holds && (fast->faults & FAULT_GATE) == 0U;
}

/* In the stator's frame, with the identified error of the magnet. */
static ab_q15_t stator_flux(const drive_t *drive, const safe_period_t *now)
{
    const flux_point_t *flux = &now->sample->point.flux;
    const dq_q15_t psi = {fx_sat_q15(flux->psi_d + drive->psi_d_error), fx_sat_q15(flux->psi_q)};
    const ab_q30_t psi_q30 = inverse_park_q30(psi, now->rotation);
    return (ab_q15_t){transform_round(psi_q30.alpha), transform_round(psi_q30.beta)};
}

/* i_d^2 + i_q^2, if the measured currents can be right. */
static int32_t i_squared_q30(const drive_t *drive, const sample_t *sample)
{
    const dq_q15_t i = sample->point.i;
    return drive_currents_add_up(drive, sample) ? i.d * i.d + i.q * i.q : OPEN_SWITCH_NOT_PLAUSIBLE;
}

/* The tables have the flux of these currents; currents that are not plausible are above any limit. */
static bool is_flux_known(const drive_t *drive, const sample_t *sample)
{
    const q15_t i_max = drive->motor->current_reference.i_max;
    return i_squared_q30(drive, sample) <= i_max * i_max;
}

/* The flux in every second period only: its sum has no need of every period, the direction of a current has. Not
 * inlined: that would take registers from the search for a shorted switch, which the longest fast ISR contains. */
static FX_NOT_INLINED open_switch_t search(drive_t *drive, const safe_period_t *now)
{
    const motor_t *m = drive->motor;
    short_circuit_t *state = &drive->fast.short_circuit;
    const open_switch_config_t config = {m->plausibility.i_dead, m->current_reference.i_max,
                                         (q15_t)(m->safe_state.psi_f / 2)};
    const int32_t i_squared = i_squared_q30(drive, now->sample);
    const uint32_t step_q16 = (uint32_t)fx_abs_q31(now->angle_step) >> 16;
    state->searches_flux = !state->searches_flux;
    if (state->searches_flux) {
        const ab_q15_t psi = stator_flux(drive, now);
        const open_switch_t found = open_switch_by_flux(&config, &state->open_switch, psi, i_squared, 2U * step_q16);
        if (found != OPEN_SWITCH_NONE) {
            return found;
        }
    }
    const open_switch_in_t in = {now->i, i_squared, step_q16, state->side == SHORT_CIRCUIT_UPPER};
    return open_switch_by_currents(&config, &state->open_switch, &in);
}

static short_circuit_side_t without_open_switch(short_circuit_t *state, bool upper, open_switch_t found)
{
    if (state->changes < CHANGES_MAX &&
        found == ((state->side == SHORT_CIRCUIT_UPPER) ? OPEN_SWITCH_UPPER : OPEN_SWITCH_LOWER)) {
        open_switch_reset(&state->open_switch);
        state->changes++;
        return (found == OPEN_SWITCH_UPPER) ? SHORT_CIRCUIT_LOWER : SHORT_CIRCUIT_UPPER;
    }
    if (state->changes != 0U) {
        return state->side;
    }
    return upper ? SHORT_CIRCUIT_UPPER : SHORT_CIRCUIT_LOWER;
}

void short_circuit_apply(fast_state_t *fast, bool upper, open_switch_t found)
{
    short_circuit_t *state = &fast->short_circuit;
    if (state->holds && !hal_pwm_gates()) {
        state->side = side_after(state->side);
    } else if (state->side <= SHORT_CIRCUIT_UPPER) {
        state->side = without_open_switch(state, upper, found);
    } else {
        /* the only side that is left */
    }
    if (state->side == SHORT_CIRCUIT_NONE) {
        short_circuit_end(fast);
        return;
    }
    const bool by_upper = state->side == SHORT_CIRCUIT_UPPER || state->side == SHORT_CIRCUIT_LAST_UPPER;
    const uint16_t duty = by_upper ? DUTY_UPPER : 0U;
    hal_pwm_write((duty_t){duty, duty, duty});
    hal_pwm_enable(true); /* with the duties, not before them */
    state->holds = hal_pwm_gates();
}

void short_circuit_step(drive_t *drive, const safe_period_t *now, bool upper)
{
    open_switch_t found = OPEN_SWITCH_NONE;
    if (is_searched(&drive->fast)) {
        found = search(drive, now);
    } else {
        open_switch_reset(&drive->fast.short_circuit.open_switch);
    }
    short_circuit_apply(&drive->fast, upper, found);
}

/* What is measured may be the sensors' error alone. */
static bool is_without_current(const drive_t *drive, const sample_t *sample)
{
    const int32_t i_alive = drive->motor->gate_fault.i_alive;
    const dq_q15_t i = sample->point.i;
    return i.d * i.d + i.q * i.q <= i_alive * i_alive;
}

/* Evaluates the last period, in which switching was disabled throughout. */
static shorted_switch_t find_shorted(const drive_t *drive, const safe_period_t *now, ab_q15_t psi)
{
    const sample_t *last = sample_box_at(&drive->samples, drive->samples.generation);
    const open_switch_state_t *begin = &drive->fast.short_circuit.open_switch;
    const shorted_switch_in_t in = {
        .i_last = measure_phases(last->i_ab, last->zero_q28),
        .i = now->i,
        .psi_last = fx_pair(begin->begin_alpha, begin->begin_beta),
        .psi = fx_pair(psi.alpha, psi.beta),
        .v_dc = now->sample->v_dc,
        .turn_gain = drive->motor->launch_power.turn_gain,
        .i_min = (q15_t)(drive->motor->plausibility.i_dead >> 1),
    };
    return shorted_switch_find(&in);
}

/* The flux of this sample ends a period and begins the next one. */
static shorted_switch_t search_period(drive_t *drive, const safe_period_t *now)
{
    open_switch_state_t *begin = &drive->fast.short_circuit.open_switch;
    const ab_q15_t psi = stator_flux(drive, now);
    const bool is_known = is_flux_known(drive, now->sample);
    const shorted_switch_t found = (is_known && begin->has_begun) ? find_shorted(drive, now, psi) : SHORTED_SWITCH_NONE;
    begin->has_begun = is_known;
    begin->begin_alpha = (q15_t)psi.alpha;
    begin->begin_beta = (q15_t)psi.beta;
    return found;
}

static void search_shorted(drive_t *drive, const safe_period_t *now)
{
    fast_state_t *fast = &drive->fast;
    short_circuit_t *state = &fast->short_circuit;
    if (state->waits == 0U) {
        return;
    }
    const uint32_t periods = drive->samples.generation + 1U - fast->fault_period; /* since the first fault */
    const shorted_switch_t found = search_period(drive, now);
    if (found != SHORTED_SWITCH_NONE) {
        state->side = (found == SHORTED_SWITCH_UPPER) ? SHORT_CIRCUIT_UPPER : SHORT_CIRCUIT_LOWER;
        state->changes = CHANGES_MAX;
    }
    /* The drivers may have switched off in the middle of the period before the first fault. */
    if (periods > 0U &&
        (found != SHORTED_SWITCH_NONE || periods >= SEARCH_PERIODS || !is_without_current(drive, now->sample))) {
        state->waits = 0;
    }
}

void short_circuit_end(fast_state_t *fast)
{
    fast->short_circuit.holds = false;
    hal_pwm_enable(false);
    hal_pwm_write((duty_t){DUTY_MIDDLE, DUTY_MIDDLE, DUTY_MIDDLE});
}

void short_circuit_prepare(fast_state_t *fast, uint32_t periods)
{
    fast->short_circuit.holds = false;
    fast->short_circuit.changes = 0;
    fast->short_circuit.waits = (uint8_t)periods;
    fast->short_circuit.open_switch.has_begun = false;
}

bool short_circuit_waits(fast_state_t *fast)
{
    const uint32_t faults = fast->faults;
    const bool at_once = (faults & FAULT_OVER_VOLTAGE) != 0U || (faults & ~FAULTS_CONTROLLED) == 0U;
    if (at_once || fast->short_circuit.waits == 0U) {
        fast->short_circuit.waits = 0;
        return false;
    }
    if ((faults & FAULT_GATE) == 0U) { /* else the search ends the wait, (SS-30) */
        fast->short_circuit.waits--;
    }
    return true;
}

void short_circuit_reset(fast_state_t *fast)
{
    short_circuit_t *state = &fast->short_circuit;
    const bool keeps_side = state->changes != 0U && state->side <= SHORT_CIRCUIT_UPPER;
    *state = (short_circuit_t){
        .side = keeps_side ? state->side : SHORT_CIRCUIT_LOWER,
        .changes = keeps_side ? state->changes : 0U,
    };
}

bool short_circuit_is_needed(const fast_state_t *fast, safe_t safe)
{
    const uint32_t faults = fast->faults & ~(fast->short_circuit.ignores_voltage ? (uint32_t)FAULT_OVER_VOLTAGE : 0U);
    const bool on_over_voltage = safe == SAFE_SHORT_ON_OVER_VOLTAGE || safe == SAFE_SHORT_ON_EITHER;
    const bool on_gate_fault = safe == SAFE_SHORT_ON_GATE_FAULT || safe == SAFE_SHORT_ON_EITHER;
    return safe == SAFE_SHORT_CIRCUIT || (on_over_voltage && (faults & FAULT_OVER_VOLTAGE) != 0U) ||
           (on_gate_fault && (faults & FAULT_GATE) != 0U);
}

/* The wait brings any flux to that of the magnets (SS-21). A smaller flux, which field weakening leaves, would rise
 * (SS-31). */
static void end_needless_wait(drive_t *drive, const sample_t *sample)
{
    if ((drive->fast.faults & ~FAULTS_OF_PHASE) != 0U || !is_flux_known(drive, sample)) {
        return;
    }
    const int32_t psi_d = fx_sat_q15(sample->point.flux.psi_d + drive->psi_d_error);
    const int32_t psi_q = fx_sat_q15(sample->point.flux.psi_q), psi_f = drive->motor->safe_state.psi_f;
    if ((uint32_t)(psi_d * psi_d) + (uint32_t)(psi_q * psi_q) < (uint32_t)(psi_f * psi_f)) {
        drive->fast.short_circuit.waits = 0;
    }
}

bool short_circuit_may_begin(drive_t *drive, const safe_period_t *now)
{
    if ((drive->fast.faults & FAULT_GATE) != 0U) {
        search_shorted(drive, now);
    } else {
        end_needless_wait(drive, now->sample);
    }
    return !short_circuit_waits(&drive->fast);
}
