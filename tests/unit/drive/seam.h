/* SPDX-License-Identifier: Apache-2.0 */
#ifndef UNIT_DRIVE_SEAM_H
#define UNIT_DRIVE_SEAM_H
/** The mocked hardware of one drive: the values that it delivers, and a log of the calls that it received.
 *   The log holds one letter per call: a adc, r angle (resolver), w duties, + enable, - disable, p pend. */
#include "drive/drive.h"

typedef struct {
    motor_t motor; /* a copy of the compiled-in motor, which a test may change */
    adc_counts_t counts;
    uint32_t theta_m;
    bool angle_unknown; /* an encoder before its index */
    int16_t winding_dC, inverter_dC, known_permille;
    duty_t duty;
    bool gates;
    bool gates_blocked; /* the gate drivers block: the bridge does not switch although it is enabled */
    int pended;
    char log[64];
} seam_t;

extern seam_t seam;
extern drive_t drive;

/* A new drive for the compiled-in motor without current, at 350 V and standstill; all mocks answer from `seam`. */
void seam_start(void);
/* Counts of a 12-bit converter for amperes and volts. */
void seam_current(double a_A, double b_A, double c_A);
void seam_voltage(double v_dc_V);
/* One PWM period: the fast ISR, then the MRAI ISR if it was pended, and in every tenth period the task. */
void seam_period(void);
void seam_periods(int count);
/* Enables and runs the task once: the next period switches. */
void seam_run(void);

#endif
