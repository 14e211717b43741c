/* SPDX-License-Identifier: Apache-2.0 */
/* Driving without any error, with the spread of machines and inverters in production; one program for each machine:
 *   second_level_healthy_<machine> <seconds> <seed> [<trips of other monitors>]
 * The speed changes by up to 40,000 rpm/s, requests and limits jump, commands stop, the battery voltage steps. The
 * second level may report no fault and must have had torque to compare. Faults of other monitors end a drive and are
 * counted by name; with the third argument more of them fail, too. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "dice.h"
#include "hal/host/fluxtrue.h"
#include "vecu/machine_data.h"
#include "vehicle.h"

#define DRIVE_MS 3000
#define RPM_PER_MS_MAX 40.0
#define DEGREE 0.017453292519943295
#define LOADED_SHARE 0.25     /* of the largest torque */
#define LOADED_TIME_MIN 0.15  /* share of the time with more than that */
#define FAULT_BITS 32

/* What the second level compares, in N.m. */
typedef struct {
    double own_Nm, negative_Nm, positive_Nm;
} compared_t;

typedef struct {
    int driven_ms, loaded_ms;
    int second_level, others; /* drives ended by a fault */
    int by_bit[FAULT_BITS];   /* of the others; a drive may end with several */
} result_t;

static vehicle_t vehicle;
static compared_t compared; /* before the last millisecond: a fault clears it */
static result_t result;
static dice_t dice;

static double chance(void)
{
    return dice_chance(&dice);
}

static double between(double low, double high)
{
    return dice_between(&dice, low, high);
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

static compared_t compare(void)
{
    const second_level_t *level = &vehicle.ecu.ecu.second_level;
    const double lsb_Nm = (double)vehicle.ecu.motor.bases.torque_Nm / 32768.0;
    return (compared_t){level->mean_q8 / 256.0 * lsb_Nm, -level->permitted.negative.bound * lsb_Nm,
                        level->permitted.positive.bound * lsb_Nm};
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
        compared = compare();
        result.loaded_ms += (fabs(compared.own_Nm) > LOADED_SHARE * torque_max_Nm) ? 1 : 0;
        vehicle_ramp_speed(&vehicle, now_rpm + (to_rpm - now_rpm) * n / steps,
                           now_rpm + (to_rpm - now_rpm) * (n + 1) / steps);
        if (vehicle.ecu.drive.fast.faults != 0U) {
            return;
        }
    }
}

static const char *fault_name(int bit)
{
    static char name[32];
    if (fluxtrue_word("fault_word", bit, name, sizeof name) != FLUXTRUE_OK) {
        (void)snprintf(name, sizeof name, "bit %d", bit);
    }
    return name;
}

/* Prints and counts how a drive has ended. */
static void note_faults(uint64_t drive, int ms)
{
    const uint32_t faults = vehicle.ecu.drive.fast.faults;
    if (faults == 0U) {
        return;
    }
    printf("drive %d: %s after %d ms, at %.0f rpm, requested %.1f N.m; before it own torque %.1f, permitted %.1f ... "
           "%.1f; faults",
           (int)drive, vehicle.second_level_found ? "second level" : "other monitor", ms,
           sim_get(vehicle.sim, "truth.speed_rpm"), vehicle.command.torque_Nm, compared.own_Nm, compared.negative_Nm,
           compared.positive_Nm);
    result.second_level += vehicle.second_level_found ? 1 : 0;
    result.others += vehicle.second_level_found ? 0 : 1;
    for (int bit = 0; bit < FAULT_BITS; bit++) {
        if (faults >> bit & 1U) {
            result.by_bit[bit] += vehicle.second_level_found ? 0 : 1;
            printf(" %s", fault_name(bit));
        }
    }
    printf("\n");
}

/* One drive of a machine of its own. */
static void drive(uint64_t seed)
{
    int ms = 0;
    dice = dice_start(seed);
    vehicle_start(&vehicle, 0.0);
    draw_plant();
    torque_max_Nm = (double)vehicle.ecu.motor.torque_max_Nm;
    speed_max_rpm = vehicle_speed_max_rpm(&vehicle);
    vdc_V = sim_get(vehicle.sim, "plant.vdc_V");
    vehicle_request(&vehicle, 0.0);
    while (ms < DRIVE_MS && vehicle.ecu.drive.fast.faults == 0U) {
        drive_once(&ms);
    }
    note_faults(seed, ms);
    result.driven_ms += ms;
    vehicle_stop(&vehicle);
}

static void print_result(void)
{
    printf("%s: %.0f s driven, %.0f %% of the time with more than %.0f %% of the largest torque; %d false trips of the "
           "second level, %d of other monitors",
           machine_data.motor, result.driven_ms / 1000.0, 100.0 * result.loaded_ms / result.driven_ms,
           100.0 * LOADED_SHARE, result.second_level, result.others);
    const char *separator = ": ";
    for (int bit = 0; bit < FAULT_BITS; bit++) {
        if (result.by_bit[bit] != 0) {
            printf("%s%s %d", separator, fault_name(bit), result.by_bit[bit]);
            separator = ", ";
        }
    }
    printf("\n");
}

int main(int argc, char **argv)
{
    if (argc != 3 && argc != 4) {
        (void)fprintf(stderr, "usage: second_level_healthy_<machine> <seconds> <seed> [<trips of other monitors>]\n");
        return 2;
    }
    const double seconds = strtod(argv[1], NULL);
    const uint64_t seed = strtoull(argv[2], NULL, 10);
    const bool limited = argc == 4;
    const long allowed = limited ? strtol(argv[3], NULL, 10) : 0;
    for (uint64_t n = 0; result.driven_ms < 1000.0 * seconds; n++) {
        drive(seed + n);
    }
    print_result();
    const bool loaded = result.loaded_ms > LOADED_TIME_MIN * result.driven_ms;
    return (result.second_level == 0 && loaded && (!limited || result.others <= allowed)) ? 0 : 1;
}
