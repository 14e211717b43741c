/* SPDX-License-Identifier: Apache-2.0 */
#include "machine_file.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define VALUES_MAX 128
#define WORD_SIZE 64
#define AXIS_MAX 400.0

static char names[VALUES_MAX][WORD_SIZE];
static machine_value_t values[VALUES_MAX + 1]; /* the last one stays without a name */
static machine_data_t machine;

static bool read_number(FILE *file, double *number)
{
    char word[WORD_SIZE];
    char *end = word;
    if (fscanf(file, "%63s", word) != 1) {
        return false;
    }
    *number = strtod(word, &end);
    return end != word && *end == '\0';
}

/* All numbers lie in one piece of memory, which is kept until the process ends. */
static bool read_map(FILE *file)
{
    double nd, nq;
    if (!read_number(file, &nd) || !read_number(file, &nq) || !(nd >= 2.0 && nd <= AXIS_MAX) ||
        !(nq >= 2.0 && nq <= AXIS_MAX)) {
        return false;
    }
    const size_t d = (size_t)nd;
    const size_t q = (size_t)nq;
    double *numbers = calloc(d + q + 2U * d * q, sizeof numbers[0]);
    for (size_t k = 0; numbers != NULL && k < d + q + 2U * d * q; k++) {
        if (!read_number(file, &numbers[k])) {
            free(numbers);
            return false;
        }
    }
    machine.nd = (int)d;
    machine.nq = (int)q;
    machine.id_A = numbers;
    machine.iq_A = &numbers[d];
    machine.psi_d_Vs = &numbers[d + q];
    machine.psi_q_Vs = &numbers[d + q + d * q];
    return numbers != NULL;
}

static bool read_all(FILE *file)
{
    char word[WORD_SIZE];
    for (int count = 0; fscanf(file, "%63s", word) == 1; count++) {
        if (strcmp(word, "map") == 0) {
            return read_map(file) && fscanf(file, "%63s", word) != 1;
        }
        if (count >= VALUES_MAX || !read_number(file, &values[count].value)) {
            return false;
        }
        memcpy(names[count], word, sizeof word);
        values[count].name = names[count];
    }
    return values[0].name != NULL;
}

const machine_data_t *machine_file_load(const char *path)
{
    FILE *file = fopen(path, "r");
    if (file == NULL) {
        return NULL;
    }
    machine = (machine_data_t){.motor = machine_data.motor, .values = values};
    const bool good = read_all(file);
    (void)fclose(file);
    return good ? &machine : NULL;
}
