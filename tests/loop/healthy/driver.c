/* SPDX-License-Identifier: Apache-2.0 */
#include "driver.h"

#include <math.h>

#include "spread.h"

#define RPM 0.10471975511965977
#define RATE_MAX_RPM 40.0      /* per millisecond */
#define BASE_STOPS_IN_MS 250.0 /* (SS-5) */
#define LOADED_SHARE 0.25      /* of the largest torque */
#define ALL_NM 1e6             /* no limit: the largest count of the bus */

const char *const kind_names[KINDS] = {
    [KIND_SPEED] = "speed",       [KIND_LIMITS] = "limits",   [KIND_KERB] = "kerb",         [KIND_SLIP] = "slip",
    [KIND_DC_STEPS] = "dc steps", [KIND_BLOCKED] = "blocked", [KIND_COMMANDS] = "commands",
};

double driver_chance(driver_t *driver)
{
    return dice_chance(&driver->dice);
}

double driver_between(driver_t *driver, double low, double high)
{
    return dice_between(&driver->dice, low, high);
}

void driver_request(driver_t *driver, double torque_Nm, int ms)
{
    vehicle_command_t *command = &driver->vehicle.command;
    const bool accepts = command->enable && driver->vehicle.ecu.ecu.supervisor.state != STATE_READY;
    command->torque_Nm = accepts ? torque_Nm : 0.0;
    driver->next_command_ms = driver->ms + ms;
}

uint32_t driver_faults(const driver_t *driver)
{
    return driver->vehicle.ecu.drive.fast.faults;
}

bool driver_millisecond(driver_t *driver, double to_rpm)
{
    vehicle_ramp_speed(&driver->vehicle, driver->speed_rpm, to_rpm);
    driver->speed_rpm = to_rpm;
    driver->loaded_ms += (fabs(driver->vehicle.torque_Nm) > LOADED_SHARE * driver->torque_max_Nm) ? 1 : 0;
    driver->kind_ms[driver->kind]++;
    driver->ms++;
    return driver_faults(driver) == 0U;
}

void driver_start(driver_t *driver, uint64_t seed, double rate_share)
{
    *driver = (driver_t){.dice = dice_start(seed)};
    vehicle_t *vehicle = &driver->vehicle;
    vehicle_start(vehicle, 0.0);
    spread_draw(vehicle, &driver->dice);
    const motor_t *m = &vehicle->ecu.motor;
    const double base_rpm = (double)m->bases.omega_rad_s / (double)m->angle_tracker.pole_pairs / RPM;
    driver->torque_max_Nm = (double)m->torque_max_Nm;
    driver->speed_max_rpm = vehicle_speed_max_rpm(vehicle);
    driver->vdc_V = sim_get(vehicle->sim, "plant.vdc_V");
    driver->rate_rpm = rate_share * fmin(RATE_MAX_RPM, base_rpm / BASE_STOPS_IN_MS);
    vehicle->command.limit_drive_Nm = ALL_NM;
    vehicle->command.limit_regen_Nm = ALL_NM;
    vehicle_request(vehicle, 0.0);
}
