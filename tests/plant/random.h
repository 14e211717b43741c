/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PLANT_RANDOM_H
#define PLANT_RANDOM_H
/** Reproducible noise: xoshiro256++ seeded through splitmix64, normal deviates by the polar method.
 * Source   Blackman and Vigna, ACM TOMS 47 (2021) 36; Marsaglia and Bray, SIAM Rev. 6 (1964) 260
 * Units    normal: mean 0, variance 1
 * Context  simulation only; a seed gives the same sequence wherever IEEE doubles and libm agree */
#include <stdint.h>

typedef struct {
    uint64_t s[4];
    double spare;
    int has_spare;
} random_t;

void random_seed(random_t *rng, uint64_t seed);
uint64_t random_bits(random_t *rng);
double random_normal(random_t *rng);

#endif
