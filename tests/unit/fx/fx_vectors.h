/* SPDX-License-Identifier: Apache-2.0 */
#ifndef UNIT_FX_VECTORS_H
#define UNIT_FX_VECTORS_H
/** Arguments that break arithmetic, repeatable random ones, and a readable failure from a long loop.
 * Units    raw integers */
#include <stdbool.h>
#include <stdint.h>

#define CORNERS 35
extern const int32_t corner[CORNERS]; /* both ends, powers of two and their neighbours, zero */

/* Uniform over 32 bits; the sequence starts anew with each test program. */
uint32_t random_u32(void);

/* Every magnitude equally likely: the leading bit's place is uniform. */
int32_t random_s32(void);
int16_t random_s16(void);

/* True in a build that can afford 2^32 evaluations: optimised, no sanitizer, no coverage. */
bool exhaustive_is_affordable(void);

/* Rounds half up as the headers promise; exact for |x| below 2^62. */
long double half_up(long double x);
long double clip(long double x, long double low, long double high);

/* Fails the test with the arguments and both results unless got == want. */
void expect_equal(const char *what, int64_t a, int64_t b, int64_t got, int64_t want);

/* The largest deviation of a sweep and where it was. */
typedef struct {
    long double error;
    int64_t a;
    int64_t b;
} worst_t;

void worst_note(worst_t *worst, long double error, int64_t a, int64_t b);
void worst_expect(const worst_t *worst, const char *what, long double allowed);

#endif
