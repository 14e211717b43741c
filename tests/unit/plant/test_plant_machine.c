/* SPDX-License-Identifier: Apache-2.0 */
#include "plant_bench.h"

#include <math.h>

#include "unity.h"

static plant_params_t p;
static plant_map_t *map;
static plant_t *plant;

void setUp(void)
{
    p = bench_params();
    map = NULL;
    plant = NULL;
}

void tearDown(void)
{
    plant_destroy(plant);
    plant_map_destroy(map);
}

static const plant_truth_t *start(void)
{
    plant = plant_create(&p, map);
    TEST_ASSERT_NOT_NULL(plant);
    return plant_truth(plant);
}

/* Errors relative to the final value. That of the mid-point rule is (h/tau)^2/6 = 2e-7 at h = 10 us, tau = 10 ms. */
void test_a_locked_rotor_responds_to_a_voltage_step_with_one_exponential_per_axis(void)
{
    p.theta_m_rad = 0.4;
    const plant_truth_t *t = start();
    const double theta_e = 1.2, u = 1.5;
    const double final_d = u * cos(theta_e) / p.r_ohm_20, final_q = -u * sin(theta_e) / p.r_ohm_20;
    double duty[3];
    bench_duty(u, p.vdc_V, duty);
    for (int k = 1; k <= 500; k++) {
        plant_advance(plant, duty, 1);
        const double at = k * 1e-4;
        TEST_ASSERT_DOUBLE_WITHIN(1e-6 * fabs(final_d), final_d * -expm1(-at * p.r_ohm_20 / p.ld_H), t->i_d_A);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6 * fabs(final_q), final_q * -expm1(-at * p.r_ohm_20 / p.lq_H), t->i_q_A);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.05, t->time_s);
}

/* With zero voltage d psi/dt = A psi + b, A = [-R/Ld w; -w -R/Lq]; the closed-form solution uses e^(At) = e^(at)
 * (cos(bt) + (A - a) sin(bt)/b). Tolerance: only the resistive term is integrated numerically; its error is (w h)^2/24
 * of R i t, here < 2e-5 of psi_f. */
void test_a_sudden_three_phase_short_circuit_follows_the_closed_form(void)
{
    p.speed_rad_s = 300.0;
    const plant_truth_t *t = start();
    plant_set_state(plant, -40.0, 90.0, 0.3, p.speed_rad_s);
    const double w = 900.0, rd = p.r_ohm_20 / p.ld_H, rq = p.r_ohm_20 / p.lq_H;
    const double det = rd * rq + w * w;
    /* steady state: A psi = -b, b = (R psi_f/Ld, 0) */
    const double end_d = rq * rd * p.psi_f_Vs / det, end_q = -w * rd * p.psi_f_Vs / det;
    const double x0 = p.psi_f_Vs - 40.0 * p.ld_H - end_d, y0 = 90.0 * p.lq_H - end_q;
    const double a = -0.5 * (rd + rq), b = sqrt(det - a * a);
    const double off[3] = {0.0, 0.0, 0.0};
    for (int k = 1; k <= 1000; k++) {
        plant_advance(plant, off, 1);
        const double at = 1e-4 * k, e = exp(a * at), c = cos(b * at), s = sin(b * at) / b;
        const double psi_d = end_d + e * (x0 * c + ((-rd - a) * x0 + w * y0) * s);
        const double psi_q = end_q + e * (y0 * c + (-w * x0 + (-rq - a) * y0) * s);
        TEST_ASSERT_DOUBLE_WITHIN(2e-5 * p.psi_f_Vs, psi_d, t->psi_d_Vs);
        TEST_ASSERT_DOUBLE_WITHIN(2e-5 * p.psi_f_Vs, psi_q, t->psi_q_Vs);
    }
}

/* By hand from w psi_q = R i_d, -w psi_d = R i_q: i_d = -w^2 Lq psi_f/(R^2 + w^2 Ld Lq),
 * i_q = -w R psi_f/(R^2 + w^2 Ld Lq); the braking torque is -1.5 p R |i|^2/w. */
void test_a_permanent_short_circuit_settles_to_its_steady_currents_and_braking_torque(void)
{
    p.speed_rad_s = 20.0;
    const plant_truth_t *t = start();
    const double w = 60.0, r = p.r_ohm_20, n = r * r + w * w * p.ld_H * p.lq_H;
    const double id = -w * w * p.lq_H * p.psi_f_Vs / n, iq = -w * r * p.psi_f_Vs / n;
    const double same[3] = {0.3, 0.3, 0.3};
    for (int k = 0; k < 6000; k++) { /* 24 times the longer time constant of 25 ms */
        plant_advance(plant, same, 1);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-6 * fabs(id), id, t->i_d_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6 * fabs(iq), iq, t->i_q_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-5 * 40.0, -4.5 * r * (id * id + iq * iq) / w, t->torque_Nm);
}

/* u = R i + j w psi. The voltage is constant within a period of 2 us, so that its vector must be larger by 1/sinc. In
 * the rotor frame this voltage turns, and its ripple makes the current at the start of a period differ from its mean by
 * up to w |u| Ts^2/(12 L): 3.4e-4 A in the d axis, 1.4e-4 A in the q axis. */
void test_a_rotating_steady_state_obeys_the_voltage_equations(void)
{
    p.pwm_hz = 5e5;
    p.speed_rad_s = 500.0;
    const plant_truth_t *t = start();
    const double w = 1500.0, id = -100.0, iq = 120.0, x = 0.5 * w / p.pwm_hz;
    const double ud = p.r_ohm_20 * id - w * p.lq_H * iq;
    const double uq = p.r_ohm_20 * iq + w * (p.psi_f_Vs + p.ld_H * id);
    p.vdc_V = 600.0;
    *plant_params(plant) = p;
    plant_set_state(plant, id, iq, 0.0, p.speed_rad_s);
    for (int k = 0; k < 50000; k++) {
        bench_drive(plant, (ud + I * uq) * x / sin(x));
    }
    TEST_ASSERT_DOUBLE_WITHIN(5e-4, id, t->i_d_A);
    TEST_ASSERT_DOUBLE_WITHIN(2e-4, iq, t->i_q_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9 * 200.0, ud, t->u_d_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9 * 200.0, uq, t->u_q_V);
}

/* One period in which the rotor turns by 0.63 rad: L di/dt + R i = u - j w psi_f e^(j w t) with constant u has the
 * solution i = i_p(t) + u/R + (i0 - i_p(0) - u/R) e^(-Rt/L), i_p = -j w psi_f e^(j w t)/(R + j w L).
 * With ten substeps the error is about R Ts/L (w h)^2/6 of the current change of some 300 A. Richardson extrapolation
 * from 10 and 20 substeps removes the second order; what remains must be a thousandth of it. */
void test_the_rotor_turns_within_the_period_while_the_voltage_is_constant(void)
{
    p.lq_H = p.ld_H;
    p.speed_rad_s = 2100.0;
    const double w = 6300.0, ts = 1e-4;
    const double complex u = 150.0 - 80.0 * I, z = p.r_ohm_20 + I * w * p.ld_H;
    const double complex ip = -I * w * p.psi_f_Vs / z, u_over_r = u / p.r_ohm_20;
    const double complex at_end = ip * cexp(I * w * ts) + u_over_r +
                                  (0.0 - ip - u_over_r) * exp(-ts * p.r_ohm_20 / p.ld_H);
    const double complex i_dq = at_end * cexp(-I * w * ts);
    /* mean of e^(-j w t) over the period: sinc(w Ts/2) e^(-j w Ts/2) */
    const double complex mean = u * sin(0.5 * w * ts) / (0.5 * w * ts) * cexp(-I * 0.5 * w * ts);
    double complex seen[2];
    double duty[3];
    bench_duty(u, p.vdc_V, duty);
    for (int n = 0; n < 2; n++) {
        p.substeps = 10 << n;
        const plant_truth_t *t = start();
        plant_advance(plant, duty, 1);
        seen[n] = t->i_d_A + I * t->i_q_A;
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, creal(mean), t->u_d_V);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, cimag(mean), t->u_q_V);
        plant_destroy(plant);
    }
    plant = NULL;
    TEST_ASSERT_DOUBLE_WITHIN(5e-3, 0.0, cabs(seen[0] - i_dq));
    TEST_ASSERT_DOUBLE_WITHIN(5e-6, 0.0, cabs((4.0 * seen[1] - seen[0]) / 3.0 - i_dq));
}

/* Derivatives of the currents for a fourth-order Runge-Kutta method, from the analytical derivatives of the
 * polynomial. */
static void slope(const double i[2], double complex u_s, double theta, double w, double out[2])
{
    double psi[2];
    poly_flux(i[0], i[1], psi);
    const double complex u = u_s * cexp(-I * theta);
    const double vd = creal(u) - p.r_ohm_20 * i[0] + w * psi[1];
    const double vq = cimag(u) - p.r_ohm_20 * i[1] - w * psi[0];
    const double dd = POLY_A - 2.0 * POLY_C * i[0], dq = -2.0 * POLY_X * i[1];
    const double qq = POLY_B - 2.0 * POLY_X * i[0], det = dd * qq - dq * dq;
    out[0] = (qq * vd - dq * vq) / det;
    out[1] = (dd * vq - dq * vd) / det;
}

static void runge_kutta(double i[2], double complex u_s, double theta, double w, double h)
{
    double k1[2], k2[2], k3[2], k4[2], x[2];
    slope(i, u_s, theta, w, k1);
    x[0] = i[0] + 0.5 * h * k1[0], x[1] = i[1] + 0.5 * h * k1[1];
    slope(x, u_s, theta + 0.5 * w * h, w, k2);
    x[0] = i[0] + 0.5 * h * k2[0], x[1] = i[1] + 0.5 * h * k2[1];
    slope(x, u_s, theta + 0.5 * w * h, w, k3);
    x[0] = i[0] + h * k3[0], x[1] = i[1] + h * k3[1];
    slope(x, u_s, theta + w * h, w, k4);
    for (int n = 0; n < 2; n++) {
        i[n] += h / 6.0 * (k1[n] + 2.0 * k2[n] + 2.0 * k3[n] + k4[n]);
    }
}

/* The smallest and the largest value of each current. */
static void note_range(double range[2][2], const double i[2])
{
    for (int axis = 0; axis < 2; axis++) {
        range[axis][0] = fmin(range[axis][0], i[axis]);
        range[axis][1] = fmax(range[axis][1], i[axis]);
    }
}

/* 400 periods of voltage pulses of up to 440 V at 3000 rpm, over nearly the whole map. Between the currents that are
 * asserted, the inductance of the d axis changes from A - 8 uH to A + 192 uH (A = 300 uH), and the mutual one,
 * -2 X i_q, between -120 and 120 uH. Runge-Kutta with 2 us is exact to < 1e-6 A here; the plant has the second-order
 * error of R i, 3.6 mA with ten substeps and a sixteenth of that with 40. */
void test_a_saturating_machine_agrees_with_an_independent_integration_of_its_currents(void)
{
    map = poly_map();
    p.vdc_V = 1600.0; /* no duty is limited */
    p.substeps = 40;
    p.speed_rad_s = 100.0 * PI;
    const plant_truth_t *t = start();
    const double w = 3.0 * p.speed_rad_s;
    double i[2] = {-80.0, 60.0}, theta = 0.0, range[2][2] = {{0.0}};
    plant_set_state(plant, i[0], i[1], 0.0, p.speed_rad_s);
    for (int k = 0; k < 400; k++) {
        double psi[2], duty[3];
        poly_flux(i[0], i[1], psi);
        const double complex towards_A = (k / 20 % 2 ? -230.0 : 0.0) + I * (k / 30 % 2 ? -220.0 : 220.0);
        const double complex pulse_V = towards_A - i[0] - I * i[1]; /* 1 V/A */
        const double complex u = (pulse_V + I * w * (psi[0] + I * psi[1])) * cexp(I * (theta + 0.5 * w * 1e-4));
        bench_duty(u, p.vdc_V, duty);
        plant_advance(plant, duty, 1);
        for (int n = 0; n < 50; n++) {
            runge_kutta(i, u, theta + 2e-6 * n * w, w, 2e-6);
        }
        theta += 1e-4 * w;
        note_range(range, i);
        TEST_ASSERT_DOUBLE_WITHIN(5e-4, i[0], t->i_d_A);
        TEST_ASSERT_DOUBLE_WITHIN(5e-4, i[1], t->i_q_A);
    }
    TEST_ASSERT_TRUE(range[0][0] < -240.0 && range[0][1] > 10.0);
    TEST_ASSERT_TRUE(range[1][0] < -200.0 && range[1][1] > 200.0);
    TEST_ASSERT_EQUAL(0, t->inversion_failures);
}

static void one_run(int substeps, double i[2])
{
    p.substeps = substeps;
    plant_t *run = plant_create(&p, map);
    plant_set_state(run, -50.0, 80.0, 0.0, p.speed_rad_s);
    for (int k = 0; k < 50; k++) {
        bench_drive(run, -120.0 + 10.0 * (k % 5) + 130.0 * I);
    }
    i[0] = plant_truth(run)->i_d_A;
    i[1] = plant_truth(run)->i_q_A;
    plant_destroy(run);
}

/* Only R i is approximated; ten times the resistance makes its error large enough to be measured. */
void test_halving_the_substep_divides_the_error_by_four(void)
{
    double exact[2], i[3][2], error[3];
    map = poly_map();
    p.r_ohm_20 = 0.2;
    p.speed_rad_s = 400.0;
    one_run(1280, exact);
    for (int n = 0; n < 3; n++) {
        one_run(10 << n, i[n]);
        error[n] = hypot(i[n][0] - exact[0], i[n][1] - exact[1]);
    }
    TEST_ASSERT_TRUE(error[0] > 1e-5); /* above the inversion's tolerance of 1e-6 A */
    TEST_ASSERT_DOUBLE_WITHIN(0.3, 4.0, error[0] / error[1]);
    TEST_ASSERT_DOUBLE_WITHIN(0.3, 4.0, error[1] / error[2]);
}

/* 1.5 p (psi_d i_q - psi_q i_d), computed from the polynomial and the state that was set. */
void test_torque_is_the_cross_product_of_flux_and_current(void)
{
    map = poly_map();
    const plant_truth_t *t = start();
    for (double id = -240.0; id <= 40.0; id += 40.0) {
        for (double iq = -240.0; iq <= 240.0; iq += 40.0) {
            double psi[2];
            poly_flux(id, iq, psi);
            plant_set_state(plant, id, iq, 1.0, 0.0);
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, 4.5 * (psi[0] * iq - psi[1] * id), t->torque_Nm);
            TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, t->i_abc_A[0] + t->i_abc_A[1] + t->i_abc_A[2]);
            /* theta_e = 3 rad: phase a carries i_d cos(theta) - i_q sin(theta) */
            TEST_ASSERT_DOUBLE_WITHIN(1e-10, id * cos(3.0) - iq * sin(3.0), t->i_abc_A[0]);
        }
    }
}

/* 0.02 ohm x (1 + 0.0039/K x 100 K) = 0.0278 ohm */
void test_resistance_follows_the_winding_temperature(void)
{
    p.r_temp_coeff_per_K = 0.0039;
    const plant_truth_t *t = start();
    plant_params(plant)->winding_C = 120.0;
    bench_drive(plant, 1.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.0278, t->r_ohm);
}

/* No load: with the voltage j w psi_f the magnetising current is zero, and the terminal current is the iron-loss
 * current of (k_h |w| + k_e w^2) |psi_f|^2. The voltage also contains R i_fe = 0.02 ohm x 3.1 A. */
void test_iron_loss_at_no_load_is_the_stated_power(void)
{
    p.pwm_hz = 1e5;
    p.speed_rad_s = 400.0;
    p.iron_k_h = 20.0;
    p.iron_k_e = 0.03;
    const plant_truth_t *t = start();
    const double w = 1200.0, psi2 = p.psi_f_Vs * p.psi_f_Vs;
    const double power = (20.0 * w + 0.03 * w * w) * psi2;
    const double i_fe = power / (1.5 * w * p.psi_f_Vs);
    const double x = 0.5 * w / p.pwm_hz;
    for (int k = 0; k < 2000; k++) {
        bench_drive(plant, I * (w * p.psi_f_Vs + p.r_ohm_20 * i_fe) * x / sin(x));
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-3 * power, power, t->iron_W);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3 * i_fe, i_fe, t->i_q_A);
    TEST_ASSERT_DOUBLE_WITHIN(2e-3, 0.0, t->i_qm_A);
    TEST_ASSERT_DOUBLE_WITHIN(2e-3, 0.0, t->torque_mean_Nm);
}

/* As above: k_x |w|^1.5 |psi|^2, here 1.0 x 41569 x 0.084^2 = 293 W. */
void test_the_excess_iron_loss_grows_with_the_power_of_three_halves(void)
{
    double watts[2];
    p.pwm_hz = 1e5;
    p.iron_k_excess = 1.0;
    for (int n = 0; n < 2; n++) {
        p.speed_rad_s = n == 0 ? 400.0 : -100.0;
        const double w = 3.0 * p.speed_rad_s, size = fabs(w);
        const double power = size * sqrt(size) * p.psi_f_Vs * p.psi_f_Vs, i_fe = power / (1.5 * size * p.psi_f_Vs);
        const double x = 0.5 * w / p.pwm_hz;
        const plant_truth_t *t = start();
        for (int k = 0; k < 8000; k++) {
            bench_drive(plant, I * (w * p.psi_f_Vs + copysign(p.r_ohm_20 * i_fe, w)) * x / sin(x));
        }
        watts[n] = t->iron_W;
        TEST_ASSERT_DOUBLE_WITHIN(2e-3 * power, power, t->iron_W);
        plant_destroy(plant);
    }
    plant = NULL;
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 8.0, watts[0] / watts[1]);
}

void test_iron_loss_is_equal_in_both_directions_of_rotation(void)
{
    double seen[2];
    p.iron_k_h = 20.0;
    p.iron_k_e = 0.03;
    for (int n = 0; n < 2; n++) {
        p.speed_rad_s = n == 0 ? 400.0 : -400.0;
        plant = plant_create(&p, NULL);
        bench_drive(plant, I * 3.0 * p.speed_rad_s * p.psi_f_Vs);
        seen[n] = plant_truth(plant)->iron_W;
        plant_destroy(plant);
    }
    plant = NULL;
    TEST_ASSERT_TRUE(seen[0] > 100.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9 * seen[0], seen[0], seen[1]);
}

/* The stator flux changes by u t: nothing is approximated, even with ten long steps of 43 degrees. */
void test_without_resistance_the_voltage_integral_is_exact_at_any_step(void)
{
    p.r_ohm_20 = 0.0;
    p.pwm_hz = 200.0;
    p.speed_rad_s = 500.0;
    const plant_truth_t *t = start();
    const double complex u = 3.0 - 7.0 * I, psi = p.psi_f_Vs - 30.0 * p.ld_H + I * 50.0 * p.lq_H;
    const double complex end = (psi + u * 5e-3) * cexp(-I * 1500.0 * 5e-3);
    double duty[3];
    plant_set_state(plant, -30.0, 50.0, 0.0, 500.0);
    bench_duty(u, p.vdc_V, duty);
    plant_advance(plant, duty, 1);
    TEST_ASSERT_DOUBLE_WITHIN(1e-14, creal(end), t->psi_d_Vs);
    TEST_ASSERT_DOUBLE_WITHIN(1e-14, cimag(end), t->psi_q_Vs);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, (creal(end) - p.psi_f_Vs) / p.ld_H, t->i_d_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, cimag(end) / p.lq_H, t->i_q_A);
}

/* +-200 V in both axes of the measured machine, changes of 10 A and more per substep: the currents still match the flux
 * to the tolerance of the inversion. */
void test_currents_match_the_flux_however_fast_they_change(void)
{
    map = hsm1_map();
    TEST_ASSERT_NOT_NULL_MESSAGE(map, "cannot read " HSM1_CSV);
    const plant_truth_t *t = start();
    plant_set_state(plant, -100.0, -150.0, 0.0, 0.0);
    for (int k = 0; k < 200; k++) {
        double d, q;
        bench_drive(plant, (k / 2 % 2 ? -200.0 : 200.0) + (k / 10 % 2 ? -200.0 : 200.0) * I);
        plant_map_flux(map, t->i_d_A, t->i_q_A, &d, &q, NULL);
        TEST_ASSERT_DOUBLE_WITHIN(2e-10, t->psi_d_Vs, d);
        TEST_ASSERT_DOUBLE_WITHIN(2e-10, t->psi_q_Vs, q);
    }
    TEST_ASSERT_EQUAL(0, t->inversion_failures);
}

/* A flux that no current can make must be counted and must not give NaN. */
void test_an_impossible_flux_is_counted(void)
{
    map = poly_map();
    const plant_truth_t *t = start();
    bench_drive(plant, 10.0);
    TEST_ASSERT_EQUAL(0, t->inversion_failures);
    plant_params(plant)->lq_scale = 0.0;
    bench_drive(plant, 10.0 * I);
    TEST_ASSERT_TRUE(t->inversion_failures > 0);
    TEST_ASSERT_TRUE(isfinite(t->i_d_A) && isfinite(t->i_q_A) && isfinite(t->torque_Nm));
}
