/* SPDX-License-Identifier: Apache-2.0 */
#ifndef UNIT_ECU_ECU_BENCH_H
#define UNIT_ECU_ECU_BENCH_H
/** An ECU on a board and a bus that consist of mocks: what they deliver, and what the ECU has done with them. */
#include "ecu/ecu.h"
#include "hal/adc.h"
#include "hal/board.h"
#include "types/can_frame.h"

#define BOARD_FRAMES 0x800U /* standard identifiers */
#define NOMINAL_PERIODS 10

typedef struct {
    bool outputs[BOARD_OUTPUTS];
    bool gate_fault;
    bool fitted, supply, switching; /* external watchdog, gate supply, read-back of the gates */
    uint8_t question;
    uint32_t answered;
    int watchdog_starts, watchdog_services;
    adc_counts_t counts;        /* of the fast ISR */
    current_counts_t converted; /* of the second level */
    bool period_passes;         /* while these counts are read */
    bool mrai_hangs;
    can_frame_t arriving; /* is received `waiting` times */
    int waiting;
    bool mailboxes_full;
    int sent, answers; /* cyclic frames, answers to the calibration tool */
    can_frame_t last_answer;
    can_frame_t last[BOARD_FRAMES]; /* of each identifier */
} board_t;

extern board_t board;
extern ecu_t ecu;

/* A new ECU for the compiled-in motor, without dc voltage and current; all mocks answer from `board`. */
void board_start(void);
/* This number of periods, then the task. */
void task_after(int periods);
void tasks(int count);

#endif
