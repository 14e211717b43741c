/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_NVM_H
#define HAL_NVM_H
/** Flash slots that survive a power cycle. The store writes them in turn, so that a power cut at any byte leaves the
 * previous or the new record intact.
 *   A port with more slots than two, or with several in a sector that is erased as a whole, defines the three numbers
 *   for the layers that include this header (hal/s32k144/nvm_layout.cmake).
 *   begin() and end() enclose every erase and program. A port whose flash needs other clocks changes them there: the
 *   drive keeps switching disabled in between, and the rotor stands still.
 * Source   docs/howto/port.md, docs/decisions/007-store.md
 * Units    bytes; program() writes whole multiples of HAL_NVM_UNIT at multiples of it, once after each erase
 * Errors   false: out of the slot's range, not erased, uncorrectable content, or the hardware reported a failure;
 *          begin(): the flash cannot be written now
 * Context  background, below every interrupt: erase and program may take milliseconds but must not stop the
 *          interrupts. read() also before the interrupts start */
#include <stdbool.h>
#include <stdint.h>

#ifndef HAL_NVM_SLOTS
#define HAL_NVM_SLOTS 2U
#define HAL_NVM_SLOT_SIZE 2048U
#define HAL_NVM_SECTOR_SLOTS 1U /* slots that are erased together: whole sectors, in the order of the slots */
#endif
#define HAL_NVM_UNIT 8U /* reads as 0xFF after an erase */

bool hal_nvm_begin(void);
void hal_nvm_end(void);
bool hal_nvm_read(uint32_t slot, uint32_t offset, void *data, uint32_t size);
/** The sector that begins with this slot. */
bool hal_nvm_erase(uint32_t slot);
bool hal_nvm_program(uint32_t slot, uint32_t offset, const void *data, uint32_t size);

#endif
