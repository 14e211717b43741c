/* SPDX-License-Identifier: Apache-2.0 */
#include "plant_bench.h"
#include "random.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "unity.h"

static plant_params_t p;
static plant_t *plant;
static plant_sensors_t seen;

void setUp(void)
{
    p = bench_params();
    plant = NULL;
}

void tearDown(void)
{
    plant_destroy(plant);
}

static void start(void)
{
    plant = plant_create(&p, NULL);
    TEST_ASSERT_NOT_NULL(plant);
}

/* theta_e = 0: i_a = i_d */
static void sample_at(double id, double iq)
{
    plant_set_state(plant, id, iq, 0.0, 0.0);
    plant_sample(plant, &seen);
}

void test_unquantised_sensors_give_the_phase_currents_themselves(void)
{
    start();
    plant_set_state(plant, -70.0, 110.0, 0.2, 0.0);
    plant_sample(plant, &seen);
    const plant_truth_t *t = plant_truth(plant);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, t->i_abc_A[0], seen.ia_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, t->i_abc_A[1], seen.ib_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, t->i_abc_A[2], seen.ic_A);
    /* phase b: its axis is 120 degrees ahead of phase a */
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, -70.0 * cos(0.6 - TWO_PI / 3) - 110.0 * sin(0.6 - TWO_PI / 3), seen.ib_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 400.0, seen.vdc_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.2, seen.theta_m_rad);
    TEST_ASSERT_DOUBLE_WITHIN(0.0, 20.0, seen.t_winding_C);
}

/* 12 bits over +-400 A: 400/2048 A a code; i_b = -i_a/2. 2048 is zero current. */
void test_quantised_currents_are_the_nearest_code(void)
{
    const double step = 400.0 / 2048.0;
    p.current_quantise = 1;
    start();
    for (double i = -390.0; i < 390.0; i += 0.037) {
        sample_at(i, 0.0);
        TEST_ASSERT_TRUE(fabs(seen.ia_A - i) <= step * (0.5 + 1e-9));
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, (seen.i_count[0] - 2048) * step, seen.ia_A);
        TEST_ASSERT_DOUBLE_WITHIN(step * (0.5 + 1e-9), -0.5 * i, seen.ib_A);
    }
    sample_at(0.0, 0.0);
    TEST_ASSERT_EQUAL(2048, seen.i_count[0]);
    sample_at(0.51 * step, 0.0);
    TEST_ASSERT_EQUAL(2049, seen.i_count[0]);
    sample_at(-0.51 * step, 0.0);
    TEST_ASSERT_EQUAL(2047, seen.i_count[0]);
}

void test_currents_beyond_the_converters_range_give_its_end_codes(void)
{
    for (int quantise = 0; quantise < 2; quantise++) {
        p.current_quantise = quantise;
        start();
        sample_at(900.0, 0.0);
        TEST_ASSERT_EQUAL(4095, seen.i_count[0]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 400.0 * 2047.0 / 2048.0, seen.ia_A);
        TEST_ASSERT_EQUAL(0, seen.i_count[1]); /* -450 A */
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, -400.0, seen.ib_A);
        plant_destroy(plant);
    }
    plant = NULL;
}

void test_gain_and_offset_act_on_each_phase_separately(void)
{
    p.current_gain[0] = 1.01;
    p.current_gain[2] = 0.5;
    p.current_offset_A[1] = -2.5;
    start();
    sample_at(100.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 101.0, seen.ia_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, -52.5, seen.ib_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, -25.0, seen.ic_A);
}

/* First outputs that are published with the generators. */
void test_the_random_bits_are_those_of_the_published_generators(void)
{
    random_t rng = {.s = {1, 2, 3, 4}};
    TEST_ASSERT_EQUAL_UINT64(41943041u, random_bits(&rng));
    TEST_ASSERT_EQUAL_UINT64(58720359u, random_bits(&rng));
    TEST_ASSERT_EQUAL_UINT64(3588806011781223u, random_bits(&rng));
    TEST_ASSERT_EQUAL_UINT64(3591011842654386u, random_bits(&rng));
    random_seed(&rng, 1234567u);
    TEST_ASSERT_EQUAL_UINT64(6457827717110365317u, rng.s[0]);
    TEST_ASSERT_EQUAL_UINT64(3203168211198807973u, rng.s[1]);
    TEST_ASSERT_EQUAL_UINT64(9817491932198370423u, rng.s[2]);
}

/* 300 000 deviates. Standard deviation of the mean: 0.5/548 = 9e-4 A; of the variance, relative: 0.26 %; of the fourth
 * moment: 1.8 % (kurtosis 3); P(|x| > 2 sigma) = 4.55 +- 0.04 %. The tolerances are five standard deviations. */
void test_noise_is_normal_with_the_stated_rms_and_white(void)
{
    const int n = 100000;
    double sum = 0.0, square = 0.0, fourth = 0.0, beyond = 0.0, lag = 0.0, across = 0.0, last = 0.0;
    p.current_noise_A_rms = 0.5;
    start();
    for (int k = 0; k < n; k++) {
        plant_sample(plant, &seen);
        const double x[3] = {seen.ia_A, seen.ib_A, seen.ic_A};
        for (int m = 0; m < 3; m++) {
            sum += x[m];
            square += x[m] * x[m];
            fourth += pow(x[m], 4.0);
            beyond += fabs(x[m]) > 1.0;
        }
        lag += x[0] * last;
        across += x[0] * x[1];
        last = x[0];
    }
    TEST_ASSERT_DOUBLE_WITHIN(4.6e-3, 0.0, sum / (3.0 * n));
    TEST_ASSERT_DOUBLE_WITHIN(0.013 * 0.25, 0.25, square / (3.0 * n));
    TEST_ASSERT_DOUBLE_WITHIN(0.09 * 3.0, 3.0, fourth / (3.0 * n) / 0.0625);
    TEST_ASSERT_DOUBLE_WITHIN(0.2, 4.55, 100.0 * beyond / (3.0 * n));
    TEST_ASSERT_DOUBLE_WITHIN(0.016 * 0.25, 0.0, lag / n); /* 5/sqrt(100 000) */
    TEST_ASSERT_DOUBLE_WITHIN(0.016 * 0.25, 0.0, across / n);
}

static void record(uint64_t seed, plant_sensors_t out[50])
{
    p.seed = seed;
    p.current_noise_A_rms = 0.5;
    p.speed_rad_s = 100.0;
    plant_t *run = plant_create(&p, NULL);
    memset(out, 0, 50 * sizeof *out);
    for (int k = 0; k < 50; k++) {
        plant_sample(run, &out[k]);
        bench_drive(run, 10.0 + 30.0 * I);
    }
    plant_destroy(run);
}

void test_a_seed_repeats_a_run_bit_by_bit_and_another_does_not(void)
{
    static plant_sensors_t a[50], b[50], c[50];
    record(7, a);
    record(7, b);
    record(8, c);
    TEST_ASSERT_EQUAL_MEMORY(a, b, sizeof a);
    TEST_ASSERT_TRUE(memcmp(a, c, sizeof a) != 0);
    TEST_ASSERT_TRUE(memcmp(&a[0], &a[1], sizeof a[0]) != 0);
}

/* 0 ... 500 V in 4096 codes: 400 V is code 3276.8, read as 3277 x 500/4096 = 400.024 V */
void test_the_dc_voltage_is_quantised_and_limited_to_full_scale(void)
{
    p.vdc_quantise = 1;
    start();
    plant_sample(plant, &seen);
    TEST_ASSERT_EQUAL(3277, seen.vdc_count);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 3277.0 * 500.0 / 4096.0, seen.vdc_V);
    for (double v = 20.0; v < 480.0; v += 0.731) {
        plant_params(plant)->vdc_V = v;
        plant_sample(plant, &seen);
        TEST_ASSERT_TRUE(fabs(seen.vdc_V - v) <= 250.0 / 4096.0 * (1.0 + 1e-9));
    }
    plant_params(plant)->vdc_V = 400.0;
    plant_params(plant)->vdc_gain = 1.5;
    plant_sample(plant, &seen);
    TEST_ASSERT_EQUAL(4095, seen.vdc_count);
    plant_params(plant)->vdc_gain = 0.995;
    plant_params(plant)->vdc_quantise = 0;
    plant_sample(plant, &seen);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 398.0, seen.vdc_V);
}

/* An offset is shown without voltage, too; the converter has nothing below 0. */
void test_an_offset_of_the_dc_voltage_is_shown_at_every_voltage(void)
{
    p.vdc_offset_V = 2.5;
    start();
    plant_sample(plant, &seen);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 402.5, seen.vdc_V);
    plant_params(plant)->vdc_V = 1.0;
    plant_sample(plant, &seen);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 3.5, seen.vdc_V);
    plant_params(plant)->vdc_offset_V = -2.5;
    plant_sample(plant, &seen);
    TEST_ASSERT_DOUBLE_WITHIN(0.0, 0.0, seen.vdc_V);
    TEST_ASSERT_EQUAL(0, seen.vdc_count);
}

/* Everything but the zero of the currents moves with the reference, and so does what is read of a known voltage. */
void test_a_reference_that_is_too_small_makes_all_readings_larger(void)
{
    start();
    sample_at(-100.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0, seen.known_share);
    plant_params(plant)->converter_reference = 0.9;
    plant_params(plant)->known_voltage_gain = 1.03;
    sample_at(-100.0, 0.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 400.0 / 0.9, seen.vdc_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, -100.0 / 0.9, seen.ia_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.03 / 0.9, seen.known_share);
    plant_params(plant)->converter_reference = 0.01;
    plant_sample(plant, &seen);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 5.0, seen.known_share);
}

/* With three pole pairs an electrical error is a third of it mechanically. */
void test_the_angle_carries_its_offset_and_both_harmonics_of_the_turn(void)
{
    p.angle_offset_rad = 0.03;
    p.angle_h1_rad = 0.02;
    p.angle_h1_phase = 0.5;
    p.angle_h2_rad = 0.01;
    p.angle_h2_phase = -1.0;
    start();
    for (double theta = 0.1; theta < 6.2; theta += 0.17) {
        plant_set_state(plant, 0.0, 0.0, theta, 0.0);
        plant_sample(plant, &seen);
        const double error = 0.03 + 0.02 * sin(theta + 0.5) + 0.01 * sin(2.0 * theta - 1.0);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, theta + error / 3.0, seen.theta_m_rad);
    }
    plant_params(plant)->resolver_pole_pairs = 3.0;
    plant_set_state(plant, 0.0, 0.0, 1.0, 0.0);
    plant_sample(plant, &seen);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0 + (0.03 + 0.02 * sin(3.5) + 0.01 * sin(5.0)) / 3.0, seen.theta_m_rad);
}

void test_a_reversed_angle_counts_against_the_rotor(void)
{
    p.angle_reversed = 1;
    p.angle_offset_rad = 0.3;
    start();
    plant_set_state(plant, 0.0, 0.0, 1.0, 0.0);
    plant_sample(plant, &seen);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, TWO_PI - 1.0 + 0.3 / p.pole_pairs, seen.theta_m_rad);
}

void test_swapped_leads_exchange_the_samples_of_b_and_c(void)
{
    start();
    sample_at(-70.0, 110.0);
    const plant_sensors_t straight = seen;
    plant_params(plant)->phases_swapped = 1;
    sample_at(-70.0, 110.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, straight.ia_A, seen.ia_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, straight.ic_A, seen.ib_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, straight.ib_A, seen.ic_A);
    TEST_ASSERT_EQUAL_INT32(straight.i_count[2], seen.i_count[1]);
    TEST_ASSERT_EQUAL_INT32(straight.i_count[1], seen.i_count[2]);
}

/* At theta_e = 0 the q axis is along (b - c): with the leads swapped the same duties turn its current around. */
void test_swapped_leads_exchange_the_duties_of_b_and_c(void)
{
    const double duty[3] = {0.5, 0.52, 0.48};
    double i_q[2];
    for (int swapped = 0; swapped < 2; swapped++) {
        plant_destroy(plant);
        p.phases_swapped = swapped;
        start();
        plant_set_state(plant, 0.0, 0.0, 0.0, 0.0);
        plant_advance(plant, duty, 1);
        i_q[swapped] = plant_truth(plant)->i_q_A;
    }
    TEST_ASSERT_TRUE(i_q[0] > 0.1);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, -i_q[0], i_q[1]);
}

void test_the_angle_stays_in_one_turn_at_its_ends(void)
{
    p.angle_offset_rad = -0.03;
    start();
    plant_set_state(plant, 0.0, 0.0, 0.001, 0.0);
    plant_sample(plant, &seen);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, TWO_PI - 0.009, seen.theta_m_rad);
    plant_params(plant)->angle_bits = 12; /* 2 pi - 0.0004 rounds up to a whole turn: code 0 */
    plant_params(plant)->angle_offset_rad = -0.0042;
    plant_sample(plant, &seen);
    TEST_ASSERT_EQUAL(0, seen.theta_count);
    TEST_ASSERT_DOUBLE_WITHIN(0.0, 0.0, seen.theta_m_rad);
}

void test_a_quantised_angle_is_the_nearest_code(void)
{
    p.angle_bits = 12;
    start();
    for (double theta = 0.0; theta < 6.28; theta += 0.0137) {
        plant_set_state(plant, 0.0, 0.0, theta, 0.0);
        plant_sample(plant, &seen);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, seen.theta_count * TWO_PI / 4096.0, seen.theta_m_rad);
        TEST_ASSERT_TRUE(fabs(sin(0.5 * (seen.theta_m_rad - theta))) <= sin(PI / 8192.0) + 1e-12);
    }
}

/* 50 us at 200 rad/s: 0.01 rad too small; too large with backward rotation. */
void test_a_delayed_angle_lags_behind_the_motion(void)
{
    p.angle_delay_s = 50e-6;
    start();
    for (int direction = -1; direction <= 1; direction += 2) {
        plant_set_state(plant, 0.0, 0.0, 1.0, 200.0 * direction);
        plant_sample(plant, &seen);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0 - 0.01 * direction, seen.theta_m_rad);
    }
}

void test_a_stuck_sensor_repeats_its_last_sample(void)
{
    start();
    sample_at(100.0, 0.0);
    plant_params(plant)->current_stuck[1] = 1;
    plant_params(plant)->angle_stuck = 1;
    plant_set_state(plant, -60.0, 0.0, 2.0, 0.0);
    plant_sample(plant, &seen);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, -50.0, seen.ib_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, -60.0 * cos(6.0), seen.ia_A);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, seen.theta_m_rad);
}

/* Resolver of two turns per mechanical one: its sine is kept at that of 0.2 rad. */
void test_a_stuck_track_shows_the_angle_of_its_last_value(void)
{
    p.resolver_pole_pairs = 2.0;
    start();
    plant_set_state(plant, 0.0, 0.0, 0.1, 0.0);
    plant_sample(plant, &seen);
    plant_params(plant)->angle_sine_stuck = 1;
    for (double theta = 0.1; theta < 6.2; theta += 0.5) {
        plant_set_state(plant, 0.0, 0.0, theta, 0.0);
        plant_sample(plant, &seen);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0,
                                  remainder(2.0 * seen.theta_m_rad - atan2(sin(0.2), cos(2.0 * theta)), TWO_PI));
        TEST_ASSERT_TRUE(fabs(remainder(seen.theta_m_rad - theta, TWO_PI)) <= 0.25 * TWO_PI);
    }
    plant_params(plant)->angle_sine_stuck = 0;
    plant_params(plant)->angle_cosine_stuck = 1;
    plant_sample(plant, &seen);
    const double kept = cos(2.0 * 6.1);
    plant_set_state(plant, 0.0, 0.0, 1.0, 0.0);
    plant_sample(plant, &seen);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, remainder(2.0 * seen.theta_m_rad - atan2(sin(2.0), kept), TWO_PI));
    plant_params(plant)->angle_cosine_stuck = 0;
    plant_sample(plant, &seen);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0, seen.theta_m_rad);
}

static double shown_at(double theta)
{
    plant_set_state(plant, 0.0, 0.0, theta, 0.0);
    plant_sample(plant, &seen);
    return seen.theta_m_rad;
}

/* Length with a sine of 0: |cos|, right up to 0.65 rad. */
void test_a_checked_converter_shows_no_angle_after_three_wrong_lengths(void)
{
    p.angle_length_check = 1;
    start();
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, shown_at(0.0));
    plant_params(plant)->angle_sine_stuck = 1;
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, shown_at(0.65));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, shown_at(0.67));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, shown_at(1.0));
    TEST_ASSERT_TRUE(isnan(shown_at(1.0)));
    TEST_ASSERT_TRUE(isnan(shown_at(1.0)));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, shown_at(0.1));
    plant_params(plant)->angle_sine_stuck = 0;
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0, shown_at(1.0));
}

void test_a_checked_converter_sees_a_length_that_is_too_large(void)
{
    p.angle_length_check = 1;
    start();
    (void)shown_at(0.25 * TWO_PI);
    plant_params(plant)->angle_sine_stuck = 1;
    (void)shown_at(0.8); /* 1.22 */
    (void)shown_at(0.8);
    TEST_ASSERT_TRUE(isnan(shown_at(0.8)));
    TEST_ASSERT_FALSE(isnan(shown_at(0.84))); /* 1.20 */
}

/* Turns from where a track stays until the converter shows no angle; the track is right for 30 degrees before. */
static double turns_to_no_angle(double at, bool of_sine, double step)
{
    const double sign = step > 0.0 ? 1.0 : -1.0;
    plant_params(plant)->angle_sine_stuck = 0;
    plant_params(plant)->angle_cosine_stuck = 0;
    for (double turned = -sign * 30.0 / 360.0; fabs(turned) < 0.75; turned += step) {
        const bool stays = turned * sign > 0.0;
        plant_params(plant)->angle_sine_stuck = stays && of_sine;
        plant_params(plant)->angle_cosine_stuck = stays && !of_sine;
        if (isnan(shown_at((at + turned) * TWO_PI))) {
            return stays ? fabs(turned) : -1.0;
        }
    }
    return 1.0;
}

/* (PL-34), with the angles of (MN-56): 45 degrees at most, 7 on average. */
void test_a_checked_converter_finds_a_stuck_track_at_every_angle(void)
{
    p.angle_length_check = 1;
    start();
    for (int k = 0; k < 4; k++) {
        const double step = (k & 1) ? 2e-4 : -2e-4;
        double worst = 0.0, sum = 0.0;
        for (int n = 0; n < 360; n++) {
            const double turned = turns_to_no_angle(n / 360.0, (k & 2) != 0, step);
            TEST_ASSERT_TRUE(turned > 0.0);
            worst = fmax(worst, turned);
            sum += turned;
        }
        TEST_ASSERT_DOUBLE_WITHIN(2.0, 44.0, 360.0 * worst);
        TEST_ASSERT_DOUBLE_WITHIN(1.0, 7.0, sum);
    }
}

void test_a_checked_converter_shows_every_angle_of_a_good_resolver(void)
{
    p.angle_length_check = 1;
    start();
    double theta = 0.0;
    for (int n = 0; n < 20000; n++) {
        theta += 0.3 * sin(n * 1e-3) * sin(n * 1.7e-3); /* up to 28,000 rpm at 10 kHz, and stops */
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, remainder(shown_at(theta) - theta, TWO_PI));
    }
}

/* The first two of five samples; after the spikes were switched off, the sequence starts again. */
void test_spikes_disturb_the_first_samples_of_each_sequence(void)
{
    p.angle_spike_every = 5;
    p.angle_spike_samples = 2;
    p.angle_spike_rad = 0.3;
    start();
    plant_set_state(plant, 0.0, 0.0, 2.0, 0.0);
    for (int n = 0; n < 22; n++) {
        plant_sample(plant, &seen);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, (n % 5 < 2) ? 2.1 : 2.0, seen.theta_m_rad);
    }
    plant_params(plant)->angle_spike_every = 0;
    plant_sample(plant, &seen);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 2.0, seen.theta_m_rad);
    plant_params(plant)->angle_spike_every = 5;
    plant_sample(plant, &seen);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 2.1, seen.theta_m_rad);
}

void test_an_open_current_input_reads_the_negative_full_scale(void)
{
    p.current_open[2] = 1;
    p.current_quantise = 1;
    start();
    sample_at(100.0, 0.0);
    TEST_ASSERT_EQUAL(0, seen.i_count[2]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, -400.0, seen.ic_A);
    TEST_ASSERT_DOUBLE_WITHIN(0.2, 100.0, seen.ia_A);
}

void test_sampling_changes_nothing_in_the_drive(void)
{
    p.speed_rad_s = 300.0;
    start();
    plant_set_state(plant, -20.0, 40.0, 1.0, 300.0);
    bench_drive(plant, 10.0 + 70.0 * I);
    const plant_truth_t before = *plant_truth(plant);
    for (int k = 0; k < 5; k++) {
        plant_sample(plant, &seen);
    }
    TEST_ASSERT_EQUAL_MEMORY(&before, plant_truth(plant), sizeof before);
}
