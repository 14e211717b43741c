/* SPDX-License-Identifier: Apache-2.0 */
#include "memory_map.h"

#include <stddef.h>

#include "ecu/ecu.h"

/* In the order of their addresses. */
#define AT(member) {#member, offsetof(ecu_t, member)}
static const struct {
    const char *name;
    size_t offset;
} blocks[] = {
    AT(drive.motor),
    AT(drive.period),
    AT(drive.parameters),
    AT(drive.data_check),
    AT(drive.request),
    AT(drive.fast),
    AT(drive.fast.window),
    AT(drive.fast.periods_since_enable),
    AT(drive.psi_d_error),
    AT(drive.task.torque_limit),
    AT(drive.task.torque_loop),
    AT(drive.task.identify),
    AT(drive.task.identify.kalman),
    AT(drive.task.identification),
    AT(drive.task.psi_d_error),
    AT(drive.task.reference),
    AT(drive.task.angle_harmonics),
    AT(drive.task.angle_correction),
    AT(drive.task.plausibility),
    AT(drive.task.torque_monitor),
    AT(drive.task.commission),
    AT(drive.task.compensation),
    AT(drive.task.i_ref),
    AT(drive.windows),
    AT(drive.commands),
    AT(drive.mrai),
    AT(drive.samples),
    AT(clock),
    AT(rx),
    AT(tx),
    AT(supervisor),
    AT(arbitration_config),
    AT(arbitration_state),
    AT(liveness),
    AT(xcp),
    AT(freeze),
    AT(scope),
};

#define BLOCKS (sizeof blocks / sizeof blocks[0])
_Static_assert(BLOCKS < MEMORY_BLOCKS_MAX, "each has a row in the table");

unsigned memory_block(uint32_t byte)
{
    unsigned block = 0;
    while (block + 1U < BLOCKS && blocks[block + 1U].offset <= byte) {
        block++;
    }
    return block;
}

const char *memory_block_name(unsigned block)
{
    return (block < BLOCKS) ? blocks[block].name : NULL;
}

uint32_t memory_block_offset(unsigned block)
{
    return (uint32_t)blocks[block].offset;
}
