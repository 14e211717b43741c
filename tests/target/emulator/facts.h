/* SPDX-License-Identifier: Apache-2.0 */
#ifndef EMULATOR_FACTS_H
#define EMULATOR_FACTS_H
/** The registers as the manufacturer's SVD file describes them: names, offsets, reset values, access.
 * Source   SVD of the S32K144, through tools/fluxtrue_tools/emulate/facts.py
 * Context  emulator only; facts_table.c is generated and committed */
#include <stdint.h>

typedef struct {
    const char *name;
    uint16_t offset;
    uint8_t bytes;
    uint32_t reset;
    uint32_t writable; /* bits that a write may change */
    uint32_t fields;   /* bits that have a meaning; the others are reserved */
} fact_t;

typedef struct {
    const char *name;
    uint32_t base;
    const fact_t *fact;
    int count;
} facts_t;

extern const facts_t facts[];
extern const int facts_count;

#endif
