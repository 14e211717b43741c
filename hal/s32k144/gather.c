/* SPDX-License-Identifier: Apache-2.0 */
/* The scope's copies by the DMA. Each of two banks of channels copies a part: channel k of a bank copies column k and
 * then starts the next one; the first is started by software. While a bank continues from part to part, the other one
 * waits for columns that are moved. The channels need no request from a peripheral, and no interrupt. S32K1xx reference
 * manual, enhanced direct memory access. */
#include "hal/gather.h"

#include <stddef.h>

#include "fx/codegen.h"
#include "hal/s32k144/registers.h"

#define VALUE_SIZE 2U
#define OTHER_BANK HAL_GATHER_COLUMNS /* its first channel */
#define BANK_SIZE (OTHER_BANK * (uint32_t)sizeof(channel_t))
#define LINK ((uint32_t)DMA_TCD0_CSR_MAJORELINK | DMA_TCD0_CSR_MAJORLINKCH_MASK)
#define HALF_WORDS (DMA_TCD0_ATTR_SSIZE(1) | DMA_TCD0_ATTR_DSIZE(1))

/* The registers of one channel. */
typedef struct {
    volatile uint32_t SADDR;
    volatile uint16_t SOFF, ATTR;
    volatile uint32_t NBYTES;
    volatile uint32_t SLAST, DADDR;
    volatile uint16_t DOFF, CITER;
    volatile uint32_t DLASTSGA;
    volatile uint16_t CSR, BITER;
} channel_t;

#define OFFSET(of_channel, of_dma) \
    _Static_assert(offsetof(channel_t, of_channel) == offsetof(dma_t, of_dma) - offsetof(dma_t, TCD0_SADDR), #of_dma)
OFFSET(SOFF, TCD0_SOFF);
OFFSET(ATTR, TCD0_ATTR);
OFFSET(NBYTES, TCD0_NBYTES_MLNO);
OFFSET(SLAST, TCD0_SLAST);
OFFSET(DADDR, TCD0_DADDR);
OFFSET(DOFF, TCD0_DOFF);
OFFSET(CITER, TCD0_CITER_ELINKNO);
OFFSET(DLASTSGA, TCD0_DLASTSGA);
OFFSET(CSR, TCD0_CSR);
OFFSET(BITER, TCD0_BITER_ELINKNO);
_Static_assert(sizeof(channel_t) == offsetof(dma_t, TCD1_SADDR) - offsetof(dma_t, TCD0_SADDR), "channels");

static struct {
    uint16_t bank; /* 0 or BANK_SIZE: of the next part, or of the one that was added last */
    uint8_t last;  /* channel of a bank */
    bool started;  /* since the set-up */
} state;

static inline channel_t *channels(void)
{
    return (channel_t *)(void *)&DMA->TCD0_SADDR;
}

/* By its offset in bytes, which is a shift less than by its number. */
static inline channel_t *bank_at(uint32_t offset)
{
    return (channel_t *)(void *)((uint8_t *)channels() + offset);
}

static inline uint32_t link_to(uint32_t k)
{
    return DMA_TCD0_CSR_MAJORELINK | DMA_TCD0_CSR_MAJORLINKCH(k);
}

/* The first store clears DONE: while that is set, a link is not accepted. */
static void set_status(channel_t *channel, uint32_t status)
{
    channel->CSR = 0;
    channel->CSR = (uint16_t)status;
}

bool hal_gather_is_idle(void)
{
    return !state.started || (bank_at(state.bank)[state.last].CSR & DMA_TCD0_CSR_DONE) != 0U;
}

static void set_up_channel(uint32_t k, uint32_t link, uint32_t stride, uint32_t row_size)
{
    channel_t *channel = &channels()[k];
    set_status(channel, link);
    channel->SOFF = (uint16_t)stride;
    channel->ATTR = HALF_WORDS;
    channel->SLAST = 0;
    channel->DOFF = (uint16_t)row_size;
    channel->CITER = 1;
    channel->DLASTSGA = 0;
    channel->BITER = 1;
}

void hal_gather_set_up(uint32_t columns, const uint32_t *stride, uint32_t row_size)
{
    state.last = (uint8_t)(columns - 1U);
    state.started = false;
    for (uint32_t k = 0; k < columns; k++) {
        const bool is_last = k + 1U == columns;
        set_up_channel(k, is_last ? 0U : link_to(k + 1U), stride[k], row_size);
        set_up_channel(OTHER_BANK + k, is_last ? 0U : link_to(OTHER_BANK + k + 1U), stride[k], row_size);
    }
}

void hal_gather_move(uint32_t column, const void *from, int16_t *to)
{
    if (column == 0U) {
        state.bank = (uint16_t)(state.bank ^ BANK_SIZE);
    }
    channel_t *channel = &bank_at(state.bank)[column];
    channel->SADDR = (uint32_t)(uintptr_t)from;
    channel->DADDR = (uint32_t)(uintptr_t)to;
}

/* Also the channels that are not used get their number of bytes: that is shorter than counting them. */
void hal_gather_add(uint32_t count, bool is_further)
{
    channel_t *bank = bank_at(state.bank);
    FX_ADDRESS_ONCE(bank);
    FX_UNROLLED
    for (uint32_t k = 0; k < HAL_GATHER_COLUMNS; k++) {
        bank[k].NBYTES = count * VALUE_SIZE;
    }
    bank[state.last].CSR = 0; /* neither DONE nor a link */
    if (is_further) {
        bank_at(state.bank ^ BANK_SIZE)[state.last].CSR = (uint16_t)link_to((state.bank == 0U) ? 0U : OTHER_BANK);
    }
}

void hal_gather_start(uint32_t parts)
{
    channel_t *first = bank_at((parts > 1U) ? state.bank ^ BANK_SIZE : state.bank);
    state.started = true;
    __asm__ volatile("dmb" ::: "memory"); /* the DMA reads what the task has stored before */
    set_status(first, (first->CSR & LINK) | DMA_TCD0_CSR_START);
}
