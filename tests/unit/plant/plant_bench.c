/* SPDX-License-Identifier: Apache-2.0 */
#include "plant_bench.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

plant_params_t bench_params(void)
{
    plant_params_t p;
    plant_params_default(&p);
    p.pole_pairs = 3.0;
    p.r_ohm_20 = 0.02;
    p.ld_H = 0.2e-3;
    p.lq_H = 0.5e-3;
    p.psi_f_Vs = 0.084;
    p.vdc_V = 400.0;
    p.pwm_hz = 10000.0;
    p.ideal_inverter = 1;
    p.current_full_scale_A = 400.0;
    p.vdc_full_scale_V = 500.0;
    return p;
}

void poly_flux(double id, double iq, double psi[2])
{
    psi[0] = POLY_F + POLY_A * id - POLY_C * id * id - POLY_X * iq * iq;
    psi[1] = POLY_B * iq - 2.0 * POLY_X * id * iq;
}

/* Field energy: i . psi - W' */
double poly_field_energy(double id, double iq)
{
    double psi[2];
    poly_flux(id, iq, psi);
    return id * psi[0] + iq * psi[1] -
           (POLY_F * id + POLY_A * id * id / 2.0 - POLY_C * id * id * id / 3.0 + POLY_B * iq * iq / 2.0 -
            POLY_X * id * iq * iq);
}

plant_map_t *poly_map(void)
{
    double id[13], iq[21], psi_d[13][21], psi_q[13][21], psi[2];
    for (int i = 0; i < 13; i++) {
        for (int j = 0; j < 21; j++) {
            id[i] = -250.0 + 25.0 * i; /* to +50 A */
            iq[j] = -250.0 + 25.0 * j;
            poly_flux(id[i], iq[j], psi);
            psi_d[i][j] = psi[0];
            psi_q[i][j] = psi[1];
        }
    }
    return plant_map_create(id, 13, iq, 21, &psi_d[0][0], &psi_q[0][0]);
}

/* 26 x 51 nodes, 10 A apart; psi_d is made even and psi_q odd in i_q, as the tools do. */
plant_map_t *hsm1_map(void)
{
    static double psi_d[26][51], psi_q[26][51], d[26][51], q[26][51];
    double id[26], iq[51], row[4];
    char line[256];
    int rows = 0;
    FILE *file = fopen(HSM1_CSV, "r");
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        if (sscanf(line, "%lf,%lf,%lf,%lf", &row[0], &row[1], &row[2], &row[3]) == 4) {
            const int i = (int)lround((row[0] + 250.0) / 10.0), j = (int)lround(row[1] / 10.0) + 25;
            psi_d[i][j] = row[2];
            psi_q[i][j] = row[3];
            rows++;
        }
    }
    if (file != NULL) {
        fclose(file);
    }
    for (int i = 0; i < 26; i++) {
        for (int j = 0; j < 51; j++) {
            id[i] = 10.0 * i - 250.0;
            iq[j] = 10.0 * j - 250.0;
            d[i][j] = 0.5 * (psi_d[i][j] + psi_d[i][50 - j]);
            q[i][j] = 0.5 * (psi_q[i][j] - psi_q[i][50 - j]);
        }
    }
    return rows == 26 * 51 ? plant_map_create(id, 26, iq, 51, &d[0][0], &q[0][0]) : NULL;
}

void bench_duty(double complex u, double vdc_V, double duty[3])
{
    for (int x = 0; x < 3; x++) {
        duty[x] = 0.5 + creal(u * cexp(-I * TWO_PI / 3.0 * x)) / vdc_V;
    }
}

void bench_drive(plant_t *plant, double complex u_dq)
{
    const plant_params_t *p = plant_params(plant);
    const plant_truth_t *t = plant_truth(plant);
    const double middle_rad = t->theta_e_rad + 0.5 * p->pole_pairs * t->speed_rad_s / p->pwm_hz;
    double duty[3];
    bench_duty(u_dq * cexp(I * middle_rad), p->vdc_V, duty);
    plant_advance(plant, duty, 1);
}
