/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_HOST_SPIN_LIMIT_H
#define HAL_HOST_SPIN_LIMIT_H
/** Ends a commissioning that turns the shaft: when its commands stop, and when the sensor turns too fast.
 *   |w_s| > w_max, w_s a first-order mean over 16 periods, or too many periods without a renewed command
 * Source   docs/theory/commissioning.md, section 11
 * Units    turns of the sensor, rpm
 * Context  host port; the drive's own monitors work as usual */
#include <stdbool.h>
#include <stdint.h>

/* X(NAME, value, explanation): named and explained here only. */
#define SPIN_FAILURE_LIST(X) \
    X(GOOD, 0, "No failure.") \
    X(SILENT, 1, "No command has prolonged the movement in time.") \
    X(FAST, 2, "The shaft turned faster than was agreed.")

#define SPIN_VALUE(name, value, text) SPIN_##name = (value),
typedef enum { SPIN_FAILURE_LIST(SPIN_VALUE) } spin_failure_t;
#undef SPIN_VALUE

typedef struct {
    uint32_t periods; /* for which the movement is still permitted; 0: there are no limits */
    double rpm_max;
    double turns, rpm; /* of the sensor */
    spin_failure_t failure;
} spin_limit_t;

/** Once per period; false: switching must be disabled. */
bool spin_limit_step(spin_limit_t *limit, double sensor_turns, double period_s);

#endif
