/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/host/nvm_host.h"

#include <string.h>

#include "hal/host/instance.h"
#include "hal/host/port.h"

_Static_assert(NVM_HOST_SIZE == FLUXTRUE_MEMORY_SIZE, "the interface names the size");

static bool within(uint32_t slot, uint32_t offset, uint32_t size)
{
    return slot < HAL_NVM_SLOTS && offset <= HAL_NVM_SLOT_SIZE && size <= HAL_NVM_SLOT_SIZE - offset;
}

void nvm_host_erase(nvm_host_t *nvm)
{
    memset(nvm->slot, 0xFF, sizeof nvm->slot);
    nvm->changes = 0;
}

bool nvm_host_read(const nvm_host_t *nvm, uint32_t slot, uint32_t offset, void *data, uint32_t size)
{
    if (!within(slot, offset, size)) {
        return false;
    }
    memcpy(data, &nvm->slot[slot][offset], size);
    return true;
}

bool nvm_host_erase_slot(nvm_host_t *nvm, uint32_t slot)
{
    if (!within(slot, 0, 0)) {
        return false;
    }
    memset(nvm->slot[slot], 0xFF, HAL_NVM_SLOT_SIZE);
    nvm->changes++;
    return true;
}

bool nvm_host_program(nvm_host_t *nvm, uint32_t slot, uint32_t offset, const void *data, uint32_t size)
{
    const uint8_t *byte = data;
    if (!within(slot, offset, size) || offset % HAL_NVM_UNIT != 0U || size % HAL_NVM_UNIT != 0U) {
        return false;
    }
    for (uint32_t k = 0; k < size; k++) {
        nvm->slot[slot][offset + k] &= byte[k];
    }
    nvm->changes++;
    return true;
}

int fluxtrue_memory_read(const fluxtrue_t *drive, unsigned char *data, int size)
{
    if (size != FLUXTRUE_MEMORY_SIZE) {
        return FLUXTRUE_OUT_OF_RANGE;
    }
    memcpy(data, drive->nvm.slot, sizeof drive->nvm.slot);
    return FLUXTRUE_OK;
}

int fluxtrue_memory_write(fluxtrue_t *drive, const unsigned char *data, int size)
{
    if (size != FLUXTRUE_MEMORY_SIZE) {
        return FLUXTRUE_OUT_OF_RANGE;
    }
    if (drive->periods != 0U) {
        return FLUXTRUE_READ_ONLY;
    }
    memcpy(drive->nvm.slot, data, sizeof drive->nvm.slot);
    host_port_recall(drive);
    return FLUXTRUE_OK;
}
