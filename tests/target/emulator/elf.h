/* SPDX-License-Identifier: Apache-2.0 */
#ifndef EMULATOR_ELF_H
#define EMULATOR_ELF_H
/** A 32-bit little-endian ELF file for Arm: its loadable parts and symbols.
 * Errors   elf_read() returns NULL, or a text that says what is wrong with the file
 * Context  emulator only */
#include <stddef.h>
#include <stdint.h>

typedef struct {
    uint8_t *image;
    size_t size;
} elf_t;

typedef struct {
    uint32_t address, file_size;
    const uint8_t *content;
} elf_segment_t;

const char *elf_read(elf_t *elf, const char *path);
void elf_free(elf_t *elf);
/** The n-th loadable segment by its load (physical) address; 0 after the last. */
int elf_segment(const elf_t *elf, int index, elf_segment_t *segment);
/** 0: no such symbol. */
uint32_t elf_symbol(const elf_t *elf, const char *name, uint32_t *size);
/** Name of the function that contains an address, "?" if there is none. */
const char *elf_function(const elf_t *elf, uint32_t address, uint32_t *offset);

#endif
