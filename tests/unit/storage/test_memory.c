/* SPDX-License-Identifier: Apache-2.0 */
#include <string.h>

#include "hal/mock_nvm.h"
#include "signal/crc32.h"
#include "storage/memory.h"
#include "unity.h"

/* The layer above the store: what is recalled at the start, and when it is saved. */

static uint8_t flash[HAL_NVM_SLOTS][HAL_NVM_SLOT_SIZE];
static int erases;
static bool broken, unwritable;
static int open; /* begin() without end() */
static drive_t drive;
static memory_t memory;

static bool nvm_read(uint32_t slot, uint32_t offset, void *data, uint32_t size, int calls)
{
    (void)calls;
    memcpy(data, &flash[slot][offset], size);
    return true;
}

static bool nvm_begin(int calls)
{
    (void)calls;
    TEST_ASSERT_TRUE(drive.held);
    open += unwritable ? 0 : 1;
    return !unwritable;
}

static void nvm_end(int calls)
{
    (void)calls;
    TEST_ASSERT_TRUE(drive.held);
    open--;
}

static bool nvm_erase(uint32_t slot, int calls)
{
    (void)calls;
    TEST_ASSERT_EQUAL_INT(1, open);
    erases++;
    memset(flash[slot], 0xFF, sizeof flash[slot]);
    return !broken;
}

static bool nvm_program(uint32_t slot, uint32_t offset, const void *data, uint32_t size, int calls)
{
    (void)calls;
    TEST_ASSERT_EQUAL_INT(1, open);
    memcpy(&flash[slot][offset], data, size);
    return true;
}

static void power_on(const motor_t *source)
{
    drive_init(&drive, source);
    memory_recall(&memory, &drive);
}

/* In q15. */
static int32_t dead_time(const motor_parameters_t *p)
{
    return p->modulate.dead_time_q16 / 2;
}

void setUp(void)
{
    hal_nvm_begin_Stub(nvm_begin);
    hal_nvm_end_Stub(nvm_end);
    hal_nvm_read_Stub(nvm_read);
    hal_nvm_erase_Stub(nvm_erase);
    hal_nvm_program_Stub(nvm_program);
    memset(flash, 0xFF, sizeof flash);
    erases = open = 0;
    broken = unwritable = false;
    power_on(&motor);
}

void tearDown(void)
{
}

/* Runs the background once per millisecond; returns the number of saves. */
static uint32_t milliseconds(uint32_t n)
{
    const uint32_t before = memory.saves;
    uint32_t returned = 0;
    for (uint32_t k = 0; k < n; k++) {
        drive.task.identifications = drive.task.identifications + 1U;
        returned += memory_background(&memory, &drive) ? 1U : 0U;
    }
    TEST_ASSERT_EQUAL_UINT32(memory.saves - before, returned);
    return returned;
}

static void run(uint32_t ms)
{
    drive.task.run_state = RUN_STATE_RUN;
    TEST_ASSERT_EQUAL_UINT32(0, milliseconds(ms));
    drive.task.run_state = RUN_STATE_OFF;
}

/* A magnet that is weak by half a standard deviation, with a small uncertainty. */
static void identify(void)
{
    drive.task.identify.kalman.x_q27[IDENTIFY_FLUX] = -IDENTIFY_ONE_Q27 / 2;
    drive.task.identify.kalman.p_q30[kalman_p_index(IDENTIFY_FLUX, IDENTIFY_FLUX)] = IDENTIFY_ONE_Q30 / 64;
    run(1000);
}

static void identify_and_save(void)
{
    identify();
    TEST_ASSERT_EQUAL_UINT32(1, milliseconds(MEMORY_REST_MS));
}

void test_identified_values_are_recalled_at_power_on_with_a_larger_uncertainty(void)
{
    identify_and_save();
    power_on(&motor);
    TEST_ASSERT_TRUE(memory.recalled);
    TEST_ASSERT_EQUAL_INT32(-IDENTIFY_ONE_Q27 / 2, drive.task.identify.kalman.x_q27[IDENTIFY_FLUX]);
    /* (ID-19): the variance grows by a quarter of that of the prior. */
    TEST_ASSERT_EQUAL_INT32(IDENTIFY_ONE_Q30 / 64 + IDENTIFY_ONE_Q30 / 4,
                            drive.task.identify.kalman.p_q30[kalman_p_index(IDENTIFY_FLUX, IDENTIFY_FLUX)]);
}

void test_an_empty_memory_leaves_the_priors(void)
{
    TEST_ASSERT_FALSE(memory.recalled);
    TEST_ASSERT_EQUAL_UINT32(0, memory.saves);
    TEST_ASSERT_EQUAL_INT32(0, drive.task.identify.kalman.x_q27[IDENTIFY_FLUX]);
    TEST_ASSERT_EQUAL_INT32(IDENTIFY_ONE_Q30,
                            drive.task.identify.kalman.p_q30[kalman_p_index(IDENTIFY_FLUX, IDENTIFY_FLUX)]);
}

void test_a_damaged_memory_leaves_the_priors(void)
{
    identify_and_save();
    for (uint32_t byte = 0; byte < 32U; byte++) {
        flash[0][byte] ^= 0x10;
        power_on(&motor);
        TEST_ASSERT_FALSE(memory.recalled);
        TEST_ASSERT_EQUAL_INT32(0, drive.task.identify.kalman.x_q27[IDENTIFY_FLUX]);
        flash[0][byte] ^= 0x10;
    }
}

/* A motor that differs by one statement does not use the record. */
#define FOREIGN(statement) \
    do { \
        static motor_t m; \
        m = motor; \
        statement; \
        power_on(&m); \
        TEST_ASSERT_FALSE_MESSAGE(memory.recalled, #statement); \
        TEST_ASSERT_EQUAL_INT32(0, drive.task.identify.kalman.x_q27[IDENTIFY_FLUX]); \
    } while (0)

void test_a_record_of_another_motor_or_of_other_priors_is_not_used(void)
{
    identify_and_save();
    FOREIGN(m.name = "another");
    FOREIGN(m.bases.flux_Vs = m.bases.flux_Vs * 1.01F);
    FOREIGN(m.identify.sigma[IDENTIFY_LQ]++);
    power_on(&motor);
    TEST_ASSERT_TRUE(memory.recalled);
}

/* Version 3 of the record. A layout that changes by itself would lose the values of every machine in the field. */
void test_the_layout_is_the_checksum_of_version_size_name_bases_and_priors(void)
{
    const uint32_t version[2] = {3, (uint32_t)(sizeof(identify_record_t) + sizeof(compensation_t) + sizeof(int32_t))};
    uint8_t all[256];
    size_t size = 0;
    TEST_ASSERT_TRUE(sizeof version + strlen(motor.name) + sizeof motor.bases + sizeof motor.identify.sigma <
                     sizeof all);
    memcpy(all, version, sizeof version);
    size += sizeof version;
    memcpy(&all[size], motor.name, strlen(motor.name));
    size += strlen(motor.name);
    memcpy(&all[size], &motor.bases, sizeof motor.bases);
    size += sizeof motor.bases;
    memcpy(&all[size], motor.identify.sigma, sizeof motor.identify.sigma);
    size += sizeof motor.identify.sigma;
    TEST_ASSERT_EQUAL_HEX32(crc32(all, (uint32_t)size), memory_layout(&motor));
}

void test_nothing_is_written_without_a_run(void)
{
    TEST_ASSERT_EQUAL_UINT32(0, milliseconds(10000));
    TEST_ASSERT_EQUAL_INT(0, erases);
}

void test_nothing_is_written_until_the_drive_has_rested(void)
{
    identify();
    TEST_ASSERT_EQUAL_UINT32(0, milliseconds(MEMORY_REST_MS - 1U));
    run(1);
    TEST_ASSERT_EQUAL_UINT32(0, milliseconds(MEMORY_REST_MS - 1U));
    TEST_ASSERT_EQUAL_UINT32(1, milliseconds(1));
    TEST_ASSERT_EQUAL_UINT32(0, milliseconds(2U * MEMORY_INTERVAL_MS)); /* the drive has not run since */
}

void test_the_second_save_waits_for_the_interval(void)
{
    identify_and_save();
    run(1000);
    TEST_ASSERT_EQUAL_UINT32(0, milliseconds(MEMORY_INTERVAL_MS - 1001U));
    TEST_ASSERT_EQUAL_UINT32(1, milliseconds(1));
    TEST_ASSERT_EQUAL_INT(2, erases);
}

void test_a_drive_with_a_fault_or_a_short_circuit_is_not_at_rest(void)
{
    identify();
    drive_raise_fault(&drive, FAULT_ANGLE_OFFSET);
    TEST_ASSERT_EQUAL_UINT32(0, milliseconds(1000));
    drive.fast.faults = 0;
    command_box_write(&drive.commands, (command_t){.safe = SAFE_SHORT_CIRCUIT});
    TEST_ASSERT_EQUAL_UINT32(0, milliseconds(1000));
    command_box_write(&drive.commands, (command_t){.safe = SAFE_FREEWHEEL});
    TEST_ASSERT_EQUAL_UINT32(1, milliseconds(1000));
}

void test_a_turning_rotor_is_not_at_rest(void)
{
    identify();
    for (int k = 0; k < 2; k++) {
        drive.samples.slot[0].point.omega = Q31(k == 0 ? 0.003 : -0.003);
        drive.samples.slot[1] = drive.samples.slot[0];
        TEST_ASSERT_EQUAL_UINT32(0, milliseconds(1000));
    }
    drive.samples.slot[0].point.omega = drive.samples.slot[1].point.omega = Q31(0.001);
    TEST_ASSERT_EQUAL_UINT32(1, milliseconds(1000));
}

void test_a_request_to_enable_switching_waits_only_while_the_record_is_written(void)
{
    identify();
    TEST_ASSERT_EQUAL_UINT32(0, milliseconds(MEMORY_REST_MS - MEMORY_HOLD_STEPS - 1U));
    TEST_ASSERT_FALSE(drive.held);
    TEST_ASSERT_EQUAL_UINT32(0, milliseconds(1));
    TEST_ASSERT_TRUE(drive.held);
    TEST_ASSERT_EQUAL_UINT32(1, milliseconds(MEMORY_HOLD_STEPS));
    TEST_ASSERT_FALSE(drive.held);
    TEST_ASSERT_EQUAL_INT(0, open);
    TEST_ASSERT_EQUAL_UINT32(0, memory.failures);
}

void test_a_drive_is_not_held_for_a_save_that_is_not_wanted_any_more(void)
{
    identify();
    TEST_ASSERT_EQUAL_UINT32(0, milliseconds(MEMORY_REST_MS - 1U));
    TEST_ASSERT_TRUE(drive.held);
    drive.task.identify.kept.mismatch_share = Q15(0.3);
    TEST_ASSERT_EQUAL_UINT32(0, milliseconds(1));
    TEST_ASSERT_FALSE(drive.held);
}

/* 0.1 s are 112.52 steps of 888.73 us. */
void test_the_time_at_rest_is_rounded_to_whole_steps(void)
{
    static motor_t m;
    m = motor;
    m.bases.step_s = 0.1F / 112.52F;
    power_on(&m);
    identify();
    TEST_ASSERT_EQUAL_UINT32(0, milliseconds(112));
    TEST_ASSERT_EQUAL_UINT32(1, milliseconds(1));
}

/* The drive was enabled by a step that began before it was held. */
void test_a_drive_that_runs_is_not_held(void)
{
    identify();
    TEST_ASSERT_EQUAL_UINT32(0, milliseconds(MEMORY_REST_MS - 1U));
    TEST_ASSERT_TRUE(drive.held);
    run(1);
    TEST_ASSERT_FALSE(drive.held);
    TEST_ASSERT_EQUAL_INT(0, erases);
}

void test_a_memory_that_cannot_be_written_now_is_tried_again(void)
{
    unwritable = true;
    identify();
    TEST_ASSERT_EQUAL_UINT32(0, milliseconds(1000));
    TEST_ASSERT_EQUAL_UINT32(1, memory.failures);
    TEST_ASSERT_FALSE(drive.held);
    unwritable = false;
    TEST_ASSERT_EQUAL_UINT32(1, milliseconds(MEMORY_INTERVAL_MS));
    TEST_ASSERT_EQUAL_UINT32(1, memory.erase_cycles);
}

void test_parameters_with_a_large_mismatch_are_not_kept(void)
{
    identify();
    drive.task.identify.kept.mismatch_share = Q15(0.25) + 1;
    TEST_ASSERT_EQUAL_UINT32(0, milliseconds(1000));
    TEST_ASSERT_EQUAL_INT(0, erases);
    drive.task.identify.kept.mismatch_share = Q15(0.25);
    TEST_ASSERT_EQUAL_UINT32(1, milliseconds(1U + MEMORY_HOLD_STEPS));
}

void test_a_failed_write_is_counted_and_tried_again_after_the_interval(void)
{
    broken = true;
    identify();
    TEST_ASSERT_EQUAL_UINT32(0, milliseconds(1000));
    TEST_ASSERT_EQUAL_UINT32(1, memory.failures);
    TEST_ASSERT_EQUAL_INT(1, erases);
    broken = false;
    TEST_ASSERT_EQUAL_UINT32(1, milliseconds(MEMORY_INTERVAL_MS));
}

void test_a_measured_compensation_is_kept_with_its_voltage_margin(void)
{
    const compensation_t measured = {dead_time(&drive.parameters) + 300, drive.parameters.modulate.knee_q17 / 2, 1};
    TEST_ASSERT_TRUE(drive_compensate(&drive, &measured));
    identify_and_save();
    power_on(&motor);
    TEST_ASSERT_TRUE(memory.recalled);
    TEST_ASSERT_EQUAL_INT(dead_time(&motor.parameters) + 300, dead_time(&drive.parameters));
    TEST_ASSERT_EQUAL_INT32(motor.parameters.modulate.knee_q17 / 2, drive.parameters.modulate.knee_q17);
    TEST_ASSERT_INT32_WITHIN(1, motor.parameters.modulate.knee_side_q17 / 2, drive.parameters.modulate.knee_side_q17);
    TEST_ASSERT_LESS_THAN_UINT32(motor.parameters.current_control.clear_q30,
                                 drive.parameters.current_control.clear_q30);
    motor_t with_them = motor;
    with_them.parameters = drive.parameters;
    TEST_ASSERT_EQUAL_INT(MOTOR_CHECK_OK, motor_check(&with_them)); /* this includes (MO-11) */
}

/* A record is taken whole or not at all. */
void test_a_record_whose_values_are_refused_leaves_the_compensation(void)
{
    const compensation_t measured = {dead_time(&drive.parameters) + 40, drive.parameters.modulate.knee_q17 / 2, 1};
    TEST_ASSERT_TRUE(drive_compensate(&drive, &measured));
    drive.task.identify.kalman.p_q30[kalman_p_index(IDENTIFY_R, IDENTIFY_R)] = 0;
    identify_and_save();
    power_on(&motor);
    TEST_ASSERT_FALSE(memory.recalled);
    TEST_ASSERT_EQUAL_MEMORY(&motor.parameters, &drive.parameters, sizeof motor.parameters);
    TEST_ASSERT_EQUAL_INT32(0, drive.task.compensation.measured);
}

/* Seven values at 1.85 standard deviations are 23.96 away, at 1.86 they are 24.22; the bound is 24. */
void test_a_record_that_no_machine_in_a_thousand_would_have_is_not_used(void)
{
    for (int far = 0; far < 2; far++) {
        setUp();
        identify();
        for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
            drive.task.identify.kalman.x_q27[j] = IDENTIFY_ONE_Q27 / 100 * ((j % 2U == 0U) ? 185 + far : -185 - far);
        }
        TEST_ASSERT_EQUAL_UINT32(1, milliseconds(MEMORY_REST_MS));
        power_on(&motor);
        TEST_ASSERT_EQUAL_INT(far == 0, memory.recalled);
    }
}

/* Four, two and two standard deviations are 24 exactly, and one count of the format in another value is too much. */
void test_the_bound_of_the_distance_is_exact(void)
{
    for (int far = 0; far < 2; far++) {
        power_on(&motor);
        identify();
        int32_t *x = drive.task.identify.kalman.x_q27;
        memset(x, 0, IDENTIFY_STATES * sizeof *x);
        x[IDENTIFY_FLUX] = 4 * IDENTIFY_ONE_Q27;
        x[IDENTIFY_LQ] = -2 * IDENTIFY_ONE_Q27;
        x[IDENTIFY_R] = 2 * IDENTIFY_ONE_Q27;
        x[IDENTIFY_LQ + 1] = far * 16384;
        TEST_ASSERT_EQUAL_UINT32(1, milliseconds(MEMORY_REST_MS));
        power_on(&motor);
        TEST_ASSERT_EQUAL_INT(far == 0, memory.recalled);
    }
}

/* A record with this compensation on a machine whose inverter loses 2 % of the period: allowed are 1 % to 3 %,
 * which are 328 to 983 counts. */
static bool recalls_with(float bridge_duty, int32_t dead_time_q15, q31_t knee_q17, int32_t measured)
{
    static motor_t m;
    m = motor;
    m.bridge_duty = bridge_duty;
    setUp();
    drive.task.compensation = (compensation_t){dead_time_q15, knee_q17, measured};
    identify_and_save();
    power_on(&m);
    return memory.recalled;
}

static bool recalls(int32_t dead_time_q15, q31_t knee_q17, int32_t measured)
{
    return recalls_with(0.02F, dead_time_q15, knee_q17, measured);
}

/* Of 1/32 of the period: 3/2 and 1/2 of it, which are 1536 and 512 counts exactly; of 1/256: 1/128 more, 384 counts. */
void test_the_bounds_of_a_measured_compensation_belong_to_what_is_used(void)
{
    const q31_t knee = motor.parameters.modulate.knee_q17;
    TEST_ASSERT_TRUE(recalls_with(0.03125F, 1536, knee, 1));
    TEST_ASSERT_FALSE(recalls_with(0.03125F, 1537, knee, 1));
    TEST_ASSERT_TRUE(recalls_with(0.03125F, 512, knee, 1));
    TEST_ASSERT_FALSE(recalls_with(0.03125F, 511, knee, 1));
    TEST_ASSERT_TRUE(recalls_with(0.00390625F, 384, knee, 1));
    TEST_ASSERT_FALSE(recalls_with(0.00390625F, 385, knee, 1));
    TEST_ASSERT_TRUE(recalls_with(0.00390625F, 0, knee, 1));
}

void test_a_measured_compensation_far_from_the_motor_data_is_not_used(void)
{
    const q31_t knee = motor.parameters.modulate.knee_q17;
    TEST_ASSERT_TRUE(recalls(983, knee, 1));
    TEST_ASSERT_FALSE(recalls(984, knee, 1));
    TEST_ASSERT_TRUE(recalls(328, knee, 1));
    TEST_ASSERT_FALSE(recalls(327, knee, 1));
    TEST_ASSERT_FALSE(recalls(700, knee + 1, 1));
    TEST_ASSERT_TRUE(recalls(700, knee / COMPENSATION_KNEE_RANGE, 1));
    TEST_ASSERT_FALSE(recalls(700, knee / COMPENSATION_KNEE_RANGE - 1, 1));
    TEST_ASSERT_TRUE(recalls(984, knee + 1, 0)); /* not measured: the motor data remain */
    TEST_ASSERT_EQUAL_INT(dead_time(&motor.parameters), dead_time(&drive.parameters));
}

void test_a_fault_does_not_count_as_a_run_and_does_not_end_one(void)
{
    drive.task.run_state = RUN_STATE_FAULT;
    TEST_ASSERT_EQUAL_UINT32(0, milliseconds(1000));
    drive.task.run_state = RUN_STATE_OFF;
    TEST_ASSERT_EQUAL_UINT32(0, milliseconds(10000));
    identify();
    drive.task.run_state = RUN_STATE_FAULT;
    TEST_ASSERT_EQUAL_UINT32(0, milliseconds(1000));
    drive.task.run_state = RUN_STATE_OFF;
    TEST_ASSERT_EQUAL_UINT32(1, milliseconds(MEMORY_REST_MS));
}

void test_a_record_whose_compensation_is_refused_leaves_the_priors(void)
{
    static motor_t m;
    m = motor;
    m.bridge_duty = 0.11F; /* so that the dead time is near the motor data, and still more than a drive takes */
    drive.task.compensation = (compensation_t){5000, motor.parameters.modulate.knee_q17, 1};
    identify_and_save();
    power_on(&m);
    TEST_ASSERT_FALSE(memory.recalled);
    TEST_ASSERT_EQUAL_INT32(0, drive.task.identify.kalman.x_q27[IDENTIFY_FLUX]);
    TEST_ASSERT_FALSE(drive.task.recall.unconfirmed);
    TEST_ASSERT_EQUAL_INT32(dead_time(&motor.parameters), dead_time(&drive.parameters));
}

void test_the_trim_of_the_compensation_is_kept_with_the_measurement(void)
{
    const int32_t measured = dead_time(&motor.parameters) + 40;
    TEST_ASSERT_TRUE(drive_compensate(&drive, &(compensation_t){measured, motor.parameters.modulate.knee_q17, 1}));
    drive_restore_trim(&drive, -60);
    TEST_ASSERT_EQUAL_INT(measured - 60, dead_time(&drive.parameters));
    identify_and_save();
    power_on(&motor);
    TEST_ASSERT_EQUAL_INT(measured - 60, dead_time(&drive.parameters));
    TEST_ASSERT_EQUAL_INT32(-60, drive.task.trim.trim);
    /* A new measurement replaces both. */
    TEST_ASSERT_TRUE(drive_compensate(&drive, &(compensation_t){measured, motor.parameters.modulate.knee_q17, 1}));
    TEST_ASSERT_EQUAL_INT32(0, drive.task.trim.trim);
}

void test_without_a_measurement_the_trim_is_kept_on_the_motors_own_data(void)
{
    drive_restore_trim(&drive, 60);
    identify_and_save();
    power_on(&motor);
    TEST_ASSERT_EQUAL_INT(dead_time(&motor.parameters) + 60, dead_time(&drive.parameters));
}

void test_an_impossible_compensation_is_refused(void)
{
    const motor_parameters_t before = drive.parameters;
    const compensation_t wrong[] = {{-1, 1000, 1}, {4097, 1000, 1}, {300, 0, 1}, {300, 1 << 30, 1}};
    for (unsigned k = 0; k < sizeof wrong / sizeof wrong[0]; k++) {
        TEST_ASSERT_FALSE(drive_compensate(&drive, &wrong[k]));
    }
    TEST_ASSERT_EQUAL_MEMORY(&before, &drive.parameters, sizeof before);
}
