/* SPDX-License-Identifier: Apache-2.0 */
/* Errors planted in the first level, classified by the torque of the simulated shaft:  second_level_planted [<error>]
 * Each error is tried at every operating point. The torque may exceed the permitted one by more than 10 N·m for 50 ms
 * in a row at most. Each error is also tried without the second level: this shows its effect on the torque, and what
 * the other monitors detect without the second level. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "planted.h"
#include "signal/crc32.h"
#include "worst.h"

#define ALLOWED_NM 10.0
#define ALLOWED_MS 50
#define STEADY_MS 120
#define AFTER_MS 220
#define LEGAL_FALL_MS 60 /* slew and jerk of a falling torque, and the time until a frame has arrived */
#define LOST_MS 45       /* time-out of the command and ramp to zero */
#define EFFECTIVE_MIN 40

/* What the vehicle does 100 ms after the error has begun. */
typedef enum { KEEPS, RELEASES, FALLS_SILENT, LIMITS, DISABLES } then_t;

typedef struct {
    double speed_rpm, torque_Nm;
    then_t then;
} point_t;

static const point_t points[] = {
    {0, 90, KEEPS},      {0, -90, KEEPS},       {0, 90, RELEASES},        {60, 110, RELEASES},   {300, -70, LIMITS},
    {1000, 80, KEEPS},   {1000, -80, RELEASES}, {2000, 80, FALLS_SILENT}, {4000, 60, KEEPS},     {4000, -60, LIMITS},
    {-3000, 70, LIMITS}, {2000, -70, DISABLES}, {8000, 40, KEEPS},        {8000, -40, RELEASES},
};
enum { POINTS = (int)(sizeof points / sizeof points[0]) };

typedef struct {
    double beyond_Nm; /* largest */
    int longest_ms;   /* beyond ALLOWED_NM, in a row, while the drive runs */
} verdict_t;

static vehicle_t vehicle;

static void react(then_t then)
{
    switch (then) {
    case RELEASES:
        vehicle.command.torque_Nm = 0.0;
        break;
    case FALLS_SILENT:
        vehicle.command.silent = true;
        break;
    case LIMITS:
        vehicle.command.limit_drive_Nm = 30.0;
        vehicle.command.limit_regen_Nm = 20.0;
        break;
    case DISABLES:
        vehicle.command.enable = false;
        vehicle.command.torque_Nm = 0.0;
        break;
    case KEEPS:
    default:
        break;
    }
}

/* What the vehicle's last frames permit, after the time that a legal decrease takes. */
static double permitted_Nm(const point_t *at, int ms_since)
{
    const int legal_ms = (at->then == FALLS_SILENT) ? LOST_MS : LEGAL_FALL_MS;
    if (at->then == KEEPS || ms_since < legal_ms) {
        return at->torque_Nm;
    }
    const double limit_Nm = (at->speed_rpm * at->torque_Nm < 0.0) ? 20.0 : 30.0;
    return (at->then == LIMITS) ? copysign(fmin(limit_Nm, fabs(at->torque_Nm)), at->torque_Nm) : 0.0;
}

static double beyond(double torque_Nm, double permitted_Nm_)
{
    const double low = fmin(permitted_Nm_, 0.0);
    const double high = fmax(permitted_Nm_, 0.0);
    return worse_of(0.0, worse_of(torque_Nm - high, low - torque_Nm));
}

static verdict_t try_error(int error, const point_t *at, bool watched)
{
    static second_level_constants_t tolerant; /* never reports a fault */
    verdict_t verdict = {0};
    int in_a_row = 0;
    vehicle_start(&vehicle, at->speed_rpm);
    if (!watched) {
        tolerant = *vehicle.ecu.motor.second_level;
        tolerant.tolerance = INT32_MAX / 2;
        tolerant.checksum = crc32(&tolerant.torque_per_count, sizeof tolerant - sizeof tolerant.checksum);
        vehicle.ecu.motor.second_level = &tolerant;
        vehicle.ecu.ecu.second_level.own_data = (second_level_own_data_t){0}; /* a pass over these begins */
    }
    vehicle_request(&vehicle, at->torque_Nm);
    vehicle_run(&vehicle, STEADY_MS);
    planted_begin(error, &vehicle);
    for (int ms = -100; ms < AFTER_MS; ms++) {
        if (ms == 0) {
            react(at->then);
        }
        vehicle_millisecond(&vehicle);
        if (vehicle.ecu.drive.fast.faults != 0U || !vehicle.ecu.gates) {
            break;
        }
        const double now_Nm = beyond(vehicle.torque_Nm, permitted_Nm(at, ms));
        verdict.beyond_Nm = worse_of(verdict.beyond_Nm, now_Nm);
        in_a_row = (now_Nm <= ALLOWED_NM) ? 0 : in_a_row + 1;
        verdict.longest_ms = (in_a_row > verdict.longest_ms) ? in_a_row : verdict.longest_ms;
    }
    planted_begin(-1, &vehicle);
    vehicle_stop(&vehicle);
    return verdict;
}

/* The largest values of all points. */
static verdict_t try_everywhere(int error, const char *name, bool watched, bool verbose)
{
    verdict_t worst = {0};
    for (int n = 0; n < POINTS; n++) {
        const verdict_t one = try_error(error, &points[n], watched);
        if (verbose || (watched && one.longest_ms > ALLOWED_MS)) {
            printf("    %-24s %6.0f rpm %5.0f N.m then %d: %6.1f N.m beyond, %d ms, faults %x\n", name,
                   points[n].speed_rpm, points[n].torque_Nm, (int)points[n].then, one.beyond_Nm, one.longest_ms,
                   (unsigned)vehicle.ecu.drive.fast.faults);
        }
        worst.beyond_Nm = worse_of(worst.beyond_Nm, one.beyond_Nm);
        worst.longest_ms = (one.longest_ms > worst.longest_ms) ? one.longest_ms : worst.longest_ms;
    }
    return worst;
}

int main(int argc, char **argv)
{
    int effective = 0;
    int late = 0;
    int missed = 0;
    for (int error = -1; error < planted_count; error++) {
        const char *name = (error < 0) ? "none" : planted_errors[error].name;
        if (argc > 1 && strcmp(argv[1], name) != 0) {
            continue;
        }
        const verdict_t alone = try_everywhere(error, name, false, false);
        const verdict_t watched = try_everywhere(error, name, true, argc > 1);
        printf("%-24s without the second level %6.1f N.m, %3d ms; with it %6.1f N.m, %3d ms\n", name, alone.beyond_Nm,
               alone.longest_ms, watched.beyond_Nm, watched.longest_ms);
        effective += (alone.beyond_Nm > ALLOWED_NM) ? 1 : 0;
        late += (alone.longest_ms > ALLOWED_MS) ? 1 : 0;
        missed += (watched.longest_ms > ALLOWED_MS) ? 1 : 0;
    }
    printf("%d errors exceed the permitted torque by more than %.0f N.m, %d of them for more than %d ms without the "
           "second level; with it %d do\n",
           effective, ALLOWED_NM, late, ALLOWED_MS, missed);
    return (missed == 0 && (argc > 1 || effective >= EFFECTIVE_MIN)) ? 0 : 1;
}
