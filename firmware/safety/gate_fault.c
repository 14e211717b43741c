/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/gate_fault.h"

#include "fx/format.h"
#include "signal/debounce.h"

#define QUIET_STEPS 50
#define WRONG_ZEROS 4 /* times i_alive: what two zeros that are wrong against each other may make */
#define REST 16 /* q15: e at rest without dc voltage, 0.25 V where V_b is 500 V */

bool gate_fault_current_flows(const gate_fault_config_t *config, const gate_fault_in_t *in)
{
    return !in->gates && in->currents_valid && in->i_magnitude > config->i_alive + 2 * in->zero;
}

/* A current that flows although switching is disabled and the dc link has opposed it for long enough (SS-10). Unless a
 * gate fault is latched, it must be more than two zeros that are wrong against each other make (SS-32). */
static bool is_switch_shorted(const gate_fault_config_t *config, gate_fault_state_t *state, const gate_fault_in_t *in)
{
    const int32_t opposed = state->opposed + fx_max_s32(in->v_dc - in->line_emf, 0);
    const bool flows = gate_fault_current_flows(config, in) && !in->rectifies;
    state->opposed = flows ? fx_min_s32(opposed, config->volt_steps) : 0;
    const bool outlasts = state->opposed == config->volt_steps;
    const bool certain = state->switch_shorted || in->latched || in->i_magnitude > WRONG_ZEROS * config->i_alive;
    return (outlasts && certain) || (state->switch_shorted && in->latched);
}

/* Contactor and gate supply may be switched off: at rest, or if no switch is shorted, which a turning machine without
 * current shows. */
static bool may_release(gate_fault_state_t *state, const gate_fault_in_t *in, bool none)
{
    const bool quiet = debounce_holds(&state->quiet, none, QUIET_STEPS);
    const bool at_rest = in->line_emf <= fx_max_s32(in->v_dc >> 6, REST);
    return at_rest || (quiet && !state->switch_shorted);
}

bool gate_fault_step(const gate_fault_config_t *config, gate_fault_state_t *state, const gate_fault_in_t *in)
{
    const bool none = !in->gates && in->currents_valid && in->i_magnitude <= config->i_alive;
    state->switch_shorted = is_switch_shorted(config, state, in);
    state->above = in->line_emf > in->v_dc >> (state->above ? 4 : 3);
    const bool released = may_release(state, in, none);
    state->holds_supply = in->latched && !released;
    return state->above || state->switch_shorted;
}
