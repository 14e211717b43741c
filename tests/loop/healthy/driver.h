/* SPDX-License-Identifier: Apache-2.0 */
#ifndef LOOP_HEALTHY_DRIVER_H
#define LOOP_HEALTHY_DRIVER_H
/** A vehicle without any error, its machine, inverter and sensors with the spread of a production, and the commands
 * that it gets millisecond by millisecond. What is driven: manoeuvres.h.
 * Units    in the names
 * Errors   a call that cannot be carried out ends the program
 * Context  simulation only */
#include "dice.h"
#include "vehicle.h"

/** What the vehicle does; a millisecond belongs to one of them. */
typedef enum {
    KIND_SPEED,    /* to another speed, requests and limits jump */
    KIND_LIMITS,   /* limits toggle between nothing, something and all, from frame to frame */
    KIND_KERB,     /* rolling slowly against a kerb that stops the rotor and throws it back */
    KIND_SLIP,     /* wheels that slip and grip again */
    KIND_DC_STEPS, /* the battery voltage steps */
    KIND_BLOCKED,  /* torque while the rotor cannot turn */
    KIND_COMMANDS, /* commands stop, or the drive is disabled, at any speed */
    KINDS
} kind_t;

typedef struct {
    vehicle_t vehicle;
    dice_t dice;
    double torque_max_Nm, speed_max_rpm, vdc_V;
    double rate_rpm;  /* largest change of speed per millisecond */
    double speed_rpm; /* now */
    kind_t kind;
    int ms, loaded_ms, kind_ms[KINDS];
    int next_command_ms; /* when the next command is drawn */
} driver_t;

extern const char *const kind_names[KINDS];

/** A machine of its own, ready for torque at standstill. The largest speed is that of its data; its rate is what (SS-5)
 *  assumes that a rotor can do, at most 40,000 rpm/s, times the share. */
void driver_start(driver_t *driver, uint64_t seed, double rate_share);
/** One millisecond in which the speed changes linearly. False: a monitor has ended the drive. */
bool driver_millisecond(driver_t *driver, double to_rpm);
/** Requests a torque, or none while the drive is not enabled, and keeps it for some time. */
void driver_request(driver_t *driver, double torque_Nm, int ms);
uint32_t driver_faults(const driver_t *driver);
double driver_chance(driver_t *driver);
double driver_between(driver_t *driver, double low, double high);

#endif
