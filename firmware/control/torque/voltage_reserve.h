/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TORQUE_VOLTAGE_RESERVE_H
#define TORQUE_VOLTAGE_RESERVE_H
/** Voltage controller of field weakening: keeps the acting voltage at its planned share of the dc voltage while the
 * flux limits the references, by a trim of the voltage that the references plan with.
 *   v_plan = v_ratio v_dc + v_trim
 *   shift  = |psi + dpsi| - |psi|: contribution of the identified flux error; psi is the tables' flux at the last
 *            reference
 *   e      = v_ratio v_dc - |u|
 *   v_trim += k e        if e < 0, or while the references use the planned flux
 *   v_trim -= k v_trim   otherwise, because away from the limit e says nothing about the trim
 *   trim_min <= v_trim <= trim_max v_dc: the added voltage must be available also when the cause of the trim is gone
 * Source   docs/theory/current-reference.md (CR-9), (CR-12) ... (CR-14)
 * Units    per unit
 * Range    k < 1; trim_min <= 0 <= trim_max < 1; v_dc >= 0
 * Rounding half up, 1/2 LSB q31 per step in v_trim, 1 LSB q15 in shift
 * Errors   saturates at both bounds, the authority of the trim
 * Context  1 kHz task; three square roots, no division */
#include <stdbool.h>

#include "types/frames.h"

typedef struct {
    q15_t v_ratio; /* the references' planned share of v_dc */
    q15_t gain;    /* k per task period */
    q15_t trim_min;
    q15_t trim_max; /* share of v_dc */
} voltage_reserve_config_t;

typedef struct {
    q31_t trim;
} voltage_reserve_state_t;

/** q15 in words, which are loaded without a sign extension. */
typedef struct {
    int32_t u; /* magnitude of the acting voltage, of the mean over the last step where there is one; q15 */
    int32_t v_dc;
    dq_q15_t psi;        /* tables' flux at the last reference */
    int32_t psi_plan;    /* of the last reference */
    int32_t psi_d_error; /* identified flux minus the table's */
    bool acting;         /* the bridge makes u */
} voltage_reserve_in_t;

typedef struct {
    int32_t v_plan;
    int32_t shift;
} voltage_reserve_t;

voltage_reserve_t voltage_reserve_step(const voltage_reserve_config_t *config, voltage_reserve_state_t *state,
                                       const voltage_reserve_in_t *in);

#endif
