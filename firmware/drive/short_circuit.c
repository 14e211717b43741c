/* SPDX-License-Identifier: Apache-2.0 */
#include "drive/short_circuit.h"

#include "hal/pwm.h"
#include "types/faults.h"

#define AT_ONCE (FAULT_OVER_VOLTAGE | FAULT_GATE)
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

void short_circuit_apply(fast_state_t *fast, bool upper)
{
    short_circuit_t *state = &fast->short_circuit;
    if (state->holds && !hal_pwm_gates()) {
        state->side = side_after(state->side);
    } else if (upper && state->side == SHORT_CIRCUIT_LOWER) {
        state->side = SHORT_CIRCUIT_UPPER;
    } else {
        /* as before */
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

void short_circuit_end(fast_state_t *fast)
{
    fast->short_circuit.holds = false;
    hal_pwm_enable(false);
    hal_pwm_write((duty_t){DUTY_MIDDLE, DUTY_MIDDLE, DUTY_MIDDLE});
}

void short_circuit_prepare(fast_state_t *fast, uint32_t periods)
{
    fast->short_circuit.holds = false;
    fast->short_circuit.waits = (uint8_t)periods;
}

bool short_circuit_waits(fast_state_t *fast)
{
    const uint32_t faults = fast->faults;
    const bool at_once = (faults & AT_ONCE) != 0U || (faults & ~FAULTS_CONTROLLED) == 0U;
    if (at_once || fast->short_circuit.waits == 0U) {
        fast->short_circuit.waits = 0;
        return false;
    }
    fast->short_circuit.waits--;
    return true;
}

void short_circuit_reset(fast_state_t *fast)
{
    fast->short_circuit = (short_circuit_t){.side = SHORT_CIRCUIT_LOWER};
}

bool short_circuit_is_needed(uint32_t faults, safe_t safe)
{
    const bool on_over_voltage = safe == SAFE_SHORT_ON_OVER_VOLTAGE || safe == SAFE_SHORT_ON_EITHER;
    const bool on_gate_fault = safe == SAFE_SHORT_ON_GATE_FAULT || safe == SAFE_SHORT_ON_EITHER;
    return safe == SAFE_SHORT_CIRCUIT || (on_over_voltage && (faults & FAULT_OVER_VOLTAGE) != 0U) ||
           (on_gate_fault && (faults & FAULT_GATE) != 0U);
}
