/* SPDX-License-Identifier: Apache-2.0 */
#include "comm/can_tx.h"

#include <math.h>

#include "comm/e2e.h"
#include "signal/step_clock.h"
#include "unity.h"

#define RUN_MS 10000

/* Identifier and cycle time, copied by hand from the DBC. */
static const struct {
    uint32_t id;
    int cycle_ms;
} wanted[] = {
    {0x210, 10},  {0x211, 10},  {0x212, 10},  {0x213, 10},  {0x214, 100}, {0x215, 10},   {0x220, 100},
    {0x221, 100}, {0x230, 100}, {0x231, 100}, {0x232, 100}, {0x233, 100}, {0x240, 1000},
};
#define MESSAGES (int)(sizeof wanted / sizeof wanted[0])

static const bus_scales_t scales = {0.1F, 1.0F, 0.001F, 0.01F, 0.1F, 0.1F, 0.01F};
static can_tx_t tx;
static telemetry_t telemetry;
static can_frame_t frame;

void setUp(void)
{
    tx = (can_tx_t){0};
    telemetry = (telemetry_t){.scales = &scales, .motor_name = "hsm1"};
}

void tearDown(void)
{
}

static int place(uint32_t id)
{
    for (int n = 0; n < MESSAGES; n++) {
        if (wanted[n].id == id) {
            return n;
        }
    }
    TEST_FAIL_MESSAGE("a message that is not in the DBC");
    return 0;
}

/* Asked before each frame, or never: the same frames. */
void test_a_frame_is_due_exactly_when_the_next_call_returns_one(void)
{
    can_tx_t asked = tx;
    for (int ms = 1; ms <= RUN_MS; ms++) {
        can_tx_begin(&tx, 1);
        can_tx_begin(&asked, 1);
        bool due;
        do {
            due = can_tx_due(&asked);
            TEST_ASSERT_EQUAL(due, can_tx_due(&asked));
            can_frame_t other = {0};
            const tx_result_t result = can_tx_next(&tx, &telemetry, &frame);
            TEST_ASSERT_EQUAL(due, result != TX_NONE);
            TEST_ASSERT_EQUAL_INT(result, can_tx_next(&asked, &telemetry, &other));
            if (due) {
                TEST_ASSERT_EQUAL_UINT32(frame.id, other.id);
                TEST_ASSERT_EQUAL_UINT8_ARRAY(frame.data, other.data, sizeof frame.data);
            }
        } while (due);
    }
}

void test_every_message_comes_exactly_in_its_cycle_time(void)
{
    int last[MESSAGES];
    int count[MESSAGES] = {0};
    for (int ms = 1; ms <= RUN_MS; ms++) {
        can_tx_begin(&tx, 1);
        while (can_tx_next(&tx, &telemetry, &frame) == TX_FRAME) {
            const int n = place(frame.id);
            TEST_ASSERT_EQUAL_UINT8(8, frame.length);
            TEST_ASSERT_FALSE(frame.extended);
            if (count[n] > 0) {
                TEST_ASSERT_EQUAL_INT(wanted[n].cycle_ms, ms - last[n]);
            }
            last[n] = ms;
            count[n]++;
        }
    }
    for (int n = 0; n < MESSAGES; n++) {
        TEST_ASSERT_EQUAL_INT(RUN_MS / wanted[n].cycle_ms, count[n]);
    }
}

/* What the ECU asks before it gathers the values of a message; identifiers copied by hand from the DBC. */
static const struct {
    bool (*may_send)(const can_tx_t *);
    uint32_t ids[4];
} questions[] = {
    {can_tx_may_send_voltage_or_currents, {0x211, 0x212}},
    {can_tx_may_send_status, {0x210}},
    {can_tx_may_send_limits, {0x215}},
    {can_tx_may_send_temperatures, {0x214}},
    {can_tx_may_send_identification, {0x213}},
    {can_tx_may_send_diagnostics, {0x230, 0x231, 0x232, 0x233}},
};
#define QUESTIONS (sizeof questions / sizeof questions[0])

static bool is_one_of(const uint32_t ids[4], uint32_t id)
{
    return id == ids[0] || id == ids[1] || id == ids[2] || id == ids[3];
}

void test_the_values_of_a_frame_are_asked_for_before_it_is_sent_and_only_in_its_slot(void)
{
    bool refused[QUESTIONS] = {0};
    for (int ms = 1; ms <= RUN_MS; ms++) {
        bool may[QUESTIONS];
        can_tx_begin(&tx, 1);
        for (unsigned k = 0; k < QUESTIONS; k++) {
            may[k] = questions[k].may_send(&tx);
            refused[k] = refused[k] || !may[k];
        }
        while (can_tx_next(&tx, &telemetry, &frame) == TX_FRAME) {
            for (unsigned k = 0; k < QUESTIONS; k++) {
                TEST_ASSERT_TRUE(may[k] || !is_one_of(questions[k].ids, frame.id));
            }
        }
    }
    for (unsigned k = 0; k < QUESTIONS; k++) {
        TEST_ASSERT_TRUE(refused[k]);
    }
}

/* A step that found no time to send leaves nothing to the next one, whose frames would be late. */
void test_what_a_step_has_not_sent_is_dropped(void)
{
    can_tx_begin(&tx, 10); /* every message that has a cycle of 10 ms */
    TEST_ASSERT_TRUE(can_tx_due(&tx));
    can_tx_t fresh = {.time_ms = tx.time_ms};
    can_tx_begin(&fresh, 1);
    can_tx_begin(&tx, 1);
    TEST_ASSERT_EQUAL_UINT16(fresh.pending, tx.pending);
}

/* Steps of PWM frequencies such as 4.5, 5.5 and 22.5 kHz: each frame is sent less than a step from its due time, and in
 * 10 s none is missing. */
void test_with_another_step_every_message_keeps_its_cycle_time_in_the_mean_and_each_frame_within_a_step(void)
{
    static const uint32_t step_ns[] = {888889U, 977778U, 1090909U, 1111111U};
    for (unsigned k = 0; k < sizeof step_ns / sizeof step_ns[0]; k++) {
        step_clock_t clock;
        step_clock_start(&clock, step_ns[k]);
        setUp();
        int64_t due_ns[MESSAGES] = {0}, now_ns = 0;
        int count[MESSAGES] = {0}, frames_max = 0;
        while (now_ns < RUN_MS * INT64_C(1000000)) {
            int frames = 0;
            step_clock_step(&clock);
            now_ns += step_ns[k];
            can_tx_begin(&tx, clock.passed_ms);
            while (can_tx_next(&tx, &telemetry, &frame) == TX_FRAME) {
                const int n = place(frame.id);
                const int64_t late_ns = (count[n] > 0) ? now_ns - due_ns[n] : 0;
                TEST_ASSERT_TRUE(late_ns > -(int64_t)step_ns[k] && late_ns < (int64_t)step_ns[k]);
                due_ns[n] = (count[n] > 0) ? due_ns[n] : now_ns;
                due_ns[n] += wanted[n].cycle_ms * INT64_C(1000000);
                count[n]++;
                frames++;
            }
            frames_max = (frames > frames_max) ? frames : frames_max;
        }
        for (int n = 0; n < MESSAGES; n++) {
            TEST_ASSERT_INT_WITHIN(1, RUN_MS / wanted[n].cycle_ms, count[n]);
        }
        TEST_ASSERT_LESS_OR_EQUAL_INT((step_ns[k] > 1000000U) ? 2 : 1, frames_max);
    }
}

void test_no_millisecond_has_more_than_one_frame(void)
{
    for (int ms = 0; ms < RUN_MS; ms++) {
        int frames = 0;
        can_tx_begin(&tx, 1);
        while (can_tx_next(&tx, &telemetry, &frame) == TX_FRAME) {
            frames++;
        }
        TEST_ASSERT_LESS_OR_EQUAL_INT(1, frames);
    }
}

/* The receiver of this project accepts every frame after the first: each message has its own counter, which advances by
 * one. */
void test_status_and_limits_are_protected(void)
{
    e2e_state_t status = {0}, limits = {0};
    int good_status = 0, good_limits = 0;
    for (int ms = 0; ms < 1000; ms++) {
        can_tx_begin(&tx, 1);
        while (can_tx_next(&tx, &telemetry, &frame) == TX_FRAME) {
            good_status += (frame.id == 0x210 && e2e_check(0x2101, &status, &frame) == E2E_OK) ? 1 : 0;
            good_limits += (frame.id == 0x215 && e2e_check(0x2151, &limits, &frame) == E2E_OK) ? 1 : 0;
        }
    }
    TEST_ASSERT_EQUAL_INT(99, good_status);
    TEST_ASSERT_EQUAL_INT(99, good_limits);
}

void test_a_frame_with_nan_or_infinity_is_left_out_and_the_others_are_sent(void)
{
    telemetry.v_dc_V = NAN;
    telemetry.iq_ref_A = INFINITY;
    int frames = 0;
    int refused = 0;
    for (int ms = 0; ms < 10; ms++) {
        can_tx_begin(&tx, 1);
        for (tx_result_t r = can_tx_next(&tx, &telemetry, &frame); r != TX_NONE;
             r = can_tx_next(&tx, &telemetry, &frame)) {
            TEST_ASSERT_TRUE(r != TX_FRAME || (frame.id != 0x211 && frame.id != 0x212));
            frames += (r == TX_FRAME) ? 1 : 0;
            refused += (r == TX_NOT_A_NUMBER) ? 1 : 0;
        }
    }
    TEST_ASSERT_EQUAL_INT(2, refused);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(2, frames);
}

/* Frames of each message in a second. */
static void count_frames(int count[MESSAGES])
{
    for (int n = 0; n < MESSAGES; n++) {
        count[n] = 0;
    }
    tx = (can_tx_t){0};
    for (int ms = 0; ms < 1000; ms++) {
        can_tx_begin(&tx, 1);
        for (tx_result_t r = can_tx_next(&tx, &telemetry, &frame); r != TX_NONE;
             r = can_tx_next(&tx, &telemetry, &frame)) {
            count[place(frame.id)] += (r == TX_FRAME) ? 1 : 0;
        }
    }
}

void test_each_value_that_is_not_a_number_leaves_out_its_own_message_only(void)
{
    float *const value[] = {
        &telemetry.torque_estimated_Nm,
        &telemetry.torque_commanded_Nm,
        &telemetry.speed_rpm,
        &telemetry.v_dc_V,
        &telemetry.i_dc_A,
        &telemetry.id_A,
        &telemetry.iq_A,
        &telemetry.id_ref_A,
        &telemetry.iq_ref_A,
        &telemetry.psi_f_mVs,
        &telemetry.r_mohm,
        &telemetry.psi_quality_percent,
        &telemetry.r_quality_percent,
        &telemetry.table_scale_percent,
        &telemetry.winding_C,
        &telemetry.inverter_C,
        &telemetry.torque_max_Nm,
    };
    static const uint32_t id[] = {0x210, 0x210, 0x210, 0x211, 0x211, 0x212, 0x212, 0x212, 0x212,
                                  0x213, 0x213, 0x213, 0x213, 0x213, 0x214, 0x214, 0x215};
    int count[MESSAGES];
    for (unsigned k = 0; k < sizeof id / sizeof id[0]; k++) {
        *value[k] = NAN;
        count_frames(count);
        *value[k] = 0.0F;
        for (int n = 0; n < MESSAGES; n++) {
            TEST_ASSERT_EQUAL_INT((wanted[n].id == id[k]) ? 0 : 1000 / wanted[n].cycle_ms, count[n]);
        }
    }
}
