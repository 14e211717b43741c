/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/irq.h"

#include "hal/s32k144/core.h"

void hal_irq_pend_mrai(void)
{
    core_irq_pend(IRQ_MRAI);
}
