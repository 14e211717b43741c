/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_IRQ_H
#define HAL_IRQ_H
/** Pends the identification interrupt, which runs below the fast ISR and above the 1 kHz task.
 * Source   docs/architecture.md, priorities
 * Units    none
 * Errors   none; an interrupt that is pended twice before it starts runs once
 * Context  fast ISR, once per period while the paper's identification is chosen */

void hal_irq_pend_mrai(void);

#endif
