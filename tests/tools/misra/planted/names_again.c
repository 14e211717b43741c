/* SPDX-License-Identifier: Apache-2.0 */
/* The other half of violations that take two files. */
#include "planted.h"

typedef int32_t planted_again_t; /* rule 5.6 */
struct planted_again_tag {       /* rule 5.7 */
    int32_t x;
};
int32_t planted_inside; /* rule 5.8 */

int32_t planted_twice(void) /* rule 8.6 */
{
    const struct planted_again_tag pair = {0};
    const planted_again_t again = 0;
    return pair.x + again;
}
