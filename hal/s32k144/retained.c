/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/s32k144/retained.h"

#include "fx/codegen.h"
#include "hal/s32k144/core.h"
#include "hal/s32k144/registers.h"

#define MAGIC 0x46545231U
#define ARMED 0x10000U
#define SPEED_VALID 0x20000U
#define LINES 0xFFFFU

enum { MAGIC_WORD, SEQUENCE, FLAGS, SPEED_AND_V_DC, PSI_D_ERROR, WORDS };

typedef struct {
    uint32_t word[WORDS], complement[WORDS];
} copy_t;

static volatile copy_t copies[2] __attribute__((section(".retained")));
static uint32_t sequence; /* of the next copy */

static void open_copies(void)
{
    SIM->CHIPCTL = SIM->CHIPCTL | SIM_CHIPCTL_SRAMU_RETEN;
}

static void keep_copies(void)
{
    __asm__ volatile("dsb" ::: "memory");
    SIM->CHIPCTL = SIM->CHIPCTL & ~SIM_CHIPCTL_SRAMU_RETEN;
}

/* A word whose write the reset has interrupted may be uncorrectable: reading it is a bus fault. */
static bool read_copy(const volatile copy_t *from, uint32_t word[WORDS])
{
    uint32_t differing = 0;
    core_ignore_bus_faults(true);
    for (uint32_t k = 0; k < WORDS; k++) {
        word[k] = from->word[k];
        differing |= word[k] ^ ~from->complement[k];
    }
    core_ignore_bus_faults(false);
    return differing == 0U && word[MAGIC_WORD] == MAGIC;
}

/* RAM may keep its content for a while without a supply. Copies that do not count now must not count after the next
 * reset, either. */
static void discard(void)
{
    copies[0].word[MAGIC_WORD] = 0;
    copies[1].word[MAGIC_WORD] = 0;
}

static bool read_newest(retained_t *retained)
{
    uint32_t first[WORDS], second[WORDS];
    if ((RCM->SRS & (RCM_SRS_POR | RCM_SRS_LVD)) != 0U) {
        discard();
        return false;
    }
    const bool is_first = read_copy(&copies[0], first), is_second = read_copy(&copies[1], second);
    const bool newer = is_second && (!is_first || second[SEQUENCE] - first[SEQUENCE] < 0x80000000U);
    const uint32_t *word = newer ? second : first;
    if (!is_first && !is_second) {
        return false;
    }
    sequence = word[SEQUENCE] + 1U;
    retained->lines = word[FLAGS] & LINES;
    retained->drive = (before_reset_t){
        .speed = (int16_t)word[SPEED_AND_V_DC],
        .v_dc = (int16_t)(word[SPEED_AND_V_DC] >> 16),
        .psi_d_error = (int16_t)word[PSI_D_ERROR],
        .armed = (word[FLAGS] & ARMED) != 0U,
        .speed_valid = (word[FLAGS] & SPEED_VALID) != 0U,
    };
    return true;
}

/* Kept again at once: the next reset may come before the first copy is written. It runs once: compiled for size. */
FX_NOT_INLINED FX_COLD bool retained_read(retained_t *retained)
{
    open_copies();
    const bool is_valid = read_newest(retained);
    keep_copies();
    return is_valid;
}

void retained_write(const retained_t *retained)
{
    const before_reset_t *drive = &retained->drive;
    const uint32_t word[WORDS] = {
        [MAGIC_WORD] = MAGIC,
        [SEQUENCE] = sequence,
        [FLAGS] = (retained->lines & LINES) | (drive->armed ? ARMED : 0U) | (drive->speed_valid ? SPEED_VALID : 0U),
        [SPEED_AND_V_DC] = (uint16_t)drive->speed | (uint32_t)drive->v_dc << 16,
        [PSI_D_ERROR] = (uint16_t)drive->psi_d_error,
    };
    volatile copy_t *to = &copies[sequence & 1U];
    open_copies();
    for (uint32_t k = 0; k < WORDS; k++) {
        to->word[k] = word[k];
        to->complement[k] = ~word[k];
    }
    keep_copies();
    sequence++;
}
