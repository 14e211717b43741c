/* SPDX-License-Identifier: Apache-2.0 */
/* Driving without any error, harsh but legal, with the spread of a production; one program for each machine:
 *   healthy_<machine> <seconds> <seed> [<share of the largest change of speed>]
 * Each drive of 10 s has a machine of its own, which its number repeats. The result is a line of JSON. Exit code 1: a
 * monitor has ended a drive, or in several drives there was hardly any torque, or a kind was not driven. */
#include <stdio.h>
#include <stdlib.h>

#include "driver.h"
#include "hal/host/fluxtrue.h"
#include "manoeuvres.h"
#include "vecu/machine_data.h"

#define DRIVE_MS 10000
#define LOADED_TIME_MIN 0.15 /* share of the time with more than a quarter of the largest torque */
#define FAULT_BITS 32

typedef struct {
    int drives, trips;
    int driven_ms, loaded_ms, kind_ms[KINDS];
} result_t;

static driver_t driver;
static result_t result;

static void print_faults(uint32_t faults)
{
    const char *separator = "";
    for (int bit = 0; bit < FAULT_BITS; bit++) {
        char name[32];
        if ((faults >> bit & 1U) != 0U) {
            if (fluxtrue_word("fault_word", bit, name, sizeof name) != FLUXTRUE_OK) {
                (void)snprintf(name, sizeof name, "bit %d", bit);
            }
            printf("%s\"%s\"", separator, name);
            separator = ", ";
        }
    }
}

static void print_trip(uint64_t seed)
{
    printf("%s{\"drive\": %llu, \"ms\": %d, \"kind\": \"%s\", \"rpm\": %.0f, \"requested_Nm\": %.1f, \"faults\": [",
           result.trips == 0 ? "" : ", ", (unsigned long long)seed, driver.ms, kind_names[driver.kind],
           driver.speed_rpm, driver.vehicle.command.torque_Nm);
    print_faults(driver_faults(&driver));
    printf("]}");
}

static void drive(uint64_t seed, double rate_share)
{
    driver_start(&driver, seed, rate_share);
    bool drives = true;
    while (drives && driver.ms < DRIVE_MS) {
        drives = manoeuvre(&driver);
    }
    if (!drives) {
        print_trip(seed);
        result.trips++;
    }
    result.drives++;
    result.driven_ms += driver.ms;
    result.loaded_ms += driver.loaded_ms;
    for (int kind = 0; kind < KINDS; kind++) {
        result.kind_ms[kind] += driver.kind_ms[kind];
    }
    vehicle_stop(&driver.vehicle);
}

int main(int argc, char **argv)
{
    if (argc != 3 && argc != 4) {
        (void)fprintf(stderr, "usage: healthy_<machine> <seconds> <seed> [<share of the largest change of speed>]\n");
        return 2;
    }
    const double seconds = strtod(argv[1], NULL);
    const uint64_t seed = strtoull(argv[2], NULL, 10);
    const double rate_share = (argc == 4) ? strtod(argv[3], NULL) : 1.0;
    bool every_kind = true;
    printf("{\"machine\": \"%s\", \"trips\": [", machine_data.motor);
    for (uint64_t n = 0; result.driven_ms < 1000.0 * seconds; n++) {
        drive(seed + n, rate_share);
    }
    printf("], \"drives\": %d, \"driven_s\": %.3f, \"loaded_s\": %.3f, \"rpm_per_s\": %.0f, \"kinds_s\": {",
           result.drives, result.driven_ms / 1e3, result.loaded_ms / 1e3, 1e3 * driver.rate_rpm);
    for (int kind = 0; kind < KINDS; kind++) {
        printf("%s\"%s\": %.3f", kind == 0 ? "" : ", ", kind_names[kind], result.kind_ms[kind] / 1e3);
        every_kind &= result.kind_ms[kind] > 0;
    }
    printf("}}\n");
    const bool enough = every_kind && result.loaded_ms > LOADED_TIME_MIN * result.driven_ms;
    return (result.trips == 0 && (enough || result.drives == 1)) ? 0 : 1;
}
