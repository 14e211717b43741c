/* SPDX-License-Identifier: Apache-2.0 */
/* Functions, arrays and unions. */
#include "planted.h"
#include <stdarg.h>

struct planted_tail {
    int32_t count;
    int32_t rest[]; /* rule 18.7 */
};

union planted_union { /* rule 19.2 */
    int32_t a;
    float b;
};

int32_t planted_any(int32_t n, ...)
{
    va_list list; /* rule 17.1 */
    va_start(list, n);
    va_end(list);
    return n;
}

int32_t planted_recursion(int32_t n)
{
    return (n > 0) ? planted_recursion(n - 1) : 0; /* rule 17.2 */
}

int32_t planted_static(int32_t a[static 2]) /* rule 17.6 */
{
    return a[0];
}

int32_t planted_calls(int32_t n, int32_t ***deep) /* rule 18.5 */
{
    int32_t variable[n];     /* rule 18.8 */
    planted_not_declared(n); /* rule 17.3 */
    planted_recursion(n);    /* rule 17.7 */
    n = 2;                   /* rule 17.8 */
    variable[0] = n;
    return variable[0] + ***deep;
}
