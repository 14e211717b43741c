/* SPDX-License-Identifier: Apache-2.0 */
#ifndef CALIBRATION_FREEZE_FRAME_H
#define CALIBRATION_FREEZE_FRAME_H
/** Freeze frame: the last 32 steps before the first fault, and the identified values at that time. It is frozen in the
 *   step that reports the fault and released when all faults have been reset; a second fault does not change it.
 *   X(name, base, text): name of calibration/measurement_list.h, taken as S16
 * Source   docs/howto/xcp.md
 * Units    those of the measurements; time since the start
 * Range    signals beyond +-32767 are limited
 * Errors   none
 * Context  1 kHz task, after the measurements; read by tools through XCP, and by a debugger */
#include <stdbool.h>
#include <stdint.h>

#include "calibration/measurements.h"

#define FREEZE_FRAME_SAMPLES 32U

#define FREEZE_FRAME_LIST(X) \
    X(i_d_A, CURRENT, "Current along the magnet") \
    X(i_q_A, CURRENT, "Current across the magnet") \
    X(u_d_V, VOLTAGE, "Voltage of the next period, d") \
    X(u_q_V, VOLTAGE, "Voltage of the next period, q") \
    X(v_dc_V, VOLTAGE, "Measured dc voltage") \
    X(speed_rpm, NONE, "Speed of the rotor") \
    X(torque_commanded_Nm, TORQUE, "Limited torque after slew") \
    X(torque_estimated_Nm, TORQUE, "Estimated air-gap torque")

#define FREEZE_FRAME_SIGNAL(name, base, text) int16_t name[FREEZE_FRAME_SAMPLES];

typedef struct {
    uint32_t now_ms;
    uint32_t time_ms;    /* of the fault; this and the following fields are valid only while frozen */
    uint32_t fault_word; /* the drive's */
    float psi_f_Vs, r_ohm;
    uint16_t ecu_faults;
    uint8_t state;  /* before the fault */
    uint8_t oldest; /* sample; the newest is the one before it */
    uint8_t frozen;
    uint8_t motor_check; /* motor_check_t */
    FREEZE_FRAME_LIST(FREEZE_FRAME_SIGNAL)
} freeze_frame_t;

/** passed_ms: since the last step. True: a fault has come, or all have gone, since the last step. */
bool freeze_frame_step(freeze_frame_t *frame, const measurements_t *now, uint16_t ecu_faults, uint8_t state,
                       uint32_t passed_ms);

#endif
