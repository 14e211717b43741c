/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CONTROL_COMMISSION_H
#define CONTROL_COMMISSION_H
/** Measures the inverter's voltage error at standstill: currents along the magnet, which make no torque, at ten levels
 *   in both polarities; each settles, then voltage and current are summed.
 *   40 ms settle, 64 ms measure, 2 x 10 currents: 2.1 s; level k is 2^(-6 + k/2) of i_max
 * Source   docs/theory/commissioning.md (CM-1), (CM-6)
 * Units    per unit
 * Range    standstill: |omega| < omega_max throughout
 * Errors   failed says why; the current reference is zero from then on and nothing is to be used
 * Context  1 kHz task; at most 2100 steps, then done or failed */
#include "control/commission_fit.h"
#include "types/frames.h"

typedef enum {
    COMMISSION_IDLE = 0,
    COMMISSION_SETTLE = 1,
    COMMISSION_MEASURE = 2,
    COMMISSION_DONE = 3,
    COMMISSION_FAILED = 4
} commission_phase_t;

typedef enum {
    COMMISSION_GOOD = 0,
    COMMISSION_STOPPED = 1, /* the gates opened, or the periods' sums are not there */
    COMMISSION_MOVED = 2,
    COMMISSION_LIMITED = 3, /* the voltage was cut */
    COMMISSION_CURRENT = 4, /* the current is not what was asked for */
    COMMISSION_FIT = 5      /* no resistance fits, or a voltage error that no inverter has */
} commission_failure_t;

typedef struct {
    q15_t i_max;
    q31_t omega_max;
} commission_config_t;

typedef struct {
    commission_phase_t phase;
    commission_failure_t failure;
    uint16_t ms;   /* in this phase */
    uint8_t index; /* current under way: level 2 k and its opposite */
    int32_t sum_i, sum_u;
    commission_data_t data;
    dq_t i_ref;
} commission_state_t;

typedef struct {
    dq_t sum_i, sum_u; /* of ten periods */
    uint32_t theta;    /* electrical */
    q31_t omega;
    bool acting, limited;
} commission_in_t;

void commission_start(const commission_config_t *config, commission_state_t *state);
void commission_step(const commission_config_t *config, commission_state_t *state, const commission_in_t *in);

static inline bool commission_runs(const commission_state_t *state)
{
    return state->phase == COMMISSION_SETTLE || state->phase == COMMISSION_MEASURE;
}

#endif
