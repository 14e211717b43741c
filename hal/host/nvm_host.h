/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_HOST_NVM_HOST_H
#define HAL_HOST_NVM_HOST_H
/** The flash of a software-in-the-loop drive. It is erased when the instance is created; a caller may copy it out and
 * back.
 *   As in flash, programming can only clear bits. The copy contains all slots, one after the other.
 * Source   hal/nvm.h; docs/howto/software-in-the-loop.md
 * Errors   as fluxtrue_memory_read() and fluxtrue_memory_write()
 * Context  between two periods; the same thread as fluxtrue_step() */
#include <stdbool.h>
#include <stdint.h>

#include "hal/nvm.h"

#define NVM_HOST_SIZE (HAL_NVM_SLOTS * HAL_NVM_SLOT_SIZE)

typedef struct {
    uint8_t slot[HAL_NVM_SLOTS][HAL_NVM_SLOT_SIZE];
    uint32_t changes; /* number of erase and program operations */
} nvm_host_t;

void nvm_host_erase(nvm_host_t *nvm);
bool nvm_host_read(const nvm_host_t *nvm, uint32_t slot, uint32_t offset, void *data, uint32_t size);
bool nvm_host_erase_slot(nvm_host_t *nvm, uint32_t slot);
bool nvm_host_program(nvm_host_t *nvm, uint32_t slot, uint32_t offset, const void *data, uint32_t size);

#endif
