/* SPDX-License-Identifier: Apache-2.0 */
/* The encoding of every transmitted value, against the places and factors of firmware/comm/fluxtrue.dbc. */
#include "comm/messages.h"

#include <string.h>

#include "types/version.h"
#include "unity.h"

static const bus_scales_t scales = {.torque_Nm = 0.1F,
                                    .speed_rpm = 1.0F,
                                    .resistance_mohm = 0.001F,
                                    .flux_mVs = 0.01F,
                                    .voltage_V = 0.1F,
                                    .current_A = 0.1F,
                                    .power_kW = 0.01F};
static telemetry_t t;
static uint8_t data[MESSAGE_LENGTH];

void setUp(void)
{
    t = (telemetry_t){.scales = &scales};
}

void tearDown(void)
{
}

/* The frame as one number: the DBC counts bits from the lowest of byte 0. */
static uint64_t encoded(message_encoder_t encode)
{
    memset(data, 0xA5, sizeof data);
    TEST_ASSERT_TRUE(encode(&t, data));
    uint64_t bits = 0;
    for (int n = (int)MESSAGE_LENGTH - 1; n >= 0; n--) {
        bits = bits << 8 | data[n];
    }
    return bits;
}

static uint64_t at_place(int64_t raw, int start, int length)
{
    const uint64_t mask = (length == 64) ? UINT64_MAX : (UINT64_C(1) << length) - 1U;
    return ((uint64_t)raw & mask) << start;
}

/* Copied by hand from the DBC: start bit and length; the raw value follows from the factor. */
typedef struct {
    message_encoder_t encode;
    float *value;
    float physical;
    int64_t raw;
    int start, length;
} decimal_t;

static const decimal_t decimals[] = {
    {message_inv_status, &t.torque_estimated_Nm, -12.34F, -123, 16, 16},
    {message_inv_status, &t.torque_commanded_Nm, 45.67F, 457, 32, 16},
    {message_inv_status, &t.speed_rpm, -1234.4F, -1234, 48, 16},
    {message_inv_dc_link, &t.v_dc_V, 351.27F, 3513, 0, 16},
    {message_inv_dc_link, &t.i_dc_A, -77.7F, -777, 16, 16},
    {message_inv_currents, &t.id_A, -101.1F, -1011, 0, 16},
    {message_inv_currents, &t.iq_A, 202.2F, 2022, 16, 16},
    {message_inv_currents, &t.id_ref_A, -303.3F, -3033, 32, 16},
    {message_inv_currents, &t.iq_ref_A, 404.4F, 4044, 48, 16},
    {message_inv_identification, &t.psi_f_mVs, 71.66F, 7166, 0, 16},
    {message_inv_identification, &t.r_mohm, 18.123F, 18123, 16, 20},
    {message_inv_identification, &t.psi_quality_percent, 55.0F, 55, 36, 7},
    {message_inv_identification, &t.r_quality_percent, 66.0F, 66, 43, 7},
    {message_inv_identification, &t.table_scale_percent, 103.05F, 2061, 50, 12},
    {message_inv_temperatures, &t.winding_C, 95.5F, 955, 0, 16},
    {message_inv_temperatures, &t.inverter_C, -1.2F, -12, 16, 16},
    {message_inv_limits, &t.torque_max_Nm, 132.0F, 1320, 16, 16},
};

void test_every_physical_value_is_encoded_in_its_place_with_its_factor_and_changes_no_other(void)
{
    for (unsigned n = 0; n < sizeof decimals / sizeof decimals[0]; n++) {
        const decimal_t *one = &decimals[n];
        setUp();
        *one->value = one->physical;
        TEST_ASSERT_EQUAL_HEX64(at_place(one->raw, one->start, one->length), encoded(one->encode));
    }
}

typedef struct {
    message_encoder_t encode;
    uint32_t *value;
    uint32_t raw;
    int start, length;
} number_t;

static const number_t numbers[] = {
    {message_inv_status, &t.state, 7, 12, 4},
    {message_inv_dc_link, &t.derating_reason, 5, 48, 4},
    {message_inv_dc_link, &t.refused_reason, 9, 52, 4},
    {message_inv_dc_link, &t.refused_count, 0xC3, 56, 8},
    {message_inv_limits, &t.request_limit, 3, 12, 4},
    {message_inv_faults, &t.drive_faults, 0x87654321U, 0, 32},
    {message_inv_faults, &t.ecu_faults, 0x8421, 32, 16},
    {message_inv_faults, &t.first_fault, 42, 48, 8},
    {message_inv_faults, &t.fault_count, 0x81, 56, 8},
    {message_inv_configuration, &t.motor_check, 43, 0, 8},
    {message_inv_configuration, &t.interface_hash, 0xCAFE1234U, 32, 32},
    {message_inv_diag_protection, &t.diagnostics.crc_errors, 0x8001, 0, 16},
    {message_inv_diag_protection, &t.diagnostics.repeated, 0x8002, 16, 16},
    {message_inv_diag_protection, &t.diagnostics.jumps, 0x8003, 32, 16},
    {message_inv_diag_protection, &t.diagnostics.length_errors, 0x8004, 48, 16},
    {message_inv_diag_receive, &t.diagnostics.range_errors, 0x8005, 0, 16},
    {message_inv_diag_receive, &t.diagnostics.id_errors, 0x8006, 16, 16},
    {message_inv_diag_receive, &t.diagnostics.time_outs, 0x8007, 32, 16},
    {message_inv_diag_receive, &t.diagnostics.accepted, 0x8008, 48, 16},
    {message_inv_diag_bus, &t.diagnostics.lost_frames, 0x8009, 0, 16},
    {message_inv_diag_bus, &t.diagnostics.not_sent, 0x800A, 16, 16},
    {message_inv_diag_bus, &t.diagnostics.ignored, 0x800B, 32, 16},
    {message_inv_diag_bus, &t.diagnostics.bus_off, 0x8C, 48, 8},
    {message_inv_diag_bus, &t.diagnostics.skipped, 0x8D, 56, 8},
    {message_inv_diag_task, &t.diagnostics.isr_overruns, 0x800E, 0, 16},
    {message_inv_diag_task, &t.diagnostics.task_overruns, 0x800F, 16, 16},
    {message_inv_diag_task, &t.diagnostics.stack_unused_bytes, 0x8010, 32, 16},
    {message_inv_diag_task, &t.diagnostics.reset_cause, 7, 48, 4},
    {message_inv_diag_task, &t.diagnostics.watchdog_held, 0x812, 52, 12},
};

void test_every_number_is_encoded_in_its_place_and_changes_no_other(void)
{
    for (unsigned n = 0; n < sizeof numbers / sizeof numbers[0]; n++) {
        const number_t *one = &numbers[n];
        setUp();
        *one->value = one->raw;
        TEST_ASSERT_EQUAL_HEX64(at_place(one->raw, one->start, one->length), encoded(one->encode));
    }
}

void test_every_flag_is_encoded_in_its_bit_and_changes_no_other(void)
{
    static const struct {
        message_encoder_t encode;
        bool *value;
        int start;
    } flags[] = {
        {message_inv_identification, &t.psi_clamped, 62},
        {message_inv_identification, &t.r_clamped, 63},
        {message_inv_temperatures, &t.winding_valid, 32},
        {message_inv_temperatures, &t.inverter_valid, 33},
    };
    for (unsigned n = 0; n < sizeof flags / sizeof flags[0]; n++) {
        setUp();
        *flags[n].value = true;
        TEST_ASSERT_EQUAL_HEX64(at_place(1, flags[n].start, 1), encoded(flags[n].encode));
    }
}

/* Other counters saturate; that of the accepted commands shows that they continue to arrive. */
void test_the_count_of_accepted_commands_wraps(void)
{
    t.diagnostics.accepted = 0x12345;
    TEST_ASSERT_EQUAL_HEX64(at_place(0x2345, 48, 16), encoded(message_inv_diag_receive));
}

void test_the_version_frame_identifies_firmware_interface_and_motor(void)
{
    t.motor_name = "hsm1"; /* FNV-1a with 32 bits, computed outside this project */
    const uint64_t version = at_place(FLUXTRUE_VERSION_MAJOR, 0, 8) | at_place(FLUXTRUE_VERSION_MINOR, 8, 8) |
                             at_place(FLUXTRUE_VERSION_PATCH, 16, 8) | at_place(INTERFACE_VERSION, 24, 8);
    TEST_ASSERT_EQUAL_HEX64(version | at_place(0x6CAE75C6, 32, 32), encoded(message_inv_version));
}
