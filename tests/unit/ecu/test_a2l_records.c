/* SPDX-License-Identifier: Apache-2.0 */
/* The description of values for tools, as tools/fluxtrue_tools/a2l reads it from the ELF file. */
#include <stddef.h>
#include <string.h>

#include "ecu/ecu.h"
#include "unity.h"

/* The layout that the tools know. */
typedef struct {
    char kind[8], name[40], text[112], unit[12], type[8], base[12];
    float lo, hi;
    uint32_t count, offset;
} record_t;

extern const record_t a2l_records[];

void setUp(void)
{
}

void tearDown(void)
{
}

#define LISTED 1000
#define NAME_OF(id, ...) #id,
#define FREEZE_NAME(id, ...) "freeze_" #id,
#define ECU_NAME(id, ...) "ECU_" #id,

static const record_t *find(const char *kind, const char *name)
{
    for (int n = 0; n < LISTED && a2l_records[n].kind[0] != '\0'; n++) {
        if (strcmp(a2l_records[n].kind, kind) == 0 && strcmp(a2l_records[n].name, name) == 0) {
            return &a2l_records[n];
        }
    }
    TEST_FAIL_MESSAGE(name);
    return NULL;
}

static void all(const char *kind, const char *const *names, size_t count)
{
    for (size_t n = 0; n < count; n++) {
        TEST_ASSERT_NOT_NULL(find(kind, names[n]));
    }
}

void test_every_value_signal_and_word_of_the_firmwares_lists_is_described(void)
{
    static const char *const values[] = {CALIBRATION_LIST(NAME_OF)}, *const measures[] = {MEASUREMENT_LIST(NAME_OF)},
                             *const frozen[] = {FREEZE_FRAME_LIST(FREEZE_NAME)},
                             *const signals[] = {SCOPE_SIGNAL_LIST(NAME_OF)}, *const faults[] = {FAULT_LIST(NAME_OF)},
                             *const ecu_faults[] = {ECU_FAULT_LIST(ECU_NAME)},
                             *const states[] = {ECU_STATE_LIST(NAME_OF)}, *const checks[] = {MOTOR_CHECK_LIST(NAME_OF)};
    all("value", values, sizeof values / sizeof values[0]);
    all("measure", measures, sizeof measures / sizeof measures[0]);
    all("frozen", frozen, sizeof frozen / sizeof frozen[0]);
    all("signal", signals, sizeof signals / sizeof signals[0]);
    all("bit", faults, sizeof faults / sizeof faults[0]);
    all("bit", ecu_faults, sizeof ecu_faults / sizeof ecu_faults[0]);
    all("word", states, sizeof states / sizeof states[0]);
    all("word", checks, sizeof checks / sizeof checks[0]);
}

void test_the_memory_of_the_scope_is_an_array_of_16_bits_at_its_place(void)
{
    const record_t *memory = find("scope", "scope_memory");
    TEST_ASSERT_EQUAL_STRING("S16", memory->type);
    TEST_ASSERT_EQUAL_STRING("NONE", memory->base);
    TEST_ASSERT_EQUAL_UINT32(CAPTURE_MEMORY, memory->count);
    TEST_ASSERT_EQUAL_UINT32(offsetof(ecu_t, scope.memory), memory->offset);
    TEST_ASSERT_TRUE(memory->text[0] != '\0');
}

void test_the_lengths_of_step_and_period_are_described_in_seconds(void)
{
    TEST_ASSERT_EQUAL_UINT32(offsetof(motor_t, bases.step_s), find("step", "step_s")->offset);
    TEST_ASSERT_EQUAL_UINT32(offsetof(motor_t, bases.period_s), find("step", "period_s")->offset);
    TEST_ASSERT_EQUAL_STRING("s", find("step", "step_s")->unit);
    TEST_ASSERT_EQUAL_STRING("s", find("step", "period_s")->unit);
}
