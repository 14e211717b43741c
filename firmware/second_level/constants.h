/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SECOND_LEVEL_CONSTANTS_H
#define SECOND_LEVEL_CONSTANTS_H
/** All data of the machine that the second level uses: a constant of its own, generated from motor.toml and the flux
 * map beside the motor data of the first level, with a checksum of its own.
 *   torque[d][q]  torque at i_d = (d - 16)/16 I_b, |i_q| = q/16 I_b, with the nominal magnet: two entries differ by a
 *                 sixteenth of the full scale of the current, because torque is almost bilinear in the currents (SL-4)
 *   checksum      CRC-32 (IEEE 802.3) of all bytes behind it, in the processor's (little-endian) order
 * Source   docs/theory/second-level.md; written by `tools/fluxtrue motor build`
 * Units    per unit of the motor's bases, q15 unless the type says otherwise; torque[][] q15
 * Range    no pointers and no padding, so that the checksum covers what is used
 * Errors   none here: second_level/own_data.h checks the checksum
 * Context  const data in flash */
#include <stdint.h>

#include "fx/q.h"

#define SECOND_LEVEL_ROWS 18
#define SECOND_LEVEL_COLUMNS 17

typedef struct {
    uint32_t checksum;
    q16_t torque_per_count;                /* of the bus, in the motor's scale */
    int32_t torque_max;                    /* rated */
    int32_t fall;                          /* slowest legal decrease of the torque, per step */
    int32_t tolerance;                     /* of the torque from currents, at no torque */
    q16_t tolerance_share;                 /* and per permitted torque */
    q16_t alpha_per_count, beta_per_count; /* current of a count of (2 i_a - i_b - i_c) and of (i_b - i_c) */
    int32_t psi_f;                         /* nominal magnet */
    q16_t l_d;                             /* change of psi_d with i_d, without i_q */
    q16_t mean_flux;                       /* psi_f l_q/l_d, with the l_q of small currents */
    q16_t mean_share; /* (2 pi p/N)^2/24: times the squared turns of a step (q16) it is theta^2/12 (q15) (SL-9) */
    uint32_t pole_pairs;
    uint32_t angle_offset;   /* electrical, 2^32 = one turn */
    int32_t turn_standstill; /* change of the mechanical angle in one step, 2^32 = one turn: below it the direction of
                                rotation is uncertain */
    int32_t mean_shift;      /* of the first-order mean: 1/2^shift per step */
    int32_t hold_steps;      /* a fourth of the time for which a reduced request is not yet expected to act */
    int32_t confirm_steps;
    int16_t torque[SECOND_LEVEL_ROWS * SECOND_LEVEL_COLUMNS];
} second_level_constants_t;

#endif
