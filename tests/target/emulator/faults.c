/* SPDX-License-Identifier: Apache-2.0 */
/* Faults of the core. Unless emu_core_faults() asks for them, a fault ends the emulation with one message: it is an
 * error of the program that no test expects. If it asks for them, the core takes them as the Armv7-M architecture says:
 * CFSR, HFSR and BFAR tell the cause, the frame holds the address of the instruction, and the exception is its own one
 * if SHCSR enables it and its priority suffices, else HardFault. A fault in HardFault's handler, or with FAULTMASK, is
 * a lock-up, which resets the chip (RCM_SRS.LOCKUP).
 *
 * Every fault is precise here. On the chip a buffered write reports its bus error some instructions later, with
 * IMPRECISERR. That a failed stacking on the entry of HardFault leaves its handler to run is from memory.
 *
 * documented behaviour                               | modelled | test
 * -------------------------------------------------- | -------- | ----------------------------------------------------
 * access to no memory, write of flash: bus fault     | yes      | test_a_core_fault_is_an_exception
 * access to a peripheral without its clock: the same | yes      | test_a_core_fault_is_an_exception
 * fetch from a peripheral's address: memory fault    | yes      | test_a_core_fault_is_an_exception
 * fetch from no memory: bus fault                    | yes      | test_a_core_fault_is_an_exception
 * undefined instruction, Arm state: usage fault      | yes      | test_a_core_fault_is_an_exception
 * own exception, if enabled and of higher priority   | yes      | test_an_enabled_fault_has_its_own_exception
 * else, also with PRIMASK: HardFault, HFSR.FORCED    | yes      | test_a_fault_that_its_own_exception_cannot_take
 * fault in HardFault or with FAULTMASK: lock-up      | yes      | test_a_fault_in_the_handler_of_faults_is_a_lock_up
 * lock-up resets the chip                            | yes      | test_a_fault_in_the_handler_of_faults_is_a_lock_up
 * no memory for the frame: HardFault                 | yes      | test_a_stack_without_memory_still_reaches_hard_fault
 * CCR: traps of division by zero, unaligned accesses | refused  | test_what_is_not_modelled_is_an_error
 * SVC, BKPT, floating point without CPACR            | refused  | test_what_is_not_modelled_is_an_error
 * no memory for a frame on return; imprecise errors  | no       | -
 */
#include "emu_private.h"

enum {
    MEMORY_FAULT = 4,
    BUS_FAULT = 5,
    USAGE_FAULT = 6,
    IACCVIOL = 1 << 0, /* of CFSR */
    IBUSERR = 1 << 8,
    PRECISERR = 1 << 9,
    BFARVALID = 1 << 15,
    UNDEFINSTR = 1 << 16,
    INVSTATE = 1 << 17,
    THUMB = 1 << 24, /* of xPSR */
};

void emu_core_faults(emu_t *emu, bool taken)
{
    emu->takes_faults = taken;
}

static void note(emu_t *emu, int vector, uint32_t cause)
{
    if (emu->s.nvic.fault == 0) { /* the first one of an instruction */
        emu->s.nvic.fault = vector;
        emu->s.nvic.fault_pc = emu_pc(emu);
        emu->s.nvic.cfsr |= cause;
    }
    emu->s.stop = true;
}

bool fault_data(emu_t *emu, uint32_t address)
{
    if (!emu->takes_faults) {
        return false;
    }
    if (emu->s.nvic.fault == 0) {
        emu->s.nvic.bfar = address;
    }
    note(emu, BUS_FAULT, PRECISERR | BFARVALID);
    return true;
}

bool fault_fetch(emu_t *emu, bool never_executable)
{
    if (emu->takes_faults) {
        note(emu, never_executable ? MEMORY_FAULT : BUS_FAULT, never_executable ? IACCVIOL : IBUSERR);
    }
    return emu->takes_faults;
}

/* What unicorn reports when it stops at an instruction: it is undefined; the core would have to be in Arm state. */
bool fault_take(emu_t *emu, uc_err code)
{
    nvic_t *n = &emu->s.nvic;
    if (emu->takes_faults && code == UC_ERR_INSN_INVALID) {
        uint32_t xpsr = 0;
        (void)uc_reg_read(emu->uc, UC_ARM_REG_XPSR, &xpsr);
        note(emu, USAGE_FAULT, (xpsr & THUMB) != 0U ? UNDEFINSTR : INVSTATE);
    }
    const int vector = n->fault;
    if (vector == 0 || emu->error[0] != '\0') {
        return false;
    }
    n->fault = 0;
    emu->s.pc = n->fault_pc;
    nvic_fault(emu, vector);
    return true;
}
