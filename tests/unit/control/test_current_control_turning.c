/* SPDX-License-Identifier: Apache-2.0 */
#include <complex.h>
#include <math.h>

#include "control/current/current_control_turning.h"
#include "fixture.h"
#include "unity.h"

static const double turn = 1.5; /* omega_b T_s: the twin's SI bases are 1, so that a period is 1.5 long */
static const double v_ratio = 0.6;
static const double q29 = 536870912.0;
static const double q28 = 268435456.0;
static const double two_pi = 6.283185307179586476925;

static turning_control_config_t config;
static current_control_config_t limits;
static motor_si_t si;
static turning_control_state_t state;
static current_target_t target;
static flux_point_t flux;
static turning_control_in_t in;
static current_control_out_t out;

static int32_t q31_of(double x)
{
    return (int32_t)lround(x * 2147483648.0);
}

void setUp(void)
{
    si = (motor_si_t){.turning_approach = 1.0 / 2.75,
                      .turning_feedback = 0.28,
                      .turning_integral = 0.045,
                      .period_s = turn,
                      .r_ohm_20 = 0.02,
                      .v_ratio = v_ratio,
                      .v_base_V = 1.0};
    config = (turning_control_config_t){
        .per_period_q29 = q31_of(1.0 / turn / 4.0),
        .approach_q32 = q31_of(2.0 * si.turning_approach),
        .feedback_q32 = q31_of(2.0 * si.turning_feedback),
        .integral_q32 = q31_of(2.0 * si.turning_integral),
        .drop_q29 = q31_of(turn * si.r_ohm_20 / 4.0),
    };
    limits = (current_control_config_t){
        .tracking_gain_q34 = q31_of(turn * v_ratio / 2.0),
        .per_ratio_q31 = (uint32_t)lround(2147483648.0 / v_ratio),
        .clear_q30 = (uint32_t)lround(1073741824.0 * 0.9),
    };
    target = (current_target_t){0};
    flux = (flux_point_t){0};
    turning_control_reset(&state, &flux);
    in = (turning_control_in_t){.control = {.target = &target, .flux = &flux, .v_dc = 32767}};
}

void tearDown(void)
{
}

static void turn_by(double theta)
{
    in.angle_step = (int32_t)lround(theta / two_pi * 4294967296.0);
    target.turn = (theta < 0.0) ? -1 : 0;
}

static double complex of_q29(dq_q29_t x)
{
    return x.d / q29 + I * (x.q / q29);
}

static double complex of_q28(dq_q28_t x)
{
    return x.d / q28 + I * (x.q / q28);
}

static void step(void)
{
    out = turning_control_step(&config, &limits, &state, &in);
}

/* After the limit, per unit of V_b. */
static double complex acting(void)
{
    const double v_max = v_ratio * from_q15(in.control.v_dc);
    return v_max * (from_q15((int16_t)out.v) + I * from_q15((int16_t)(out.v >> 16)));
}

static double complex before_limit(void)
{
    return from_q15(out.u.d) + I * from_q15(out.u.q);
}

static twin_dq_t pair(double complex x)
{
    return (twin_dq_t){creal(x), cimag(x)};
}

static double complex number(twin_dq_t x)
{
    return x.d + I * x.q;
}

/* The twin with the same state and inputs. Returns the voltage that acts. */
static double complex twin_step(twin_turning_state_t *twin, double theta)
{
    const twin_flux_t psi = {.psi_d = from_q15(flux.psi_d), .psi_q = from_q15(flux.psi_q)};
    const twin_turning_in_t x = {
        {{.psi = {from_q15(target.psi.d), from_q15(target.psi.q)}}, &psi, theta / turn, from_q15(in.control.v_dc)},
        {from_q15(in.i.d), from_q15(in.i.q)},
        theta,
        from_q15(in.psi_d_error)};
    *twin = (twin_turning_state_t){
        .s = pair(of_q28(state.s) / turn), .now = pair(of_q29(state.now)), .next = pair(of_q29(state.next))};
    return number(twin_turning_control(&si, twin, &x));
}

static dq_q29_t random_flux(uint64_t *seed, int32_t largest)
{
    return (dq_q29_t){random_in(seed, -largest, largest) * 16384, random_in(seed, -largest, largest) * 16384};
}

static void randomise(uint64_t *seed, int32_t largest)
{
    const dq_q29_t s = random_flux(seed, 3000);
    state = (turning_control_state_t){
        .s = {s.d / 2, s.q / 2}, .now = random_flux(seed, largest), .next = random_flux(seed, largest)};
    flux = (flux_point_t){.psi_d = random_in(seed, -largest, largest), .psi_q = random_in(seed, -largest, largest)};
    target.psi = (dq_q15_halfword_t){(q15_t)random_in(seed, -largest, largest),
                                     (q15_t)random_in(seed, -largest, largest)};
    in.i = (dq_q15_t){random_in(seed, -20000, 20000), random_in(seed, -20000, 20000)};
    in.psi_d_error = (q15_t)random_in(seed, -3000, 3000);
}

/* Near a boundary of the circle's 256 steps, stage and twin may use different ones. */
static bool is_between_steps(double complex u, double max)
{
    const double d = fabs(creal(u)) / max * 256.0, q = fabs(cimag(u)) / max * 256.0;
    return fabs(d - round(d)) < 0.1 || fabs(q - round(q)) < 0.1;
}

/* Sine and cosine have 3.2e-5; times sums of fluxes below 3, over omega_b T_s. The cut's circle has 1/256. */
void test_a_step_follows_the_twin_at_every_angle_in_both_directions(void)
{
    worst_t voltage = {0}, acts = {0}, model = {0}, integrated = {0};
    uint64_t seed = 91;
    int limited = 0;
    for (int n = 0; n < 100000; n++) {
        randomise(&seed, (n % 2) ? 15000 : 5000);
        in.control.v_dc = random_in(&seed, 2500, 25000);
        const double theta = random_in(&seed, -1200, 1200) * 1e-3;
        turn_by(theta);
        twin_turning_state_t twin;
        const double complex want = twin_step(&twin, theta);
        const double max = v_ratio * from_q15(in.control.v_dc);
        step();
        if (cabs(number(twin.unlimited)) > 0.99) {
            continue; /* the stage limits it to V_b first */
        }
        worst_note(&voltage, cabs(before_limit() - number(twin.unlimited)), "theta %g", theta);
        worst_note(&integrated, cabs(of_q28(state.s) / turn - number(twin.s)), "theta %g", theta);
        if (!twin.limited || !is_between_steps(number(twin.unlimited), max)) {
            limited += twin.limited;
            worst_note(&acts, cabs(acting() - want), "theta %g v_dc %d", theta, in.control.v_dc);
            worst_note(&model, cabs(of_q29(state.next) - number(twin.next)), "theta %g", theta);
        }
    }
    TEST_ASSERT_GREATER_THAN_INT(10000, limited);
    ASSERT_WORST(voltage, 2e-4);
    ASSERT_WORST(integrated, 1e-5);
    ASSERT_WORST(acts, 4e-4);
    ASSERT_WORST(model, 8e-4);
}

void test_the_model_starts_from_the_machines_flux_and_its_voltage_is_the_rotational_one(void)
{
    flux = (flux_point_t){.psi_d = 12000, .psi_q = -5000};
    state.s.d = 1000;
    turning_control_reset(&state, &flux);
    TEST_ASSERT_EQUAL_INT32(0, state.s.d);
    target.psi = (dq_q15_halfword_t){12000, -5000};
    turn_by(1.0);
    step();
    const double complex psi = from_q15(12000) + I * from_q15(-5000);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.0, cabs(before_limit() - 2.0 * I * sin(0.5) * psi / turn));
    TEST_ASSERT_TRUE(out.clear);
}

/* (CC-12) with a table whose slope is `slope` times the machine's. */
typedef struct {
    double complex psi, acts;
    double slope;
} machine_t;

static machine_t machine_at(double psi_d, double slope)
{
    flux = (flux_point_t){.psi_d = (int32_t)lround(32768.0 * psi_d)};
    turning_control_reset(&state, &flux);
    return (machine_t){.psi = psi_d, .slope = slope};
}

static void run(machine_t *machine, double theta, int periods)
{
    turn_by(theta);
    for (int n = 0; n < periods; n++) {
        flux = (flux_point_t){.psi_d = (int32_t)lround(32768.0 * creal(machine->psi)),
                              .psi_q = (int32_t)lround(32768.0 * cimag(machine->psi))};
        step();
        machine->psi = cexp(-I * theta) * machine->psi + machine->slope * turn * cexp(-0.5 * I * theta) * machine->acts;
        machine->acts = acting();
    }
}

/* The flux follows the model, two periods after it, whatever the angle: no overshoot, nothing on the other axis. */
void test_a_step_reaches_the_machine_without_overshoot_or_cross_coupling_at_every_speed(void)
{
    static const double angles[] = {-1.2, -0.5, 0.0, 0.1, 0.36, 0.6, 0.8, 1.0, 1.2};
    for (unsigned k = 0; k < sizeof angles / sizeof *angles; k++) {
        machine_t machine = machine_at(0.3, 1.0);
        machine.acts = 2.0 * I * sin(0.5 * angles[k]) / turn * machine.psi;
        target.psi = (dq_q15_halfword_t){9830, 0};
        run(&machine, angles[k], 30);
        target.psi.q = 3000;
        double largest_q = 0.0, smallest_d = 1.0;
        for (int n = 0; n < 40; n++) {
            run(&machine, angles[k], 1);
            largest_q = fmax(largest_q, cimag(machine.psi));
            smallest_d = fmin(smallest_d, creal(machine.psi));
        }
        TEST_ASSERT_DOUBLE_WITHIN(3e-4, 3000.0 / 32768.0, cimag(machine.psi));
        TEST_ASSERT_TRUE(largest_q < 3010.0 / 32768.0);
        TEST_ASSERT_TRUE(smallest_d > 0.3 - 5e-4);
    }
}

/* The phase margin of 44 degrees and more shows as tables that may be wrong by a factor. */
void test_tables_at_half_and_at_twice_the_true_slope_are_stable_at_every_speed(void)
{
    for (double theta = -1.2; theta < 1.21; theta += 0.1) {
        for (double slope = 0.5; slope < 2.1; slope *= 2.0) {
            machine_t machine = machine_at(0.2, slope);
            machine.acts = 2.0 * I * sin(0.5 * theta) / turn * machine.psi;
            target.psi = (dq_q15_halfword_t){6554, 1000};
            run(&machine, theta, 400);
            TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.0, cabs(machine.psi - (6554.0 + 1000.0 * I) / 32768.0));
        }
    }
}

/* (CC-20): what the voltage cannot do the model does not expect; afterwards nothing overshoots. */
void test_at_the_voltage_limit_the_model_goes_as_far_as_the_voltage_reaches(void)
{
    machine_t machine = machine_at(0.3, 1.0);
    const double theta = 0.6;
    machine.acts = 2.0 * I * sin(0.5 * theta) / turn * machine.psi;
    target.psi = (dq_q15_halfword_t){9830, 0};
    run(&machine, theta, 20);
    target.psi = (dq_q15_halfword_t){9830, 14000};
    in.control.v_dc = 11400; /* a circle of 0.209: the rotational voltage of the target needs 0.206 */
    int limited = 0;
    for (int n = 0; n < 12; n++) {
        run(&machine, theta, 1);
        limited += out.limited != 0U;
        const turning_control_state_t *s = &state;
        const double complex reached = cexp(-I * theta) * machine.psi + turn * cexp(-0.5 * I * theta) * machine.acts;
        TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.0, cabs(of_q29(s->next) - reached));
    }
    TEST_ASSERT_TRUE(limited > 0);
    double largest = 0.0;
    for (int n = 0; n < 60; n++) {
        run(&machine, theta, 1);
        largest = fmax(largest, cimag(machine.psi));
    }
    TEST_ASSERT_DOUBLE_WITHIN(2e-3, 14000.0 / 32768.0, cimag(machine.psi));
    TEST_ASSERT_TRUE(largest < 1.05 * 14000.0 / 32768.0);
}

/* A machine generates in field weakening with all of its flux on the q axis, and the dc voltage falls at once: the
 * voltage of one period is 14 % too small, then 4 % less are left than its flux needs, on the d axis alone. The
 * reference stays. Only a smaller q flux gives the d axis its voltage. Without (CC-14) the q axis keeps its flux, and
 * the d flux falls by a period's share of these 4 % in each period, that is |i_d| grows until the drive trips. */
void test_the_d_flux_does_not_run_away_when_the_dc_voltage_falls(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        const double theta = 0.31 * sign, psi_q = -0.3 * sign;
        const double needed = 2.0 * sin(0.5 * 0.31) / turn * 0.3;
        machine_t machine = {.psi = I * psi_q, .slope = 1.0, .acts = 2.0 * I * sin(0.5 * theta) / turn * I * psi_q};
        flux = (flux_point_t){.psi_q = (int32_t)lround(32768.0 * psi_q)};
        turning_control_reset(&state, &flux);
        target.psi = (dq_q15_halfword_t){0, (q15_t)flux.psi_q};
        in.control.v_dc = (int32_t)lround(1.1 * needed / v_ratio * 32768.0);
        run(&machine, theta, 20);
        machine.acts *= 0.86;
        in.control.v_dc = (int32_t)lround(0.96 * needed / v_ratio * 32768.0);
        double least = 0.0;
        for (int n = 0; n < 40; n++) {
            run(&machine, theta, 1);
            least = fmin(least, creal(machine.psi));
        }
        TEST_ASSERT_TRUE(least > -0.02); /* 0.14 * 0.31 * 0.3 = 0.013 are of the first period */
    }
}

/* Nothing wraps: the sanitizers run this test too, and the results keep their limits. */
void test_extreme_inputs_stay_within_their_limits(void)
{
    static const int32_t corner[3] = {-32768, 0, 32767};
    uint64_t seed = 92;
    for (int n = 0; n < 20000; n++) {
        flux = (flux_point_t){.psi_d = corner[random_in(&seed, 0, 2)], .psi_q = corner[random_in(&seed, 0, 2)]};
        target.psi = (dq_q15_halfword_t){(q15_t)corner[random_in(&seed, 0, 2)], (q15_t)corner[random_in(&seed, 0, 2)]};
        in.i = (dq_q15_t){corner[random_in(&seed, 0, 2)], corner[random_in(&seed, 0, 2)]};
        in.psi_d_error = (q15_t)corner[random_in(&seed, 0, 2)];
        in.control.v_dc = random_in(&seed, 0, 1) ? 32767 : random_in(&seed, 0, 2000);
        in.angle_step = (int32_t)random_u32(&seed);
        step();
        TEST_ASSERT_TRUE(cabs(of_q29(state.next)) < 1.5 && cabs(of_q28(state.s)) < 3.0);
        TEST_ASSERT_TRUE(out.u.d >= -32768 && out.u.d <= 32767);
    }
}

void test_a_motor_without_these_constants_does_not_use_them(void)
{
    TEST_ASSERT_TRUE(turning_control_used(&config));
    config.per_period_q29 = 0;
    TEST_ASSERT_FALSE(turning_control_used(&config));
}
