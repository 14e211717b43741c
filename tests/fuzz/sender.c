/* SPDX-License-Identifier: Apache-2.0 */
#include "sender.h"

#include "comm/e2e.h"

#define ENABLE 0x10U
#define RESET 0x20U
#define MODE_TORQUE 0x40U
/* Frames: each step is one of the sender's ten milliseconds. */
#define STEP_IDLE 4U
#define STEP_ENABLE 12U
#define STEP_TORQUE 16U
#define STEPS 100U

static const uint32_t ids[2] = {0x110, 0x111};
static const uint16_t data_ids[2] = {0x1101, 0x1111};

void sender_start(sender_t *sender, uint64_t seed)
{
    *sender = (sender_t){.random = seed * 0x9E3779B97F4A7C15ULL + 1ULL, .bits = 0x40};
}

/* xorshift64* */
uint32_t sender_random(sender_t *sender, uint32_t below)
{
    uint64_t x = sender->random;
    x ^= x >> 12;
    x ^= x << 25;
    x ^= x >> 27;
    sender->random = x;
    return (uint32_t)((x * 0x2545F4914F6CDD1DULL) >> 32) % below;
}

static void put16(can_frame_t *frame, unsigned at, unsigned value)
{
    frame->data[at] = (uint8_t)(value & 0xFFU);
    frame->data[at + 1U] = (uint8_t)(value >> 8 & 0xFFU);
}

static void sign(sender_t *s, unsigned which, can_frame_t *frame)
{
    uint8_t counter = (uint8_t)s->counter[which];
    e2e_protect(data_ids[which], &counter, frame);
    s->counter[which] = counter;
}

/* Repeats the sequence from a fault to the state run: reset, idle, enable, torque; sometimes with another frame. */
static void make_up_mind(sender_t *s)
{
    s->step = (s->step + 1U) % STEPS;
    if (sender_random(s, 200) == 0U) {
        s->bits = sender_random(s, 3) << 6 | sender_random(s, 4) << 4;
    } else if (s->step < STEP_IDLE) {
        s->bits = MODE_TORQUE | RESET;
        s->torque_dNm = 0;
    } else if (s->step < STEP_ENABLE) {
        s->bits = MODE_TORQUE;
    } else if (s->step < STEP_TORQUE) {
        s->bits = MODE_TORQUE | ENABLE;
    } else if (sender_random(s, 10) == 0U) {
        s->torque_dNm = (int)sender_random(s, 3001) - 1500;
    }
}

can_frame_t sender_sane(sender_t *s, unsigned which)
{
    can_frame_t frame = {.id = ids[which], .length = 8};
    if (which == 0U) {
        make_up_mind(s);
        frame.data[1] = (uint8_t)s->bits;
        put16(&frame, 2, (unsigned)s->torque_dNm);
        put16(&frame, 4, 2000);
        put16(&frame, 6, sender_random(s, 2001));
    } else {
        put16(&frame, 2, sender_random(s, 60001));
        put16(&frame, 4, sender_random(s, 60001));
        put16(&frame, 6, 3500); /* the plant's battery: 350 V */
    }
    sign(s, which, &frame);
    s->last = frame;
    return frame;
}

static void scribble(sender_t *s, can_frame_t *frame)
{
    for (unsigned n = 0; n < 8U; n++) {
        frame->data[n] = (uint8_t)sender_random(s, 256);
    }
}

static can_frame_t noise(sender_t *s)
{
    can_frame_t frame = {.length = (uint8_t)sender_random(s, 9), .extended = sender_random(s, 4) == 0U};
    frame.id = (sender_random(s, 3) == 0U) ? ids[sender_random(s, 2)] : sender_random(s, 0x800);
    scribble(s, &frame);
    return frame;
}

/* Valid CRC and counter, random signals. */
static can_frame_t signed_noise(sender_t *s)
{
    const unsigned which = sender_random(s, 2);
    can_frame_t frame = {.id = ids[which], .length = 8};
    scribble(s, &frame);
    frame.data[1] &= 0xF0U;
    sign(s, which, &frame);
    return frame;
}

can_frame_t sender_insane(sender_t *s)
{
    can_frame_t frame = s->last;
    switch (sender_random(s, 8)) {
    case 0: /* a replay */
        break;
    case 1:
    case 2: /* a few bits */
        for (uint32_t n = sender_random(s, 6) + 1U; n > 0U; n--) {
            const uint32_t bit = sender_random(s, 64);
            frame.data[bit / 8U] = (uint8_t)(frame.data[bit / 8U] ^ 1U << bit % 8U);
        }
        break;
    case 3: /* a byte */
        frame.data[sender_random(s, 8)] = (uint8_t)sender_random(s, 256);
        break;
    case 4: /* length or identifier */
        frame.length = (uint8_t)sender_random(s, 9);
        frame.id ^= sender_random(s, 2);
        break;
    case 5: /* another counter with a good CRC */
        frame.data[1] = (uint8_t)((frame.data[1] & 0xF0U) | sender_random(s, 16));
        frame.data[0] = e2e_crc(data_ids[frame.id & 1U], &frame);
        break;
    case 6:
        return signed_noise(s);
    default:
        return noise(s);
    }
    return frame;
}
