/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/s32k144/can.h"

#include "fx/codegen.h"
#include "hal/can.h"
#include "hal/s32k144/can_mailbox.h"
#include "hal/s32k144/registers.h"
#include "hal/s32k144/startup.h"

#define MEMORY_WORDS 128U
#define LAST_BOX 15U
#define FIRST_SEND_BOX 8U
#define QUEUE 32U /* a power of two */
#define FROZEN (CAN_MCR_FRZ | CAN_MCR_HALT)
#define NORMAL (CAN_MCR_RFEN | CAN_MCR_SRXDIS | CAN_MCR_SUPV | CAN_MCR_MAXMB(LAST_BOX))
/* 8 MHz / 1 = 16 quanta of 125 ns: sync 1, propagation 8, segment 1 five, segment 2 two; sampled at 87.5 %. */
#define TIMING                                                                                      \
    (CAN_CTRL1_PRESDIV(0) | CAN_CTRL1_RJW(1) | CAN_CTRL1_PSEG1(4) | CAN_CTRL1_PSEG2(1) | CAN_CTRL1_PROPSEG(7))

/* One writer each: the interrupt writes put, the reader writes taken. */
static can_frame_t queue[QUEUE];
static volatile uint32_t put, taken, lost, bus_off;

void can_init(void)
{
    CAN0->MCR = NORMAL | FROZEN; /* leaves disabled mode with the oscillator as clock (CLKSRC is 0) */
    await(&CAN0->MCR, CAN_MCR_FRZACK, CAN_MCR_FRZACK);
    CAN0->MCR = NORMAL | FROZEN; /* some of its bits take a value only when frozen */
    CAN0->CTRL1 = TIMING | CAN_CTRL1_BOFFMSK;
    for (uint32_t k = 0; k < MEMORY_WORDS; k++) {
        CAN0->EmbeddedRAM[k] = 0;
    }
    for (uint32_t box = FIRST_SEND_BOX; box <= LAST_BOX; box++) {
        CAN0->EmbeddedRAM[box * CAN_BOX_WORDS] = CAN_CODE_INACTIVE;
    }
    CAN0->RXMGMASK = 0;
    CAN0->RXFGMASK = 0; /* no bit of the filters counts: every frame passes */
    CAN0->IFLAG1 = 0xFFFFFFFFU;
    CAN0->IMASK1 = CAN_IFLAG1_BUF5I;
    CAN0->MCR = NORMAL;
    await(&CAN0->MCR, CAN_MCR_FRZACK | CAN_MCR_NOTRDY, 0);
}

static void keep(const can_box_t *box)
{
    const uint32_t at = put;
    if (at - taken >= QUEUE) {
        lost = lost + 1U;
        return;
    }
    queue[at % QUEUE] = can_box_unpack(box);
    fx_compiler_barrier();
    put = at + 1U;
}

void can_message_isr(void)
{
    if ((CAN0->IFLAG1 & CAN_IFLAG1_BUF7I) != 0U) {
        CAN0->IFLAG1 = CAN_IFLAG1_BUF7I;
        lost = lost + 1U;
    }
    while ((CAN0->IFLAG1 & CAN_IFLAG1_BUF5I) != 0U) {
        can_box_t box;
        for (uint32_t k = 0; k < CAN_BOX_WORDS; k++) {
            box.word[k] = CAN0->EmbeddedRAM[k];
        }
        CAN0->IFLAG1 = CAN_IFLAG1_BUF5I; /* the next frame moves up */
        keep(&box);
    }
}

void can_bus_off_isr(void)
{
    if ((CAN0->ESR1 & CAN_ESR1_BOFFINT) != 0U) {
        CAN0->ESR1 = CAN_ESR1_BOFFINT;
        bus_off = bus_off + 1U;
    }
}

bool hal_can_receive(can_frame_t *frame)
{
    const uint32_t at = taken;
    if (at == put) {
        return false;
    }
    *frame = queue[at % QUEUE];
    fx_compiler_barrier();
    taken = at + 1U;
    return true;
}

bool hal_can_send(const can_frame_t *frame)
{
    for (uint32_t box = FIRST_SEND_BOX; box <= LAST_BOX; box++) {
        volatile uint32_t *word = &CAN0->EmbeddedRAM[box * CAN_BOX_WORDS];
        if ((word[0] & CAN_CODE_MASK) == CAN_CODE_INACTIVE) {
            const can_box_t packed = can_box_pack(frame);
            CAN0->IFLAG1 = 1U << box; /* of the frame before */
            word[1] = packed.word[1];
            word[2] = packed.word[2];
            word[3] = packed.word[3];
            word[0] = packed.word[0]; /* the code starts it */
            return true;
        }
    }
    return false;
}

uint32_t hal_can_lost(void)
{
    return lost;
}

uint32_t hal_can_bus_off(void)
{
    return bus_off;
}
