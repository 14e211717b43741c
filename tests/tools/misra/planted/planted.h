/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PLANTED_H
#define PLANTED_H
/* Declarations of the planted violations, and half of some of them. */

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

int32_t planted_language(int32_t x, int32_t unused);
int32_t planted_names(int32_t x);
int32_t planted_twice(void);
extern int32_t planted_external; /* rule 8.5 */
void planted_declared_twice(void);

#endif
