/* SPDX-License-Identifier: Apache-2.0 */
#ifndef FUZZ_ORACLE_H
#define FUZZ_ORACLE_H
/** An independent model of which frames may command the inverter. It was written from docs/howto/can.md, with another
 * CRC algorithm, another model of time and raw bytes instead of generated code, and shares only can_frame_t with the
 * firmware.
 * Source   docs/howto/can.md
 * Context  fuzz campaign only */
#include <stdbool.h>
#include <stdint.h>

#include "types/can_frame.h"

typedef struct {
    int last_counter;     /* -1: not synchronised */
    uint32_t accepted_ms; /* time of the last accepted frame */
    bool alive;
    char history[10]; /* 'g'ood or 'b'ad, newest first */
} oracle_channel_t;

typedef struct {
    uint32_t now_ms;
    oracle_channel_t command, limits;
    bool enable, reset;
    int mode;
    int torque_dNm, drive_dNm, regen_dNm; /* tenths of a newton metre */
    int power_drive_10W, power_regen_10W;
    int battery_dV; /* the last one, also after a time-out */
    uint32_t accepted;
} oracle_t;

void oracle_start(oracle_t *oracle);
/** Whether the frame must be accepted. */
bool oracle_frame(oracle_t *oracle, const can_frame_t *frame);
/** Ends a millisecond. */
void oracle_tick(oracle_t *oracle);
bool oracle_failed(const oracle_channel_t *channel);

#endif
