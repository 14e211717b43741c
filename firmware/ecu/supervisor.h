/* SPDX-License-Identifier: Apache-2.0 */
#ifndef ECU_SUPERVISOR_H
#define ECU_SUPERVISOR_H
/** The state machine of the inverter: which board outputs are on, and when switching may be enabled.
 *   In every step the present conditions are collected in one word. The first row of supervisor_table that begins in
 *   the present state and whose conditions all hold is taken. Outputs depend on the state alone.
 *   Except for a trip, run and derate end only when a ramp has brought the torque to zero.
 *   Enable is accepted at a rising edge in a frame of the bus, in state ready, with no torque requested, no fault,
 *   plausible sensors, an absolute angle or an imposed one, and the dc voltage in range; otherwise it is refused and
 *   the reason is transmitted.
 * Source   docs/howto/can.md, whose drawing is made from the same table
 * Units    us of true time; the longest time-out is 5 s
 * Range    every combination of inputs
 * Errors   its own faults are latched in faults (ecu_fault_t) until a reset after their cause has gone
 * Context  1 kHz task; pure decisions */
#include <stdbool.h>
#include <stdint.h>

/* X(NAME, value or bit, explanation): named and explained here only; the bus has the names in lower case. */
#define ECU_STATE_LIST(X) \
    X(INIT, 0, "After start-up, until the self-test has passed.") \
    X(STANDBY, 1, "The dc link is off; mode torque charges it.") \
    X(PRECHARGE, 2, "The dc link is being charged.") \
    X(READY, 3, "The dc link is charged; enable is accepted. At speed the torque may be held at zero.") \
    X(RUN, 4, "Switching is enabled and the torque follows the request.") \
    X(DERATE, 5, "As run, with the torque limited for the reason that DeratingReason names.") \
    X(SAFE_STATE, 6, "A fault tripped the drive, which applies its safe state; the machine turns fast.") \
    X(FAULT, 7, "A fault is latched; a reset is accepted.") \
    X(DISCHARGE, 8, "The dc link is being discharged.")

/* Latched by the supervisor: the bits of EcuFaults. */
#define ECU_FAULT_LIST(X) \
    X(PROTECTION, 0, "3 of the last 10 torque commands were bad.") \
    X(PRECHARGE, 1, "Precharge took too long.") \
    X(DISCHARGE, 2, "Discharge took too long.") \
    X(GATE, 3, "The gate driver reports a fault.") \
    X(TASK, 4, "The 1 kHz task came late 3 times in a row.") \
    X(STALL, 5, "An interrupt stopped for 3 steps of the task.") \
    X(SELF_TEST, 6, "The self-test did not pass in time after start-up.") \
    X(BATTERY_VOLTAGE, 7, "The dc voltage is not the battery's after precharge or with the contactor closed.") \
    X(GATE_DISABLE, 8, "Switching read back as enabled in the test of the shut-off paths at start.") \
    X(GATE_SUPPLY, 9, "The gate supply does not follow its switch in the test at start, or is off when needed.") \
    X(WATCHDOG, 10, "The external watchdog does not switch the gate supply in the test at start.")

#define REFUSED_LIST(X) \
    X(NONE, 0, "Nothing was refused since the last enable that was granted.") \
    X(TORQUE_REQUEST_NOT_ZERO, 1, "Enable with a requested torque that is not zero.") \
    X(FAULT, 2, "Enable while a fault is latched.") \
    X(DC_VOLTAGE_OUT_OF_RANGE, 3, "Enable with a dc voltage out of its range.") \
    X(SENSOR_IMPLAUSIBLE, 4, "Enable while the measured currents are implausible.") \
    X(NOT_READY, 5, "Enable in another state than ready, or in another mode than torque.") \
    X(MODE_LOCKED, 6, "Enable in the current mode for commissioning, which is locked on the bus.") \
    X(COMMAND_TIMED_OUT, 7, "The command was lost while the drive was enabled.") \
    X(RESET_WHILE_ENABLED, 8, "Reset while enable was on, or in another state than fault.") \
    X(ANGLE_NOT_ABSOLUTE, 9, "Enable before the angle sensor has found the absolute angle.") \
    X(MOVEMENT_ENDED, 10, "A movement for commissioning has ended early; Movement none must come first.")

#define STATE_VALUE(name, value, text) STATE_##name = (value),
#define ECU_FAULT_BIT(name, bit, text) ECU_FAULT_##name = 1U << (bit),
#define REFUSED_VALUE(name, value, text) REFUSED_##name = (value),
// NOLINTNEXTLINE(cert-int09-c,readability-enum-initial-value): STATES is their number
typedef enum { ECU_STATE_LIST(STATE_VALUE) STATES } ecu_state_t;
#define STATES_AND_END (STATES + 1)
typedef enum { ECU_FAULT_LIST(ECU_FAULT_BIT) } ecu_fault_t;
typedef enum { REFUSED_LIST(REFUSED_VALUE) } refused_t;
#undef STATE_VALUE
#undef ECU_FAULT_BIT
#undef REFUSED_VALUE

/** Conditions of a transition, one bit each. */
typedef enum {
    WHEN_SELF_TEST_PASSED = 1U << 0,
    WHEN_TRIPPED = 1U << 1, /* a fault that has disabled switching or must do so at once */
    WHEN_FAULTED = 1U << 2, /* any latched fault */
    WHEN_HEALTHY = 1U << 3, /* none */
    WHEN_ON = 1U << 4,      /* a live command asks for mode torque */
    WHEN_OFF = 1U << 5,     /* a live command asks for mode off */
    WHEN_CHARGED = 1U << 6, /* dc voltage in range, settled, and the battery's where that is known */
    WHEN_DISCHARGED = 1U << 7,
    WHEN_NOT_DISCHARGED = 1U << 8, /* its opposite, unless discharge has failed */
    WHEN_ENABLED = 1U << 9,        /* enable was asked for and granted */
    WHEN_STOPPED = 1U << 10,       /* not enabled and no torque left */
    WHEN_NO_TORQUE = 1U << 11,
    WHEN_DERATED = 1U << 12,
    WHEN_FULL = 1U << 13,            /* not derated */
    WHEN_SLOW = 1U << 14,            /* at the known speed the machine cannot charge the dc link */
    WHEN_DISCHARGE_FAILED = 1U << 15 /* discharging took too long */
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
    bool dc_near_battery, dc_contradicts;  /* ecu/battery_voltage.h; near also while the battery's is not known */
    bool sensors_plausible, angle_absolute;
    bool angle_imposed; /* by a movement for commissioning, which needs no absolute angle */
    bool slow;
    bool derated;
    bool movement_ended; /* drive/movement.h: early */
    bool gate_fault, task_late, stalled;
    bool shut_off_tested;     /* every path that shuts off the torque has been tested */
    uint16_t shut_off_faults; /* ecu/shut_off.h */
    uint32_t elapsed_us;      /* since the last step */
} supervisor_in_t;

typedef struct {
    ecu_state_t state;
    refused_t refused;
    uint16_t faults;
    uint32_t us; /* in this state, including the present step; saturates */
    uint32_t drive_faults_seen;
    uint32_t resets;              /* granted, counted up */
    uint8_t reset_pending;        /* steps until the drive has carried out a reset */
    bool enable_seen, reset_seen; /* as the last live command had them */
    bool enabled;
    uint8_t first_fault, fault_count; /* first: 1 ... 32 drive faults, 33 ... ecu faults */
    uint8_t refused_count;
} supervisor_t;

extern const transition_t supervisor_table[];
/** The first row of each state, and behind the last state the number of rows. */
extern const uint8_t supervisor_first[STATES_AND_END];
extern const state_outputs_t supervisor_outputs[STATES];

void supervisor_step(supervisor_t *supervisor, const supervisor_in_t *in);

#endif
