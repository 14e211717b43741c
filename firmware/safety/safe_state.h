/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SAFETY_SAFE_STATE_H
#define SAFETY_SAFE_STATE_H
/** Safe state that a fault would need now: active short circuit, or switching disabled.
 *   e = sqrt(3) w max(psi_f, psi_f + dpsi), the line back-EMF's peak at the known speed w
 *   e > share_short v_dc: short circuit, because the diodes could otherwise rectify the back-EMF into the battery and
 *   brake; e < share_open v_dc: switching disabled; between both levels the last decision holds; without a valid speed
 *   share_open is the only one
 *   That the diodes may conduct is decided in the same way, with a share of 1 in place of a larger share_short, and
 *   with share_open reduced by as much: from v_dc on they conduct in short pulses that brake less than the short
 *   circuit.
 *   v_dc is the known dc voltage. It rises with the measured one and falls with a time constant of 64 steps. While a
 *   fault is latched or the converters' reference reads wrong, it falls only if a current has flowed for 10 steps
 *   although switching is disabled: a failed sensor reads as an empty dc link does, but only the empty link draws a
 *   current through the diodes.
 *   A short circuit that is on with a latched over-voltage lasts until the measured v_dc has been below v_release for
 *   200 steps. In this time the first currents decay, which would charge the link again. Afterwards the short circuit
 *   is not applied again for the same over-voltage.
 *   The known speed is the measured one, but falls no faster than a rotor can: an angle that freezes would otherwise
 *   look like a standstill. In the short circuit the measurement counts only if the currents agree with it. They stand
 *   still in the rotor's frame if the angle turns with the rotor, and they vanish at standstill, whatever the angle
 *   says. Without a valid speed the last one holds; with switching disabled it falls after 20,000 steps of the task.
 * Source   docs/theory/safe-state.md (SS-1) ... (SS-7), (SS-19), (SS-25)
 * Units    per unit; speeds are magnitudes
 * Range    every argument; e saturates at 1
 * Rounding 1 LSB q15, well inside the hysteresis
 * Errors   none
 * Context  1 kHz task, which passes the decision to the fast ISR before a fault occurs; no division */
#include <stdbool.h>

#include "fx/q.h"
#include "types/frames.h"

typedef struct {
    q16_t share_short, share_open; /* of v_dc, up to 1.06 */
    q15_t psi_f;
    q15_t v_release; /* an over-voltage has ended below this */
} safe_state_config_t;

typedef struct {
    q15_t speed;        /* known: the measured one, or the last valid one, which falls at a limited rate */
    q15_t line_emf;     /* at the known speed */
    q15_t v_dc;         /* known */
    bool short_circuit; /* by the back-EMF */
    bool rectifies;     /* the diodes of an intact bridge may conduct with switching disabled */
    uint8_t rectifying; /* steps in which a current flowed with switching disabled; saturates */
    uint8_t low; /* steps in which v_dc was below v_release in a short circuit after an over-voltage; saturates */
    uint8_t steady, without_current; /* steps in which the short circuit's currents were so; saturate */
    uint16_t unknown_steps;          /* steps without a valid speed and with switching disabled; saturates */
    dq_q15_halfword_t i_before;      /* of the last step */
} safe_state_state_t;

typedef struct {
    q15_t omega;
    q15_t psi_d_error; /* identified flux minus the table's */
    q15_t v_dc;
    dq_q15_t i, i_last_period; /* measured in this period and in the one before it */
    dq_q15_t psi_current;      /* tables' flux at i, less that at no current */
    bool shorted;              /* the phases are shorted, as read back */
    bool currents_valid;
    bool speed_valid;
    bool doubtful;     /* of v_dc: a fault is latched, or the converters' reference reads wrong */
    bool rectifying;   /* a current flows although switching is disabled, as read back */
    bool over_voltage; /* latched, and the phases are shorted */
} safe_state_in_t;

bool safe_state_step(const safe_state_config_t *config, safe_state_state_t *state, const safe_state_in_t *in);

#endif
