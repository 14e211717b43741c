/* SPDX-License-Identifier: Apache-2.0 */
#include "dice.h"

dice_t dice_start(uint64_t seed)
{
    return (dice_t){seed * 0x9E3779B97F4A7C15ULL + 1ULL};
}

double dice_chance(dice_t *dice)
{
    dice->state ^= dice->state >> 12;
    dice->state ^= dice->state << 25;
    dice->state ^= dice->state >> 27;
    return (double)((dice->state * 0x2545F4914F6CDD1DULL) >> 11) / 9007199254740992.0;
}

double dice_between(dice_t *dice, double low, double high)
{
    return low + (high - low) * dice_chance(dice);
}
