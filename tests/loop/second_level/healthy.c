/* SPDX-License-Identifier: Apache-2.0 */
/* Driving without any error, with the spread of machines and inverters in production:
 *   second_level_healthy <seconds> <seed>
 * The speed changes by up to 40,000 rpm/s, requests and limits jump, commands stop, the battery voltage steps. The
 * second level may report no fault; faults of other monitors end a drive and are counted. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "vecu/machine_data.h"
#include "vehicle.h"

#define DRIVE_MS 3000
#define RPM_PER_MS_MAX 40.0
#define DEGREE 0.017453292519943295

static vehicle_t vehicle;
static uint64_t state;

/* xorshift64*, 0 ... 1 */
static double chance(void)
{
    state ^= state >> 12;
    state ^= state << 25;
    state ^= state >> 27;
    return (double)((state * 0x2545F4914F6CDD1DULL) >> 11) / 9007199254740992.0;
}

static double between(double low, double high)
{
    return low + (high - low) * chance();
}

static void scale(const char *name, double low, double high)
{
    vehicle_set(&vehicle, name, sim_get(vehicle.sim, name) * between(low, high));
}

static void draw_plant(void)
{
    const double full_scale_A = sim_get(vehicle.sim, "plant.current_full_scale_A");
    scale("plant.lq_scale", 0.9, 1.1);
    scale("plant.magnet_scale", 0.8, 1.05);
    scale("plant.r_ohm_20", 0.9, 1.1);
    vehicle_set(&vehicle, "plant.winding_C", between(-20.0, 150.0));
    scale("plant.dead_time_s", 0.8, 1.2);
    scale("plant.vdc_gain", 0.99, 1.01);
    scale("plant.current_gain_a", 0.99, 1.01);
    scale("plant.current_gain_b", 0.99, 1.01);
    scale("plant.current_gain_c", 0.99, 1.01);
    vehicle_set(&vehicle, "plant.current_noise_A_rms", 0.002 * full_scale_A);
    vehicle_set(&vehicle, "plant.angle_offset_rad", between(-0.5, 0.5) * DEGREE);
}

static double torque_max_Nm;
static double speed_max_rpm;
static double vdc_V;

/* Draws the next command of the vehicle. */
static void draw_command(void)
{
    vehicle_command_t *command = &vehicle.command;
    const double kind = chance();
    command->silent = kind < 0.01;
    command->enable = kind > 0.03;
    command->torque_Nm = between(-1.0, 1.0) * torque_max_Nm;
    if (!command->enable || vehicle.ecu.ecu.supervisor.state == STATE_READY) {
        command->torque_Nm = 0.0;
    }
    if (chance() < 0.3) {
        command->limit_drive_Nm = chance() < 0.5 ? 1000.0 : between(0.0, torque_max_Nm);
        command->limit_regen_Nm = chance() < 0.5 ? 1000.0 : between(0.0, torque_max_Nm);
    }
    if (chance() < 0.05) {
        vehicle_set(&vehicle, "plant.vdc_V", vdc_V * between(0.9, 1.08));
    }
}

/* Drives to another speed, up to 0.9 of the largest and sometimes standstill, at up to 40,000 rpm/s. */
static void drive_once(int *ms)
{
    const double now_rpm = sim_get(vehicle.sim, "plant.speed_rad_s") * 30.0 / 3.141592653589793;
    const double to_rpm = chance() < 0.2 ? 0.0 : between(-0.9, 0.9) * speed_max_rpm;
    const double rate = chance() < 0.3 ? RPM_PER_MS_MAX : between(1.0, RPM_PER_MS_MAX);
    const int steps = (int)fmax(ceil(fabs(to_rpm - now_rpm) / rate), between(10.0, 200.0));
    int next = 0;
    for (int n = 0; n < steps; n++, (*ms)++) {
        if (n == next) {
            draw_command();
            next = n + (int)between(10.0, 150.0);
        }
        vehicle_ramp_speed(&vehicle, now_rpm + (to_rpm - now_rpm) * n / steps,
                           now_rpm + (to_rpm - now_rpm) * (n + 1) / steps);
        if (vehicle.ecu.drive.fast.faults != 0U) {
            return;
        }
    }
}

int main(int argc, char **argv)
{
    if (argc != 3) {
        (void)fprintf(stderr, "usage: second_level_healthy <seconds> <seed>\n");
        return 2;
    }
    const double seconds = strtod(argv[1], NULL);
    const uint64_t seed = strtoull(argv[2], NULL, 10);
    int faulted = 0;
    int others = 0;
    double driven_s = 0.0;
    for (uint64_t n = 0; driven_s < seconds; n++) {
        int ms = 0;
        state = (seed + n) * 0x9E3779B97F4A7C15ULL + 1ULL;
        vehicle_start(&vehicle, 0.0);
        draw_plant();
        torque_max_Nm = (double)vehicle.ecu.motor.torque_max_Nm;
        speed_max_rpm = vehicle_speed_max_rpm(&vehicle);
        vdc_V = sim_get(vehicle.sim, "plant.vdc_V");
        vehicle_request(&vehicle, 0.0);
        while (ms < DRIVE_MS && vehicle.ecu.drive.fast.faults == 0U) {
            drive_once(&ms);
        }
        const uint32_t faults = vehicle.ecu.drive.fast.faults;
        if (faults != 0U) {
            const second_level_t *level = &vehicle.ecu.ecu.second_level;
            printf("drive %d: faults 0x%x after %d ms, at %.0f rpm, requested %.1f N.m, at the shaft %.1f; own torque "
                   "%.1f, permitted -%.1f ... %.1f, second level %d\n",
                   (int)n, (unsigned)faults, ms, sim_get(vehicle.sim, "truth.speed_rpm"), vehicle.command.torque_Nm,
                   vehicle.torque_Nm, level->mean_q8 / 256.0 / 32768.0 * (double)vehicle.ecu.motor.bases.torque_Nm,
                   level->permitted.negative.bound / 32768.0 * (double)vehicle.ecu.motor.bases.torque_Nm,
                   level->permitted.positive.bound / 32768.0 * (double)vehicle.ecu.motor.bases.torque_Nm,
                   vehicle.second_level_found);
            faulted += vehicle.second_level_found ? 1 : 0;
            others += vehicle.second_level_found ? 0 : 1;
        }
        driven_s += ms / 1000.0;
        vehicle_stop(&vehicle);
    }
    printf("%s: %.0f s driven, %d false trips of the second level, %d of other monitors\n", machine_data.motor,
           driven_s, faulted, others);
    return faulted == 0 ? 0 : 1;
}
