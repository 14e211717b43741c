/* SPDX-License-Identifier: Apache-2.0 */
/* Reception of the protected messages: comm/e2e and comm/can_rx. */
#include "proof.h"

#include "comm/can_rx.c"

void proof_count_ones(void)
{
    unsigned bits;
    ASSUME(bits <= WINDOW_MASK);
    unsigned sum = 0;
    for (unsigned n = 0; n < 10U; n++) {
        sum += bits >> n & 1U;
    }
    PROVE(count_ones(bits) == sum);
}
