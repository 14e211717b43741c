/* SPDX-License-Identifier: Apache-2.0 */
/* The preprocessor. */
static int planted_before;
#include "planted.h"       /* rule 20.1 */
#include <planted,comma.h> /* rule 20.2 */
#include planted_name.h    /* rule 20.3 */

#define while if                                 /* rule 20.4 */
#define PLANTED_DOUBLE(x) (x * 2)                /* rule 20.7 */
#define PLANTED_TEXT_AND_NAME(x) #x##x           /* rule 20.11 */
#define PLANTED_VALUE 1
#define PLANTED_NAME_AND_VALUE(x) (planted_##x + x) /* rule 20.12 */
#define _PLANTED_RESERVED 1                      /* rule 21.1 */
#define __builtin_planted 1                      /* rule 21.2 */

#if 2 /* rule 20.8 */
#endif
#if PLANTED_NEVER_DEFINED == 1 /* rule 20.9 */
#endif
#planted unknown /* rule 20.13 */
#if PLANTED_VALUE == 1
#include "planted_half.inc"

int32_t planted_preprocessor(int32_t planted_PLANTED_VALUE)
{
    return PLANTED_DOUBLE(planted_before) + PLANTED_NAME_AND_VALUE(PLANTED_VALUE);
}
