/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_SERIAL_ANGLE_H
#define HAL_S32K144_SERIAL_ANGLE_H
/** LPSPI0 with an angle sensor: one frame in each PWM period, which the hardware starts. The frame is complete before
 * the fast ISR needs it, so that the ISR never waits.
 *   Four words wait in the transmit FIFO; each pulse of PDB0 lets the module send one. The newest received frame
 *   belongs to the present period as long as a word is left in the FIFO: only then every period since the last reading
 *   has sent one.
 * Source   README.md, angle
 * Units    start: ticks of 112 MHz from the start of the period; the others: clocks of 28 MHz
 * Errors   serial_angle_read(): 0 if no frame was received, or if more than three periods have passed since the last
 *          reading
 * Context  serial_angle_read(): fast ISR, once; the others: start-up */
#include <stdint.h>

typedef struct {
    uint32_t command; /* LPSPI_TCR: size and mode of a frame */
    uint32_t word;    /* to be sent in each */
    uint32_t start;   /* of the frame in the period */
} serial_angle_t;

/** Clocks for each bit, from the chip select to the first bit, and between two frames (each at least 2); from the last
 * bit to the chip select's end are 4. */
typedef struct {
    uint32_t bit, select, gap;
} serial_angle_timing_t;

#define SERIAL_ANGLE_RELEASE 4U

/** Enables the module without a request: a word that is written to TDR is sent at once. */
void serial_angle_init(const serial_angle_timing_t *timing);
/** A frame, awaited; 0 if none is received. */
uint32_t serial_angle_exchange(uint32_t word);
/** From the next period on the hardware starts the frames. The module must be idle. */
void serial_angle_start(const serial_angle_t *config);
/** Number of frames since the last reading, and the newest in *frame; 0: there is none of this period. word: the one
 * that serial_angle_start() was given. */
uint32_t serial_angle_read(uint32_t word, uint32_t *frame);

#endif
