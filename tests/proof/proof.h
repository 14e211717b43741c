/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PROOF_H
#define PROOF_H
/** Macros of the harnesses. For CBMC a local variable that is not initialised stands for every value of its type.
 * Context  CBMC only: no program contains these functions */
#include <stdbool.h>
#include <stdint.h>

#define ASSUME(condition) __CPROVER_assume(condition)
#define PROVE(condition) __CPROVER_assert((condition), #condition)
#define WITHIN(x, low, high) ((x) >= (low) && (x) <= (high))

/* A q15 value in a word, as most structures of the firmware hold it. */
#define IS_Q15(x) WITHIN((x), INT16_MIN, INT16_MAX)
/* A magnitude in the same format. */
#define IS_MAGNITUDE(x) WITHIN((x), 0, INT16_MAX)

/* Only false or true: an uninitialised bool could also hold any other content of its byte. */
bool nondet_bool(void);

/* The nearest number that a format holds. */
static inline int64_t nearest_within(int64_t x, int64_t low, int64_t high)
{
    return (x < low) ? low : (x > high) ? high : x;
}

static inline int64_t to_q15(int64_t x)
{
    return nearest_within(x, INT16_MIN, INT16_MAX);
}

static inline int64_t to_q31(int64_t x)
{
    return nearest_within(x, INT32_MIN, INT32_MAX);
}

static inline int64_t magnitude(int64_t x)
{
    return (x < 0) ? -x : x;
}

#endif
