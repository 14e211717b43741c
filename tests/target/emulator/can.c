/* SPDX-License-Identifier: Apache-2.0 */
/* FlexCAN0: freeze handshake, legacy receive FIFO without filtering (all masks 0), transmit mailboxes, one frame on the
 * bus at a time. Bit errors, arbitration and bus off do not happen.
 *
 * documented behaviour                                | modelled | test
 * --------------------------------------------------- | -------- | --------------------------------------------
 * bits that can be written in freeze mode only        | refused  | test_what_is_not_modelled_is_an_error
 * message memory must be initialised                  | refused  | test_what_is_not_modelled_is_an_error
 * legacy FIFO of six, read in mailbox 0; BUF5I        | yes      | test_received_frames_queue_for_the_program
 * FIFO warning, overflow                              | yes      | test_received_frames_queue_for_the_program
 * lowest identifier is sent first, CODE 12 to 8       | yes      | test_mailboxes_are_sent_lowest_identifier_first
 * bit time from CTRL1 and its clock                   | yes      | test_mailboxes_are_sent_lowest_identifier_first
 * interrupt of mailboxes 0 to 15                      | yes      | test_received_frames_queue_for_the_program
 * filters of the FIFO, soft reset, flexible data rate | refused  | test_other_bus_modes_are_refused
 * stuff bits, errors, arbitration, bus off            | no       | -
 */
#include <string.h>

#include "can_port.h"
#include "emu_private.h"

enum {
    MCR = 0x00,
    CTRL1 = 0x04,
    TIMER = 0x08,
    RXMGMASK = 0x10,
    ECR = 0x1C,
    ESR1 = 0x20,
    IMASK1 = 0x28,
    IFLAG1 = 0x30,
    CTRL2 = 0x34,
    RXFGMASK = 0x48,
    RAM = 0x80,
    RAM_END = 0x280,
    BOX = 16,
    RXIMR = 0x880,
    CODE_SEND = 12,
    CODE_DONE = 8,
    FIRST_SEND_BOX = 8,
    BOXES = 16,
    MB_IRQ = 81,
    FRAME_OVERHEAD_BITS = 47,
    EXTENDED_OVERHEAD_BITS = 67,
    FIFO_WARNING = 1 << 6,
    FIFO_OVERFLOW = 1 << 7,
    FIFO_FRAME = 1 << 5,
};
#define MDIS (1U << 31)
#define FRZ (1U << 30)
#define RFEN (1U << 29)
#define HALT (1U << 28)
#define NOTRDY (1U << 27)
#define SOFTRST (1U << 25)
#define FRZACK (1U << 24)
#define LPMACK (1U << 20)
#define MCR_FROZEN_ONLY 0x20A3337FU /* RFEN, SUPV, WRNEN, SRXDIS, IRMQ, LPRIOEN, AEN, IDAM, MAXMB */

static const peripheral_t *can0(void)
{
    return PERIPHERAL(CAN0);
}

bool can_models(uint32_t offset)
{
    return offset <= ESR1 || offset == IMASK1 || offset == IFLAG1 || offset == CTRL2 || offset == RXFGMASK ||
           (offset >= RAM && offset < RAM_END) || (offset >= RXIMR && offset < RXIMR + 64U);
}

static bool frozen(const emu_t *emu)
{
    return (bus_get(emu, can0(), MCR) & (FRZ | HALT)) == (FRZ | HALT);
}

static bool running(const emu_t *emu)
{
    return (bus_get(emu, can0(), MCR) & MDIS) == 0 && !frozen(emu);
}

uint32_t can_read(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t stored)
{
    (void)self;
    if (offset == MCR) {
        const uint32_t off = (stored & MDIS) != 0 ? NOTRDY | LPMACK : 0U;
        const uint32_t halted = off == 0 && frozen(emu) ? NOTRDY | FRZACK : 0U;
        return (stored & ~(NOTRDY | FRZACK | LPMACK | SOFTRST)) | off | halted;
    }
    return offset == TIMER ? (uint32_t)(emu->s.now / (EMU_TICKS_PER_S / 500000U)) & 0xFFFFU : stored;
}

static void line_update(emu_t *emu)
{
    const uint32_t raised = bus_get(emu, can0(), IFLAG1) & bus_get(emu, can0(), IMASK1) & 0xFFFFU;
    nvic_line(emu, MB_IRQ, raised != 0);
}

/* ---- receiving ---- */

static uint32_t word_of(const uint8_t *byte)
{
    return (uint32_t)byte[0] << 24 | (uint32_t)byte[1] << 16 | (uint32_t)byte[2] << 8 | byte[3];
}

/* The program reads the FIFO's first frame in mailbox 0. */
static void fifo_show(emu_t *emu)
{
    const peripheral_t *self = can0();
    const can_t *c = &emu->s.can;
    if (c->fifo_count == 0) {
        return;
    }
    const can_port_frame_t *frame = &c->fifo[0];
    bus_put(emu, self, RAM, (uint32_t)frame->length << 16 | (frame->extended ? 3U << 21 : 0U));
    bus_put(emu, self, RAM + 4U, frame->extended ? frame->id : frame->id << 18);
    bus_put(emu, self, RAM + 8U, word_of(frame->data));
    bus_put(emu, self, RAM + 12U, word_of(frame->data + 4));
    bus_put(emu, self, IFLAG1, bus_get(emu, self, IFLAG1) | FIFO_FRAME);
    line_update(emu);
}

void can_frame_arrives(emu_t *emu, const can_port_frame_t *frame)
{
    const peripheral_t *self = can0();
    can_t *c = &emu->s.can;
    if (!running(emu) || (bus_get(emu, self, MCR) & RFEN) == 0) {
        return; /* the module does not receive */
    }
    if (c->fifo_count == EMU_CAN_FIFO) {
        bus_put(emu, self, IFLAG1, bus_get(emu, self, IFLAG1) | FIFO_OVERFLOW);
        line_update(emu);
        return;
    }
    c->fifo[c->fifo_count++] = *frame;
    if (c->fifo_count == EMU_CAN_FIFO - 1) {
        bus_put(emu, self, IFLAG1, bus_get(emu, self, IFLAG1) | FIFO_WARNING);
    }
    if (c->fifo_count == 1) {
        fifo_show(emu);
    }
}

static void flags_written(emu_t *emu, uint32_t old, uint32_t value)
{
    can_t *c = &emu->s.can;
    bus_put(emu, can0(), IFLAG1, old & ~value);
    if ((old & value & FIFO_FRAME) != 0 && c->fifo_count > 0) {
        c->fifo_count--;
        memmove(&c->fifo[0], &c->fifo[1], (size_t)c->fifo_count * sizeof c->fifo[0]);
        fifo_show(emu);
    }
    line_update(emu);
}

/* ---- sending ---- */

static uint32_t box_at(int box)
{
    return RAM + BOX * (uint32_t)box;
}

static can_port_frame_t frame_in(const emu_t *emu, int box)
{
    const peripheral_t *self = can0();
    const uint32_t form = bus_get(emu, self, box_at(box)), id = bus_get(emu, self, box_at(box) + 4U);
    can_port_frame_t frame = {.extended = (form >> 21 & 1U) != 0, .length = (uint8_t)(form >> 16 & 15U)};
    frame.id = frame.extended ? id & 0x1FFFFFFFU : id >> 18 & 0x7FFU;
    frame.length = frame.length > 8U ? 8U : frame.length;
    for (uint32_t k = 0; k < 8U; k++) {
        frame.data[k] = (uint8_t)(bus_get(emu, self, box_at(box) + 8U + 4U * (k / 4U)) >> (24U - 8U * (k % 4U)));
    }
    return frame;
}

/* The mailbox with the lowest identifier is sent first. */
static int box_to_send(const emu_t *emu)
{
    int best = -1;
    uint32_t lowest = 0;
    for (int box = FIRST_SEND_BOX; box < BOXES; box++) {
        if ((bus_get(emu, can0(), box_at(box)) >> 24 & 15U) != CODE_SEND) {
            continue;
        }
        const uint32_t id = bus_get(emu, can0(), box_at(box) + 4U) & 0x1FFFFFFFU;
        if (best < 0 || id < lowest) {
            best = box;
            lowest = id;
        }
    }
    return best;
}

/* Time of a bit: clock (8 MHz oscillator or system clock), PRESDIV and number of quanta. */
static uint64_t bit_ticks(emu_t *emu)
{
    const uint32_t c = bus_get(emu, can0(), CTRL1);
    const uint32_t clock = (c & 1U << 13) != 0 ? 2U * emu->s.core_ticks : clocks_async_ticks(emu, 1, 2);
    const uint32_t quanta = 4U + (c & 7U) + (c >> 19 & 7U) + (c >> 16 & 7U);
    if (clock == 0) {
        emu_fail(emu, "CAN0 runs without a clock (SOSCDIV2)");
    }
    return (uint64_t)clock * ((c >> 24) + 1U) * quanta;
}

static void send_next(emu_t *emu)
{
    can_t *c = &emu->s.can;
    const int box = running(emu) ? box_to_send(emu) : -1;
    if (c->sending != 0 || box < 0) {
        return;
    }
    const can_port_frame_t frame = frame_in(emu, box);
    const uint32_t overhead = frame.extended ? EXTENDED_OVERHEAD_BITS : FRAME_OVERHEAD_BITS;
    c->sending = box + 1;
    emu_timer(emu, TIMER_CAN, emu_instant(emu) + bit_ticks(emu) * (overhead + 8U * frame.length));
}

void can_fire(emu_t *emu)
{
    can_t *c = &emu->s.can;
    const peripheral_t *self = can0();
    const int box = c->sending - 1;
    const can_port_frame_t frame = frame_in(emu, box);
    const uint32_t form = bus_get(emu, self, box_at(box));
    c->sending = 0;
    bus_put(emu, self, box_at(box), (form & ~(15U << 24)) | (uint32_t)CODE_DONE << 24);
    bus_put(emu, self, IFLAG1, bus_get(emu, self, IFLAG1) | 1U << box);
    line_update(emu);
    if (emu->can_port != NULL && emu->can_port->sent != NULL) {
        emu->can_port->sent(emu->can_port->user, &frame, emu->s.now);
    }
    send_next(emu);
}

/* ---- registers ---- */

static bool memory_filled(const emu_t *emu)
{
    const uint32_t *filled = emu->s.can.filled;
    return (filled[0] & filled[1] & filled[2] & filled[3]) == 0xFFFFFFFFU;
}

/* Outside freeze mode some bits keep their values. */
static void control_written(emu_t *emu, uint32_t old, uint32_t value)
{
    const bool was_frozen = (old & (MDIS | FRZ | HALT)) == (FRZ | HALT);
    const uint32_t kept = was_frozen ? 0U : (old ^ value) & MCR_FROZEN_ONLY;
    bus_put(emu, can0(), MCR, bus_get(emu, can0(), MCR) ^ kept);
    if (kept != 0 && (old & MDIS) == 0) {
        emu_fail(emu, "write of CAN0.MCR: the bits 0x%x can be written in freeze mode only", kept);
    }
    if (running(emu)) {
        pins_check(emu, PERIPHERAL(CAN0));
    }
    if (running(emu) && !memory_filled(emu)) {
        emu_fail(emu, "write of CAN0.MCR: its message memory has not been initialised");
    }
    if ((value & SOFTRST) != 0 || (value & 0x00004800U) != 0) {
        emu_fail(emu, "write of CAN0.MCR: soft reset, pretended networking and flexible data rate are not modelled");
    }
    send_next(emu);
}

void can_written(emu_t *emu, const peripheral_t *self, uint32_t offset, uint32_t old, uint32_t value)
{
    (void)self;
    if (offset >= RAM && offset < RAM_END) {
        emu->s.can.filled[(offset - RAM) / 128U] |= 1U << ((offset - RAM) / 4U % 32U);
    }
    const bool only_frozen = offset == CTRL1 || offset == RXMGMASK || offset == RXFGMASK ||
                             (offset >= RXIMR && offset < RXIMR + 64U);
    if (only_frozen && running(emu) && old != value) {
        emu_fail(emu, "write of CAN0 offset 0x%x: it can be written in freeze mode only", offset);
    }
    if (offset == RXFGMASK && value != 0) {
        emu_fail(emu, "write of CAN0.RXFGMASK: the FIFO's filters are not modelled, all pass");
    }
    if (offset == IFLAG1) {
        flags_written(emu, old, value);
    } else if (offset == IMASK1) {
        line_update(emu);
    } else if (offset == ESR1) {
        bus_put(emu, can0(), ESR1, old & ~value);
    } else if (offset == MCR) {
        control_written(emu, old, value);
    } else if (offset >= RAM && offset < RAM_END && (offset - RAM) % BOX == 0) {
        send_next(emu);
    }
}
