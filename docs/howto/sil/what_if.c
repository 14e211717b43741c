/* SPDX-License-Identifier: Apache-2.0 */
/* One drive continued three times from the same state, with another torque each time; then the first time once more.
 *   gcc -I. docs/howto/sil/what_if.c -Lbuild/host/motors/paper -lfluxtrue_sil -lm -o what_if
 *   LD_LIBRARY_PATH=build/host/motors/paper ./what_if
 * The plant is the machine of the 2014 paper with an ideal inverter, in the frame of the rotor. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "hal/host/fluxtrue.h"

#define TURN 6.283185307179586
enum { SUBSTEPS = 10 };
static const double p = 4.0, r = 0.018, l_d = 0.2e-3, l_q = 0.5e-3, psi_f = 0.084, v_dc = 350.0, omega_m = 157.08;

typedef struct {
    double psi_d, psi_q, theta_m;
    double duty[3]; /* computed in the period before: they act now */
} plant_t;

static void sample(const plant_t *x, double in[6])
{
    const double i_d = (x->psi_d - psi_f) / l_d, i_q = x->psi_q / l_q;
    for (int k = 0; k < 3; k++) {
        const double angle = p * x->theta_m - k * TURN / 3.0;
        in[k] = i_d * cos(angle) - i_q * sin(angle);
    }
    in[3] = v_dc;
    in[4] = x->theta_m;
    in[5] = 20.0;
}

static void advance(plant_t *x, double period_s)
{
    const double h = period_s / SUBSTEPS;
    for (int n = 0; n < SUBSTEPS; n++) {
        double u_d = 0.0, u_q = 0.0;
        x->theta_m = fmod(x->theta_m + 0.5 * omega_m * h, TURN);
        for (int k = 0; k < 3; k++) {
            const double angle = p * x->theta_m - k * TURN / 3.0;
            u_d += 2.0 / 3.0 * v_dc * x->duty[k] * cos(angle);
            u_q -= 2.0 / 3.0 * v_dc * x->duty[k] * sin(angle);
        }
        x->theta_m = fmod(x->theta_m + 0.5 * omega_m * h, TURN);
        const double psi_d = x->psi_d;
        x->psi_d += h * (u_d - r * (psi_d - psi_f) / l_d + p * omega_m * x->psi_q);
        x->psi_q += h * (u_q - r * x->psi_q / l_q - p * omega_m * psi_d);
    }
}

/* Mean torque of the last tenth of the time. */
static double run(fluxtrue_t *drive, plant_t *x, int periods)
{
    double sum = 0.0;
    for (int n = 0; n < periods; n++) {
        double in[6], out[4];
        sample(x, in);
        fluxtrue_step(drive, in, out);
        advance(x, fluxtrue_period_s());
        memcpy(x->duty, out, sizeof x->duty);
        if (n >= periods - periods / 10) {
            sum += 1.5 * p * (x->psi_d * x->psi_q / l_q - x->psi_q * (x->psi_d - psi_f) / l_d);
        }
    }
    return sum / (periods / 10);
}

int main(void)
{
    fluxtrue_t *drive = fluxtrue_create();
    plant_t plant = {psi_f, 0.0, 0.0, {0.5, 0.5, 0.5}}, saved_plant, first = {0};
    const int size = fluxtrue_state_size(), requested = fluxtrue_handle("torque_requested_Nm");
    void *saved = malloc((size_t)size);
    if (!drive || !saved || fluxtrue_abi() < 2) {
        return EXIT_FAILURE;
    }
    printf("firmware %s, ABI %d, motor %s, period %g us\n", fluxtrue_version(), fluxtrue_abi(), fluxtrue_motor(),
           1e6 * fluxtrue_period_s());
    (void)fluxtrue_set(drive, "dead_time_compensation", 0.0); /* this inverter is ideal */
    (void)fluxtrue_set(drive, "enable", 1.0);
    (void)run(drive, &plant, 5000);
    (void)fluxtrue_state_save(drive, saved, size);
    saved_plant = plant;
    for (int n = 0; n < 4; n++) {
        const double torque_Nm = (const double[]){40.0, -40.0, 80.0, 40.0}[n];
        (void)fluxtrue_state_restore(drive, saved, size);
        plant = saved_plant;
        (void)fluxtrue_set_by(drive, requested, torque_Nm);
        printf("%5.1f N.m requested, %6.2f N.m at the shaft\n", torque_Nm, run(drive, &plant, 3000));
        first = (n == 0) ? plant : first;
    }
    const int same = memcmp(&first, &plant, sizeof plant) == 0 && fluxtrue_get(drive, "fault_word") == 0.0;
    puts(same ? "The repetition is the same to the last bit." : "The repetition differs.");
    free(saved);
    fluxtrue_destroy(drive);
    return same ? EXIT_SUCCESS : EXIT_FAILURE;
}
