/* SPDX-License-Identifier: Apache-2.0 */
#include "elf.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LOADABLE = 1, SYMBOLS = 2, NO_BITS = 8, FUNCTION = 2, ARM = 40 };
enum { PROGRAM_SIZE = 32, SECTION_SIZE = 40, SYMBOL_SIZE = 16 };

static uint32_t word(const elf_t *elf, size_t at)
{
    uint32_t value = 0;
    if (at + 4 <= elf->size) {
        memcpy(&value, elf->image + at, 4);
    }
    return value;
}

static uint32_t half(const elf_t *elf, size_t at)
{
    return word(elf, at) & 0xFFFFU;
}

static bool inside(const elf_t *elf, size_t at, size_t size)
{
    return at <= elf->size && size <= elf->size - at;
}

/* All ranges in the tables lie inside the file. */
static bool complete(const elf_t *elf)
{
    const uint32_t programs = half(elf, 44), sections = half(elf, 48);
    bool good = inside(elf, word(elf, 28), (size_t)programs * PROGRAM_SIZE) &&
                inside(elf, word(elf, 32), (size_t)sections * SECTION_SIZE);
    for (uint32_t i = 0; good && i < programs; i++) {
        const size_t at = word(elf, 28) + (size_t)i * PROGRAM_SIZE;
        good = inside(elf, word(elf, at + 4), word(elf, at + 16));
    }
    for (uint32_t i = 0; good && i < sections; i++) {
        const size_t at = word(elf, 32) + (size_t)i * SECTION_SIZE;
        good = word(elf, at + 4) == NO_BITS || inside(elf, word(elf, at + 16), word(elf, at + 20));
    }
    return good;
}

const char *elf_read(elf_t *elf, const char *path)
{
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return "cannot be opened";
    }
    (void)fseek(file, 0, SEEK_END);
    const long size = ftell(file);
    (void)fseek(file, 0, SEEK_SET);
    elf->size = size > 0 ? (size_t)size : 0U;
    elf->image = calloc(1, elf->size + 4U); /* zeros terminate a text at the end of the file */
    const bool whole = elf->image != NULL && fread(elf->image, 1, elf->size, file) == elf->size;
    (void)fclose(file);
    if (!whole) {
        return "cannot be read";
    }
    if (elf->size < 52 || memcmp(elf->image, "\177ELF\001\001", 6) != 0 || half(elf, 18) != ARM) {
        return "is not a 32-bit little-endian ELF file for Arm";
    }
    return complete(elf) ? NULL : "is cut short or damaged: parts of it lie beyond the end of the file";
}

void elf_free(elf_t *elf)
{
    free(elf->image);
    elf->image = NULL;
}

int elf_segment(const elf_t *elf, int index, elf_segment_t *segment)
{
    const uint32_t table = word(elf, 28), count = half(elf, 44);
    for (uint32_t i = 0; i < count; i++) {
        const size_t at = table + (size_t)i * PROGRAM_SIZE;
        const uint32_t offset = word(elf, at + 4), size = word(elf, at + 16);
        if (word(elf, at) != LOADABLE || size == 0 || (size_t)offset + size > elf->size) {
            continue;
        }
        if (index-- == 0) {
            *segment = (elf_segment_t){word(elf, at + 12), size, elf->image + offset};
            return 1;
        }
    }
    return 0;
}

typedef struct {
    const char *name;
    uint32_t value, size;
    unsigned kind;
} symbol_t;

/* Reads the symbol table entry by entry; *index is the position, 0 for the first call. */
static bool next_symbol(const elf_t *elf, uint32_t *index, symbol_t *symbol)
{
    const uint32_t sections = word(elf, 32), count = half(elf, 48);
    for (uint32_t i = 0; i < count; i++) {
        const size_t at = sections + (size_t)i * SECTION_SIZE;
        if (word(elf, at + 4) != SYMBOLS) {
            continue;
        }
        const size_t strings = sections + (size_t)word(elf, at + 24) * SECTION_SIZE;
        const uint32_t n = word(elf, at + 20) / SYMBOL_SIZE;
        if (*index >= n) {
            return false;
        }
        const size_t entry = word(elf, at + 16) + (size_t)(*index)++ * SYMBOL_SIZE;
        const size_t name = (size_t)word(elf, strings + 16) + word(elf, entry);
        *symbol = (symbol_t){(const char *)elf->image + (name < elf->size ? name : 0), word(elf, entry + 4),
                             word(elf, entry + 8), elf->image[entry + 12] & 15U};
        return true;
    }
    return false;
}

uint32_t elf_symbol(const elf_t *elf, const char *name, uint32_t *size)
{
    symbol_t symbol;
    for (uint32_t i = 0; next_symbol(elf, &i, &symbol);) {
        if (strcmp(symbol.name, name) == 0) {
            if (size != NULL) {
                *size = symbol.size;
            }
            return symbol.value;
        }
    }
    return 0;
}

const char *elf_function(const elf_t *elf, uint32_t address, uint32_t *offset)
{
    symbol_t symbol;
    for (uint32_t i = 0; next_symbol(elf, &i, &symbol);) {
        const uint32_t begin = symbol.value & ~1U;
        if (symbol.kind == FUNCTION && address >= begin && address < begin + symbol.size) {
            *offset = address - begin;
            return symbol.name;
        }
    }
    *offset = 0;
    return "?";
}
