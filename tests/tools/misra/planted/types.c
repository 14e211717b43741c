/* SPDX-License-Identifier: Apache-2.0 */
/* Essential types and conversions of pointers. */
#include "planted.h"

enum planted_colour { PLANTED_RED, PLANTED_GREEN };
struct planted_opaque;
struct planted_pair {
    int32_t a;
};
struct planted_other {
    int64_t b;
};
typedef int32_t (*planted_function_t)(int32_t x);
typedef int32_t (*planted_other_function_t)(int64_t x);

static void fill(int32_t *to)
{
    *to = 1;
}

int32_t planted_types(int32_t s, uint16_t u, char c, float f, bool b)
{
    int32_t y = s << 2;                    /* rule 10.1 */
    y += (int32_t)('a' + c);               /* rule 10.2 */
    u = f;                                 /* rule 10.3 */
    y = s + (u + 1U);                      /* rule 10.4 */
    b = (bool)s;                           /* rule 10.5 */
    const uint32_t wide = u * u;           /* rule 10.6 */
    const uint32_t w2 = wide * (u + u);    /* rule 10.7 */
    const uint32_t w3 = (uint32_t)(u + u); /* rule 10.8 */
    return y + (int32_t)b + (int32_t)w2 + (int32_t)w3;
}

int32_t planted_pointers(struct planted_opaque *hidden, struct planted_pair *pair, const int32_t *fixed, void *any,
                         planted_function_t call)
{
    planted_other_function_t other = (planted_other_function_t)call; /* rule 11.1 */
    struct planted_pair *seen = (struct planted_pair *)hidden;       /* rule 11.2 */
    struct planted_other *cast = (struct planted_other *)pair;       /* rule 11.3 */
    const uint32_t address = (uint32_t)pair;                         /* rule 11.4 */
    int32_t *word = any;                                             /* rule 11.5 */
    const uint32_t number = (uint32_t)any;                           /* rule 11.6 */
    const float real = (float)word;                                  /* rule 11.7 */
    fill((int32_t *)fixed);                                          /* rule 11.8 */
    int32_t *none = 0;                                               /* rule 11.9 */
    return (other != NULL && seen != NULL && cast != NULL && none != NULL) ? (int32_t)(address + number)
                                                                           : (int32_t)real;
}
