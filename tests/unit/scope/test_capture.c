/* SPDX-License-Identifier: Apache-2.0 */
/* The capture beside a record of every period that was ever written: each sample is compared with that record. The
 * file is compiled twice: for a port without hardware that copies (GATHER 0), and for one with it. */
#include "scope/capture.h"

#include <string.h>

#include "late_gather.h"
#include "unity.h"

#define PERIODS 4000U
#define STEP 10 /* periods from one step of the task to the next */
#define NEVER 30000

static sample_t ring[SAMPLE_SLOTS];
static int16_t memory[CAPTURE_MEMORY];
static int16_t written[PERIODS]; /* i_q of each period */
static uint32_t newest, offset;  /* of the periods' numbers */
static capture_t capture;
static capture_config_t config;

static int16_t wave(uint32_t period)
{
    return (int16_t)(100 * (int)(period % 50U) - 2500);
}

/* The place of each signal, by hand. */
static void write_period(uint32_t n, int16_t i_q)
{
    sample_t *slot = &ring[(offset + n) % SAMPLE_SLOTS];
    memset(slot, 0x55, sizeof *slot);
    written[n] = i_q;
    slot->point.i.q = i_q;
    slot->point.i.d = (int16_t)n;
    slot->point.omega = (int32_t)(n << 16 | 0xFFFFU);
    slot->v_dc = -(int16_t)n;
    slot->point.u.d = (int16_t)(n + 1000U);
    slot->point.u.q = -(int16_t)(n + 2000U);
    slot->theta_e = (n + 3000U) << 16 | 0x1234U;
    slot->zero_q28 = -(int32_t)(n + 4000U) * 65536 + 0x4321;
}

static void run(uint32_t periods)
{
    for (uint32_t k = 0; k < periods; k++) {
        newest++;
        write_period(newest, wave(newest));
    }
}

static void step(void)
{
    capture_step(&capture, memory, ring, offset + newest);
    late_gather_end(); /* the hardware has copied nothing before */
}

static void run_steps(uint32_t steps)
{
    for (uint32_t k = 0; k < steps; k++) {
        run(STEP);
        step();
    }
}

/* A sample in the order of time. */
static int16_t sample(uint32_t signal, uint32_t k)
{
    return memory[(capture.first + k) % config.samples * config.signals + signal];
}

static uint32_t trigger_period(void)
{
    return capture.trigger_period - offset;
}

/* Every sample is that of its own period, without a gap, counted from the trigger. */
static void expect_periods(void)
{
    TEST_ASSERT_EQUAL(CAPTURE_DONE, capture.state);
    for (uint32_t k = 0; k < capture.taken; k++) {
        const uint32_t period = trigger_period() + k * config.divisor - (uint32_t)capture.before * config.divisor;
        TEST_ASSERT_EQUAL_INT16(written[period], sample(0, k));
        TEST_ASSERT_EQUAL_INT16((int16_t)period, sample(1, k));
    }
}

static void arm(void)
{
    TEST_ASSERT_TRUE(capture_config_is_valid(&config));
    capture_arm(&capture, &config, offset + newest);
}

static void arm_for(capture_trigger_t trigger, int16_t level)
{
    config.trigger = (uint8_t)trigger;
    config.level = level;
    arm();
}

/* The period of the first trigger. */
static uint32_t triggered_in(capture_trigger_t trigger, int16_t level)
{
    arm_for(trigger, level);
    run_steps(60);
    expect_periods();
    return trigger_period();
}

void setUp(void)
{
    memset(&capture, 0, sizeof capture);
    late_gather_reset(GATHER);
    newest = offset = 0;
    capture.values = (scope_step_values_t){.i_d_ref = 1, .i_q_ref = 2, .torque_commanded = 3, .psi_error = 4};
    config = (capture_config_t){
        .signals = 2,
        .signal = {CAPTURE_i_q_A, CAPTURE_i_d_A},
        .trigger_signal = CAPTURE_i_q_A,
        .divisor = 1,
        .samples = 100,
        .before = 25,
    };
    run(3); /* the capture does not begin at a multiple of anything */
}

void tearDown(void)
{
}

void test_the_values_of_the_step_are_kept_if_the_trigger_needs_them(void)
{
    arm();
    TEST_ASSERT_FALSE(capture.uses_step);
    config.trigger_signal = CAPTURE_torque_commanded_Nm;
    arm();
    TEST_ASSERT_TRUE(capture.uses_step);
    config.trigger_signal = CAPTURE_i_q_A;
    config.signal[0] = CAPTURE_torque_commanded_Nm;
    arm();
    TEST_ASSERT_TRUE(capture.uses_step);
}

void test_a_rising_edge_triggers_where_the_signal_comes_from_below(void)
{
    run(20); /* the first wave's edge at 0 lies within the samples that must be before the trigger */
    TEST_ASSERT_EQUAL_UINT32(75, triggered_in(TRIGGER_RISING, 0));
    TEST_ASSERT_EQUAL_INT16(0, sample(0, 25));
    TEST_ASSERT_EQUAL_INT16(-100, sample(0, 24));
    TEST_ASSERT_EQUAL_UINT16(25, capture.before);
    TEST_ASSERT_EQUAL_UINT16(100, capture.taken);
}

void test_a_falling_edge_triggers_where_the_signal_comes_from_above(void)
{
    TEST_ASSERT_EQUAL_UINT32(50, triggered_in(TRIGGER_FALLING, 0));
    TEST_ASSERT_EQUAL_INT16(-2500, sample(0, 25));
    TEST_ASSERT_EQUAL_INT16(2400, sample(0, 24));
}

void test_a_falling_edge_needs_no_more_than_the_level_itself(void)
{
    TEST_ASSERT_EQUAL_UINT32(50, triggered_in(TRIGGER_FALLING, -2500));
}

void test_a_level_triggers_at_once_when_enough_samples_lie_before(void)
{
    TEST_ASSERT_EQUAL_UINT32(3 + 1 + 25, triggered_in(TRIGGER_ABOVE, -2500));
    capture_stop(&capture);
    const uint32_t from = newest;
    TEST_ASSERT_EQUAL_UINT32(from + 1 + 25, triggered_in(TRIGGER_BELOW, 2400));
}

void test_a_level_waits_for_the_signal(void)
{
    TEST_ASSERT_EQUAL_UINT32(49, triggered_in(TRIGGER_ABOVE, 2400));
    capture_stop(&capture);
    const uint32_t from = newest;
    TEST_ASSERT_EQUAL_UINT32((from + 26 + 49) / 50 * 50, triggered_in(TRIGGER_BELOW, -2500));
}

/* Samples are searched several at once: the first that reaches the level counts, wherever it lies among them. */
void test_a_level_is_found_at_each_place_of_a_step(void)
{
    for (uint32_t place = 0; place < 2U * STEP; place++) {
        setUp();
        config.before = 0;
        run(place);
        const uint32_t first = newest + 1U;
        TEST_ASSERT_EQUAL_UINT32((first + 40U) / 50U * 50U + 10U, triggered_in(TRIGGER_RISING, wave(10)));
    }
}

void test_a_level_that_is_never_reached_does_not_trigger(void)
{
    arm_for(TRIGGER_ABOVE, NEVER);
    run_steps(300);
    TEST_ASSERT_EQUAL(CAPTURE_ARMED, capture.state);
}

/* The signal is high from the start: only the fall and the rise after it are an edge. */
void test_a_signal_that_is_above_from_the_start_is_no_edge(void)
{
    config.before = 0;
    run(27); /* wave(30) = 500 */
    TEST_ASSERT_EQUAL_UINT32(75, triggered_in(TRIGGER_RISING, 0));
}

/* At the level is not below it. */
void test_a_signal_that_begins_at_the_level_is_no_edge(void)
{
    config.before = 0;
    run(26);
    TEST_ASSERT_EQUAL_UINT32(80, triggered_in(TRIGGER_RISING, wave(30)));
}

/* The 25th sample is the last that need not be searched, and the next one rises. */
void test_an_edge_at_the_first_sample_that_is_searched_is_found(void)
{
    run(50 - 3 - 1);
    TEST_ASSERT_EQUAL_INT16(2400, wave(newest));
    config.before = 25;
    TEST_ASSERT_EQUAL_UINT32(75, triggered_in(TRIGGER_RISING, 0));
    TEST_ASSERT_EQUAL_UINT16(25, capture.before);
}

void test_a_command_triggers_in_its_period_whatever_the_trigger_is(void)
{
    arm_for(TRIGGER_ABOVE, NEVER);
    run_steps(10);
    capture_trigger(&capture, newest + 4);
    run_steps(20);
    TEST_ASSERT_EQUAL_UINT32(3 + 100 + 4, trigger_period());
    expect_periods();
}

void test_a_command_for_a_later_step_waits_for_it(void)
{
    arm_for(TRIGGER_MANUAL, 0);
    run_steps(10);
    capture_trigger(&capture, newest + STEP + 1);
    run_steps(1);
    TEST_ASSERT_EQUAL(CAPTURE_ARMED, capture.state);
    run_steps(20);
    TEST_ASSERT_EQUAL_UINT32(3 + 110 + 1, trigger_period());
    expect_periods();
}

void test_a_command_that_comes_early_leaves_fewer_samples_before_it(void)
{
    arm_for(TRIGGER_MANUAL, 0);
    run(STEP);
    capture_trigger(&capture, newest - 4);
    run_steps(20);
    TEST_ASSERT_EQUAL_UINT16(5, capture.before);
    TEST_ASSERT_EQUAL_UINT16(100, capture.taken);
    expect_periods();
}

/* A period that is past, also before the arming: the next sample is the trigger. */
void test_a_command_for_a_period_that_is_past_triggers_at_once(void)
{
    arm_for(TRIGGER_MANUAL, 0);
    capture_trigger(&capture, newest - 2);
    run_steps(20);
    TEST_ASSERT_EQUAL_UINT16(0, capture.before);
    TEST_ASSERT_EQUAL_UINT32(4, trigger_period());
    expect_periods();
}

void test_the_signal_triggers_before_a_later_command(void)
{
    config.before = 0;
    arm_for(TRIGGER_ABOVE, wave(6));
    capture_trigger(&capture, 9);
    run_steps(20);
    TEST_ASSERT_EQUAL_UINT32(6, trigger_period());
    expect_periods();
}

void test_a_command_acts_on_an_armed_capture_only(void)
{
    capture_trigger(&capture, newest + 1);
    run_steps(2);
    TEST_ASSERT_EQUAL(CAPTURE_IDLE, capture.state);
    arm_for(TRIGGER_MANUAL, 0);
    run_steps(20);
    TEST_ASSERT_EQUAL(CAPTURE_ARMED, capture.state);
}

void test_the_samples_before_the_trigger_outlast_many_turns_of_the_memory(void)
{
    arm_for(TRIGGER_MANUAL, 0);
    run_steps(57);
    capture_trigger(&capture, newest + 1);
    run_steps(9);
    TEST_ASSERT_EQUAL_UINT32(574, trigger_period());
    TEST_ASSERT_NOT_EQUAL(0, capture.first);
    expect_periods();
}

void test_every_number_of_samples_before_the_trigger(void)
{
    for (uint16_t before = 0; before < 100; before++) {
        setUp();
        config.before = before;
        uint32_t expected = 3U + 1U + before;
        while (wave(expected) < wave(12) || wave(expected - 1U) >= wave(12)) {
            expected++;
        }
        TEST_ASSERT_EQUAL_UINT32(expected, triggered_in(TRIGGER_RISING, wave(12)));
        TEST_ASSERT_EQUAL_UINT16(before, capture.before);
    }
}

void test_a_divisor_takes_every_so_many_periods(void)
{
    const uint16_t divisors[] = {2, 3, 7, 10, 13, 64, 100};
    for (unsigned k = 0; k < sizeof divisors / sizeof divisors[0]; k++) {
        setUp();
        config.divisor = divisors[k];
        config.samples = 20;
        config.before = 5;
        arm_for(TRIGGER_MANUAL, 0);
        run_steps(110);
        capture_trigger(&capture, newest + 1);
        run_steps(200);
        expect_periods();
        TEST_ASSERT_EQUAL_UINT16(5, capture.before);
        TEST_ASSERT_TRUE(trigger_period() > 1103U && trigger_period() <= 1103U + divisors[k]);
        TEST_ASSERT_EQUAL_UINT32(0, (trigger_period() - 4U) % divisors[k]);
    }
}

/* The level is looked for in the samples, not between them. */
void test_a_trigger_with_a_divisor_compares_the_samples(void)
{
    config.divisor = 20;
    config.samples = 10;
    config.before = 0;
    TEST_ASSERT_EQUAL_UINT32(44, triggered_in(TRIGGER_ABOVE, wave(30)));
}

void test_steps_of_every_length_take_the_same_samples(void)
{
    for (uint32_t length = 1; length <= 60; length++) {
        setUp();
        arm_for(TRIGGER_RISING, 0);
        while (capture.state != CAPTURE_DONE) {
            run(length);
            step();
        }
        TEST_ASSERT_EQUAL_UINT32(75, trigger_period());
        expect_periods();
        TEST_ASSERT_EQUAL_UINT16(0, capture.lost);
    }
}

void test_the_whole_memory_is_one_signals(void)
{
    config.signals = 1;
    config.samples = 3000;
    config.before = 2999;
    TEST_ASSERT_TRUE(capture_config_is_valid(&config));
    arm_for(TRIGGER_RISING, 0);
    run_steps(310);
    TEST_ASSERT_EQUAL(CAPTURE_DONE, capture.state);
    for (uint32_t k = 0; k < 3000U; k++) {
        TEST_ASSERT_EQUAL_INT16(written[trigger_period() - 2999U + k], sample(0, k));
    }
}

void test_every_number_of_signals(void)
{
    for (uint8_t signals = 1; signals <= CAPTURE_SIGNALS_MAX; signals++) {
        setUp();
        config.signals = signals;
        for (uint8_t k = 2; k < signals; k++) {
            config.signal[k] = (k % 2U != 0U) ? CAPTURE_v_dc_V : CAPTURE_omega_rad_s;
        }
        arm_for(TRIGGER_RISING, 0);
        run_steps(30);
        TEST_ASSERT_EQUAL(CAPTURE_DONE, capture.state);
        for (uint32_t k = 0; k < 100U; k++) {
            TEST_ASSERT_EQUAL_INT16(written[50U + k], sample(0, k));
            for (uint32_t other = 1; other < signals; other++) {
                TEST_ASSERT_EQUAL_INT16((int)(50U + k) * ((other > 1U && other % 2U != 0U) ? -1 : 1), sample(other, k));
            }
        }
    }
}

static void expect_usual(uint32_t row, uint32_t period)
{
    const int16_t n = (int16_t)period;
    const int16_t expected[] = {n, written[period],     (int16_t)(n + 1000), (int16_t)(-n - 2000), (int16_t)-n,
                                n, (int16_t)(n + 3000), (int16_t)(-n - 4000)};
    for (uint32_t k = 0; k < CAPTURE_SIGNALS_MAX; k++) {
        TEST_ASSERT_EQUAL_INT16(expected[k], sample(k, row));
    }
}

static void choose_the_usual(void)
{
    const uint8_t chosen[] = SCOPE_USUAL_SIGNALS;
    config.signals = CAPTURE_SIGNALS_MAX;
    memcpy(config.signal, chosen, sizeof chosen);
}

static void expect_usual_periods(void)
{
    TEST_ASSERT_EQUAL(CAPTURE_DONE, capture.state);
    for (uint32_t k = 0; k < capture.taken; k++) {
        expect_usual(k, trigger_period() + k * config.divisor - (uint32_t)capture.before * config.divisor);
    }
}

void test_the_usual_signals_in_steps_of_every_length(void)
{
    for (uint32_t length = 1; length <= 60; length++) {
        setUp();
        choose_the_usual();
        arm_for(TRIGGER_RISING, 0);
        while (capture.state != CAPTURE_DONE) {
            run(length);
            step();
        }
        TEST_ASSERT_EQUAL_UINT32(75, trigger_period());
        expect_usual_periods();
    }
}

void test_the_usual_signals_with_a_divisor(void)
{
    choose_the_usual();
    config.divisor = 3;
    arm_for(TRIGGER_MANUAL, 0);
    run_steps(30);
    capture_trigger(&capture, newest + 1U);
    run_steps(30);
    expect_usual_periods();
}

/* The ring begins again in each 64 periods, the memory in each 100: the hardware is told only there. */
void test_the_hardware_continues_until_ring_or_memory_begin_again(void)
{
    late_gather_reset(true);
    arm_for(TRIGGER_MANUAL, 0);
    run_steps(64);
    TEST_ASSERT_EQUAL_UINT32(64, late_gather.copies);
    TEST_ASSERT_EQUAL_UINT32(1, late_gather.set_ups);
    TEST_ASSERT_EQUAL_UINT32(1 + 10 + 6, late_gather.moves);
}

/* Where ring and memory begin again in the same step, it has a third part. */
void test_the_processor_copies_the_third_part_of_a_step(void)
{
    late_gather_reset(true);
    config.samples = 70;
    arm_for(TRIGGER_MANUAL, 0);
    for (uint32_t k = 0; k < 60U; k++) {
        run(40);
        step();
    }
    TEST_ASSERT_EQUAL_UINT32(60, late_gather.copies);
    TEST_ASSERT_TRUE(late_gather.parts < 60U * 40U / 64U + 60U * 40U / 70U + 60U);
    capture_trigger(&capture, newest + 1);
    run_steps(6);
    expect_periods();
}

/* One step may write such a memory twice: the hardware, which comes later, would overwrite what the processor wrote. */
void test_a_small_memory_is_filled_by_the_processor(void)
{
    late_gather_reset(true);
    config.samples = 5;
    config.before = 4;
    arm_for(TRIGGER_MANUAL, 0);
    run_steps(64);
    TEST_ASSERT_EQUAL_UINT32(0, late_gather.copies);
    capture_trigger(&capture, newest + 1);
    run_steps(2);
    expect_periods();
}

/* The capture is complete without it, and the copy that did not end is counted. */
void test_hardware_that_does_not_end_is_not_used_again(void)
{
    late_gather_reset(true);
    config.before = 0;
    arm_for(TRIGGER_MANUAL, 0);
    run_steps(3);
    late_gather.stuck = true;
    run_steps(1);
    TEST_ASSERT_EQUAL_UINT32(4, late_gather.copies);
    capture_trigger(&capture, newest + 1);
    run_steps(20);
    TEST_ASSERT_EQUAL_UINT32(4, late_gather.copies);
    TEST_ASSERT_EQUAL_UINT16(1, capture.lost);
    expect_periods();
}

/* One step later, whatever the divisor is, and also if the periods stop. */
void test_a_capture_is_done_one_step_after_its_last_copy(void)
{
    const uint16_t divisors[] = {1, 10, 100, 300};
    for (unsigned k = 0; k < sizeof divisors / sizeof divisors[0]; k++) {
        setUp();
        late_gather_reset(true);
        config.divisor = divisors[k];
        config.samples = SAMPLE_SLOTS;
        config.before = 0;
        config.signals = 1;
        arm_for(TRIGGER_MANUAL, 0);
        capture_trigger(&capture, newest + 1);
        while (capture.recording == CAPTURE_RECORDS && newest + STEP < UINT16_MAX) {
            newest += STEP;
            step();
        }
        TEST_ASSERT_EQUAL(CAPTURE_TRIGGERED, capture.state);
        step();
        TEST_ASSERT_EQUAL(CAPTURE_DONE, capture.state);
    }
}

/* A changed bit leaves the hardware unused, or moves it: it never starts columns that have not been set up. */
void test_a_changed_bit_starts_no_hardware_that_is_not_set_up(void)
{
    for (unsigned bit = 0; bit < 8U; bit++) {
        setUp();
        late_gather_reset(true);
        config.samples = 40;
        arm_for(TRIGGER_MANUAL, 0);
        capture.gather ^= (uint8_t)(1U << bit);
        run_steps(4);
        TEST_ASSERT_TRUE(late_gather.copies == 0U || late_gather.set_ups > 0U);
        config.samples = 100;
        arm();
        capture.gather ^= (uint8_t)(1U << bit);
        const uint32_t before = late_gather.set_ups, copied = late_gather.copies;
        run_steps(4);
        TEST_ASSERT_TRUE(late_gather.copies == copied || late_gather.set_ups > before);
    }
}

/* A tool that finds the state done reads samples that are there. */
void test_the_last_copy_has_ended_when_the_capture_is_done(void)
{
    late_gather_reset(true);
    config.before = 0;
    config.samples = SAMPLE_SLOTS;
    arm_for(TRIGGER_ABOVE, -2500);
    while (capture.state != CAPTURE_DONE) {
        run(STEP);
        capture_step(&capture, memory, ring, offset + newest);
        if (capture.state != CAPTURE_DONE) {
            late_gather_end();
        }
    }
    TEST_ASSERT_TRUE(late_gather.copies >= 2U);
    TEST_ASSERT_TRUE(hal_gather_is_idle());
    expect_periods();
}

/* Where enough samples lie before and nothing but the signal can trigger, the search needs no other test. */
void test_what_is_searched_without_other_tests(void)
{
    arm_for(TRIGGER_ABOVE, NEVER);
    run_steps(2);
    TEST_ASSERT_EQUAL(SEARCH_LATER, capture.search); /* 20 samples, and 25 must lie before */
    run_steps(1);
    TEST_ASSERT_EQUAL(SEARCH_PERIODS, capture.search);
    capture_trigger(&capture, newest + 4U);
    TEST_ASSERT_EQUAL(SEARCH_ANY, capture.search);
    arm_for(TRIGGER_RISING, -30000); /* no edge: the signal is never below */
    run_steps(10);
    TEST_ASSERT_EQUAL(SEARCH_PERIODS, capture.search);
    TEST_ASSERT_FALSE(capture.ready);
    arm_for(TRIGGER_MANUAL, 0);
    run_steps(10);
    TEST_ASSERT_EQUAL(SEARCH_NOT, capture.search);
    config.divisor = 2;
    arm_for(TRIGGER_ABOVE, NEVER);
    run_steps(10);
    TEST_ASSERT_EQUAL(SEARCH_SAMPLES, capture.search);
    config.trigger_signal = CAPTURE_i_d_ref_A;
    arm_for(TRIGGER_ABOVE, NEVER);
    run_steps(10);
    TEST_ASSERT_EQUAL(SEARCH_STEP, capture.search);
}

static uint32_t random_state;

static uint32_t draw(uint32_t below)
{
    random_state = random_state * 1664525U + 1013904223U;
    return (random_state >> 16) % below;
}

static int16_t drawn_value(void)
{
    static int16_t value;
    value = (draw(4) == 0U) ? (int16_t)((int32_t)draw(61) - 30) : value; /* often the same as before */
    return value;
}

/* The trigger's value in each sample since the arming, and the first sample that triggers by the definition. */
static int16_t seen[PERIODS];

static uint32_t first_trigger(uint32_t samples)
{
    const bool downwards = config.trigger == TRIGGER_FALLING || config.trigger == TRIGGER_BELOW;
    const bool is_edge = config.trigger == TRIGGER_RISING || config.trigger == TRIGGER_FALLING;
    const uint32_t first = config.before - ((config.before > 0U) ? 1U : 0U);
    bool ready = !is_edge;
    for (uint32_t k = first; k < samples; k++) {
        const bool reached = downwards ? seen[k] <= config.level : seen[k] >= config.level;
        if (reached && ready && k >= config.before) {
            return k;
        }
        ready = ready || !reached;
    }
    return samples;
}

static void draw_config(void)
{
    const uint8_t triggers[] = {TRIGGER_RISING, TRIGGER_FALLING, TRIGGER_ABOVE, TRIGGER_BELOW};
    config.signals = 3;
    config.signal[2] = CAPTURE_i_d_ref_A;
    config.trigger = triggers[draw(4)];
    config.trigger_signal = (uint8_t)((draw(2) == 0U) ? CAPTURE_i_q_A : CAPTURE_i_d_ref_A);
    config.divisor = (uint16_t)((draw(2) == 0U) ? 1U : 1U + draw(12));
    config.samples = (uint16_t)(1U + draw(150));
    config.before = (uint16_t)draw(config.samples);
    config.level = (int16_t)((int32_t)draw(65) - 32);
}

/* Since the arming, or since a gap. */
static uint32_t samples, first_period, asked_for, asked;

#define SEARCHED 1800U /* so that the samples after the trigger have periods in the record, too */

/* The sample that a command for this period triggers, unless the signal does so before. */
static uint32_t sample_of(uint32_t period)
{
    const uint32_t after = (period > first_period) ? period - first_period : 0U;
    const uint32_t k = (after + config.divisor - 1U) / config.divisor;
    return (k > samples) ? k : samples;
}

static void drawn_command(void)
{
    asked_for = newest + 40U - draw(43);
    capture_trigger(&capture, offset + asked_for);
    asked = sample_of(asked_for);
}

/* One step of the task with some periods, now and then with more than the ring holds. */
static void drawn_step(void)
{
    const bool is_late = draw(60) == 0U;
    const bool begins_anew = is_late && capture.state == CAPTURE_ARMED;
    capture.values.i_d_ref = drawn_value();
    for (uint32_t left = is_late ? SAMPLE_SLOTS + 12U + draw(5) : 1U + draw(25); left > 0U; left--) {
        newest++;
        write_period(newest, drawn_value());
        if (begins_anew && left == 1U) {
            first_period = newest;
            samples = 0;
            asked = (asked == PERIODS) ? PERIODS : sample_of(asked_for);
        }
        if ((newest - first_period) % config.divisor == 0U) {
            seen[samples] = (config.trigger_signal == CAPTURE_i_q_A) ? written[newest] : capture.values.i_d_ref;
            samples++;
        }
    }
    step();
}

static void drawn_capture(void)
{
    setUp();
    draw_config();
    arm();
    first_period = newest + 1U;
    samples = 0;
    asked = PERIODS;
    const uint32_t commanded = (draw(3) == 0U) ? draw(20) : PERIODS;
    for (uint32_t n = 0; newest < SEARCHED && capture.state == CAPTURE_ARMED; n++) {
        if (n == commanded) {
            drawn_command();
        }
        drawn_step();
    }
}

/* Against the definition of the trigger: random signals, configurations, commands and lengths of the steps. */
void test_every_trigger_is_the_first_one(void)
{
    uint32_t found = 0;
    random_state = 1;
    for (uint32_t n = 0; n < 3000U; n++) {
        drawn_capture();
        const uint32_t by_signal = first_trigger(samples);
        const uint32_t expected = (by_signal < asked) ? by_signal : asked;
        TEST_ASSERT_EQUAL(expected >= samples, capture.state == CAPTURE_ARMED);
        if (capture.state != CAPTURE_ARMED) {
            TEST_ASSERT_EQUAL_UINT32(first_period + expected * config.divisor, trigger_period());
            while (capture.state != CAPTURE_DONE) {
                drawn_step();
            }
            expect_periods();
            found++;
        }
    }
    TEST_ASSERT_TRUE(found > 2000U);
}

void test_eight_signals_of_all_kinds(void)
{
    config.signals = 8;
    const uint8_t chosen[] = {CAPTURE_i_q_A,     CAPTURE_i_d_A,     CAPTURE_omega_rad_s,         CAPTURE_v_dc_V,
                              CAPTURE_i_d_ref_A, CAPTURE_i_q_ref_A, CAPTURE_torque_commanded_Nm, CAPTURE_psi_error_Vs};
    memcpy(config.signal, chosen, sizeof chosen);
    TEST_ASSERT_EQUAL_UINT32(75, triggered_in(TRIGGER_RISING, 0));
    for (uint32_t k = 0; k < 100U; k++) {
        const int16_t period = (int16_t)(50U + k);
        TEST_ASSERT_EQUAL_INT16(period, sample(2, k));
        TEST_ASSERT_EQUAL_INT16(-period, sample(3, k));
        for (uint32_t of_step = 0; of_step < 4U; of_step++) {
            TEST_ASSERT_EQUAL_INT16(of_step + 1U, sample(4U + of_step, k));
        }
    }
}

/* A value of the step belongs to the periods that are copied in that step. */
void test_a_value_of_the_step_changes_with_the_step(void)
{
    config.signal[1] = CAPTURE_i_q_ref_A;
    config.trigger_signal = CAPTURE_i_q_ref_A;
    arm_for(TRIGGER_RISING, 7);
    run_steps(5);
    capture.values.i_q_ref = 7;
    run_steps(12);
    TEST_ASSERT_EQUAL(CAPTURE_DONE, capture.state);
    TEST_ASSERT_EQUAL_UINT32(3 + 50 + 1, trigger_period());
    TEST_ASSERT_EQUAL_INT16(2, sample(1, 24));
    TEST_ASSERT_EQUAL_INT16(7, sample(1, 25));
}

void test_a_changed_bit_does_not_make_an_idle_capture_record(void)
{
    for (unsigned bit = 0; bit < 8U; bit++) {
        capture.recording = (uint8_t)(1U << bit);
        run_steps(3);
        TEST_ASSERT_EQUAL(CAPTURE_IDLE, capture.state);
        TEST_ASSERT_EQUAL_UINT32(0, capture.next);
    }
}

void test_nothing_is_recorded_when_idle_or_done(void)
{
    run_steps(3);
    TEST_ASSERT_EQUAL_UINT32(0, capture.next);
    (void)triggered_in(TRIGGER_RISING, 0);
    const int16_t first = sample(0, 0);
    run_steps(20);
    TEST_ASSERT_EQUAL_INT16(first, sample(0, 0));
    TEST_ASSERT_EQUAL_UINT32(75, trigger_period());
}

void test_each_arming_has_the_next_number_and_begins_anew(void)
{
    TEST_ASSERT_EQUAL_UINT32(75, triggered_in(TRIGGER_RISING, 0));
    TEST_ASSERT_EQUAL_UINT16(1, capture.number);
    capture_stop(&capture);
    TEST_ASSERT_EQUAL(CAPTURE_IDLE, capture.state);
    TEST_ASSERT_EQUAL_UINT32(675, triggered_in(TRIGGER_RISING, 0));
    TEST_ASSERT_EQUAL_UINT16(2, capture.number);
}

void test_a_task_that_comes_too_late_begins_the_search_anew(void)
{
    arm_for(TRIGGER_RISING, 0);
    run_steps(2);
    run(61);
    step();
    TEST_ASSERT_EQUAL_UINT16(1, capture.lost);
    TEST_ASSERT_EQUAL(CAPTURE_ARMED, capture.state);
    run_steps(20);
    TEST_ASSERT_EQUAL_UINT32(125, trigger_period());
    expect_periods();
}

void test_samples_from_before_a_gap_are_not_taken(void)
{
    arm_for(TRIGGER_MANUAL, 0);
    run_steps(20);
    run(61);
    step();
    run_steps(1);
    capture_trigger(&capture, newest + 1);
    run_steps(20);
    TEST_ASSERT_EQUAL_UINT16(11, capture.before);
    expect_periods();
}

void test_a_task_that_comes_too_late_ends_what_has_been_triggered(void)
{
    arm_for(TRIGGER_RISING, 0);
    run_steps(8);
    TEST_ASSERT_EQUAL(CAPTURE_TRIGGERED, capture.state);
    run(61);
    step();
    TEST_ASSERT_EQUAL_UINT16(1, capture.lost);
    TEST_ASSERT_EQUAL_UINT16(25 + 9, capture.taken);
    expect_periods();
}

/* The number of a period overflows after five days at 10 kHz. */
void test_the_periods_numbers_may_overflow(void)
{
    offset = 0U - 64U;
    config.before = 40;
    TEST_ASSERT_EQUAL_UINT32(75, triggered_in(TRIGGER_RISING, 0));
    TEST_ASSERT_EQUAL_UINT16(40, capture.before);
}

static void freeze(uint32_t period)
{
    config.samples = 64;
    config.before = 32;
    capture_freeze(&capture, &config, offset + period, offset + newest);
}

void test_a_freeze_frame_has_the_periods_before_the_fault(void)
{
    run_steps(30);
    run(5);
    freeze(newest - 3);
    TEST_ASSERT_EQUAL_UINT8(1, capture.frozen);
    step();
    TEST_ASSERT_EQUAL(CAPTURE_TRIGGERED, capture.state);
    run_steps(4);
    TEST_ASSERT_EQUAL_UINT16(32, capture.before);
    TEST_ASSERT_EQUAL_UINT16(64, capture.taken);
    TEST_ASSERT_EQUAL_UINT32(305, trigger_period());
    expect_periods();
}

void test_a_freeze_frame_may_begin_with_the_period_that_is_being_made(void)
{
    run_steps(30);
    freeze(newest + 1);
    step();
    run_steps(5);
    TEST_ASSERT_EQUAL_UINT16(32, capture.before);
    expect_periods();
}

void test_a_freeze_frame_of_the_first_periods_is_shorter(void)
{
    freeze(3);
    step();
    run_steps(7);
    TEST_ASSERT_EQUAL_UINT16(2, capture.before);
    TEST_ASSERT_EQUAL_UINT16(34, capture.taken);
    expect_periods();
}

/* At 40 kHz a step has 40 periods; a fault at its start is that old already. */
void test_a_freeze_frame_reaches_as_far_back_as_the_ring(void)
{
    run_steps(30);
    freeze(newest - 40);
    step();
    run_steps(7);
    TEST_ASSERT_EQUAL_UINT16(19, capture.before);
    TEST_ASSERT_EQUAL_UINT16(51, capture.taken);
    TEST_ASSERT_EQUAL_UINT16(0, capture.lost);
    expect_periods();
}

void test_a_fault_beyond_the_ring_leaves_no_samples(void)
{
    run_steps(30);
    freeze(newest - 90);
    step();
    TEST_ASSERT_EQUAL(CAPTURE_DONE, capture.state);
    TEST_ASSERT_EQUAL_UINT16(1, capture.lost);
    TEST_ASSERT_EQUAL_UINT16(0, capture.taken);
}

static void expect_refused(capture_config_t wrong)
{
    TEST_ASSERT_FALSE(capture_config_is_valid(&wrong));
}

#define WITH(member, value) \
    do { \
        capture_config_t wrong = config; \
        wrong.member = (value); \
        expect_refused(wrong); \
    } while (0)

void test_configurations_that_cannot_be_recorded_are_refused(void)
{
    TEST_ASSERT_TRUE(capture_config_is_valid(&config));
    WITH(signals, 0);
    WITH(signals, CAPTURE_SIGNALS_MAX + 1);
    WITH(signal[0], CAPTURE_SIGNALS);
    WITH(signal[1], CAPTURE_SIGNALS);
    WITH(trigger, TRIGGERS);
    WITH(trigger_signal, CAPTURE_SIGNALS);
    WITH(divisor, 0);
    WITH(samples, 25);
    WITH(before, 100);
    WITH(samples, CAPTURE_MEMORY / 2 + 1);
    config.samples = CAPTURE_MEMORY / 2;
    TEST_ASSERT_TRUE(capture_config_is_valid(&config));
}
