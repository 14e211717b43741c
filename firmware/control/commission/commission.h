/* SPDX-License-Identifier: Apache-2.0 */
#ifndef COMMISSION_COMMISSION_H
#define COMMISSION_COMMISSION_H
/** Measures the inverter's voltage error at standstill with currents in the d axis, which make no torque: ten levels in
 *   both polarities. Each current settles for 40 ms; then voltage and current are averaged over 64 ms.
 *   2 x 10 currents take 2.1 s; level k is 2^(-6 + k/2) of i_max.
 * Source   docs/theory/commissioning.md (CM-1), (CM-6)
 * Units    per unit
 * Range    standstill: |omega| < omega_max throughout
 * Errors   failure names the reason; the current reference is then 0 and the data must not be used
 * Context  1 kHz task; at most 2400 steps, then done or failed */
#include "control/commission/fit.h"
#include "types/frames.h"

/* X(NAME, value, explanation): named and explained here only. */
#define COMMISSION_PHASE_LIST(X) \
    X(IDLE, 0, "No measurement has been asked for.") \
    X(SETTLE, 1, "A current settles.") \
    X(MEASURE, 2, "Voltage and current are averaged.") \
    X(DONE, 3, "The measurement is complete and the compensation has changed.") \
    X(FAILED, 4, "The measurement has failed and nothing has changed; the failure says why.")

#define COMMISSION_FAILURE_LIST(X) \
    X(GOOD, 0, "No failure.") \
    X(STOPPED, 1, "Switching was disabled, or the paper's identification is selected.") \
    X(MOVED, 2, "The rotor moved.") \
    X(LIMITED, 3, "The voltage was not sufficient.") \
    X(CURRENT, 4, "The current did not reach its reference.") \
    X(FIT, 5, "No resistance or voltage error of an inverter fits the measurement.")

#define COMMISSION_VALUE(name, value, text) COMMISSION_##name = (value),
typedef enum { COMMISSION_PHASE_LIST(COMMISSION_VALUE) } commission_phase_t;
typedef enum { COMMISSION_FAILURE_LIST(COMMISSION_VALUE) } commission_failure_t;
#undef COMMISSION_VALUE

typedef struct {
    q15_t i_max;
    q31_t omega_max;
    uint16_t settle_steps, measure_steps; /* 40, 64 ms */
    int32_t periods_per_step;
    int32_t mean_gain_q31; /* 1/(measure_steps periods_per_step): Q15 * Q31 = Q46, a sum to its mean */
} commission_config_t;

typedef struct {
    commission_phase_t phase;
    commission_failure_t failure;
    uint16_t steps; /* in this phase */
    uint8_t index;  /* of the present current: 2 k is level k, 2 k + 1 the same with opposite sign */
    int32_t sum_i, sum_u;
    commission_data_t data;
    dq_q15_t i_ref;
} commission_state_t;

typedef struct {
    dq_q15_t sum_i, sum_u; /* over the periods of a step: up to 40 */
    uint32_t theta;        /* electrical */
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
