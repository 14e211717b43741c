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

/* A second of wild voltages around the steady ones, so that every form of energy moves. */
static void wild_run(int periods)
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

/* The terms are integrated one by one (mid-point current, trapezoidal torque): they agree to second
 * order, some 1e-5 of the energy that went through. */
void test_constants_take_in_what_they_burn_turn_and_store(void)
{
    p.iron_k_h = 10.0;
    p.iron_k_e = 0.02;
    plant = plant_create(&p, NULL);
    const plant_truth_t *t = plant_truth(plant);
    wild_run(3100);
    TEST_ASSERT_TRUE(t->e_copper_J > 10.0 && t->e_iron_J > 10.0 && stored(t) > 1.0);
    const double out = t->e_copper_J + t->e_iron_J + t->e_mechanical_J + stored(t);
    TEST_ASSERT_DOUBLE_WITHIN(3e-5 * t->e_copper_J, out, t->e_electrical_J);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9 * t->e_copper_J, stored(t), t->e_field_J);
}

/* The polynomial machine is conservative; its field energy in closed form, times 1.5. */
void test_a_conservative_map_gives_back_the_field_energy_it_took(void)
{
    map = poly_map();
    plant = plant_create(&p, map);
    const plant_truth_t *t = plant_truth(plant);
    wild_run(3100);
    const double field = 1.5 * (poly_field_energy(t->i_dm_A, t->i_qm_A));
    TEST_ASSERT_TRUE(field > 3.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4 * t->e_copper_J, t->e_copper_J + t->e_mechanical_J + field, t->e_electrical_J);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3 * field, field, t->e_field_J);
}

/* The measured map need not be conservative: the balance then holds with the field energy as it was
 * integrated along the path, not with a function of the state. */
void test_the_measured_map_balances_along_its_path(void)
{
    map = hsm1_map();
    TEST_ASSERT_NOT_NULL_MESSAGE(map, "cannot read " HSM1_CSV);
    p.iron_k_e = 0.02;
    plant = plant_create(&p, map);
    const plant_truth_t *t = plant_truth(plant);
    wild_run(3100);
    const double out = t->e_copper_J + t->e_iron_J + t->e_mechanical_J + t->e_field_J;
    TEST_ASSERT_DOUBLE_WITHIN(1e-4 * t->e_copper_J, out, t->e_electrical_J);
    TEST_ASSERT_EQUAL(0, t->inversion_failures);
}

/* Air-gap work = kinetic energy + load + friction, each computed here from the speeds and angles.
 */
void test_a_free_rotor_takes_up_the_air_gap_work(void)
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
        wild_run(1);
        const double mean = 0.5 * (before + t->speed_rad_s);
        load += 1e-4 * p.load_Nm * mean;
        friction += 1e-4 * p.viscous_Nms * mean * mean;
    }
    const double now = 0.5 * p.inertia_kgm2 * t->speed_rad_s * t->speed_rad_s;
    TEST_ASSERT_TRUE(fabs(now - at_start) > 100.0 && friction > 10.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4 * fabs(now - at_start), t->e_mechanical_J, now - at_start + load + friction);
}

/* No torque: J dw/dt = -T - B w, so w = (w0 + T/B) e^(-B t/J) - T/B, second order in 10 us. */
void test_a_coasting_rotor_slows_down_as_the_exponential_says(void)
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
    /* angle: J/B (w0 - w) - T t/B, in turns of 2 pi */
    const double angle = (250.0 - t->speed_rad_s) - 40.0 * 0.5;
    TEST_ASSERT_DOUBLE_WITHIN(1e-5, fmod(angle, TWO_PI), t->theta_m_rad);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, t->speed_rad_s * 30.0 / PI, t->speed_rpm);
}

/* Friction belongs to the machine: at an imposed speed the shaft has that much less. */
void test_shaft_torque_is_air_gap_torque_less_friction(void)
{
    p.viscous_Nms = 0.03;
    plant = plant_create(&p, NULL);
    wild_run(10);
    const plant_truth_t *t = plant_truth(plant);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, t->torque_mean_Nm - 7.5, t->torque_shaft_mean_Nm);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, t->torque_mean_Nm * 250.0, t->mechanical_W);
}

/* A map that lets energy appear in a closed loop would show here: the loop runs d down, q up, d up,
 * q down. For the conservative polynomial the sum is zero to the quadrature's error. */
static double loop_energy(const plant_map_t *m, double d_A, double q_A)
{
    const double corner[5][2] = {{0, 0}, {d_A, 0}, {d_A, q_A}, {0, q_A}, {0, 0}};
    double sum = 0.0, was[2], now[2];
    plant_map_flux(m, 0.0, 0.0, &was[0], &was[1], NULL);
    for (int side = 0; side < 4; side++) {
        for (int k = 1; k <= 2000; k++) {
            const double f = k / 2000.0, g = (k - 0.5) / 2000.0;
            const double *a = corner[side], *b = corner[side + 1];
            plant_map_flux(m, a[0] + f * (b[0] - a[0]), a[1] + f * (b[1] - a[1]), &now[0], &now[1], NULL);
            sum += 1.5 * (a[0] + g * (b[0] - a[0])) * (now[0] - was[0]);
            sum += 1.5 * (a[1] + g * (b[1] - a[1])) * (now[1] - was[1]);
            was[0] = now[0], was[1] = now[1];
        }
    }
    return sum;
}

/* The measured map's loop is a property of the data, quoted in the theory page: below 2 % of the
 * 20 J that the field holds at the far corner. */
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

/* A short circuit at high speed: half an electrical turn on, the flux that was there lies the other
 * way round, against the magnet, and takes 800 A of i_d, 550 A past the map's edge. The balance
 * holds as it does inside; the currents move no further than the flux allows, |di| <= |dpsi|/0.11 mH,
 * the least slope of the map in any direction; they end where u_d = u_q = 0 is steady. */
void test_a_short_circuit_that_leaves_the_map_balances_along_its_path(void)
{
    map = hsm1_map();
    TEST_ASSERT_NOT_NULL_MESSAGE(map, "cannot read " HSM1_CSV);
    plant = plant_create(&p, map);
    const plant_truth_t *t = plant_truth(plant);
    const double zero[3] = {0.0, 0.0, 0.0}, w = 3.0 * 1000.0;
    plant_set_state(plant, 0.0, -100.0, 0.0, 1000.0);
    double furthest = 0.0;
    for (int k = 0; k < 5000; k++) {
        const plant_truth_t was = *t;
        plant_advance(plant, zero, 1);
        furthest = fmin(furthest, t->i_d_A);
        const double moved = hypot(t->psi_d_Vs - was.psi_d_Vs, t->psi_q_Vs - was.psi_q_Vs);
        TEST_ASSERT_TRUE(hypot(t->i_d_A - was.i_d_A, t->i_q_A - was.i_q_A) <= moved / 0.11e-3);
    }
    const double out = t->e_copper_J + t->e_mechanical_J + t->e_field_J;
    TEST_ASSERT_DOUBLE_WITHIN(1e-4 * t->e_copper_J, out, t->e_electrical_J);
    TEST_ASSERT_EQUAL(0, t->inversion_failures);
    TEST_ASSERT_TRUE(furthest < -750.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.02 * t->i_d_A, w * t->psi_q_Vs);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.02 * t->i_q_A, -w * t->psi_d_Vs);
}

/* The same loop two maps past the edge, where the field holds 205 J at the far corner. The edge's
 * asymmetry fades with its cross slopes, so the loop's share is no larger than inside: 2 %. */
void test_a_closed_current_loop_outside_the_map_returns_the_field_energy(void)
{
    plant_map_t *hsm1 = hsm1_map();
    TEST_ASSERT_NOT_NULL_MESSAGE(hsm1, "cannot read " HSM1_CSV);
    map = poly_map();
    for (double reach = 300.0; reach <= 750.0; reach += 150.0) {
        const double bound = 0.02 * 205.0 * pow(reach / 750.0, 2.0); /* falls faster than the field */
        TEST_ASSERT_DOUBLE_WITHIN(bound, 0.0, loop_energy(map, -reach, reach));
        TEST_ASSERT_DOUBLE_WITHIN(bound, 0.0, loop_energy(map, reach, reach));
        TEST_ASSERT_DOUBLE_WITHIN(bound, 0.0, loop_energy(hsm1, -reach, reach));
        TEST_ASSERT_DOUBLE_WITHIN(bound, 0.0, loop_energy(hsm1, reach, reach));
    }
    plant_map_destroy(hsm1);
}
