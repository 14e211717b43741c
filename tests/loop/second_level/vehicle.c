/* SPDX-License-Identifier: Apache-2.0 */
#include "vehicle.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "comm/e2e.h"
#include "hal/host/can_host.h"
#include "vecu/machine_data.h"

#define COMMAND_ID 0x110U
#define COMMAND_DATA_ID 0x1101U
#define ENABLE 0x10U
#define MODE_TORQUE 0x40U
#define CYCLE_MS 10U
#define CAPACITANCE_F 500e-6
#define COUNTS_MAX 10000.0
#define RPM 0.10471975511965977
#define READY_MS 1200
#define RPM_PER_MS 20.0
#define SPEED_TRIP_RESERVE 0.1 /* largest distance from the largest speed to the over-speed trip, as a share of it */

static void check(bool good, const char *what)
{
    if (!good) {
        (void)fprintf(stderr, "%s\n", what);
        exit(2);
    }
}

void vehicle_set(vehicle_t *vehicle, const char *name, double value)
{
    check(sim_set(vehicle->sim, name, value) == SIM_OK, name);
}

/* In counts of the machine's bus, at most the largest that the DBC allows. */
static void put_torque(vehicle_t *vehicle, can_frame_t *frame, unsigned at, double torque_Nm)
{
    const double counts = torque_Nm / (double)vehicle->ecu.motor.bus_scales.torque_Nm;
    const int count = (int)lrint(fmax(-COUNTS_MAX, fmin(COUNTS_MAX, counts)));
    frame->data[at] = (uint8_t)((unsigned)count & 0xFFU);
    frame->data[at + 1U] = (uint8_t)((unsigned)count >> 8 & 0xFFU);
}

static void send(vehicle_t *vehicle)
{
    const vehicle_command_t *command = &vehicle->command;
    can_frame_t frame = {.id = COMMAND_ID, .length = 8};
    frame.data[1] = (uint8_t)(MODE_TORQUE | (command->enable ? ENABLE : 0U));
    put_torque(vehicle, &frame, 2, command->torque_Nm);
    put_torque(vehicle, &frame, 4, command->limit_drive_Nm);
    put_torque(vehicle, &frame, 6, command->limit_regen_Nm);
    e2e_protect(COMMAND_DATA_ID, &vehicle->counter, &frame);
    check(can_host_put(&vehicle->ecu, &frame), "the queue is full");
}

void vehicle_millisecond(vehicle_t *vehicle)
{
    can_frame_t sent;
    if (!vehicle->command.silent && vehicle->ms % CYCLE_MS == 0U) {
        send(vehicle);
    }
    const int periods = (int)vehicle->ecu.drive.motor->bases.periods_per_step;
    check(sim_run(vehicle->sim, periods, &vehicle->torque_Nm, 1) >= 0, "the simulation cannot continue");
    while (can_host_take(&vehicle->ecu, &sent)) {
    }
    vehicle->second_level_found |= vehicle->ecu.drive.request.faults != 0U;
    vehicle->ms++;
}

void vehicle_run(vehicle_t *vehicle, int milliseconds)
{
    for (int n = 0; n < milliseconds; n++) {
        vehicle_millisecond(vehicle);
    }
}

static void start_plant(vehicle_t *vehicle)
{
    const machine_data_t *m = &machine_data;
    const char *const names[1] = {"truth.torque_Nm"};
    vehicle->sim = sim_create_around(&vehicle->ecu);
    check(vehicle->sim != NULL, "out of memory");
    for (const machine_value_t *v = m->values; v->name != NULL; v++) {
        vehicle_set(vehicle, v->name, v->value);
    }
    check(m->nd == 0 || sim_map(vehicle->sim, m->id_A, m->nd, m->iq_A, m->nq, m->psi_d_Vs, m->psi_q_Vs) == SIM_OK,
          "flux map");
    vehicle_set(vehicle, "plant.dc_link_F", CAPACITANCE_F);
    vehicle_set(vehicle, "plant.precharge_s", 0.02);
    vehicle_set(vehicle, "plant.imposed_speed", 1.0);
    check(sim_start(vehicle->sim) == NULL, "plant");
    const int periods = (int)vehicle->ecu.drive.motor->bases.periods_per_step;
    check(sim_record(vehicle->sim, names, 1, periods) == SIM_OK, "record");
}

void vehicle_ramp_speed(vehicle_t *vehicle, double from_rpm, double to_rpm)
{
    check(sim_ramp(vehicle->sim, "plant.speed_rad_s", from_rpm * RPM, to_rpm * RPM) == SIM_OK, "ramp");
    vehicle_millisecond(vehicle);
}

double vehicle_speed_max_rpm(const vehicle_t *vehicle)
{
    const motor_t *m = &vehicle->ecu.motor;
    const double trip = (double)m->plausibility.omega_trip / 32768.0 * (double)m->bases.omega_rad_s;
    return trip / (double)m->angle_tracker.pole_pairs / RPM / (1.0 + SPEED_TRIP_RESERVE);
}

void vehicle_to_speed(vehicle_t *vehicle, double speed_rpm)
{
    const double start_rad_s = sim_get(vehicle->sim, "plant.speed_rad_s");
    const double change_rad_s = speed_rpm * RPM - start_rad_s;
    const int steps = (int)ceil(fabs(change_rad_s) / RPM / RPM_PER_MS);
    for (int n = 0; n < steps; n++) {
        const double from_rpm = (start_rad_s + change_rad_s * n / steps) / RPM;
        vehicle_ramp_speed(vehicle, from_rpm, from_rpm + change_rad_s / steps / RPM);
    }
}

void vehicle_start(vehicle_t *vehicle, double speed_rpm)
{
    fluxtrue_init(&vehicle->ecu);
    can_host_attach(&vehicle->ecu);
    vehicle->command = (vehicle_command_t){.limit_drive_Nm = 1000.0, .limit_regen_Nm = 1000.0};
    vehicle->ms = 0;
    vehicle->second_level_found = false;
    vehicle->counter = 0;
    start_plant(vehicle);
    for (int n = 0; n < READY_MS && vehicle->ecu.ecu.supervisor.state != STATE_READY; n++) {
        vehicle_millisecond(vehicle);
    }
    check(vehicle->ecu.ecu.supervisor.state == STATE_READY, "the ECU did not reach the state ready");
    vehicle_to_speed(vehicle, speed_rpm);
}

void vehicle_stop(vehicle_t *vehicle)
{
    sim_destroy(vehicle->sim);
    vehicle->sim = NULL;
}

void vehicle_request(vehicle_t *vehicle, double torque_Nm)
{
    vehicle->command.enable = true;
    vehicle->command.torque_Nm = 0.0;
    vehicle_run(vehicle, 25);
    vehicle->command.torque_Nm = torque_Nm;
}
