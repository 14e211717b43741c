/* SPDX-License-Identifier: Apache-2.0 */
/* Expressions, statements and the flow of control. */
#include "planted.h"

int32_t planted_expressions(int32_t x, int32_t *a, bool b)
{
    int32_t y = 0, z = 1; /* rule 12.3 */
    const uint8_t byte = (uint8_t)x;
    const uint32_t far = (uint32_t)(byte >> 9); /* rule 12.2 */
    const uint32_t wrapped = 0U - 1U;           /* rule 12.4 */
    const int32_t list[2] = {x++, 0};           /* rule 13.1 */
    y = x++ + z;                                /* rule 13.3 */
    if ((y = x) > 0) {                          /* rule 13.4 */
        z = 2;
    }
    if (b && (y++ > 0)) {         /* rule 13.5 */
        z = (int32_t)sizeof(x++); /* rule 13.6 */
    }
    return y + z + a[0] + list[0] + (int32_t)far + (int32_t)wrapped;
}

int32_t planted_loops(int32_t x)
{
    int32_t sum = 0;
    for (float f = 0.0F; f < 1.0F; f += 0.5F) { /* rule 14.1 */
        sum++;
    }
    for (int32_t k = 0; k < x; sum++) { /* rule 14.2 */
        sum += 2;
    }
    if (x) {         /* rule 14.4 */
        goto inside; /* rule 15.1, 15.3 */
    }
back:
    if (sum > 3) {
    inside:
        sum--;
    }
    if (sum > 9) {
        goto back; /* rule 15.2 */
    }
    while (sum > 0) { /* rule 15.4 */
        if (sum == 7) {
            break;
        }
        if (sum == 8) {
            break;
        }
        sum--;
    }
    if (sum > 1) /* rule 15.6 */
        sum = 1;
    if (sum > 2) {
        sum = 2;
    } else if (sum > 1) {
        sum = 1;
    } /* rule 15.7 */
    return sum;
}

int32_t planted_switches(int32_t x, bool b)
{
    int32_t y = 0;
    switch (x) {
        y = 1; /* rule 16.1 */
    case 1:
        y = 2;
        break;
    default:
        break;
    }
    switch (x) {
    case 1:
        if (b) {
        case 2: /* rule 16.2 */
            y = 3;
        }
        break;
    default:
        break;
    }
    switch (x) {
    case 1:
        y = 4;
    case 2: /* rule 16.3 */
        y = 5;
        break;
    default:
        break;
    }
    switch (x) { /* rule 16.4 */
    case 1:
        y = 6;
        break;
    case 2:
        y = 7;
        break;
    }
    switch (x) {
    case 1:
        y = 8;
        break;
    default: /* rule 16.5 */
        break;
    case 2:
        y = 9;
        break;
    }
    switch (x) { /* rule 16.6 */
    default:
        y = 10;
        break;
    }
    switch (x > 1) { /* rule 16.7 */
    case 0:
        y = 11;
        break;
    default:
        break;
    }
    return y;
}
