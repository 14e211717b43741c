/* SPDX-License-Identifier: Apache-2.0 */
#include "manoeuvres.h"

#include <math.h>

#define SPEED_SHARE 0.9    /* of the largest speed */
#define KERB_SHARE 0.04    /* of the largest speed: rolling */
#define SLIP_SHARE 0.2     /* of the largest speed, above that of the road */
#define FULL_LOAD 0.25     /* share of the commands with the largest torque */
#define ENABLED_AFTER_MS 60

static double either_sign(driver_t *driver)
{
    return driver_chance(driver) < 0.5 ? -1.0 : 1.0;
}

static double any_limit_Nm(driver_t *driver)
{
    const double kind = driver_chance(driver);
    return kind < 0.4 ? 10.0 * driver->torque_max_Nm
                      : (kind < 0.6 ? 0.0 : driver_between(driver, 0.0, driver->torque_max_Nm));
}

static void draw_limits(driver_t *driver)
{
    driver->vehicle.command.limit_drive_Nm = any_limit_Nm(driver);
    driver->vehicle.command.limit_regen_Nm = any_limit_Nm(driver);
}

static void draw_command(driver_t *driver)
{
    const double share = driver_chance(driver) < FULL_LOAD ? either_sign(driver) : driver_between(driver, -1.0, 1.0);
    if (driver_chance(driver) < 0.3) {
        draw_limits(driver);
    }
    driver_request(driver, share * driver->torque_max_Nm, (int)driver_between(driver, 10.0, 150.0));
}

/* Requests this share of the torque for the whole manoeuvre, without limits. */
static void request_share(driver_t *driver, double share)
{
    driver->vehicle.command.limit_drive_Nm = 10.0 * driver->torque_max_Nm;
    driver->vehicle.command.limit_regen_Nm = 10.0 * driver->torque_max_Nm;
    driver_request(driver, share * driver->torque_max_Nm, 1000000);
}

/* A millisecond; a command that has ended is followed by another one. */
static bool pass(driver_t *driver, double to_rpm)
{
    if (driver->ms >= driver->next_command_ms) {
        draw_command(driver);
    }
    return driver_millisecond(driver, to_rpm);
}

static bool to_speed(driver_t *driver, double rpm, double rate_rpm)
{
    bool drives = true;
    while (drives && driver->speed_rpm != rpm) {
        const double change = rpm - driver->speed_rpm;
        drives = pass(driver, fabs(change) <= rate_rpm ? rpm : driver->speed_rpm + copysign(rate_rpm, change));
    }
    return drives;
}

static bool hold(driver_t *driver, double least_ms, double most_ms)
{
    const int until_ms = driver->ms + (int)driver_between(driver, least_ms, most_ms);
    bool drives = true;
    while (drives && driver->ms < until_ms) {
        drives = pass(driver, driver->speed_rpm);
    }
    return drives;
}

/* Of the road, sometimes standstill. */
static double any_speed_rpm(driver_t *driver)
{
    const double share = driver_chance(driver) < 0.2 ? 0.0 : driver_between(driver, -SPEED_SHARE, SPEED_SHARE);
    return share * driver->speed_max_rpm;
}

static double any_rate_rpm(driver_t *driver)
{
    const double share = driver_chance(driver) < 0.3 ? 1.0 : driver_between(driver, 0.025, 1.0);
    return share * driver->rate_rpm;
}

static bool change_speed(driver_t *driver)
{
    const double rpm = any_speed_rpm(driver);
    return to_speed(driver, rpm, any_rate_rpm(driver)) && hold(driver, 10.0, 200.0);
}

static bool toggle_limits(driver_t *driver)
{
    const int toggles = (int)driver_between(driver, 5.0, 30.0);
    bool drives = true;
    request_share(driver, either_sign(driver) * driver_between(driver, 0.3, 1.0));
    for (int n = 0; n < toggles && drives; n++) {
        draw_limits(driver);
        drives = hold(driver, 10.0, 30.0);
    }
    return drives;
}

/* With torque towards the kerb; the rotor is thrown back by up to half of its speed and rolls on. */
static bool hit_kerb(driver_t *driver)
{
    const double rolling_rpm = driver_between(driver, -KERB_SHARE, KERB_SHARE) * driver->speed_max_rpm;
    const double rate_rpm = driver->rate_rpm * driver_between(driver, 0.25, 1.0);
    const double back_rpm = -rolling_rpm * driver_between(driver, 0.0, 0.5);
    if (!to_speed(driver, rolling_rpm, driver->rate_rpm)) {
        return false;
    }
    request_share(driver, copysign(driver_between(driver, 0.1, 1.0), rolling_rpm));
    return hold(driver, 20.0, 100.0) && to_speed(driver, 0.0, rate_rpm) && hold(driver, 0.0, 20.0) &&
           to_speed(driver, back_rpm, rate_rpm) && to_speed(driver, 0.0, rate_rpm) && hold(driver, 20.0, 300.0) &&
           to_speed(driver, rolling_rpm, rate_rpm) && hold(driver, 20.0, 100.0);
}

static bool slip(driver_t *driver)
{
    const double road_rpm = driver_between(driver, -0.7, 0.7) * driver->speed_max_rpm;
    const int times = (int)driver_between(driver, 2.0, 6.0);
    bool drives = to_speed(driver, road_rpm, driver->rate_rpm);
    request_share(driver, either_sign(driver) * driver_between(driver, 0.3, 1.0));
    for (int n = 0; n < times && drives; n++) {
        const double slip_rpm = driver_between(driver, -SLIP_SHARE, SLIP_SHARE) * driver->speed_max_rpm;
        drives = to_speed(driver, road_rpm + slip_rpm, driver->rate_rpm) && hold(driver, 0.0, 50.0) &&
                 to_speed(driver, road_rpm, any_rate_rpm(driver)) && hold(driver, 0.0, 50.0);
    }
    return drives;
}

static bool step_dc(driver_t *driver)
{
    const int times = (int)driver_between(driver, 3.0, 10.0);
    bool drives = true;
    for (int n = 0; n < times && drives; n++) {
        vehicle_set(&driver->vehicle, "plant.vdc_V", driver->vdc_V * driver_between(driver, 0.9, 1.08));
        drives = hold(driver, 20.0, 100.0);
    }
    return drives;
}

static bool block(driver_t *driver)
{
    if (!to_speed(driver, 0.0, any_rate_rpm(driver))) {
        return false;
    }
    const double share = either_sign(driver) * driver_between(driver, 0.3, 1.0);
    request_share(driver, share);
    if (!hold(driver, 100.0, 800.0)) {
        return false;
    }
    request_share(driver, driver_chance(driver) < 0.5 ? -share : 0.5 * share);
    return hold(driver, 50.0, 300.0);
}

static bool interrupt_commands(driver_t *driver)
{
    vehicle_command_t *command = &driver->vehicle.command;
    const bool silent = driver_chance(driver) < 0.5;
    command->silent = silent;
    command->enable = silent;
    driver_request(driver, command->torque_Nm, 1000000);
    const bool drives = hold(driver, 10.0, 200.0);
    command->silent = false;
    command->enable = true;
    driver_request(driver, 0.0, ENABLED_AFTER_MS);
    return drives && hold(driver, ENABLED_AFTER_MS, ENABLED_AFTER_MS);
}

bool manoeuvre(driver_t *driver)
{
    static bool (*const drive[KINDS])(driver_t *) = {
        [KIND_SPEED] = change_speed,
        [KIND_LIMITS] = toggle_limits,
        [KIND_KERB] = hit_kerb,
        [KIND_SLIP] = slip,
        [KIND_DC_STEPS] = step_dc,
        [KIND_BLOCKED] = block,
        [KIND_COMMANDS] = interrupt_commands,
    };
    driver->kind = (kind_t)(driver_chance(driver) * (double)KINDS);
    driver->next_command_ms = driver->ms;
    return drive[driver->kind](driver);
}
