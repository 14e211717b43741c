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
    p.speed_rad_s = 250.0;
    map = NULL;
    plant = NULL;
}

void tearDown(void)
{
    plant_destroy(plant);
    plant_map_destroy(map);
}

/* Large, fast changes of the operating point, so that every form of energy changes. */
static void run_with_large_changes(int periods)
{
    const plant_truth_t *t = plant_truth(plant);
    for (int k = 0; k < periods; k++) {
        const double w = 3.0 * t->speed_rad_s;
        const double complex aim = (k / 200) % 2 ? -120.0 + 150.0 * I : -40.0 - 90.0 * I;
        const double complex i = t->i_d_A + I * t->i_q_A, psi = t->psi_d_Vs + I * t->psi_q_Vs;
        bench_drive(plant, I * w * psi + 0.4 * (aim - i) + 8.0 * cexp(I * 0.7 * k));
    }
}

static double stored(const plant_truth_t *t)
{
    return 0.75 * (p.ld_H * t->i_dm_A * t->i_dm_A + p.lq_H * t->i_qm_A * t->i_qm_A);
}

/* Each term is integrated by its own rule (mid-point current, trapezoidal torque): the balance holds to second order,
 * some 1e-5 of the energy that was converted. */
void test_with_constant_inductances_losses_work_and_stored_energy_are_the_electrical_energy(void)
{
    p.iron_k_h = 10.0;
    p.iron_k_e = 0.02;
    plant = plant_create(&p, NULL);
    const plant_truth_t *t = plant_truth(plant);
    run_with_large_changes(3100);
    TEST_ASSERT_TRUE(t->e_copper_J > 10.0 && t->e_iron_J > 10.0 && stored(t) > 1.0);
    const double out = t->e_copper_J + t->e_iron_J + t->e_mechanical_J + stored(t);
    TEST_ASSERT_DOUBLE_WITHIN(3e-5 * t->e_copper_J, out, t->e_electrical_J);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9 * t->e_copper_J, stored(t), t->e_field_J);
}

/* The polynomial machine is conservative: its field energy is 1.5 times the closed form. */
void test_the_field_energy_of_a_conservative_map_is_a_function_of_its_state(void)
{
    map = poly_map();
    plant = plant_create(&p, map);
    const plant_truth_t *t = plant_truth(plant);
    run_with_large_changes(3100);
    const double field = 1.5 * (poly_field_energy(t->i_dm_A, t->i_qm_A));
    TEST_ASSERT_TRUE(field > 3.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4 * t->e_copper_J, t->e_copper_J + t->e_mechanical_J + field, t->e_electrical_J);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3 * field, field, t->e_field_J);
}

/* The measured map is not exactly conservative: its balance holds with the field energy integrated along the path, not
 * with a function of the state. */
void test_the_energy_of_the_measured_map_balances_along_its_path(void)
{
    map = hsm1_map();
    TEST_ASSERT_NOT_NULL_MESSAGE(map, "cannot read " HSM1_CSV);
    p.iron_k_e = 0.02;
    plant = plant_create(&p, map);
    const plant_truth_t *t = plant_truth(plant);
    run_with_large_changes(3100);
    const double out = t->e_copper_J + t->e_iron_J + t->e_mechanical_J + t->e_field_J;
    TEST_ASSERT_DOUBLE_WITHIN(1e-4 * t->e_copper_J, out, t->e_electrical_J);
    TEST_ASSERT_EQUAL(0, t->inversion_failures);
}

/* Work of the air-gap torque = kinetic energy + load + friction, each computed here from the speeds. */
void test_the_work_of_the_air_gap_torque_accelerates_a_free_rotor_and_drives_its_load(void)
{
    p.imposed_speed = 0;
    p.inertia_kgm2 = 0.05;
    p.load_Nm = 20.0;
    p.viscous_Nms = 0.02;
    plant = plant_create(&p, NULL);
    const plant_truth_t *t = plant_truth(plant);
    const double at_start = 0.5 * p.inertia_kgm2 * t->speed_rad_s * t->speed_rad_s;
    double load = 0.0, friction = 0.0;
    for (int k = 0; k < 2000; k++) {
        const double before = t->speed_rad_s;
        run_with_large_changes(1);
        const double mean = 0.5 * (before + t->speed_rad_s);
        load += 1e-4 * p.load_Nm * mean;
        friction += 1e-4 * p.viscous_Nms * mean * mean;
    }
    const double now = 0.5 * p.inertia_kgm2 * t->speed_rad_s * t->speed_rad_s;
    TEST_ASSERT_TRUE(fabs(now - at_start) > 100.0 && friction > 10.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4 * fabs(now - at_start), t->e_mechanical_J, now - at_start + load + friction);
}

/* No torque: J dw/dt = -T - B w, so w = (w0 + T/B) e^(-B t/J) - T/B, second order in 10 us. */
void test_the_speed_of_a_coasting_rotor_decays_exponentially(void)
{
    p.imposed_speed = 0;
    p.inertia_kgm2 = 0.01;
    p.load_Nm = 0.4;
    p.viscous_Nms = 0.01;
    p.psi_f_Vs = 0.0;
    plant = plant_create(&p, NULL);
    const plant_truth_t *t = plant_truth(plant);
    const double off[3] = {0.5, 0.5, 0.5};
    for (int k = 0; k < 5000; k++) {
        plant_advance(plant, off, 0);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-7, (250.0 + 40.0) * exp(-0.5) - 40.0, t->speed_rad_s);
    /* angle: J/B (w0 - w) - T t/B, modulo 2 pi */
    const double angle = (250.0 - t->speed_rad_s) - 40.0 * 0.5;
    TEST_ASSERT_DOUBLE_WITHIN(1e-5, fmod(angle, TWO_PI), t->theta_m_rad);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, t->speed_rad_s * 30.0 / PI, t->speed_rpm);
}

static void driven_by(double load_Nm, int periods)
{
    const double off[3] = {0.5, 0.5, 0.5};
    plant_params(plant)->load_Nm = load_Nm;
    for (int k = 0; k < periods; k++) {
        plant_advance(plant, off, 0);
    }
}

/* 1 N m hold a rotor at rest, 0.5 N m brake one that turns: 0.9 N m do not move it, 1.1 N m do, and then the 0.6 N m
 * that are left accelerate 0.01 kg m^2 by 60 rad/s^2, up to the speed that the Stribeck range of 0.1 rad/s costs. */
void test_stiction_holds_a_rotor_until_more_acts_on_it(void)
{
    p.imposed_speed = 0;
    p.speed_rad_s = 0.0;
    p.inertia_kgm2 = 0.01;
    p.coulomb_Nm = 0.5;
    p.stiction_Nm = 1.0;
    p.stribeck_rad_s = 0.1;
    p.psi_f_Vs = 0.0;
    plant = plant_create(&p, NULL);
    const plant_truth_t *t = plant_truth(plant);
    driven_by(-0.9, 1000);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, t->speed_rad_s);
    driven_by(0.9, 1000);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, t->speed_rad_s);
    driven_by(-1.1, 1000);
    TEST_ASSERT_DOUBLE_WITHIN(0.5, 6.0, t->speed_rad_s);
}

/* 0.5 N m on 0.01 kg m^2: 50 rad/s^2 less, then a rotor at rest, to the last bit. */
void test_dry_friction_brakes_a_rotor_evenly_and_does_not_turn_it_back(void)
{
    p.imposed_speed = 0;
    p.speed_rad_s = -10.0;
    p.inertia_kgm2 = 0.01;
    p.coulomb_Nm = 0.5;
    p.psi_f_Vs = 0.0;
    plant = plant_create(&p, NULL);
    const plant_truth_t *t = plant_truth(plant);
    driven_by(0.0, 1000);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, -5.0, t->speed_rad_s);
    driven_by(0.0, 1100);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, t->speed_rad_s);
}

/* At the Stribeck speed 1/e of the difference is left: 0.5 + 1/e = 0.8679 N m. */
void test_dry_friction_reduces_the_shaft_torque_by_stribecks_curve(void)
{
    p.speed_rad_s = -2.0;
    p.coulomb_Nm = 0.5;
    p.stiction_Nm = 1.5;
    p.stribeck_rad_s = 2.0;
    plant = plant_create(&p, NULL);
    driven_by(0.0, 1);
    const plant_truth_t *t = plant_truth(plant);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, t->torque_mean_Nm + 0.5 + exp(-1.0), t->torque_shaft_mean_Nm);
}

/* Friction belongs to the machine: at an imposed speed it reduces the shaft torque. */
void test_shaft_torque_is_air_gap_torque_less_friction(void)
{
    p.viscous_Nms = 0.03;
    plant = plant_create(&p, NULL);
    run_with_large_changes(10);
    const plant_truth_t *t = plant_truth(plant);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, t->torque_mean_Nm - 7.5, t->torque_shaft_mean_Nm);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, t->torque_mean_Nm * 250.0, t->mechanical_W);
}

/* Field energy of a closed loop of currents, 0 -> i_d -> i_q -> 0 -> 0. For a conservative map it is zero up to the
 * error of the quadrature. */
static double loop_energy(const plant_map_t *m, double d_A, double q_A)
{
    const double corner[5][2] = {{0, 0}, {d_A, 0}, {d_A, q_A}, {0, q_A}, {0, 0}};
    double sum = 0.0, before[2], now[2];
    plant_map_flux(m, 0.0, 0.0, &before[0], &before[1], NULL);
    for (int side = 0; side < 4; side++) {
        for (int k = 1; k <= 2000; k++) {
            const double f = k / 2000.0, g = (k - 0.5) / 2000.0;
            const double *a = corner[side], *b = corner[side + 1];
            plant_map_flux(m, a[0] + f * (b[0] - a[0]), a[1] + f * (b[1] - a[1]), &now[0], &now[1], NULL);
            sum += 1.5 * (a[0] + g * (b[0] - a[0])) * (now[0] - before[0]);
            sum += 1.5 * (a[1] + g * (b[1] - a[1])) * (now[1] - before[1]);
            before[0] = now[0], before[1] = now[1];
        }
    }
    return sum;
}

/* The energy of the loop on the measured map is a property of the data (docs/theory/plant.md, section 6): below 2 % of
 * the 20 J of field energy at the far corner. */
void test_a_closed_current_loop_returns_the_field_energy(void)
{
    map = poly_map();
    TEST_ASSERT_DOUBLE_WITHIN(1e-5, 0.0, loop_energy(map, -200.0, 200.0));
    plant_map_t *hsm1 = hsm1_map();
    TEST_ASSERT_NOT_NULL_MESSAGE(hsm1, "cannot read " HSM1_CSV);
    const double measured = loop_energy(hsm1, -200.0, 200.0);
    plant_map_destroy(hsm1);
    TEST_ASSERT_DOUBLE_WITHIN(0.4, 0.0, measured);
}

/* A short circuit at high speed keeps the stator flux nearly constant. Half an electrical turn later it opposes the
 * magnet and needs i_d = -800 A, 550 A beyond the edge of the map. The energy balance holds there too. The currents
 * never change by more than |di| <= |dpsi|/0.11 mH, the smallest slope of the map in any direction, and end at the
 * steady state of u_d = u_q = 0. */
void test_the_energy_of_a_short_circuit_that_leaves_the_map_balances_along_its_path(void)
{
    map = hsm1_map();
    TEST_ASSERT_NOT_NULL_MESSAGE(map, "cannot read " HSM1_CSV);
    plant = plant_create(&p, map);
    const plant_truth_t *t = plant_truth(plant);
    const double zero[3] = {0.0, 0.0, 0.0}, w = 3.0 * 1000.0;
    plant_set_state(plant, 0.0, -100.0, 0.0, 1000.0);
    double i_d_min = 0.0;
    for (int k = 0; k < 5000; k++) {
        const plant_truth_t before = *t;
        plant_advance(plant, zero, 1);
        i_d_min = fmin(i_d_min, t->i_d_A);
        const double change_Vs = hypot(t->psi_d_Vs - before.psi_d_Vs, t->psi_q_Vs - before.psi_q_Vs);
        TEST_ASSERT_TRUE(hypot(t->i_d_A - before.i_d_A, t->i_q_A - before.i_q_A) <= change_Vs / 0.11e-3);
    }
    const double out = t->e_copper_J + t->e_mechanical_J + t->e_field_J;
    TEST_ASSERT_DOUBLE_WITHIN(1e-4 * t->e_copper_J, out, t->e_electrical_J);
    TEST_ASSERT_EQUAL(0, t->inversion_failures);
    TEST_ASSERT_TRUE(i_d_min < -750.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.02 * t->i_d_A, w * t->psi_q_Vs);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.02 * t->i_q_A, -w * t->psi_d_Vs);
}

/* Loops of up to three times the map's range, where the field energy is 205 J at the far corner. Beyond the edge the
 * cross slopes decrease, and with them the asymmetry, so that the share of the loop is no larger than inside: 2 %. */
void test_a_closed_current_loop_outside_the_map_returns_the_field_energy(void)
{
    plant_map_t *hsm1 = hsm1_map();
    TEST_ASSERT_NOT_NULL_MESSAGE(hsm1, "cannot read " HSM1_CSV);
    map = poly_map();
    for (double reach = 300.0; reach <= 750.0; reach += 150.0) {
        const double bound = 0.02 * 205.0 *
                             pow(reach / 750.0, 2.0); /* smaller than 2 % of the field energy at this corner */
        TEST_ASSERT_DOUBLE_WITHIN(bound, 0.0, loop_energy(map, -reach, reach));
        TEST_ASSERT_DOUBLE_WITHIN(bound, 0.0, loop_energy(map, reach, reach));
        TEST_ASSERT_DOUBLE_WITHIN(bound, 0.0, loop_energy(hsm1, -reach, reach));
        TEST_ASSERT_DOUBLE_WITHIN(bound, 0.0, loop_energy(hsm1, reach, reach));
    }
    plant_map_destroy(hsm1);
}
