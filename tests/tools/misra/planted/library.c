/* SPDX-License-Identifier: Apache-2.0 */
/* The standard library. */
#include "planted.h"
#include <errno.h>
#include <fenv.h>
#include <locale.h>
#include <setjmp.h> /* rule 21.4 */
#include <signal.h> /* rule 21.5 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <tgmath.h> /* rule 21.11 */
#include <time.h>   /* rule 21.10 */

int32_t planted_library(const char *name, int32_t (*compare)(const void *a, const void *b), int32_t *x, float *f)
{
    char copy[8];
    void *memory = malloc(4);          /* rule 21.3 */
    (void)printf("planted");           /* rule 21.6 */
    const int32_t number = atoi(name); /* rule 21.7 */
    if (number == 3) {
        exit(1); /* rule 21.8 */
    }
    qsort(x, 3, sizeof *x, compare);  /* rule 21.9 */
    (void)feraiseexcept(FE_OVERFLOW); /* rule 21.12 */
    (void)strcpy(copy, name);
    const int32_t same = memcmp(copy, name, 3); /* rule 21.14 */
    (void)memcpy(x, f, 4);                      /* rule 21.15 */
    const int32_t equal = memcmp(f, f, 4);      /* rule 21.16 */
    (void)system(name);                         /* rule 21.21 */
    return same + equal + (memory != NULL ? 1 : 0);
}

void planted_locale(void)
{
    char *changed = setlocale(LC_ALL, "C"); /* rule 21.19 */
    changed[0] = 'x';
}

int32_t planted_stale(void)
{
    const char *first = getenv("FIRST");
    const char *second = getenv("SECOND");
    (void)second;
    const char stale = first[0]; /* rule 21.20 */
    return stale;
}

int32_t planted_files(FILE *file, char *end)
{
    const FILE copy = *file; /* rule 22.5 */
    const char c = (char)getchar();
    if (c == EOF) { /* rule 22.7 */
        return 1;
    }
    const uint32_t a = strtoul("1", &end, 10); /* rule 22.8, 22.9 */
    (void)planted_stale();
    if (errno == 0) { /* rule 22.10 */
        return 2;
    }
    (void)copy;
    return (int32_t)a;
}
