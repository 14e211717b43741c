/* SPDX-License-Identifier: Apache-2.0 */
/* What tools must know about the values they read and write, made from the declarations themselves. The image carries
 * no byte of it: the linker script keeps the section out of memory; tools read it from the ELF. */
#include <stddef.h>

#include "app/ecu.h"

typedef struct {
    char kind[8];    /* value, measure or base */
    char name[40];
    char text[80];
    char unit[12];
    char type[8];
    char base[12];
    float lo, hi;
    uint32_t offset; /* from the symbol ecu; of a base: from the symbol motor */
} a2l_record_t;

#define VALUE(id, low, high, si, comment) \
    {.kind = "value", .name = #id, .text = comment, .unit = si, .type = "F32", .base = "NONE", .lo = (low), \
     .hi = (high), .offset = offsetof(ecu_t, xcp.working) + sizeof(float) * CALIBRATION_##id},
#define MEASURE(id, kind_of, base_of, expression, comment) \
    {.kind = "measure", .name = #id, .text = comment, .type = #kind_of, .base = #base_of, \
     .offset = offsetof(ecu_t, xcp.measurements.id)},
#define BASE(id, field, si) {.kind = "base", .name = #id, .unit = si, .offset = offsetof(motor_t, bases.field)},

/* Not static: the link asks for it by name, since no code does. */
extern const a2l_record_t a2l_records[];
__attribute__((section(".a2l"), used)) const a2l_record_t a2l_records[] = {
    CALIBRATION_LIST(VALUE) MEASUREMENT_LIST(MEASURE)
    BASE(CURRENT, current_A, "A") BASE(VOLTAGE, voltage_V, "V") BASE(TORQUE, torque_Nm, "Nm")
};
