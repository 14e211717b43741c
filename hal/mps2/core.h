/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_MPS2_CORE_H
#define HAL_MPS2_CORE_H
/** The few registers of Armv7-M and Armv8-M that this port uses; it uses no peripheral of the board.
 * Source   Armv7-M Architecture Reference Manual, B3.2 ... B3.4
 * Context  private to the port */
#include <stdint.h>

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define SYST_CSR REGISTER(0xE000E010U)
#define SYST_RVR REGISTER(0xE000E014U)
#define SYST_CVR REGISTER(0xE000E018U)
#define NVIC_ISER0 REGISTER(0xE000E100U)
#define NVIC_ISPR0 REGISTER(0xE000E200U)
#define NVIC_IPR(n) (*(volatile uint8_t *)(0xE000E400U + (n)))
#define SCB_ICSR REGISTER(0xE000ED04U)
#define SCB_VTOR REGISTER(0xE000ED08U)
#define SCB_SHPR3 REGISTER(0xE000ED20U)
#define SCB_CPACR REGISTER(0xE000ED88U)
#define SYST_RUN 7U             /* processor clock, interrupt, enable */
#define ICSR_PENDSV (1U << 28)
#define CPACR_FPU 0x00F00000U

#define IRQ_TASK 31U /* not used by the board's peripherals in this port */
#define PRIORITY_FAST 0x20U /* uppermost three bits */
#define PRIORITY_MRAI 0x40U
#define PRIORITY_TASK 0x60U

void reset_handler(void);
void fault_handler(void);
void systick_handler(void);
void pendsv_handler(void);
void task_handler(void);

#endif
