/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/s32k144/startup.h"

#include "hal/s32k144/core.h"
#include "hal/s32k144/registers.h"
#include "hal/s32k144/wdog.h"
#include "hal/system.h"

#define STACK_PATTERN 0xC5C5C5C5U
#define AWAIT_LOOPS 1000000U /* 50 ms at the least; at most the watchdog's first 100 ms */
#define OUTPUTS_OFF 0x3FU
#define VECTORS (16 + 123)

/* From the linker script. */
extern uint32_t stack_bottom[], stack_top[];
extern uint32_t data_start[], data_end[], bss_start[], bss_end[];
extern const uint32_t data_load[];
extern uint32_t hot_start[], hot_end[]; /* whole blocks of four words */
extern const uint32_t hot_load[];

int main(void);

static uint32_t cause, unused;

/* The bits of RCM_SRS, the most specific first: a power-on also sets the bit for low voltage. */
reset_cause_t hal_system_reset_cause(void)
{
    static const struct {
        uint32_t bit;
        reset_cause_t meaning;
    } known[] = {
        {RCM_SRS_POR, RESET_POWER_ON},  {RCM_SRS_WDOG, RESET_WATCHDOG}, {RCM_SRS_LOCKUP, RESET_LOCKUP},
        {RCM_SRS_LOC, RESET_CLOCK},     {RCM_SRS_LOL, RESET_CLOCK},     {RCM_SRS_SW, RESET_SOFTWARE},
        {RCM_SRS_LVD, RESET_BROWN_OUT}, {RCM_SRS_PIN, RESET_PIN},
    };
    for (uint32_t k = 0; k < sizeof known / sizeof known[0]; k++) {
        if ((cause & known[k].bit) != 0U) {
            return known[k].meaning;
        }
    }
    return RESET_UNKNOWN;
}

uint32_t stack_measure(void)
{
    const volatile uint32_t *word = stack_bottom;
    while (word < stack_top && *word == STACK_PATTERN) {
        word++;
    }
    unused = (uint32_t)((uintptr_t)word - (uintptr_t)stack_bottom);
    return unused;
}

uint32_t hal_system_stack_unused(void)
{
    return unused;
}

_Noreturn void panic(void)
{
    FTM0->SWOCTRL = OUTPUTS_OFF; /* before its clock is on, this access faults in turn: the core resets then, too */
    SCB_AIRCR = AIRCR_RESET;
    for (;;) {
    }
}

void await(const volatile uint32_t *word, uint32_t mask, uint32_t value)
{
    for (uint32_t k = 0; k < AWAIT_LOOPS; k++) {
        if ((*word & mask) == value) {
            return;
        }
    }
    panic();
}

/* The stack itself may be the cause of a fault, so its pointer is reset first. */
__attribute__((naked)) void fault_handler(void)
{
    __asm__ volatile("ldr r0, =stack_top\n msr msp, r0\n b panic\n" ::"i"(panic));
}

/* The long areas by four words at a time: after a reset at speed the bridge waits until this has been done. */
static void clear_and_copy(void)
{
    const uint32_t *from = data_load;
    for (uint32_t *to = data_start; to < data_end; to++, from++) {
        *to = *from;
    }
    from = hot_load;
    for (uint32_t *to = hot_start; to < hot_end; to += 4, from += 4) {
        const uint32_t a = from[0], b = from[1], c = from[2], d = from[3];
        to[0] = a;
        to[1] = b;
        to[2] = c;
        to[3] = d;
    }
    uint32_t *to = bss_start;
    for (; bss_end - to >= 4; to += 4) {
        to[0] = to[1] = to[2] = to[3] = 0;
    }
    for (; to < bss_end; to++) {
        *to = 0;
    }
}

__attribute__((used)) void start_up(void)
{
    wdog_first();
    SCB_CPACR = SCB_CPACR | CPACR_FPU;
    __asm__ volatile("dsb\n isb" ::: "memory");
    clear_and_copy();
    cause = RCM->SRS;
    (void)main();
    panic();
}

/* First, what must outlast a reset is kept again (retained.h), because the next reset may come before it has been read.
 *
 * All RAM in use is written in whole words before any of it is read or written in part, because until then its error
 * correction codes are undefined: the stack here, four words at a time as in clear_and_copy(), with the pattern from
 * which the high-water mark is found; the rest there. */
__attribute__((naked)) void reset_handler(void)
{
    __asm__ volatile("ldr r0, =%c1\n"
                     "ldr r1, [r0]\n"
                     "bic r1, r1, %2\n"
                     "str r1, [r0]\n"
                     "ldr r0, =stack_bottom\n"
                     "ldr r1, =stack_top\n"
                     "ldr r2, =%c0\n"
                     "mov r3, r2\n"
                     "mov r4, r2\n"
                     "mov r5, r2\n"
                     "1: stmia r0!, {r2, r3, r4, r5}\n"
                     "cmp r0, r1\n"
                     "blo 1b\n"
                     "b start_up\n" ::"i"(STACK_PATTERN),
                     "i"(&SIM->CHIPCTL), "i"(SIM_CHIPCTL_SRAMU_RETEN));
}

#define EXTERNAL(irq) (16 + (irq))

typedef void (*vector_t)(void);

__attribute__((section(".vectors"), used)) static const vector_t vectors[VECTORS] = {
    [0] = (vector_t)(uintptr_t)stack_top,
    [1] = reset_handler,
    /* No system exception is used, and no interrupt but these: each of the others is a fault. */
    [2 ... EXTERNAL(IRQ_ADC0) - 1] = fault_handler,
    [EXTERNAL(IRQ_ADC0)] = adc_handler,
    [EXTERNAL(IRQ_ADC0) + 1 ... EXTERNAL(IRQ_LPIT0_CH0) - 1] = fault_handler,
    [EXTERNAL(IRQ_LPIT0_CH0)] = tick_handler,
    [EXTERNAL(IRQ_LPIT0_CH0) + 1 ... EXTERNAL(IRQ_PDB0) - 1] = fault_handler,
    [EXTERNAL(IRQ_PDB0)] = sampling_error_handler,
    [EXTERNAL(IRQ_PDB0) + 1 ... EXTERNAL(IRQ_PDB1) - 1] = fault_handler,
    [EXTERNAL(IRQ_PDB1)] = sampling_error_handler,
    [EXTERNAL(IRQ_MRAI)] = mrai_handler,
    [EXTERNAL(IRQ_MRAI) + 1 ... EXTERNAL(IRQ_CAN0_ORED) - 1] = fault_handler,
    [EXTERNAL(IRQ_CAN0_ORED)] = can_bus_off_handler,
    [EXTERNAL(IRQ_CAN0_ORED) + 1 ... EXTERNAL(IRQ_CAN0_ORED_0_15_MB) - 1] = fault_handler,
    [EXTERNAL(IRQ_CAN0_ORED_0_15_MB)] = can_message_handler,
    [EXTERNAL(IRQ_CAN0_ORED_0_15_MB) + 1 ... EXTERNAL(IRQ_FTM0_FAULT) - 1] = fault_handler,
    [EXTERNAL(IRQ_FTM0_FAULT)] = gate_fault_handler,
    [EXTERNAL(IRQ_FTM0_FAULT) + 1 ... VECTORS - 1] = fault_handler,
};

/* Keys, protection off, FSEC: not secured, FOPT: as delivered. */
__attribute__((section(".flash_config"), used)) static const uint32_t flash_config[4] = {0xFFFFFFFFU, 0xFFFFFFFFU,
                                                                                         0xFFFFFFFFU, 0xFFFF7FFEU};
