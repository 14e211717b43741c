/* SPDX-License-Identifier: Apache-2.0 */
#ifndef LOOP_SECOND_LEVEL_DICE_H
#define LOOP_SECOND_LEVEL_DICE_H
/** Random numbers that a seed repeats: xorshift64*.
 * Range    0 to 1, or between two values
 * Context  simulation only */
#include <stdint.h>

typedef struct {
    uint64_t state; /* never 0 */
} dice_t;

dice_t dice_start(uint64_t seed);
double dice_chance(dice_t *dice);
double dice_between(dice_t *dice, double low, double high);

#endif
