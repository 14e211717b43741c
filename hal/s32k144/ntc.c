/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/s32k144/ntc.h"

#include "fx/format.h"
#include "hal/temperature.h"

#define NODES 35
#define FIRST_DC (-400)
#define STEP_DC 100

/* Counts at -40, -30 ... 300 degrees: falling. */
static const uint16_t node[NODES] = {3937, 3814, 3628, 3368, 3038, 2654, 2249, 1854, 1497, 1191, 941, 741,
                                     584,  462,  368,  295,  238,  194,  159,  132,  110,  92,   78,  66,
                                     57,   49,   43,   37,   33,   29,   25,   23,   20,   18,   16};

/* The section of the largest count below 4096, 2048 ... 32: the search begins there. */
static const uint8_t first_of_octave[] = {0, 6, 9, 12, 15, 19, 23, 28};
#define FEWEST_ZEROS 20U /* of a count of 12 bits in a word of 32 */

int16_t ntc_dC(uint16_t count)
{
    if (count > node[0] || count < node[NODES - 1]) {
        return TEMPERATURE_OUT_OF_RANGE;
    }
    int k = first_of_octave[fx_leading_zeros(count) - FEWEST_ZEROS];
    while (count < node[k + 1]) {
        k++;
    }
    const int span = node[k] - node[k + 1];
    const int part = (STEP_DC * (node[k] - count) + span / 2) / span;
    return (int16_t)(FIRST_DC + STEP_DC * k + part);
}
