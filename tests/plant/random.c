/* SPDX-License-Identifier: Apache-2.0 */
#include "random.h"

#include <math.h>

void random_seed(random_t *rng, uint64_t seed)
{
    for (int k = 0; k < 4; k++) {
        seed += 0x9e3779b97f4a7c15u;
        uint64_t z = seed;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        rng->s[k] = z ^ (z >> 31);
    }
    rng->has_spare = 0;
}

static inline uint64_t rotate_left(uint64_t x, unsigned n)
{
    return (x << n) | (x >> (64u - n));
}

uint64_t random_bits(random_t *rng)
{
    uint64_t *s = rng->s;
    const uint64_t out = rotate_left(s[0] + s[3], 23) + s[0], t = s[1] << 17;
    s[2] ^= s[0];
    s[3] ^= s[1];
    s[1] ^= s[2];
    s[0] ^= s[3];
    s[2] ^= t;
    s[3] = rotate_left(s[3], 45);
    return out;
}

/* [-1, 1) with 53 bits */
static double symmetric(random_t *rng)
{
    return (double)(random_bits(rng) >> 11) * 0x1p-52 - 1.0;
}

double random_normal(random_t *rng)
{
    if (rng->has_spare) {
        rng->has_spare = 0;
        return rng->spare;
    }
    double x, y, r;
    do {
        x = symmetric(rng);
        y = symmetric(rng);
        r = x * x + y * y;
    } while (r >= 1.0 || r == 0.0);
    double scale = sqrt(-2.0 * log(r) / r);
    rng->spare = y * scale;
    rng->has_spare = 1;
    return x * scale;
}
