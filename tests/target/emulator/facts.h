/* SPDX-License-Identifier: Apache-2.0 */
#ifndef EMULATOR_FACTS_H
#define EMULATOR_FACTS_H
/** What the reference manual's machine-readable form says of the registers: names, offsets, resets, access.
 * Source   SVD of the S32K144, through tools/fluxtrue_tools/emulate/facts.py
 * Context  emulator only; facts_table.c is generated and committed */
#include <stdint.h>

typedef struct {
    const char *name;
    uint16_t offset;
    uint8_t bytes;
    uint32_t reset;
    uint32_t writable; /* bits a write may change */
    uint32_t fields;   /* bits that mean anything; the rest is reserved */
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
