/* SPDX-License-Identifier: Apache-2.0 */
#include "safety/torque_monitor.h"

#include <math.h>

#include "fx/vec.h"
#include "types/faults.h"
#include "unity.h"

/* r = 0.0137, psi_f = 0.44, 10 N·m = 0.034, 7 V = 0.013: about those of hsm1. */
static const torque_monitor_config_t config = {.r = 898 << 15,
                                               .r_per_dC = 11564, /* 0.00393/K */
                                               .winding_min_dC = -400,
                                               .winding_max_dC = 1800,
                                               .psi_f = 14418,
                                               .t_0 = 1112,
                                               .v_0 = 425,
                                               .i_0 = 0,
                                               .rate_gain = 19867,
                                               .lag_gain = 433000, /* 6.6 steps */
                                               .lag_noise = 20,
                                               .v_lag = 53,
                                               .mean_rate = 8192,
                                               .torque_steps = 20,
                                               .angle_steps = 5,
                                               .settle_steps = 5};
static torque_monitor_state_t state;
static torque_monitor_in_t in;
static int16_t winding_dC = 200;

enum { SETTLING = 5, NOISE = 2000 };

static uint32_t monitor_step(const torque_monitor_config_t *c)
{
    in.current = fx_magnitude(in.i.d, in.i.q);
    in.r = torque_monitor_resistance(c, winding_dC);
    return torque_monitor_step(c, &state, &in);
}

static int32_t q15(double x)
{
    return (int32_t)lround(x * 32768.0);
}

/* A machine with l_d = 0.65, l_q = 1.6 and the given magnet in steady state, measured with an angle error. Voltages and
 * currents turn with the frame; the flux of the tables belongs to the measured current. */
static void machine(double omega, double i_d, double i_q, double magnet, double turned_deg)
{
    const double a = turned_deg * 3.14159265358979 / 180.0;
    const double psi_d = 0.44 * magnet + 0.65 * i_d;
    const double psi_q = 1.6 * i_q;
    const double u_d = 898.0 / 65536.0 * i_d - omega * psi_q;
    const double u_q = 898.0 / 65536.0 * i_q + omega * psi_d;
    const double d = cos(a) * i_d + sin(a) * i_q;
    const double q = cos(a) * i_q - sin(a) * i_d;
    in = (torque_monitor_in_t){
        .acting = true,
        .u = {q15(cos(a) * u_d + sin(a) * u_q), q15(cos(a) * u_q - sin(a) * u_d)},
        .i = {q15(d), q15(q)},
        .psi = {q15(0.44 + 0.65 * d), q15(1.6 * q)},
        .omega = (q15_t)q15(omega),
        .torque = (q15_t)q15(psi_d * i_q - psi_q * i_d),
    };
    in.u_mean = in.u;
}

static int steps_until(uint32_t fault)
{
    for (int n = 1; n <= 200; n++) {
        if (monitor_step(&config) & fault) {
            return n;
        }
    }
    return -1;
}

static void fresh(void)
{
    state = (torque_monitor_state_t){0};
}

void setUp(void)
{
    winding_dC = 200;
    fresh();
    machine(0.5, -0.2, 0.2, 1.0, 0.0);
}

void tearDown(void)
{
}

/* e = u_mean - r i - d psi/dt - j w psi, here 0.02 and -0.03 more than the machine's; not known while settling. */
void test_the_residual_of_the_voltages_is_kept_for_the_next_step(void)
{
    machine(0.3, -0.2, 0.3, 1.0, 0.0);
    in.u_mean.d += q15(0.02);
    in.u_mean.q -= q15(0.03);
    for (int n = 0; n < SETTLING; n++) {
        monitor_step(&config);
        TEST_ASSERT_EQUAL_INT(0, state.residual.d);
    }
    monitor_step(&config);
    TEST_ASSERT_INT_WITHIN(3, q15(0.02), state.residual.d);
    TEST_ASSERT_INT_WITHIN(3, q15(-0.03), state.residual.q);
    in.u_mean = (dq_q15_t){32767, -32768}; /* and a rotational voltage in the same direction */
    monitor_step(&config);
    TEST_ASSERT_EQUAL_INT(INT16_MAX, state.residual.d);
    TEST_ASSERT_EQUAL_INT(INT16_MIN, state.residual.q);
    in.acting = false;
    monitor_step(&config);
    TEST_ASSERT_EQUAL_INT(0, state.residual.d);
    TEST_ASSERT_EQUAL_INT(0, state.residual.q);
}

void test_a_sound_machine_raises_nothing_in_any_quadrant(void)
{
    for (int n = 0; n < 4; n++) {
        fresh();
        machine((n & 1) ? 0.9 : -0.5, -0.3, (n & 2) ? 0.25 : -0.25, 1.0, 0.0);
        TEST_ASSERT_EQUAL_INT(-1, steps_until(UINT32_MAX));
    }
}

void test_magnets_from_20_percent_weak_to_10_percent_strong_are_no_fault(void)
{
    static const double magnets[] = {0.8, 0.9, 1.05, 1.1};
    for (int n = 0; n < 4; n++) {
        fresh();
        machine(0.9, -0.3, 0.25, magnets[n], 0.0);
        TEST_ASSERT_EQUAL_INT(-1, steps_until(UINT32_MAX));
    }
}

/* The machine makes 0.126. Beyond the command 0.034, an eighth of it, and 0.013 |i|/|w| = 0.007 are allowed. */
void test_more_torque_than_requested_is_found_within_30_ms_of_settling(void)
{
    static const int signs[2] = {1, -1};
    for (int n = 0; n < 2; n++) {
        fresh();
        machine(0.5, -0.2, signs[n] * 0.2, 1.0, 0.0);
        in.torque = (q15_t)(signs[n] * q15(0.06));
        const int found = steps_until(FAULT_TORQUE);
        TEST_ASSERT_TRUE(found > SETTLING && found <= SETTLING + 30);
        fresh();
        in.torque = (q15_t)(signs[n] * q15(0.09));
        TEST_ASSERT_EQUAL_INT(-1, steps_until(FAULT_TORQUE));
    }
}

/* The machine brakes although driving is requested, and drives although braking is requested. */
void test_torque_against_the_request_is_found(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        fresh();
        machine(0.5, -0.2, sign * 0.2, 1.0, 0.0);
        in.torque = (q15_t)(-sign * q15(0.1));
        const int found = steps_until(FAULT_TORQUE);
        TEST_ASSERT_TRUE(found > SETTLING && found <= SETTLING + 30);
    }
}

void test_torque_of_either_sign_around_a_zero_request_is_found(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        fresh();
        machine(-0.5, -0.2, sign * 0.2, 1.0, 0.0);
        in.torque = 0;
        TEST_ASSERT_GREATER_THAN_INT(SETTLING, steps_until(FAULT_TORQUE));
    }
}

void test_too_little_torque_is_no_fault(void)
{
    in.torque = (q15_t)q15(0.3);
    TEST_ASSERT_EQUAL_INT(-1, steps_until(FAULT_TORQUE));
}

/* (MN-9): e_d is w psi_f sin(30) less a part that saliency compensates. */
void test_an_angle_that_is_30_degrees_off_is_found_in_5_ms(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        fresh();
        machine(0.5, 0.0, 0.05, 1.0, sign * 30.0);
        TEST_ASSERT_EQUAL_INT(SETTLING + 5, steps_until(FAULT_ANGLE_OFFSET));
    }
}

/* e_d allowed at w = 0.1: 288 + 33, v_0/2 = 212 and r |i| = 22. The mean voltage of a step has noise beyond v_0. */
void test_noise_of_the_voltage_is_no_wrong_angle(void)
{
    torque_monitor_config_t noisy = config;
    for (int32_t noise = 0; noise <= NOISE; noise += NOISE) {
        noisy.v_noise = (q15_t)noise;
        for (int beyond = 0; beyond <= 1; beyond++) {
            uint32_t faults = 0;
            fresh();
            machine(0.1, 0.0, 0.05, 1.0, 0.0);
            in.u_mean.d += noise + (beyond ? 600 : 510);
            for (int n = 0; n < 100; n++) {
                faults |= monitor_step(&noisy);
            }
            TEST_ASSERT_EQUAL_HEX32(beyond ? FAULT_ANGLE_OFFSET : 0U, faults & FAULT_ANGLE_OFFSET);
        }
    }
}

/* Current control answers the noise of the current sensors with the voltage of single periods: here 0.3 in every one
 * that is sampled. It leaves the mean over the step, and the angle with it. */
void test_the_voltage_of_a_single_period_says_nothing_about_the_angle(void)
{
    in.u.d += 10000;
    TEST_ASSERT_EQUAL_INT(-1, steps_until(FAULT_ANGLE_OFFSET));
    fresh();
    machine(0.5, -0.2, 0.2, 1.0, 0.0);
    in.u_mean.d += 10000;
    TEST_ASSERT_EQUAL_INT(SETTLING + 5, steps_until(FAULT_ANGLE_OFFSET));
}

void test_a_reversed_angle_is_found_in_5_ms(void)
{
    machine(0.5, -0.1, 0.05, 1.0, 180.0);
    TEST_ASSERT_EQUAL_INT(SETTLING + 5, steps_until(FAULT_ANGLE_OFFSET));
    fresh();
    machine(-0.5, -0.1, 0.05, 1.0, 180.0);
    TEST_ASSERT_EQUAL_INT(SETTLING + 5, steps_until(FAULT_ANGLE_OFFSET));
}

/* Below w = 0.0737 the threshold 0.2 psi_f w is smaller than v_0/2. */
void test_where_the_inverters_error_hides_the_back_emf_nothing_is_checked(void)
{
    machine(0.07, 0.0, 0.05, 1.0, 30.0);
    TEST_ASSERT_EQUAL_INT(-1, steps_until(FAULT_ANGLE_OFFSET));
}

/* A changing flux takes power that does not reach the shaft: i_d changes by 0.006 per step, psi_d by 0.0039. */
void test_power_that_changes_the_flux_is_no_torque(void)
{
    for (int n = 0; n < 40; n++) {
        machine(0.2, -0.3 + 0.006 * n, 0.3, 1.0, 0.0);
        if (n > 0) {
            const double change = 19867.0 / 65536.0 * 0.65 * 0.006;
            in.u.d += q15(change);
        }
        TEST_ASSERT_EQUAL_HEX32(0, monitor_step(&config));
    }
}

/* A torque reversal in 6 ms: i_q changes by 0.2 per step and psi_q by 0.32. This needs a voltage of 0.097, which has
 * ended before the sample is taken. At this speed the voltage of the magnet is 0.044. */
void test_a_reversal_that_ends_before_the_sample_is_no_wrong_angle(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        fresh();
        machine(0.1, 0.0, -0.6 * sign, 1.0, 0.0);
        TEST_ASSERT_EQUAL_INT(-1, steps_until(UINT32_MAX));
        for (int n = -2; n <= 3; n++) {
            machine(0.1, 0.0, 0.2 * n * sign, 1.0, 0.0);
            TEST_ASSERT_EQUAL_UINT32(0, monitor_step(&config) & FAULT_ANGLE_OFFSET);
        }
    }
}

/* psi_d rises by 0.03 per step: c = |d psi/dt| = 0.0091, less than v_0 = 0.013, so that only half of it counts. With
 * 0.2 w psi_f = 0.044, v_0/2 = 0.0065 and at most 0.0035 of r |i|, e_d may be 0.055 to 0.0585. */
void test_a_slowly_changing_flux_hides_no_wrong_angle(void)
{
    static const struct {
        double e_d;
        uint32_t fault;
    } cases[] = {{0.059, FAULT_ANGLE_OFFSET}, {-0.059, FAULT_ANGLE_OFFSET}, {0.054, 0}, {-0.054, 0}};
    for (unsigned int k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        uint32_t found = 0;
        fresh();
        for (int n = 0; n <= SETTLING + 5; n++) {
            machine(0.5, -0.25 + 0.03 / 0.65 * n, 0.0, 1.0, 0.0);
            in.u_mean.d += q15(cases[k].e_d + 19867.0 / 65536.0 * 0.03);
            in.u_mean.q += q15(-0.5 * 0.03 / 2.0); /* psi_d in the middle of the step */
            found |= monitor_step(&config);
        }
        TEST_ASSERT_EQUAL_HEX32(cases[k].fault, found & FAULT_ANGLE_OFFSET);
    }
}

/* The tracker of the drive, ten periods of it: w_n T_s = 0.03. */
typedef struct {
    double theta, omega, angle; /* tracked, tracked, of the rotor */
} tracker_t;

static void track(tracker_t *t, double omega, double acceleration)
{
    for (int n = 0; n < 10; n++) {
        t->angle += omega - acceleration * (9 - n) / 10.0;
        const double e = t->angle - t->theta - t->omega;
        t->theta += t->omega + 0.06 * e;
        t->omega += 0.0009 * e;
    }
}

/* Faults while a machine at its largest torque accelerates from one speed to the other and turns on. */
static uint32_t accelerated(const torque_monitor_config_t *c, double i_q, double from, double to)
{
    tracker_t tracker = {.omega = from};
    uint32_t found = 0;
    fresh();
    for (int n = 0; n < 140; n++) {
        const double share = fmin(fmax((n - 30) / 70.0, 0.0), 1.0), omega = from + (to - from) * share;
        machine(omega, -0.5, i_q, 1.0, 0.0);
        track(&tracker, omega, (share > 0.0 && share < 1.0) ? (to - from) / 70.0 : 0.0);
        in.omega = (q15_t)q15(tracker.omega);
        found |= monitor_step(c);
    }
    return found;
}

/* The tracked speed lags by 0.05 while the speed changes by 0.0076 per step, 80,000 rpm/s on hsm1. Without (MN-26) both
 * halves of the monitor find a fault in it. */
void test_a_speed_that_lags_is_neither_torque_nor_a_wrong_angle(void)
{
    torque_monitor_config_t lagging = config;
    lagging.lag_gain = 0;
    uint32_t without = 0;
    for (int sign = -1; sign <= 1; sign += 2) {
        for (int direction = -1; direction <= 1; direction += 2) {
            TEST_ASSERT_EQUAL_HEX32(0, accelerated(&config, 0.6 * sign, -0.266 * direction, 0.266 * direction));
            without |= accelerated(&lagging, 0.6 * sign, -0.266 * direction, 0.266 * direction);
        }
    }
    TEST_ASSERT_EQUAL_HEX32(FAULT_TORQUE | FAULT_ANGLE_OFFSET, without);
}

/* 10,000 rpm/s on hsm1: the thresholds rise with the lag that has been corrected, here by 0.006 of the speed base. */
void test_an_angle_that_is_30_degrees_off_is_found_while_the_speed_rises(void)
{
    int found = 0;
    for (int n = 1; n <= 40 && found == 0; n++) {
        machine(0.3 + 0.00095 * n, 0.0, 0.05, 1.0, 30.0);
        in.omega = (q15_t)(in.omega - q15(6.6 * 0.00095));
        found = (monitor_step(&config) & FAULT_ANGLE_OFFSET) ? n : 0;
    }
    TEST_ASSERT_EQUAL_INT(SETTLING + 5, found);
}

/* By how much a step of the tracked speed shows that it is behind: all but what one count feigns. */
void test_the_lag_of_the_tracked_speed_is_known_beyond_a_count(void)
{
    for (int sign = -1; sign <= 1; sign += 2) {
        state.omega = (q15_t)(sign * 1000);
        const int change[3] = {0, 3, 30};
        for (int n = 0; n < 3; n++) {
            const int tracked = sign * 1000 + sign * change[n];
            const int lag = (int)lround(change[n] * config.lag_gain / 65536.0);
            const int beyond = sign * (lag > config.lag_noise ? lag - config.lag_noise : 0);
            TEST_ASSERT_EQUAL_INT(beyond, torque_monitor_lag(&config, &state, (q15_t)tracked));
        }
    }
    /* 0.44 of the flux base, on both axes: 120/32768 of the speed base omit 52.8, and 124/32768 omit 54.6. */
    const dq_q15_t psi = {-8651, 11534};
    TEST_ASSERT_EQUAL_INT(0, torque_monitor_missing_voltage(0, psi));
    TEST_ASSERT_EQUAL_INT(53, torque_monitor_missing_voltage(120, psi));
    TEST_ASSERT_EQUAL_INT(1, torque_monitor_missing_voltage(1, (dq_q15_t){0, 24576})); /* 0.75, rounded */
    TEST_ASSERT_EQUAL_INT(55, torque_monitor_missing_voltage(124, psi));
    TEST_ASSERT_EQUAL_INT(55, torque_monitor_missing_voltage(-124, psi));
}

void test_nothing_is_checked_while_the_bridge_is_off_or_has_just_been_switched_on(void)
{
    in.torque = INT16_MIN;
    in.acting = false;
    TEST_ASSERT_EQUAL_INT(-1, steps_until(UINT32_MAX));
    in.acting = true;
    for (int n = 0; n < SETTLING; n++) {
        TEST_ASSERT_EQUAL_HEX32(0, monitor_step(&config));
    }
}

/* (MN-32): a winding of 12 V at standstill, where 0.1 of its voltage drops on it at 20 C and full current. */
static const struct {
    int16_t winding_dC, measured_dC;
    bool found;
} windings[] = {
    {200, 200, false},
    {1800, 1800, false},
    {-400, -400, false},
    {1800, 200, true},
    {200, 1800, true}, /* a sensor that reads 20 C, and one that reads 180 C */
    {1800, 3000, false},
    {1800, TEMPERATURE_UNKNOWN, false},
    {-400, TEMPERATURE_OUT_OF_RANGE, false},
    {3000, 3000, true}, /* beyond its trip */
};

void test_the_resistance_is_that_of_the_windings_temperature_or_of_any_that_it_may_have(void)
{
    torque_monitor_config_t lossy = config;
    lossy.r = 6554 << 15;
    lossy.r_per_dC = 84406;
    lossy.v_0 = 100;
    lossy.t_0 = 100;
    for (unsigned int k = 0; k < sizeof windings / sizeof windings[0]; k++) {
        fresh();
        machine(0.01, -0.6, 0.4, 1.0, 0.0);
        const double r = 0.1 * (1.0 + 0.000393 * (windings[k].winding_dC - 200)) - 898.0 / 65536.0;
        in.u.d += q15(-0.6 * r);
        in.u.q += q15(0.4 * r);
        winding_dC = windings[k].measured_dC;
        uint32_t found = 0;
        for (int n = 0; n < 60; n++) {
            found |= monitor_step(&lossy);
        }
        TEST_ASSERT_EQUAL_MESSAGE(windings[k].found, (found & FAULT_TORQUE) != 0U, "case of the table");
    }
}

/* A monitor without tolerances of its own, which decides in one step, at half of the speed base. */
static const torque_monitor_config_t exact = {.winding_min_dC = -400,
                                              .winding_max_dC = 1800,
                                              .mean_rate = 8192,
                                              .torque_steps = 1,
                                              .angle_steps = 1,
                                              .settle_steps = SETTLING};

/* Faults where the mean of the deviation has settled at this value, and nothing changes. */
static uint32_t faults_at(const torque_monitor_config_t *c, int32_t deviation)
{
    in.acting = true;
    state = (torque_monitor_state_t){
        .psi = in.psi, .omega = in.omega, .deviation = deviation * 65536, .settling = SETTLING};
    return monitor_step(c);
}

/* Whether the torque is a fault with i_q = 0.5 and this voltage without resistance: the power is half of it, that of
 * the command half of the torque, and the limit half of t_0 + |T|/8. */
static bool torque_found(q15_t t_0, int32_t torque, int32_t u_q)
{
    torque_monitor_config_t c = exact;
    c.t_0 = t_0;
    in = (torque_monitor_in_t){.u = {0, u_q}, .i = {0, 16384}, .omega = 16384, .torque = (q15_t)torque};
    return (faults_at(&c, (u_q - torque) / 2) & FAULT_TORQUE) != 0U;
}

/* A command of 16000 has the power 8000 and the limit 1000, one of 0 with t_0 = 1000 the limit 500. */
void test_the_limits_of_the_power_are_exact(void)
{
    static const struct {
        int16_t torque, inside, beyond;
    } cases[] = {{16000, 18000, 18002}, {16000, -2000, -2002}, {-16000, -18000, -18002}, {-16000, 2000, 2002}};
    for (unsigned k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        TEST_ASSERT_FALSE(torque_found(0, cases[k].torque, cases[k].inside));
        TEST_ASSERT_TRUE(torque_found(0, cases[k].torque, cases[k].beyond));
    }
    TEST_ASSERT_FALSE(torque_found(0, 0, 0));
    TEST_ASSERT_FALSE(torque_found(1000, 0, 1000) || torque_found(1000, 0, -1000));
    TEST_ASSERT_TRUE(torque_found(1000, 0, 1002) && torque_found(1000, 0, -1002));
}

/* With 900 the command is below t_0, and the limit (1000 + 112)/2 = 556 holds in both directions; with 1000 it is not,
 * and power up to 562 beyond zero in the other direction is allowed. The deviations are -600. */
void test_below_the_least_torque_both_directions_count(void)
{
    TEST_ASSERT_TRUE(torque_found(1000, 900, -300));
    TEST_ASSERT_FALSE(torque_found(1000, 1000, -200));
}

/* Half a per unit of resistance: 8192 drop at i_q = 0.5. An eighth of it is 1024, of which the limit takes half. */
void test_the_tolerance_of_the_resistance_is_an_eighth_at_every_temperature(void)
{
    torque_monitor_config_t cold = exact, warm = exact;
    cold.r = 1 << 30;
    warm.r_per_dC = 1 << 21;
    for (int k = 0; k < 2; k++) {
        const torque_monitor_config_t *c = k ? &warm : &cold;
        for (int beyond = 0; beyond <= 2; beyond += 2) {
            in = (torque_monitor_in_t){.u = {0, 8192 + 1024 + beyond}, .i = {0, 16384}, .omega = 16384};
            winding_dC = k ? 712 : 200;
            const bool found = (faults_at(c, (1024 + beyond) / 2) & FAULT_TORQUE) != 0U;
            TEST_ASSERT_EQUAL(beyond > 0, found);
        }
    }
}

/* r rises by 2^-12 for each 0.1 K from 0.5 at 20 C: 0.622 in the middle of -40 and 180 C. It may differ by the 0.2686
 * to the ends and by an eighth, 0.3463: the drop at i_q = 0.5 is 10192, and half of 5674 is allowed. */
void test_without_a_temperature_the_resistance_may_be_that_of_any(void)
{
    torque_monitor_config_t c = exact;
    c.r = 1 << 30;
    c.r_per_dC = 1 << 19;
    for (int beyond = 0; beyond <= 2; beyond += 2) {
        in = (torque_monitor_in_t){.u = {0, 10192 + 5674 + beyond}, .i = {0, 16384}, .omega = 16384};
        winding_dC = TEMPERATURE_UNKNOWN;
        TEST_ASSERT_EQUAL(beyond > 0, (faults_at(&c, (5674 + beyond) / 2) & FAULT_TORQUE) != 0U);
    }
}

static bool angle_found(const torque_monitor_config_t *c, int32_t u_d, int32_t u_q, int32_t i_d)
{
    in = (torque_monitor_in_t){.u = {u_d, u_q}, .u_mean = {u_d, u_q}, .i = {i_d, 0}, .omega = 16384};
    return (faults_at(c, 0) & FAULT_ANGLE_OFFSET) != 0U;
}

/* The nominal back-EMF is 10000: 2000 across it are allowed, 3500 more along it, and 5000 in the opposite direction. */
void test_the_limits_of_the_back_emf_are_exact(void)
{
    torque_monitor_config_t c = exact;
    c.psi_f = 20000;
    TEST_ASSERT_FALSE(angle_found(&c, 2000, 0, 0) || angle_found(&c, -2000, 0, 0));
    TEST_ASSERT_TRUE(angle_found(&c, 2001, 0, 0) && angle_found(&c, -2001, 0, 0));
    TEST_ASSERT_FALSE(angle_found(&c, 0, 3500, 0) || angle_found(&c, 0, -5000, 0));
    TEST_ASSERT_TRUE(angle_found(&c, 0, 3501, 0) && angle_found(&c, 0, -5001, 0));
    c.v_0 = 4000; /* half of it is just not more than the 2000, and is allowed beyond them */
    TEST_ASSERT_TRUE(angle_found(&c, 4001, 0, 0));
    TEST_ASSERT_FALSE(angle_found(&c, 4000, 0, 0));
    c.v_0 = 4002;
    TEST_ASSERT_FALSE(angle_found(&c, 30000, 0, 0));
}

/* 0.1 of resistance at i_d = 0.5 drop 1638: e_d = 3362 is beyond 2000 and within 3638. */
void test_the_drop_of_the_whole_resistance_is_allowed_across_the_back_emf(void)
{
    torque_monitor_config_t c = exact;
    c.psi_f = 20000;
    c.r = 6554 << 15;
    TEST_ASSERT_FALSE(angle_found(&c, 5000, 0, 16384));
    TEST_ASSERT_TRUE(angle_found(&c, 5300, 0, 16384));
}

/* The same at i_q = 0.5 along it: e_q = u_q - 1638 may be 3500 + 1638. */
void test_the_drop_of_the_whole_resistance_is_allowed_along_the_back_emf(void)
{
    torque_monitor_config_t c = exact;
    c.psi_f = 20000;
    c.r = 6554 << 15;
    for (int beyond = 0; beyond < 2; beyond++) {
        const int32_t u_q = 6700 + 150 * beyond;
        in = (torque_monitor_in_t){.u = {0, u_q}, .u_mean = {0, u_q}, .i = {0, 16384}, .omega = 16384};
        TEST_ASSERT_EQUAL(beyond > 0, (faults_at(&c, 0) & FAULT_ANGLE_OFFSET) != 0U);
    }
}

/* Settling begins when the bridge begins to act, whatever was before. */
void test_the_first_decision_is_that_of_the_step_after_settling(void)
{
    in = (torque_monitor_in_t){.u = {0, 20000}, .i = {0, 16384}, .omega = 16384};
    for (int round = 0; round < 2; round++) {
        in.acting = false;
        TEST_ASSERT_EQUAL_HEX32(0, monitor_step(&exact));
        TEST_ASSERT_EQUAL_HEX32(0, monitor_step(&exact));
        in.acting = true;
        for (int n = 0; n < SETTLING; n++) {
            TEST_ASSERT_EQUAL_HEX32(0, monitor_step(&exact));
        }
        TEST_ASSERT_EQUAL_HEX32(FAULT_TORQUE, monitor_step(&exact) & FAULT_TORQUE);
    }
}

/* The value as the monitor can represent it. */
static double saturated(double x)
{
    return fmin(fmax(x, -1.0), 32767.0 / 32768.0);
}

typedef struct {
    double psi_d, psi_q, deviation;
    double tracked; /* speed of the last step */
    double w, doubt;
} reference_t;

/* By how much the torque and the angle exceed their thresholds, per unit: the header's equations in double precision.
 */
typedef struct {
    double torque, angle;
} excess_t;

static double torque_excess(reference_t *reference, double e_d, double e_q, double rates)
{
    const double i_d = in.i.d / 32768.0, i_q = in.i.q / 32768.0, w = reference->w;
    const double t = in.torque / 32768.0;
    const double error = saturated(e_d * i_d + e_q * i_q) - t * w;
    reference->deviation = saturated(reference->deviation + 0.25 * saturated(error - reference->deviation));
    const double current = saturated(hypot(i_d, i_q));
    const double v_error = saturated(425.0 / 32768.0 + rates / 2.0 + 112.0 / 65536.0 * current);
    const double limit = fabs(w) * (1112.0 / 32768.0 + fabs(t) / 8.0) + v_error * current + fabs(t) * reference->doubt;
    if (fabs(t) < 1112.0 / 32768.0) {
        return fabs(reference->deviation) - limit;
    }
    const double along = (t * w < 0.0) ? -reference->deviation : reference->deviation;
    return fmax(along, -along - fabs(t * w)) - limit;
}

/* psi: in the middle of the step. */
static double angle_excess(const reference_t *reference, double e_d, double e_q, double rates, const double psi[2])
{
    const double w = reference->w, psi_d = in.psi.d / 32768.0, psi_q = in.psi.q / 32768.0;
    const double magnet = fabs(w) * 14418.0 / 32768.0, v_0 = 425.0 / 32768.0;
    const double current = saturated(hypot(in.i.d, in.i.q) / 32768.0);
    const double v = v_0 / 2.0 + NOISE / 32768.0 + 898.0 / 65536.0 * current + rates / 2.0 + fmax(rates - v_0, 0.0);
    const double doubt_d = reference->doubt * fabs(psi_q), doubt_q = reference->doubt * fabs(psi_d);
    const double d = fabs(e_d + w * psi[1]) - magnet / 5.0 - fabs(w * psi_q) / 8.0 - doubt_d - v;
    const double q = copysign(1.0, w) * (e_q - w * psi[0]);
    return fmax(d, fmax(q - 0.35 * magnet, -q - 0.5 * magnet) - doubt_q - v);
}

static excess_t reference_step(reference_t *reference)
{
    const double gain = 19867.0 / 65536.0, r = 898.0 / 65536.0;
    const double rate_d = gain * saturated(in.psi.d / 32768.0 - reference->psi_d);
    const double rate_q = gain * saturated(in.psi.q / 32768.0 - reference->psi_q);
    const double e_d = saturated((in.u.d - r * in.i.d) / 32768.0 - rate_d);
    const double e_q = saturated((in.u.q - r * in.i.q) / 32768.0 - rate_q);
    const double mean_d = saturated((in.u_mean.d - r * in.i.d) / 32768.0 - rate_d);
    const double mean_q = saturated((in.u_mean.q - r * in.i.q) / 32768.0 - rate_q);
    const double psi[2] = {(in.psi.d / 32768.0 + reference->psi_d) / 2.0,
                           (in.psi.q / 32768.0 + reference->psi_q) / 2.0};
    const double rates = fabs(rate_d) + fabs(rate_q);
    const double tracked = in.omega / 32768.0;
    const double lag = saturated(433000.0 / 65536.0 * saturated(tracked - reference->tracked));
    reference->psi_d = in.psi.d / 32768.0;
    reference->psi_q = in.psi.q / 32768.0;
    reference->w = saturated(tracked + lag);
    reference->doubt = fabs(lag);
    reference->tracked = tracked;
    return (excess_t){torque_excess(reference, e_d, e_q, rates), angle_excess(reference, mean_d, mean_q, rates, psi)};
}

/* Compares one decision that is not within 20 LSB of its threshold; counts it by its result. */
static void compare(double excess, bool found, int counts[2])
{
    if (fabs(excess) > 20.0 / 32768.0) {
        TEST_ASSERT_EQUAL_INT(excess > 0.0, found);
        counts[found]++;
    }
}

static int16_t end_of(int bits, int bit)
{
    return (bits >> bit & 1) ? INT16_MAX : INT16_MIN;
}

/* All combinations of largest and smallest arguments with five torques, and the same flux or the opposite one before: a
 * sum or product that wraps instead of saturating changes its sign, and the decision with it. */
void test_no_argument_wraps(void)
{
    static const q15_t torques[5] = {INT16_MIN, -2000, 0, 2000, INT16_MAX};
    torque_monitor_config_t immediate = config;
    int torque[2] = {0}, angle[2] = {0};
    immediate.torque_steps = immediate.angle_steps = 1;
    immediate.v_noise = NOISE;
    for (int bits = 0; bits < 5 << 9; bits++) {
        in = (torque_monitor_in_t){.acting = true, .psi = {end_of(bits, 0), end_of(bits, 1)}};
        fresh();
        for (int n = 0; n < SETTLING; n++) {
            (void)monitor_step(&immediate);
        }
        reference_t reference = {.psi_d = in.psi.d / 32768.0, .psi_q = in.psi.q / 32768.0};
        in = (torque_monitor_in_t){true,
                                   {end_of(bits, 2), end_of(bits, 3)},
                                   {end_of(bits, 4), end_of(bits, 5)},
                                   {end_of(bits, 6), end_of(bits, 7)},
                                   {end_of(bits, 3), end_of(bits, 2)},
                                   end_of(bits, 8),
                                   torques[bits >> 9],
                                   {0, 0},
                                   0};
        for (int n = 0; n < 30; n++) {
            const uint32_t faults = monitor_step(&immediate);
            const excess_t excess = reference_step(&reference);
            compare(excess.torque, (faults & FAULT_TORQUE) != 0, torque);
            compare(excess.angle, (faults & FAULT_ANGLE_OFFSET) != 0, angle);
        }
    }
    /* Both decisions occur, and all but a few of 5 * 512 * 30 are compared. */
    TEST_ASSERT_TRUE(torque[0] > 10000 && torque[1] > 10000 && torque[0] + torque[1] > 76000);
    TEST_ASSERT_TRUE(angle[0] > 10000 && angle[1] > 10000 && angle[0] + angle[1] > 76000);
}
