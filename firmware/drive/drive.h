/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_DRIVE_H
#define DRIVE_DRIVE_H
/** One drive: configuration, the state of every stage, and the three activities that run it.
 *   fast_isr  each PWM period: samples to duties (measure, tables, current control, modulation), windows of the
 *     robust identification; with the paper's identification it pends mrai_isr
 *   mrai_isr  below the fast ISR, while the paper's identification is chosen: its law and its torque estimate
 *   task_1khz every bases.periods_per_step periods, below both: torque path, current reference, identification,
 *     supervision
 * Source   docs/architecture.md
 * Units    per unit of motor.bases
 * Errors   latched in faults; the safe state acts in the same period
 * Context  all state lives here: several drives run in one process */
#include <stdbool.h>
#include <stdint.h>

#include "control/adapt/dead_time_trim.h"
#include "control/commission/commission.h"
#include "control/identify/record.h"
#include "drive/exchange.h"
#include "drive/motor.h"
#include "drive/movement.h"
#include "drive/pulses.h"
#include "safety/gain_jump.h"
#include "types/features.h"
#include "types/identification.h"
#include "types/motor_check.h"
#include "types/torque_limits.h"

#if FLUXTRUE_MRAI
#include "drive/mrai/mrai_data.h"
#endif

/** How resistance and flux are identified. */
typedef enum {
    IDENTIFICATION_PAPER = 0, /* model reference adaptive, each period: resistance and magnet flux */
    IDENTIFICATION_ROBUST = 1 /* seven parameters with their uncertainty, each millisecond */
} identification_mode_t;

/** Requested voltage pulses at standstill. */
typedef struct {
    pulses_config_t config;
    uint32_t starts; /* counts up: each count starts these pulses once, or refuses them */
} pulses_request_t;

/** Requests from outside. Writer: one (communication or test). Read by the 1 kHz task, identification_resets also by
 * the MRAI ISR, identification_mode by the fast ISR; every field is aligned and read word by word. */
typedef struct {
    q15_t torque_arbitrated; /* without a bus nothing arbitrates: the requested torque itself */
    dq_q15_t i_ref;          /* current mode only */
    torque_limits_t limits;
    bool enable;
    bool current_mode; /* commissioning: i_ref directly, no torque path */
    bool torque_loop;
    bool identification;
    bool trim; /* the dead-time compensation follows what is identified */
    identification_mode_t identification_mode;
    bool pulses_agreed;    /* else no voltage pulses start, and those that run end */
    bool may_hold;         /* the bridge may switch with enable off where disabled switching would rectify: (SS-12) */
    uint32_t faults;       /* found outside of the drive, by the second level: latched as the drive's own */
    uint32_t fault_resets; /* counts up: each count clears the faults once, if enable is off */
    uint32_t identification_resets; /* counts up: each count resets the identification once */
    uint32_t commissionings; /* counts up: each count measures the inverter's voltage error once, at standstill */
    pulses_request_t pulses;
    movement_request_t movement;
} request_t;

/* X(NAME, value, explanation): named and explained here only. */
#define RUN_STATE_LIST(X) \
    X(OFF, 0, "Switching is disabled.") \
    X(RUN, 1, "Switching is enabled.") \
    X(FAULT, 2, "A fault is latched.")

#define RUN_STATE_VALUE(name, value, text) RUN_STATE_##name = (value),
typedef enum { RUN_STATE_LIST(RUN_STATE_VALUE) } run_state_t;
#undef RUN_STATE_VALUE

/** The active short circuit at the bridge (drive/short_circuit.h). */
typedef enum {
    SHORT_CIRCUIT_LOWER = 0,      /* by the lower switches */
    SHORT_CIRCUIT_UPPER = 1,      /* by the upper ones: the currents show a defect (safety/short_side.h) */
    SHORT_CIRCUIT_LAST_LOWER = 2, /* by the lower ones: the gate drivers have ended it on the upper side */
    SHORT_CIRCUIT_LAST_UPPER = 3, /* by the upper ones: the gate drivers have ended it on the lower side */
    SHORT_CIRCUIT_NONE = 4        /* not possible: the gate drivers have ended it on both sides */
} short_circuit_side_t;

typedef struct {
    short_circuit_side_t side;
    bool holds;                      /* the short circuit is on, as read back */
    uint8_t changes;                 /* of the side, because a switch does not switch on, since the bridge last ran */
    uint8_t waits;                   /* periods with switching disabled that come before it, (SS-21), (SS-30) */
    bool searches_flux;              /* the flux is searched in every second period */
    bool ignores_voltage;            /* the latched over-voltage is a jump of the sensor, which shorts nothing */
    open_switch_state_t open_switch; /* while it waits after a gate fault, psi_0 is the flux a period ago */
} short_circuit_t;

/** Written by the fast ISR alone (drive_raise_fault() is called from its priority). */
typedef struct {
    angle_tracker_state_t angle_tracker;
    current_control_state_t current_control;
    monitor_state_t monitor;
    dq_q15_t u_next;              /* voltage of the next period, which the duties just written will make */
    identify_window_t window;     /* of the robust identification, being summed up */
    uint8_t periods_since_enable; /* saturates at 3: from then on the voltage of the whole last period is known */
    uint8_t silent_steps;         /* in a row in which the task wrote no command */
    uint8_t motor_check;          /* motor_check_t: the first check of the motor data that failed */
    bool is_settled;              /* the bridge runs, no fault, no counter: the next period can take the usual route */
    uint32_t step_end;            /* generation of the sample that completes the present step of the task */
    uint32_t command_seen;        /* generation of the last command that the task wrote in time */
    short_circuit_t short_circuit;
    uint32_t fault_resets;                   /* of the command, as far as carried out */
    volatile uint32_t faults;                /* latched */
    uint32_t fault_period;                   /* generation of the sample in whose period the first of them was raised */
    turning_control_state_t turning_control; /* of a motor that needs it, in place of current_control */
} fast_state_t;

#define COMPENSATION_KNEE_RANGE 16 /* largest ratio of a measured knee to the nominal one */

/** What the modulation adds against dead time and device drop, if it has been measured. */
typedef struct {
    int32_t dead_time; /* q15 */
    int32_t knee_q17;
    int32_t measured; /* not zero: this is not motor.toml's */
} compensation_t;

/** Values that a start has recalled (drive/recall.h). */
typedef struct {
    q15_t first_speed; /* at which updates first agreed with the values, negative while braking; 0: none have yet */
    uint8_t agreed;    /* updates in a row that agree with the values */
    uint8_t trials;    /* updates that could have confirmed them */
    bool unconfirmed;
} recall_t;

/** Leaving torque at speed (drive/switch_off.h). */
typedef struct {
    dq_q15_t from; /* current reference at the start of the transition to the short circuit's currents */
    int32_t i_d;   /* of the short circuit, q15 */
    uint8_t steps; /* of that transition; 0: not active */
    bool holds;    /* enable is off, the torque is held at zero */
} switch_off_t;

/** The 1 kHz task's part of the voltage pulses (drive/pulsing.c). */
typedef struct {
    pulses_phase_t phase;
    pulses_failure_t failure;
    uint32_t starts; /* of the request, as far as seen */
} pulsing_t;

/** Written by the 1 kHz task alone. */
typedef struct {
    torque_limit_state_t torque_limit;
    torque_limit_t allowed;
    torque_loop_state_t torque_loop;
    identify_state_t identify;
    identification_t identification;   /* of the law that is chosen */
    volatile q15_t psi_d_error;        /* of the robust one: the fast ISR copies one half word */
    uint16_t derating;                 /* DERATING_...: reasons for less than the requested torque */
    volatile uint32_t identifications; /* number of steps, by which a lower priority detects an inconsistent copy */
    current_reference_t reference;
    voltage_reserve_state_t voltage_reserve;
    angle_harmonics_state_t angle_harmonics;
    volatile int32_t angle_correction[ANGLE_HARMONICS_PARTS]; /* 2^32 = one turn; the fast ISR reads one word */
    plausibility_state_t plausibility;
    torque_monitor_state_t torque_monitor;
    frozen_angle_state_t frozen_angle;
    gain_jump_state_t gain_jump;
    launch_power_state_t launch_power;
    int32_t monitored_dead_time_q16; /* compensation of the last step, for the monitors of a standing angle */
    commission_state_t commission;
    commission_curve_t inverter; /* voltage error against current, as last measured */
    compensation_t compensation;
    uint32_t commissionings;     /* of the request, as far as seen */
    dq_q15_t i_ref;              /* acts until the next step */
    dq_q15_t psi_ref;            /* tables' flux at the last reference */
    rotating_flux_t rotating;    /* whose rotational voltage the target makes (CC-25) */
    dead_time_trim_state_t trim; /* of the compensation: added while driving */
    q15_t torque_commanded;      /* the limited torque after slew */
    q15_t torque_corrected;      /* after the torque loop: input of the current reference */
    run_state_t run_state;
    uint8_t excessive; /* steps in a row with too much torque in field weakening; saturates */
    bool armed;        /* has run since the safe state was last freewheel: the bridge is powered */
    recall_t recall;
    pulsing_t pulsing;
    movement_state_t movement;
    safe_state_state_t safe_state;
    gate_fault_state_t gate_fault;
    short_side_state_t short_side;
    switch_off_t switch_off;
    uint32_t fault_resets_asked;    /* of the request, as far as seen */
    uint32_t fault_resets;          /* passed on to the fast ISR */
    uint32_t identification_resets; /* of the request, as far as carried out by the task */
    uint32_t periods_seen;          /* of the fast ISR, at the last drive_progress() */
    uint32_t flow;                  /* signal/program_flow.h; its owner begins it in each step */
} task_state_t;

/** What the interrupts have done since they were last asked. */
typedef struct {
    uint32_t periods; /* of the fast ISR */
    bool stalled;     /* an interrupt had work and has completed none of it */
} progress_t;

/** All inputs of one step of the 1 kHz task from higher priorities and from the port, from the same moment. */
typedef struct {
    sample_t sample;
    uint32_t generation;    /* of the sample: its place in the ring */
    dq_q15_t i_last_period; /* measured in the period before the sample's */
    identify_window_t window;
#if FLUXTRUE_MRAI
    mrai_snapshot_t mrai;
#endif
    q15_t psi_d_error;
    uint32_t faults;
    int16_t inverter_dC, winding_dC;
    int16_t known_permille;  /* hal_adc_known_permille() */
    q15_t lag;               /* of the tracked speed, torque_monitor_lag() */
    q15_t i_magnitude;       /* of the sample's current */
    dq_q15_t i_mean, u_mean; /* over the step, drive/step_mean.h */
    bool mrai_is_chosen;     /* the paper's identification, throughout this step */
    bool gates;              /* as read back: the switches follow the duties */
    bool angle_absolute;
    bool shorted; /* drive_is_shorted() */
} snapshot_t;

/** The motor's constants that every PWM period reads, copied: in RAM they need neither a pointer nor an access to
 * flash, and the look-up stays inside its tables if the flash is damaged later. Nothing writes to them. */
typedef struct {
    measure_config_t measure;
    angle_tracker_config_t angle_tracker;
    monitor_config_t monitor;
    flux_table_config_t flux_table;
    uint32_t periods_per_step;
} period_data_t;

#define DATA_CHECK_PERIOD_WORDS ((uint32_t)(sizeof(period_data_t) / sizeof(uint32_t)))
#define DATA_CHECK_PARAMETERS_WORDS ((uint32_t)(sizeof(motor_parameters_t) / sizeof(uint32_t)))
#if FLUXTRUE_MRAI
#define DATA_CHECK_MRAI_WORDS ((uint32_t)(sizeof(mrai_config_t) / sizeof(uint32_t)))
#else
#define DATA_CHECK_MRAI_WORDS 0U
#endif

/** What drive/data_check.h compares the motor data with. Written by the 1 kHz task, and before it starts. */
typedef struct {
    /* Complements, in the order of the data in drive_t. */
    uint32_t period[DATA_CHECK_PERIOD_WORDS];
    uint32_t parameters[DATA_CHECK_PARAMETERS_WORDS];
#if FLUXTRUE_MRAI
    uint32_t mrai_parameters[DATA_CHECK_MRAI_WORDS];
#endif
    uint32_t options; /* of the request */
    const motor_t *motor;
    uintptr_t motor_complement;
    uint32_t at;      /* word to be compared next */
    uint32_t windows; /* command_seen of the fast ISR at the last change of it */
    uint32_t periods; /* generation of the samples then */
    bool damaged;     /* until the next start */
} data_check_t;

/** All of a drive. */
typedef struct {
    const motor_t *motor;          /* constant: in flash on a target */
    period_data_t period;          /* constant: a copy */
    motor_parameters_t parameters; /* live: what calibration, commissioning and the trim change */
#if FLUXTRUE_MRAI
    mrai_config_t mrai_parameters; /* the same of the paper's law */
#endif
    data_check_t data_check;
    request_t request;
    fast_state_t fast;
    volatile q15_t psi_d_error; /* fed forward: the fast ISR copies the robust identification's, else the MRAI ISR's */
    volatile bool held; /* switching stays disabled while the background, which sets this flag, writes the flash */
    task_state_t task;
    window_box_t windows;
    command_box_t commands;
#if FLUXTRUE_MRAI
    mrai_data_t mrai;
#endif
    pulses_config_t pulses;      /* in effect: written by the 1 kHz task while no pulses are active */
    pulses_state_t pulses_state; /* written by the fast ISR alone */
    movement_frame_t frame;      /* of a movement: written by the 1 kHz task */
    movement_angle_t frame_angle;
    sample_box_t samples; /* last: the offset of a member behind its slots would not fit a load instruction */
} drive_t;

void drive_init(drive_t *drive, const motor_t *source);
/** Computes all complements of drive/data_check.h, after the data have been set as a whole. */
void data_check_start(drive_t *drive);
void drive_raise_fault(drive_t *drive, uint32_t fault);
/** Raises FAULT_CONFIG and records its reason: the first check that failed is kept until the next start. MOTOR_CHECK_OK
 * has no effect. From the fast ISR's priority, or before the interrupts start. */
void drive_refuse(drive_t *drive, motor_check_t check);
/** The reason of FAULT_CONFIG; MOTOR_CHECK_OK while there is no such fault. From any priority. */
static inline motor_check_t drive_motor_check(const drive_t *drive)
{
    const motor_check_t check = (motor_check_t)drive->fast.motor_check;
    return (check == MOTOR_CHECK_OK && drive->data_check.damaged) ? MOTOR_CHECK_LIVE_DATA : check;
}

/** What the interrupts have done since the last call. Once per step, from the task or its caller. */
progress_t drive_progress(drive_t *drive);

/** The identified values, for the store that survives a power cycle. Called in the background. */
identify_record_t drive_identified_record(const drive_t *drive);
/** After drive_init(), before the first task; false: the record is refused and nothing has changed. The recalled values
 * act once measured windows have confirmed them (drive/recall.h). */
bool drive_recall(drive_t *drive, const identify_record_t *record);
/** Restarts the identification from its priors. */
void drive_reset_identification(drive_t *drive);

/** The identification's share of the 1 kHz task. */
void drive_identify(drive_t *drive, const snapshot_t *snapshot);

/** The commissioning's share of the 1 kHz task. */
void drive_commission(drive_t *drive, const snapshot_t *snapshot);
/** The voltage pulses' share of the 1 kHz task. */
void drive_pulse(drive_t *drive, const snapshot_t *snapshot);
static inline bool drive_is_pulsing(const drive_t *drive)
{
    return drive->task.pulsing.phase == PULSES_PULSE;
}
/** The movement's share of the 1 kHz task. */
void drive_move(drive_t *drive, const snapshot_t *snapshot);
/** If the command is one in the frame of a movement, changes angle and speed of the sample to those of that frame.
 * Returns the advance per period. Fast ISR, outside the usual route. */
int32_t drive_take_frame(drive_t *drive, const command_t *command, sample_t *sample, int32_t own_step);
/** The currents of a movement act. */
static inline bool drive_is_moving(const drive_t *drive)
{
    return movement_moves(&drive->task.movement);
}
/** A movement is agreed that needs no absolute angle: an encoder's shaft gets past its index by it. */
static inline bool drive_imposes_angle(const drive_t *drive)
{
    return movement_imposes_angle(&drive->task.movement);
}
/** BRIDGE_OFF ... of the next command. */
uint8_t drive_bridge_mode(const drive_t *drive, bool runs);
/** A movement has ended early: switching stays disabled until the movement is no longer requested. */
static inline bool drive_has_ended_movement(const drive_t *drive)
{
    return drive->task.movement.phase == MOVEMENT_PHASE_ENDED;
}
/** Sets the compensation; false: out of range, nothing changed. From the task, or before it starts. */
bool drive_compensate(drive_t *drive, const compensation_t *compensation);
/** The compensated dead time, a share of the period, with the bound that follows from it (MO-11). */
void drive_set_dead_time(motor_parameters_t *p, q15_t dead_time);
/** Moves the identified voltage error into the compensation. From the task. */
void drive_trim(drive_t *drive, q15_t v_dc);
/** Adds a stored trim to the compensation in effect; 0 removes the trim. */
void drive_restore_trim(drive_t *drive, int32_t trim);
/** The active short circuit is on, as read back from the bridge. From any priority. */
static inline bool drive_is_shorted(const drive_t *drive)
{
    return drive->fast.short_circuit.holds;
}
/** Magnitude of the mean of the three phase currents, q15: those of the machine add up to zero. */
static inline int32_t drive_mean_of_phases(const sample_t *sample)
{
    return fx_abs_q31(sample->zero_q28 >> 13);
}
/** False: a current sensor is wrong or saturated. */
static inline bool drive_currents_add_up(const drive_t *drive, const sample_t *sample)
{
    return drive_mean_of_phases(sample) <= drive->motor->monitor.zero_sequence_max;
}
/** Share of the speed base below which the rotor counts as standing. */
#define DRIVE_STANDSTILL Q31(0.002)
static inline bool drive_stands_still(q31_t omega)
{
    return omega <= DRIVE_STANDSTILL && omega >= -DRIVE_STANDSTILL;
}
/** While the drive is held, a request to enable switching waits. Acts from the next step on; from the background. */
static inline void drive_hold(drive_t *drive, bool held)
{
    drive->held = held;
}
/** The angle sensor has found its zero: from the next reading on its angle is larger by this part of a turn, although
 * the rotor has not moved. Only with switching disabled; from the fast ISR's priority. */
static inline void drive_move_angle(drive_t *drive, uint32_t by)
{
    angle_tracker_move(&drive->period.angle_tracker, &drive->fast.angle_tracker, by);
}
/** Current references come from outside the torque path. */
static inline bool drive_bypasses_torque_path(const drive_t *drive)
{
    return drive->request.current_mode || commission_runs(&drive->task.commission) || drive_is_moving(drive);
}

void fast_isr(drive_t *drive);
void task_1khz(drive_t *drive);
#if FLUXTRUE_MRAI
void mrai_isr(drive_t *drive);
#else
/* Empty, so that a port needs no condition. */
static inline void mrai_isr(drive_t *drive)
{
    (void)drive;
}
#endif

#endif
