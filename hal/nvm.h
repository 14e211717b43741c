/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_NVM_H
#define HAL_NVM_H
/** Two flash slots that survive a power cycle. The store writes them alternately, so that a power cut at any byte
 * leaves the previous or the new record intact.
 * Source   docs/howto/port.md
 * Units    bytes; program() writes whole multiples of HAL_NVM_UNIT at multiples of it, once after each erase
 * Errors   false: out of the slot's range, not erased, or the hardware reported a failure
 * Context  background, below every interrupt: erase and program may take milliseconds but must not stop the
 *          interrupts */
#include <stdbool.h>
#include <stdint.h>

#define HAL_NVM_SLOTS 2U
#define HAL_NVM_SLOT_SIZE 2048U
#define HAL_NVM_UNIT 8U /* reads as 0xFF after an erase */

bool hal_nvm_read(uint32_t slot, uint32_t offset, void *data, uint32_t size);
bool hal_nvm_erase(uint32_t slot);
bool hal_nvm_program(uint32_t slot, uint32_t offset, const void *data, uint32_t size);

#endif
