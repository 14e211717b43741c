/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/nvm.h"

/* Write these functions only if the port has two flash slots to spare and calls memory_recall() and
 * memory_background() (docs/howto/port.md). Until then every access fails and nothing survives a power cycle. */
bool hal_nvm_begin(void)
{
    return false;
}

void hal_nvm_end(void)
{
}

bool hal_nvm_read(uint32_t slot, uint32_t offset, void *data, uint32_t size)
{
    (void)slot;
    (void)offset;
    (void)data;
    (void)size;
    return false;
}

bool hal_nvm_erase(uint32_t slot)
{
    (void)slot;
    return false;
}

bool hal_nvm_program(uint32_t slot, uint32_t offset, const void *data, uint32_t size)
{
    (void)slot;
    (void)offset;
    (void)data;
    (void)size;
    return false;
}
