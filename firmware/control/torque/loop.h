/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TORQUE_LOOP_H
#define TORQUE_LOOP_H
/** Closed torque loop: a relative correction of the commanded torque, so that a correction found at one torque is valid
 * at another.
 *   r = T* (1 + x) + k_p e,  e = T_m - T^,  x += k_i e / max(|T*|, T_min) sign(T*),  |r - T*| <= c A |T*|
 *   x is held while |T*| < T_min/2, because dividing by a small T* would turn an offset of T^ into a large ratio.
 *   T_m is T* after the first-order response of the closed current loop, so that a step of T* does not charge the
 *   integrator.
 *   While the voltage or current limit is active, x does not rise above 0, and an x above 0 decays at a quarter of the
 *   loop's own rate; while the loop is disabled, x decays to 0 at that rate. The authority A is scaled by the
 *   confidence c in the estimate: at c = 0 nothing is corrected.
 * Source   docs/theory/torque-loop.md (TL-3) ... (TL-9)
 * Units    per unit of T_b; x is a ratio
 * Range    authority (0, 1); |T*| < 1; the relative error e / max(|T*|, T_min) is limited to 1
 * Rounding half up: 1/2 LSB q31 per step in x, 1/2 LSB q15 in r; at a limit the decay of x up to 1 LSB downwards
 * Errors   saturates at the authority and reports it in saturated
 * Context  1 kHz task; one bounded division */
#include <stdbool.h>

#include "fx/q.h"

typedef struct {
    q15_t ki; /* integral gain per task period */
    q15_t kp;
    q15_t model_rate; /* first-order coefficient of T_m per task period */
    q15_t authority;
    q15_t torque_min; /* T_min */
} torque_loop_config_t;

typedef struct {
    q31_t correction; /* x */
    q31_t model;      /* T_m */
    bool saturated;
} torque_loop_state_t;

/** q15 in words, which are loaded without a sign extension. */
typedef struct {
    int32_t torque_commanded; /* T* */
    int32_t torque_estimated; /* T^ */
    int32_t confidence;       /* share of the authority that may be used, Q15_MAX: all of it */
    bool enabled;
    bool limited; /* current or voltage limit active */
} torque_loop_in_t;

q15_t torque_loop_step(const torque_loop_config_t *config, torque_loop_state_t *state, const torque_loop_in_t *in);

#endif
