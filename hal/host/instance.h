/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_HOST_INSTANCE_H
#define HAL_HOST_INSTANCE_H
/** One software-in-the-loop drive: the firmware's drive and the port's registers.
 * Source   docs/howto/software-in-the-loop.md
 * Context  private to hal/host and to the virtual ECU, which gives the instance a fixed address */
#include <stdbool.h>
#include <stddef.h>

#include "ecu/ecu.h"
#include "hal/board.h"
#include "hal/host/angle_source.h"
#include "hal/host/external_watchdog.h"
#include "hal/host/fluxtrue.h"
#include "hal/host/nvm_host.h"
#include "hal/host/spin_limit.h"
#include "storage/memory.h"
#include "types/samples.h"

#define CAN_HOST_QUEUE 64U

typedef struct {
    can_frame_t frames[CAN_HOST_QUEUE];
    uint32_t put, taken; /* counted up */
} can_queue_t;

typedef struct {
    can_queue_t received, sent;
    uint32_t lost, bus_off;
    bool output[BOARD_OUTPUTS];
    bool gate_fault;                      /* the gate drivers' line */
    bool short_circuit_blocked;           /* by the gate drivers in the last period: a pulse of the line */
    bool fault_latched;                   /* by the timer, which disables switching */
    bool gate_fault_told;                 /* to the drive: once until switching is enabled again */
    bool gate_fault_for_board;            /* not read yet */
    bool winding_broken, inverter_broken; /* sensor defective */
    double inverter_C;
    double known_share; /* what the converters read of a known voltage; 1: right */
    bool watchdog_started;
    uint32_t watchdog_services;
    external_watchdog_t external_watchdog;
    bool angle_unknown; /* the sensor has not found the absolute angle */
    bool gates_stuck;   /* reads back as enabled */
    bool task_stuck;    /* the 1 kHz task does not run any more */
} host_board_t;

struct fluxtrue {
    union {
        drive_t drive; /* also without a bus */
        ecu_t ecu;     /* begins with the drive */
    };
    const motor_t *data; /* of the machine, as generated */
    motor_t motor;       /* the drive's: without a machine its slow monitors are disabled */
    bool on_bus;         /* ecu_task_1khz() runs instead of task_1khz() */
    host_board_t board;
    nvm_host_t nvm;
    memory_t memory;
    adc_counts_t counts;
    uint32_t theta_m;
    angle_source_t angle_source;
    spin_limit_t spin_limit;
    double winding_C;
    duty_t duty;
    bool gates;
    bool mrai_pending;
    uint32_t periods;           /* since creation: every periods_per_step-th runs the 1 kHz task */
    double torque_requested_Nm; /* as set, without a bus */
};

_Static_assert(offsetof(ecu_t, drive) == 0, "the drive must be where a port without a bus expects it");

/** As fluxtrue_create() leaves it, in memory of the caller's. */
void fluxtrue_init(fluxtrue_t *instance);
/** The same with other motor data than those compiled in; they outlive the instance. */
void fluxtrue_init_with(fluxtrue_t *instance, const motor_t *data);

#endif
