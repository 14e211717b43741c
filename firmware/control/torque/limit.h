/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TORQUE_LIMIT_H
#define TORQUE_LIMIT_H
/** Torque limits: the arbitrated torque is limited to what vehicle, battery, temperatures, dc voltage, speed and the
 * machine's reach allow, separately for driving and regenerating.
 *   loss   = first-order mean of u.i - t^ w, plus drop |i|: dc power minus shaft power
 *   drive <= min(torque_max f, torque_drive, (power_drive - loss)/|w|, reach)    f = min of the derating factors
 *   regen <= min(torque_max f, torque_regen, (power_regen + loss)/|w|, reach)
 *   Near standstill the direction of power is not known, and the driving limit holds for both directions.
 * Source   docs/theory/limits.md (LM-1) ... (LM-7)
 * Units    per unit; temperatures in tenths of a degree C, or TEMPERATURE_UNKNOWN
 * Range    every argument; loss is kept in 0 ... 1/4
 * Rounding 1 LSB q15
 * Errors   derating contains the reason of every limit that the torque exceeds, not only of the smallest one; a
 *          temperature whose sensor is out of its range, or that was known and is lost, counts as a factor of 1/2
 * Context  1 kHz task; two bounded divisions */
#include <stdbool.h>
#include <stdint.h>

#include "fx/q.h"
#include "types/frames.h"
#include "types/motor_check.h"
#include "types/temperature.h"
#include "types/torque_limits.h"

/* X(NAME, bit, explanation): the bits of `derating`, named and explained here only. */
#define DERATING_LIST(X) \
    X(REQUEST, 0, "Rated torque of the machine, or the vehicle's torque limit.") \
    X(POWER, 1, "Power limit of the battery.") \
    X(REACH, 2, "Reach: voltage and current circle.") \
    X(INVERTER, 3, "Inverter temperature.") \
    X(WINDING, 4, "Winding temperature.") \
    X(DC_LOW, 5, "The dc voltage is low.") \
    X(DC_HIGH, 6, "The dc voltage is high.") \
    X(SPEED, 7, "Speed.") \
    X(MAGNET, 8, "i_d is at the demagnetisation limit.") /* set by the 1 kHz task */ \
    X(SENSOR, 9, "A temperature sensor is out of its range.")

#define DERATING_BIT(name, bit, text) DERATING_##name = 1u << (bit),
enum { DERATING_LIST(DERATING_BIT) };
#undef DERATING_BIT

/** A straight line: 0 at end, 1 where (x - end) gain is 1. gain = 2^31/(start - end), with its sign. */
typedef struct {
    q15_t end;
    q16_t gain;
} derating_line_t;

typedef struct {
    q15_t torque_max;
    q15_t drop;             /* device drop as loss per current */
    q15_t loss_rate;        /* first-order coefficient per task period */
    derating_line_t moving; /* over |w|: 0 at standstill, 1 where the direction of power is certain */
    derating_line_t inverter, winding, dc_low, dc_high, speed;
} torque_limit_config_t;

typedef struct {
    q31_t loss;
    bool inverter_seen, winding_seen;
} torque_limit_state_t;

/** q15 in words, which are loaded without a sign extension. */
typedef struct {
    int32_t torque_arbitrated;
    const torque_limits_t *limits;
    dq_q15_t u, i;
    int32_t current; /* magnitude of i */
    int32_t torque_estimated;
    int32_t omega;
    int32_t v_dc;
    int32_t reach; /* the references' torque_max of the last step */
    int16_t inverter_dC, winding_dC;
} torque_limit_in_t;

typedef struct {
    q15_t torque_limited; /* the arbitrated torque inside its limits */
    q15_t drive, regen;   /* magnitudes allowed now */
    uint16_t derating;
} torque_limit_t;

/** Another torque, for example that of the step before, inside the same limits. */
static inline q15_t torque_limit_clamp(const torque_limit_t *limit, q15_t torque, bool backwards)
{
    const q15_t high = backwards ? limit->regen : limit->drive, low = backwards ? limit->drive : limit->regen;
    return (q15_t)fx_clamp_q31(torque, -low, high);
}

motor_check_t torque_limit_check(const torque_limit_config_t *config);
torque_limit_t torque_limit_step(const torque_limit_config_t *config, torque_limit_state_t *state,
                                 const torque_limit_in_t *in);

#endif
