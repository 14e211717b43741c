/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/irq.h"

/* Write: set the pending bit of the interrupt whose handler is mrai_handler() in main.c, for example PendSV. */
void hal_irq_pend_mrai(void)
{
}
