/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PORT_HANDLERS_H
#define PORT_HANDLERS_H
/** The interrupts of the port, and what start-up calls.
 * Source   docs/howto/port.md, priorities
 * Context  startup.c puts them into the vector table */

void reset_handler(void);  /* the processor starts here */
void period_handler(void); /* highest priority: the samples of this PWM period are complete */
void mrai_handler(void);   /* below: pended by hal_irq_pend_mrai() */
void task_handler(void);   /* lowest: every bases.periods_per_step periods */
int main(void);

#endif
