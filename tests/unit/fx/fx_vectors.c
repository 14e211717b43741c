/* SPDX-License-Identifier: Apache-2.0 */
#include "fx_vectors.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>

#include "unity.h"
#include "worst.h"

const int32_t corner[CORNERS] = {
    INT32_MIN,   INT32_MIN + 1,
    -0x7FFF8001, -0x7FFF8000,
    -0x40000001, -0x40000000,
    -0x3FFFFFFF, -0x00020000,
    -65537,      -65536,
    -65535,      -32769,
    -32768,      -32767,
    -16384,      -2,
    -1,          0,
    1,           2,
    3,           16383,
    16384,       32767,
    32768,       65535,
    65536,       65537,
    0x0001FFFF,  0x3FFFFFFF,
    0x40000000,  0x40000001,
    0x7FFF7FFF,  0x7FFF8000,
    INT32_MAX,
};

uint32_t random_u32(void)
{
    static uint64_t state = UINT64_C(0x9E3779B97F4A7C15);
    state ^= state >> 12;
    state ^= state << 25;
    state ^= state >> 27;
    return (uint32_t)((state * UINT64_C(0x2545F4914F6CDD1D)) >> 32);
}

int32_t random_s32(void)
{
    const uint32_t places = random_u32() % 32U;
    return (int32_t)random_u32() >> places;
}

int16_t random_s16(void)
{
    const uint32_t places = random_u32() % 16U;
    return (int16_t)((int16_t)(random_u32() & 0xFFFFU) >> places);
}

bool exhaustive_is_affordable(void)
{
#if defined(__OPTIMIZE__) && !defined(__SANITIZE_ADDRESS__)
    return true;
#else
    return false;
#endif
}

long double half_up(long double x)
{
    return floorl(x + 0.5L);
}

long double clip(long double x, long double low, long double high)
{
    return fminl(fmaxl(x, low), high);
}

void expect_equal(const char *what, int64_t a, int64_t b, int64_t got, int64_t want)
{
    if (got != want) {
        char text[200];
        (void)snprintf(text, sizeof text, "%s(%" PRId64 ", %" PRId64 ") is %" PRId64 ", expected %" PRId64, what, a, b,
                       got, want);
        TEST_FAIL_MESSAGE(text);
    }
}

void worst_note(worst_t *worst, long double error, int64_t a, int64_t b)
{
    if (is_worse(fabsl(error), worst->error)) {
        *worst = (worst_t){fabsl(error), a, b};
    }
}

void worst_expect(const worst_t *worst, const char *what, long double allowed)
{
    char text[200];
    (void)snprintf(text, sizeof text, "%s: largest error %.6Lg at (%" PRId64 ", %" PRId64 "), allowed %.6Lg", what,
                   worst->error, worst->a, worst->b, allowed);
    TEST_ASSERT_TRUE_MESSAGE(worst->error <= allowed, text);
}
