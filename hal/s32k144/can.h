/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_CAN_H
#define HAL_S32K144_CAN_H
/** FlexCAN0 at 500 kbit/s: start-up and interrupts of hal/can.h.
 * Source   README.md, CAN
 * Errors   a full queue drops the newest frame and counts it
 * Context  can_init(): start-up; the others: CAN interrupts */

void can_init(void);
void can_message_isr(void);
void can_bus_off_isr(void);

#endif
