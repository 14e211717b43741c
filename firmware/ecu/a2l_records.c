/* SPDX-License-Identifier: Apache-2.0 */
/* Description of calibration and measurement values for tools, generated from their declarations. It takes no memory in
 * the image: the linker script places the section outside of memory, and tools read it from the ELF file. */
#include <stddef.h>

#include "ecu/ecu.h"

typedef struct {
    char kind[8]; /* value, measure, frozen, scope, signal, base, step, word or bit */
    char name[40];
    char text[112];
    char unit[12];
    char type[8];
    char base[12]; /* of a measurement also the list that its words or bits are from */
    float lo, hi;
    uint32_t count;  /* of an array, else 0 */
    uint32_t offset; /* from the symbol ecu; of a base and the step: from the symbol motor; of a word: its value */
} a2l_record_t;

/* NOLINTBEGIN(bugprone-macro-parentheses): the name of a member cannot stand in parentheses. */
#define VALUE(id, low, high, si, comment) \
    {.kind = "value", .name = #id, .text = comment, .unit = si, .type = "F32", .base = "NONE", .lo = (low), \
     .hi = (high), .offset = offsetof(ecu_t, xcp.working) + sizeof(float) * CALIBRATION_##id},
#define MEASURE(id, kind_of, base_of, expression, comment) \
    {.kind = "measure", .name = #id, .text = comment, .type = #kind_of, .base = #base_of, \
     .offset = offsetof(ecu_t, xcp.measurements.id)},
#define FROZEN(id, kind_of, si, base_of, comment) \
    {.kind = "frozen", .name = "freeze_" #id, .text = comment, .unit = si, .type = #kind_of, .base = #base_of, \
     .offset = offsetof(ecu_t, freeze.id)},
#define SAMPLES(id, base_of, comment) \
    {.kind = "frozen", .name = "freeze_" #id, .text = comment, .type = "S16", .base = #base_of, \
     .count = FREEZE_FRAME_SAMPLES, .offset = offsetof(ecu_t, freeze.id)},
#define SCOPE(id, kind_of, field, comment) \
    {.kind = "scope", .name = "scope_" #id, .text = comment, .type = #kind_of, .base = "NONE", \
     .offset = offsetof(ecu_t, scope.capture.field)},
#define SIGNAL(id, base_of, place, comment) \
    {.kind = "signal", .name = #id, .text = comment, .type = "S16", .base = #base_of, .offset = CAPTURE_##id},
#define BASE(id, field, si) {.kind = "base", .name = #id, .unit = si, .offset = offsetof(motor_t, bases.field)},
#define FAULT_WORD(id, number, comment) \
    {.kind = "bit", .name = #id, .text = comment, .base = "FAULT", .offset = (number)},
#define ECU_FAULT_WORD(id, number, comment) \
    {.kind = "bit", .name = "ECU_" #id, .text = comment, .base = "ECU_FAULT", .offset = (number)},
#define MOTOR_CHECK_WORD(id, number, comment) \
    {.kind = "word", .name = #id, .text = comment, .base = "MOTOR_CHECK", .offset = (number)},
#define STATE_WORD(id, number, comment) \
    {.kind = "word", .name = #id, .text = comment, .base = "ECU_STATE", .offset = (number)},
/* NOLINTEND(bugprone-macro-parentheses) */

/* Not static: no code refers to it, so the linker keeps it by its name. */
extern const a2l_record_t a2l_records[];
/* clang-format off */
__attribute__((section(".a2l"), used)) const a2l_record_t a2l_records[] = {
    CALIBRATION_LIST(VALUE)
    MEASUREMENT_LIST(MEASURE)
    FROZEN(frozen, U8, "", NONE, "1: a fault has frozen the frame")
    FROZEN(time_ms, U32, "ms", NONE, "Time of the fault since the start")
    FROZEN(fault_word, U32, "", FAULT, "Faults of the drive, one bit each")
    FROZEN(motor_check, U8, "", MOTOR_CHECK, "What the fault config stands for")
    FROZEN(ecu_faults, U16, "", ECU_FAULT, "Faults of the supervisor, one bit each")
    FROZEN(state, U8, "", ECU_STATE, "State before the fault")
    FROZEN(psi_f_Vs, F32, "Vs", NONE, "Identified magnet flux")
    FROZEN(r_ohm, F32, "ohm", NONE, "Identified resistance")
    FROZEN(oldest, U8, "", NONE, "Index of the oldest of 32 samples, a step apart")
    FREEZE_FRAME_LIST(SAMPLES)
    SCOPE(signals, U8, config.signals, "Number of signals")
    SCOPE(signal, U8, config.signal, "The first of them, by its number in the list")
    SCOPE(trigger, U8, config.trigger, "What triggers")
    SCOPE(trigger_signal, U8, config.trigger_signal, "Whose level triggers")
    SCOPE(divisor, U16, config.divisor, "PWM periods from one sample to the next")
    SCOPE(samples, U16, config.samples, "Samples of each signal")
    SCOPE(wanted, U16, config.before, "How many of them were wanted before the trigger")
    SCOPE(level, S16, config.level, "Raw level of the trigger")
    SCOPE(state, U8, state, "0 idle, 1 armed, 2 triggered, 3 done")
    SCOPE(frozen, U8, frozen, "1: a freeze frame around a fault")
    SCOPE(number, U16, number, "Counts the captures")
    SCOPE(first, U16, first, "Row of the oldest sample")
    SCOPE(before, U16, before, "Samples before the trigger")
    SCOPE(taken, U16, taken, "Valid samples when done")
    SCOPE(lost, U16, lost, "Times that the ring had lost periods")
    SCOPE(trigger_period, U32, trigger_period, "Number of the PWM period of the trigger")
    {.kind = "scope", .name = "scope_memory", .text = "The samples: rows of all signals", .type = "S16", .base = "NONE",
     .count = CAPTURE_MEMORY, .offset = offsetof(ecu_t, scope.memory)},
    SCOPE_SIGNAL_LIST(SIGNAL)
    BASE(CURRENT, current_A, "A")
    BASE(VOLTAGE, voltage_V, "V")
    BASE(TORQUE, torque_Nm, "Nm")
    BASE(OMEGA, omega_rad_s, "rad/s")
    BASE(FLUX, flux_Vs, "Vs")
    {.kind = "step", .name = "step_s", .unit = "s", .offset = offsetof(motor_t, bases.step_s)},
    {.kind = "step", .name = "period_s", .unit = "s", .offset = offsetof(motor_t, bases.period_s)},
    FAULT_LIST(FAULT_WORD)
    ECU_FAULT_LIST(ECU_FAULT_WORD)
    ECU_STATE_LIST(STATE_WORD)
    MOTOR_CHECK_LIST(MOTOR_CHECK_WORD)
};
/* clang-format on */
