/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CALIBRATION_PULSE_ACCESS_H
#define CALIBRATION_PULSE_ACCESS_H
/** The voltage pulses at standstill over XCP: commands of XCP_USER_CMD beside those of the scope.
 *   PULSE_SET    field (1), value (2, little endian): one value of the next pulses
 *   PULSE_START  starts them once; the drive refuses them without the consent of VCU_Commission, and unless it runs,
 *                stands and has no request (drive/pulsing.c)
 *   PULSE_STATE  answers pulses_phase_t, pulses_failure_t and whether there is a consent, one byte each
 *   MOVEMENT_STATE  the same of the movement: movement_phase_t, movement_failure_t (drive/movement.h)
 *   ANGLE_CORRECTION ... +3  answers a coefficient of the correction of the angle sensor, four bytes, little endian:
 *                c_1, s_1, c_2, s_2 (control/adapt/angle_harmonics.h)
 * Source   docs/howto/commission.md
 * Units    voltages and the share of the first half wave in q15, currents in q15 of the current's base, the angle in
 *          turns times 2^16, delay and time in PWM periods, coefficients in mechanical turns times 2^32
 * Range    the drive checks the values when the pulses are started
 * Errors   the protocol's codes; setting and starting need the key, as they change what the drive does
 * Context  1 kHz task, before the drive's step */
#include <stdbool.h>

#include "comm/xcp_protocol.h"
#include "drive/drive.h"
#include "types/can_frame.h"

/** First byte of a command. */
enum {
    PULSE_SET = 0x10,
    PULSE_START = 0x11,
    PULSE_STATE = 0x12,
    MOVEMENT_STATE = 0x13,
    ANGLE_CORRECTION = 0x14,
    PULSE_ACCESS_LAST = ANGLE_CORRECTION + ANGLE_HARMONICS - 1
};

/** The fields of PULSE_SET, in the order of pulses_config_t. */
enum {
    PULSE_V_D = 0,
    PULSE_D_LOW = 1,
    PULSE_D_HIGH = 2,
    PULSE_V_Q = 3,
    PULSE_Q_LOW = 4,
    PULSE_Q_HIGH = 5,
    PULSE_FIRST = 6,
    PULSE_ANGLE = 7,
    PULSE_DELAY = 8,
    PULSE_REVERSALS = 9,
    PULSE_PERIODS = 10
};

static inline bool pulse_access_is_command(uint8_t command)
{
    return command >= PULSE_SET && command <= PULSE_ACCESS_LAST;
}

/** command: without the protocol's own code, at least one byte. */
xcp_result_t pulse_access_command(drive_t *drive, bool unlocked, const uint8_t *command, uint8_t length);
/** Writes the bytes of the answer after its first one: those that set or start have none. */
void pulse_access_state(const drive_t *drive, uint8_t command, can_frame_t *answer);

#endif
