/* SPDX-License-Identifier: Apache-2.0 */
/* Names and declarations. */
#include "planted.h"

#define PLANTED_MACRO_OF_MORE_THAN_SIXTY_THREE_CHARACTERS_WHICH_IS_A_LOT_A 1
#define PLANTED_MACRO_OF_MORE_THAN_SIXTY_THREE_CHARACTERS_WHICH_IS_A_LOT_B 2 /* rule 5.4 */
#define planted_variable 3
#define PLANTED_UNUSED 4 /* rule 2.5 */

extern int32_t planted_external_name_of_more_than_sixty_three_characters_which_is_long_a;
extern int32_t planted_external_name_of_more_than_sixty_three_characters_which_is_long_b; /* rule 5.1 */
extern int32_t planted_external;                                                          /* rule 8.5 */
extern int32_t planted_open[];                                                            /* rule 8.11 */

static int32_t planted_local_name_of_more_than_sixty_three_characters_which_is_long_a;
static int32_t planted_local_name_of_more_than_sixty_three_characters_which_is_long_b; /* rule 5.2 */

typedef int32_t planted_unused_t; /* rule 2.3 */
typedef int32_t planted_again_t;
struct planted_unused_tag { /* rule 2.4 */
    int32_t x;
};
struct planted_again_tag {
    int32_t x;
};
enum { PLANTED_ONE = 1, PLANTED_TWO, PLANTED_SAME = 2 }; /* rule 8.12 */

static int32_t planted_inside;
static const int32_t planted_in_one_function = 1; /* rule 8.9 */
extern planted_count;                             /* rule 8.1 */
static int32_t planted_linkage;
extern int32_t planted_linkage; /* rule 8.8 */
int32_t planted_undeclared;     /* rule 8.4 */

inline int32_t planted_inline(int32_t x) /* rule 8.10 */
{
    return x;
}

static int32_t planted_nothing() /* rule 8.2 */
{
    return 0;
}

int32_t planted_twice(void)
{
    return 1;
}

int32_t planted_only_here(void) /* rule 8.7 */
{
    return planted_nothing();
}

int32_t planted_names(int32_t *restrict x) /* rule 8.14 */
{
    struct planted_again_tag pair = {0};
    planted_again_t again = PLANTED_TWO + PLANTED_SAME;
    int32_t PLANTED_MACRO_OF_MORE_THAN_SIXTY_THREE_CHARACTERS_WHICH_IS_A_LOT_C = 0; /* rule 5.5 */
    return pair.x + again + *x + planted_in_one_function + planted_count + planted_inside + planted_only_here() +
           planted_local_name_of_more_than_sixty_three_characters_which_is_long_a +
           PLANTED_MACRO_OF_MORE_THAN_SIXTY_THREE_CHARACTERS_WHICH_IS_A_LOT_C;
}

void planted_declared_twice(void)
{
    planted_inside = planted_linkage;
}
