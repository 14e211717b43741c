/* SPDX-License-Identifier: Apache-2.0 */
#ifndef LOOP_SECOND_LEVEL_VEHICLE_H
#define LOOP_SECOND_LEVEL_VEHICLE_H
/** An ECU on a bus with its simulated machine at an imposed speed, and the vehicle that commands it, millisecond by
 * millisecond. One instance.
 * Units    in the names
 * Errors   a call that cannot be carried out ends the program
 * Context  simulation only */
#include "hal/host/instance.h"
#include "loop/runner/sim.h"

typedef struct {
    bool enable, silent; /* silent: no command is sent */
    double torque_Nm, limit_drive_Nm, limit_regen_Nm;
} vehicle_command_t;

typedef struct {
    fluxtrue_t ecu;
    sim_t *sim;
    vehicle_command_t command;
    uint32_t ms;
    uint8_t counter;
    bool second_level_found; /* the second level has reported a fault */
    double torque_Nm;        /* of the shaft, mean of the last millisecond */
} vehicle_t;

/** A new ECU and plant, charged and ready for torque, at a speed. */
void vehicle_start(vehicle_t *vehicle, double speed_rpm);
/** Changes the speed of the machine at 20,000 rpm/s. */
void vehicle_to_speed(vehicle_t *vehicle, double speed_rpm);
/** One millisecond in which the speed changes linearly from one value to the other. */
void vehicle_ramp_speed(vehicle_t *vehicle, double from_rpm, double to_rpm);
/** The over-speed trip less its largest reserve: at most the largest speed of the machine. */
double vehicle_speed_max_rpm(const vehicle_t *vehicle);
void vehicle_stop(vehicle_t *vehicle);
void vehicle_set(vehicle_t *vehicle, const char *name, double value);
void vehicle_millisecond(vehicle_t *vehicle);
void vehicle_run(vehicle_t *vehicle, int milliseconds);
/** Enables with zero torque and the present limits, and requests the torque 25 ms later. */
void vehicle_request(vehicle_t *vehicle, double torque_Nm);

#endif
