/* SPDX-License-Identifier: Apache-2.0 */
#ifndef UNIT_CONTROL_FIXTURE_H
#define UNIT_CONTROL_FIXTURE_H
/** An invented saturating machine, as fixed-point configurations and as the SI data of the twin.
 *   The SI data are computed from the rounded fixed-point constants, so that the tolerance of a test contains only the
 *   errors of the arithmetic. The conversions follow the units stated in the headers and use no code of the firmware.
 * Units    bases in SI; q15 values in counts */
#include <stdint.h>

#include "control/current/angle_tracker.h"
#include "control/current/current_control.h"
#include "control/current/flux_table.h"
#include "control/current/modulate.h"
#include "control/mrai/mrai.h"
#include "control/torque/current_reference.h"
#include "control/torque/i_d_limit.h"
#include "control/torque/limit.h"
#include "control/torque/loop.h"
#include "control/torque/voltage_reserve.h"
#include "twin/twin_stages.h"

typedef struct {
    double i, v, w, psi, z, l, t; /* bases */
    motor_si_t si;
    angle_tracker_config_t angle_tracker;
    flux_table_config_t flux_table;
    current_control_config_t current_control;
    modulate_config_t modulate;
    mrai_config_t mrai;
    torque_loop_config_t torque_loop;
    current_reference_config_t current_reference;
    voltage_reserve_config_t voltage_reserve;
    torque_limit_config_t torque_limit;
    i_d_limit_config_t i_d_limit;
} fixture_t;

/* Returns a new copy, which a test may change. */
fixture_t fixture(void);

/* Dead time and shortest pulse, as shares of the period, of the modulation and of the twin. */
void fixture_dead_time(fixture_t *f, double duty);
void fixture_min_pulse(fixture_t *f, double duty);

/* The largest error of a sweep and the arguments at which it occurred, so that a sweep reports one failure. */
typedef struct {
    double error;
    char where[200];
} worst_t;

void worst_note(worst_t *worst, double error, const char *format, ...) __attribute__((format(printf, 3, 4)));
void worst_assert(const worst_t *worst, double tolerance, int line);
#define ASSERT_WORST(worst, tolerance) worst_assert(&(worst), (tolerance), __LINE__)

/* Reproducible random numbers, uniform in [lo, hi] (xorshift64*). */
uint32_t random_u32(uint64_t *state);
int32_t random_in(uint64_t *state, int32_t lo, int32_t hi);

static inline double from_q15(int32_t x)
{
    return x / 32768.0;
}

static inline double from_q31(int32_t x)
{
    return x / 2147483648.0;
}

#endif
