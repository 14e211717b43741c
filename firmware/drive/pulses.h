/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_PULSES_H
#define DRIVE_PULSES_H
/** Voltage pulses at standstill, from whose currents and voltages the tools compute the flux map.
 *   Each axis has a voltage of constant magnitude, which reverses before its current would leave its bounds:
 *   s = +-(i - i_1) > 0   change in the last period, in the direction of the voltage that acted there
 *   i' = i +- s           when the voltage that is computed now begins to act, by the voltage that acts until then
 *   i' + s + g >= high: -v;   i' - s - g <= low: +v;   g = max(s - s_1, 0): saturation lets the change grow
 *   The pulses end after a number of reversals of one axis: q if it has a voltage, else d. Two half waves of q are
 *   smaller than the others, so that the alternating torque leaves the rotor in its place and at rest:
 *     the first ends at a share of its bound that is commanded: without saturation 0.71, half of the next impulse;
 *     the last ends where the sum of all i_q, which is about the impulse, will be zero after its way back to zero.
 *   Then both currents are brought to zero.
 * Source   docs/theory/commissioning.md (CM-9), (CM-10)
 * Units    v as a share of v_ratio v_dc, currents per unit, both in q15 and their sums in counts of it; angles in turns
 *          times 2^32
 * Range    v up to 0.7 in each axis: both stay inside the voltage circle
 * Errors   failure: the current is larger than square_max allows, the rotor has moved by more than angle_max, or the
 *          reversals have not occurred within periods_max; the currents are then brought to zero, too
 * Context  fast ISR, outside the usual route */
#include <stdbool.h>
#include <stdint.h>

#include "control/current/current_control.h"
#include "types/frames.h"

/* X(NAME, value, explanation): named and explained here only. */
#define PULSES_PHASE_LIST(X) \
    X(IDLE, 0, "No pulses have been asked for.") \
    X(PULSE, 1, "The voltages alternate.") \
    X(BACK, 2, "The currents are brought to zero.") \
    X(DONE, 3, "The pulses are complete.") \
    X(FAILED, 4, "The pulses have ended early; the failure says why.")

#define PULSES_FAILURE_LIST(X) \
    X(GOOD, 0, "No failure.") \
    X(REFUSED, 1, "Switching was disabled, the rotor turned, there was a request, or a value was out of its range.") \
    X(STOPPED, 2, "Switching has been disabled.") \
    X(MOVED, 3, "The rotor has moved.") \
    X(TIME, 4, "The currents did not reach their bounds in time.") \
    X(CURRENT, 5, "The current was larger than the largest one of the machine.") \
    X(NO_CONSENT, 6, "The bus has not agreed to voltage pulses, or agrees no longer.")

#define PULSES_VALUE(name, value, text) PULSES_##name = (value),
typedef enum { PULSES_PHASE_LIST(PULSES_VALUE) } pulses_phase_t;
typedef enum { PULSES_FAILURE_LIST(PULSES_VALUE) } pulses_failure_t;
#undef PULSES_VALUE

/** One axis. */
typedef struct {
    int32_t v;         /* magnitude of the voltage; 0: none */
    int32_t low, high; /* bounds of the current */
} pulses_axis_config_t;

typedef struct {
    pulses_axis_config_t d, q;
    q15_t first;          /* share of its bound at which the first half wave of q ends */
    uint32_t angle_max;   /* electrical, from where the rotor stood at the start */
    uint32_t square_max;  /* of the current, Q30: set by the drive */
    uint16_t delay;       /* periods before the q axis begins */
    uint16_t reversals;   /* that end the pulses */
    uint16_t periods_max; /* in which they must have happened */
    uint16_t number;      /* counts up: each number is carried out once */
} pulses_config_t;

typedef struct {
    int32_t i, i_next;         /* the last sample; when the next voltage begins to act */
    int32_t slope, growth;     /* s, g */
    int32_t sign, sign_before; /* -1, 0 or 1: of the voltage that will act, and of the one that acts now */
} pulses_axis_t;

typedef struct {
    pulses_phase_t phase;
    pulses_failure_t failure;
    uint32_t theta_start;
    pulses_axis_t d, q;
    int32_t sum;        /* of i_q since the start */
    int32_t half_wave;  /* of i_q since it last changed its sign */
    uint16_t periods;   /* since the start */
    uint16_t reversals; /* so far */
    uint16_t number;    /* of the configuration that is being carried out */
} pulses_state_t;

/** The voltages of the next period, with the current and the electrical angle of this one. */
dq_q15_t pulses_step(const pulses_config_t *config, pulses_state_t *state, dq_q15_t i, uint32_t theta);

/** As an output of current control; ratio: of the largest voltage to the dc voltage. */
current_control_out_t pulses_voltage(dq_q15_t v, q31_t ratio, int32_t v_dc);

static inline bool pulses_active(const pulses_state_t *state)
{
    return state->phase == PULSES_PULSE || state->phase == PULSES_BACK;
}

#endif
