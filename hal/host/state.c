/* SPDX-License-Identifier: Apache-2.0 */
#include <string.h>

#include "hal/host/instance.h"
#include "hal/host/limits.h"
#include "signal/crc32.h"
#include "types/version.h"

#define MARK "fluxtrue-state" /* 15 bytes with its end */

/* Header of a state, before the instance. The motor data are not part of a state, because they contain addresses; only
 * the flag whether the monitors of the machine are enabled is. */
typedef struct {
    char mark[16];
    uint32_t library; /* checksum of what a state depends on */
    uint32_t checksum;
    uint32_t machine_monitors;
    uint32_t reserved;
} header_t;

typedef struct {
    header_t header;
    fluxtrue_t instance;
} state_t;

/* Checksum of version, motor and layout, not of the code: two builds whose parts have the same sizes count as equal. */
static uint32_t library_checksum(void)
{
    const uint32_t sizes[] = {
        (uint32_t)sizeof(fluxtrue_t),   (uint32_t)sizeof(drive_t),   (uint32_t)sizeof(task_state_t),
        (uint32_t)sizeof(fast_state_t), (uint32_t)sizeof(request_t), (uint32_t)sizeof(identify_state_t),
        (uint32_t)sizeof(host_board_t), (uint32_t)sizeof(memory_t),  (uint32_t)offsetof(drive_t, task)};
    const uint32_t layout = memory_layout(&motor);
    uint32_t crc = crc32_update(CRC32_START, sizes, sizeof sizes);
    crc = crc32_update(crc, firmware_version.text, (uint32_t)strlen(firmware_version.text));
    crc = crc32_update(crc, &layout, sizeof layout);
    return ~crc32_update(crc, &motor.parameters, sizeof motor.parameters);
}

/* The only members of an instance that hold addresses, except those of a bus. */
static void remove_addresses(unsigned char *instance)
{
    memset(instance + offsetof(fluxtrue_t, data), 0, sizeof(const motor_t *));
    memset(instance + offsetof(fluxtrue_t, motor), 0, sizeof(motor_t));
    memset(instance + offsetof(fluxtrue_t, drive.period.flux_table), 0, sizeof(flux_table_config_t));
    memset(instance + offsetof(fluxtrue_t, drive.motor), 0, sizeof(const motor_t *));
    memset(instance + offsetof(fluxtrue_t, drive.data_check.motor), 0, sizeof(const motor_t *));
    memset(instance + offsetof(fluxtrue_t, drive.data_check.motor_complement), 0, sizeof(uintptr_t));
    memset(instance + offsetof(fluxtrue_t, drive.data_check.period), 0, sizeof(uint32_t[DATA_CHECK_PERIOD_WORDS]));
}

static void add_addresses(fluxtrue_t *instance, bool machine_monitors)
{
    instance->data = &motor;
    limits_set_machine_monitors(instance, machine_monitors ? 1.0 : 0.0);
    instance->drive.period.flux_table = motor.flux_table;
    instance->drive.motor = &instance->motor;
    data_check_start(&instance->drive);
}

static uint32_t state_checksum(const header_t *header, const unsigned char *instance)
{
    const uint32_t crc = crc32_update(CRC32_START, &header->machine_monitors, sizeof header->machine_monitors);
    return ~crc32_update(crc, instance, sizeof(fluxtrue_t));
}

int fluxtrue_state_size(void)
{
    return (int)sizeof(state_t);
}

int fluxtrue_state_save(const fluxtrue_t *drive, void *state, int size)
{
    unsigned char *instance = (unsigned char *)state + offsetof(state_t, instance);
    if (size != fluxtrue_state_size()) {
        return FLUXTRUE_OUT_OF_RANGE;
    }
    if (drive->on_bus || drive->data != &motor) {
        return FLUXTRUE_NO_STATE;
    }
    header_t header = {.mark = MARK,
                       .library = library_checksum(),
                       .machine_monitors = (limits_get_machine_monitors(drive) != 0.0) ? 1U : 0U};
    memcpy(instance, drive, sizeof *drive);
    remove_addresses(instance);
    header.checksum = state_checksum(&header, instance);
    memcpy(state, &header, sizeof header);
    return FLUXTRUE_OK;
}

int fluxtrue_state_restore(fluxtrue_t *drive, const void *state, int size)
{
    const unsigned char *instance = (const unsigned char *)state + offsetof(state_t, instance);
    header_t header;
    if (size != fluxtrue_state_size()) {
        return FLUXTRUE_OUT_OF_RANGE;
    }
    memcpy(&header, state, sizeof header);
    if (drive->on_bus || memcmp(header.mark, MARK, sizeof MARK) != 0 || header.library != library_checksum() ||
        header.checksum != state_checksum(&header, instance)) {
        return FLUXTRUE_NO_STATE;
    }
    memcpy(drive, instance, sizeof *drive);
    add_addresses(drive, header.machine_monitors != 0U);
    return FLUXTRUE_OK;
}
