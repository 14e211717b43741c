/* SPDX-License-Identifier: Apache-2.0 */
#ifndef ECU_SUPERVISOR_H
#define ECU_SUPERVISOR_H
/** The state machine of the inverter: which board outputs are on, and when switching may be enabled.
 *   In every step the present conditions are collected in one word. The first row of supervisor_table that begins in
 *   the present state and whose conditions all hold is taken. Outputs depend on the state alone.
 *   Except for a trip, run and derate end only when a ramp has brought the torque to zero.
 *   Enable is accepted at a rising edge in a frame of the bus, in state ready, with no torque requested, no fault,
 *   plausible sensors and the dc voltage in range; otherwise it is refused and the reason is transmitted.
 * Source   docs/howto/can.md, whose drawing is made from the same table
 * Units    us of true time; the longest time-out is 5 s
 * Errors   its own faults are latched in faults (ecu_fault_t) until a reset after their cause has gone
 * Context  1 kHz task; pure decisions */
#include <stdbool.h>
#include <stdint.h>

typedef enum {
    STATE_INIT = 0,
    STATE_STANDBY = 1,
    STATE_PRECHARGE = 2,
    STATE_READY = 3,
    STATE_RUN = 4,
    STATE_DERATE = 5,
    STATE_SAFE = 6,
    STATE_FAULT = 7,
    STATE_DISCHARGE = 8,
    STATES = 9
} ecu_state_t;

/** Latched by the supervisor, bits of EcuFaults on the bus. */
typedef enum {
    ECU_FAULT_PROTECTION = 1U << 0, /* 3 of 10 commands bad */
    ECU_FAULT_PRECHARGE = 1U << 1,  /* dc voltage not reached in time */
    ECU_FAULT_DISCHARGE = 1U << 2,  /* dc link not discharged in time */
    ECU_FAULT_GATE = 1U << 3,       /* gate driver */
    ECU_FAULT_TASK = 1U << 4,       /* the 1 kHz task came late 3 times in a row */
    ECU_FAULT_STALL = 1U << 5,      /* an interrupt stood still */
    ECU_FAULT_SELF_TEST = 1U << 6   /* no plausible measurement in time after start-up */
} ecu_fault_t;

typedef enum {
    REFUSED_NOTHING = 0,
    REFUSED_TORQUE_NOT_ZERO = 1,
    REFUSED_FAULT = 2,
    REFUSED_DC_VOLTAGE = 3,
    REFUSED_SENSOR = 4,
    REFUSED_NOT_READY = 5,
    REFUSED_MODE = 6,
    REFUSED_TIMED_OUT = 7,
    REFUSED_RESET = 8
} refused_t;

/** Conditions of a transition, one bit each. */
typedef enum {
    WHEN_SELF_TEST_PASSED = 1U << 0,
    WHEN_TRIPPED = 1U << 1, /* a fault that has disabled switching or must do so at once */
    WHEN_FAULTED = 1U << 2, /* any latched fault */
    WHEN_HEALTHY = 1U << 3, /* none */
    WHEN_ON = 1U << 4,      /* a live command asks for mode torque */
    WHEN_OFF = 1U << 5,     /* a live command asks for mode off */
    WHEN_CHARGED = 1U << 6, /* dc voltage in range and settled */
    WHEN_DISCHARGED = 1U << 7,
    WHEN_DANGEROUS = 1U << 8, /* dc link charged, and discharging has not failed */
    WHEN_ENABLED = 1U << 9,   /* enable was asked for and granted */
    WHEN_STOPPED = 1U << 10,  /* not enabled and no torque left */
    WHEN_NO_TORQUE = 1U << 11,
    WHEN_DERATED = 1U << 12,
    WHEN_FULL = 1U << 13,           /* not derated */
    WHEN_SLOW = 1U << 14,           /* back-EMF below the voltage that is safe to touch: it cannot charge the dc link */
    WHEN_NOT_DISCHARGING = 1U << 15 /* discharging took too long */
} supervisor_when_t;

typedef struct {
    ecu_state_t from;
    uint32_t when; /* all of them */
    ecu_state_t to;
} transition_t;

typedef struct {
    bool precharge, contactor, discharge, gate_driver, run;
} state_outputs_t;

typedef struct {
    uint32_t drive_faults;
    bool alive;  /* a command was accepted in time */
    bool failed; /* command protection: 3 of 10 bad */
    bool torque_mode, current_mode;
    bool enable, reset;
    bool torque_requested_is_zero, torque_arbitrated_is_zero;
    bool dc_in_range, dc_settled, dc_safe; /* safe: below the voltage that is safe to touch */
    bool sensors_plausible;
    bool slow;
    bool derated;
    bool gate_fault, task_late, stalled;
    uint32_t elapsed_us; /* since the last step */
} supervisor_in_t;

typedef struct {
    ecu_state_t state;
    uint32_t us; /* in this state, including the present step; saturates */
    uint16_t faults;
    uint8_t first_fault, fault_count; /* first: 1 ... 32 drive faults, 33 ... ecu faults */
    uint32_t drive_faults_seen;
    uint8_t reset_pending;        /* steps until the drive has carried out a reset */
    bool enable_seen, reset_seen; /* as the last live command had them */
    bool enabled;
    refused_t refused;
    uint8_t refused_count;
    uint32_t resets; /* granted, counted up */
} supervisor_t;

extern const transition_t supervisor_table[];
extern const uint32_t supervisor_transitions;
extern const state_outputs_t supervisor_outputs[STATES];

void supervisor_step(supervisor_t *supervisor, const supervisor_in_t *in);

#endif
