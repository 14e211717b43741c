/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_CAN_MAILBOX_H
#define HAL_S32K144_CAN_MAILBOX_H
/** FlexCAN message buffers: four words, the first byte of the data in the uppermost bits.
 *   word 0: CODE 27..24, SRR 22, IDE 21, RTR 20, DLC 19..16, time stamp 15..0
 *   word 1: identifier, standard 28..18, extended 28..0
 * Source   S32K1xx reference manual, FlexCAN message buffer structure
 * Errors   a remote request unpacks as a frame of length 0; a DLC above 8 as 8
 * Context  values only */
#include <stdint.h>

#include "types/can_frame.h"

#define CAN_BOX_WORDS 4
#define CAN_CODE_MASK (15U << 24)
#define CAN_CODE_INACTIVE (8U << 24)
#define CAN_CODE_SEND (12U << 24)
#define CAN_BOX_SRR (1U << 22)
#define CAN_BOX_EXTENDED (1U << 21)
#define CAN_BOX_REMOTE (1U << 20)

typedef struct {
    uint32_t word[CAN_BOX_WORDS];
} can_box_t;

static inline uint32_t can_box_bytes(const uint8_t *byte)
{
    return (uint32_t)byte[0] << 24 | (uint32_t)byte[1] << 16 | (uint32_t)byte[2] << 8 | byte[3];
}

static inline can_box_t can_box_pack(const can_frame_t *frame)
{
    const uint32_t length = (frame->length > 8U) ? 8U : frame->length;
    const uint32_t form = frame->extended ? CAN_BOX_SRR | CAN_BOX_EXTENDED : 0U;
    return (can_box_t){{
        CAN_CODE_SEND | form | length << 16,
        frame->extended ? frame->id & 0x1FFFFFFFU : (frame->id & 0x7FFU) << 18,
        can_box_bytes(&frame->data[0]),
        can_box_bytes(&frame->data[4]),
    }};
}

static inline can_frame_t can_box_unpack(const can_box_t *box)
{
    const uint32_t form = box->word[0];
    const uint32_t length = (form >> 16) & 15U;
    can_frame_t frame = {.extended = (form & CAN_BOX_EXTENDED) != 0U};
    frame.id = frame.extended ? box->word[1] & 0x1FFFFFFFU : (box->word[1] >> 18) & 0x7FFU;
    if ((form & CAN_BOX_REMOTE) == 0U) {
        frame.length = (uint8_t)((length > 8U) ? 8U : length);
    }
    for (uint32_t k = 0; k < frame.length; k++) {
        frame.data[k] = (uint8_t)(box->word[2U + k / 4U] >> (24U - 8U * (k % 4U)));
    }
    return frame;
}

#endif
