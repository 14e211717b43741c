/* SPDX-License-Identifier: Apache-2.0 */
/* A vehicle of 1600 kg that starts with a wrong angle: wheels of 0.32 m behind a gear of 9:1, 2 kg.m2 at the rotor.
 *   launch_wrong_angle [print]: the movement until a fault for all offsets, torques and pedals, against its bounds */
#include <math.h>
#include <stdbool.h>
#include <stdio.h>

#include "vehicle.h"

#define DEGREE 0.017453292519943295
#define CM_PER_RAD (32.0 / 9.0)
#define INERTIA_KGM2 2.0
#define SETTLE_MS 400
#define LAUNCH_MS 4000
#define FAR_CM 100.0
#define AGAINST_CM 5.0 /* largest movement against the request, and in its direction */
#define ALONG_CM 20.0
#define LARGE 0.45 /* of the largest torque: from there on these hold */

static vehicle_t vehicle;

/* The angle becomes wrong slowly at standstill: an encoder without absolute reference is wrong from the start. */
static void start(double offset_deg)
{
    vehicle_start(&vehicle, 0.0);
    for (int ms = 1; ms <= SETTLE_MS; ms++) {
        vehicle_set(&vehicle, "plant.angle_offset_rad", offset_deg * DEGREE * ms / SETTLE_MS);
        vehicle_millisecond(&vehicle);
    }
    vehicle_set(&vehicle, "plant.imposed_speed", 0.0);
    vehicle_set(&vehicle, "plant.inertia_kgm2", INERTIA_KGM2);
}

/* In cm until a fault, in the direction of the request; or after 4 s or 100 cm. The pedal is pressed within ramp_ms. */
static double launch(double offset_deg, double share, int ramp_ms, bool *found)
{
    double cm = 0.0;
    start(offset_deg);
    vehicle_request(&vehicle, 0.0);
    for (int ms = 0; ms < LAUNCH_MS && fabs(cm) < FAR_CM && vehicle.ecu.drive.fast.faults == 0U; ms++) {
        const double pedal = (ms < ramp_ms) ? (double)ms / ramp_ms : 1.0;
        vehicle.command.torque_Nm = pedal * share * (double)vehicle.ecu.motor.torque_max_Nm;
        vehicle_millisecond(&vehicle);
        cm += sim_get(vehicle.sim, "truth.speed_rad_s") * 1e-3 * CM_PER_RAD;
    }
    *found = vehicle.ecu.drive.fast.faults != 0U;
    vehicle_stop(&vehicle);
    return (share < 0.0) ? -cm : cm;
}

/* How many launches with this pedal go beyond their bound. */
static int count_late(double share, int ramp_ms, bool print)
{
    static const double offsets[] = {60.0, -60.0, 90.0, -90.0, 120.0, -120.0, 150.0, -150.0, 180.0};
    bool found = false;
    const double healthy = launch(0.0, share, ramp_ms, &found);
    int bad = (found || healthy < FAR_CM) ? 1 : 0;
    for (unsigned k = 0; k < sizeof offsets / sizeof offsets[0]; k++) {
        const double cm = launch(offsets[k], share, ramp_ms, &found);
        const bool late = fabs(share) > LARGE && (!found || cm < -AGAINST_CM || cm > ALONG_CM);
        if (late || print) {
            printf(
                "%4.0f degrees, %5.2f of the largest torque within %4d ms: %6.1f cm in the direction of the request, "
                "%s\n",
                offsets[k], share, ramp_ms, cm, found ? "found" : "not found");
        }
        bad += late ? 1 : 0;
    }
    return bad;
}

int main(int argc, char **argv)
{
    static const double shares[] = {0.1, -0.2, 0.5, -0.5, 1.0};
    static const int ramps_ms[] = {0, 300, 1000, 2000};
    int bad = 0;
    (void)argv;
    for (unsigned t = 0; t < sizeof shares / sizeof shares[0]; t++) {
        for (unsigned r = 0; r < sizeof ramps_ms / sizeof ramps_ms[0]; r++) {
            bad += count_late(shares[t], ramps_ms[r], argc > 1);
        }
    }
    printf("%d launches beyond their bound\n", bad);
    return bad;
}
