/* SPDX-License-Identifier: Apache-2.0 */
/* Language, comments, characters, constants and initialisers: every marked line violates the rule that it names. */
#include "planted.h"

static _Alignas(8) uint8_t buffer[8]; /* rule 1.4 */

/* A comment that begins again /* rule 3.1 */

static const char text[] = "\x1Bzz";       /* rule 4.1 */
static const char trigraph[] = "is it??!"; /* rule 4.2 */

typedef struct {
    int16_t plain : 4; /* signed without saying so */
    int kind : 3;      /* rule 6.1 */
    int32_t sign : 1;  /* rule 6.2 */
} planted_bits_t;

int32_t planted_language(int32_t x, int32_t unused) /* rule 2.7 */
{
    const int32_t y = x ?: 1;              /* rule 1.2 */
    const int32_t octal = 017;             /* rule 7.1 */
    const uint32_t high = 0x90000000;      /* rule 7.2 */
    const int64_t small = 12l;             /* rule 7.3 */
    char *written = "constant";            /* rule 7.4 */
    int32_t square[2][2] = {1, 2, 3, 4};   /* rule 9.2 */
    int32_t partial[4] = {1, 2};           /* rule 9.3 */
    int32_t twice[2] = {[0] = 1, [0] = 2}; /* rule 9.4 */
    int32_t open[] = {[0] = 1, [2] = 3};   /* rule 9.5 */
    buffer[0] = (uint8_t)text[0];
    return y + 0 + octal + (int32_t)high + (int32_t)small + written[0] + trigraph[0] + /* rule 2.2 */
           square[0][0] + partial[0] + twice[0] + open[0];
}
