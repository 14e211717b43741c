/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/system.h"

/* Write: count the bytes at the end of the stack that still hold the pattern written at start-up. 0: unknown. */
uint32_t hal_system_stack_unused(void)
{
    return 0;
}

/* Write: translate the reset status register, which start-up must save before it is cleared. */
reset_cause_t hal_system_reset_cause(void)
{
    return RESET_UNKNOWN;
}
