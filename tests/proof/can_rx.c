/* SPDX-License-Identifier: Apache-2.0 */
/* Reception of the protected messages: comm/e2e, comm/can_take and comm/can_rx. */
#include "proof.h"

#include "bus/bus.c" /* before the file that forbids its conversions */

#include "comm/e2e.c"

#include "comm/can_take.c"

#include "comm/can_rx.c"

static const bus_scales_t scales = {.torque_Nm = 0.1F, .power_kW = 0.01F};

static can_frame_t any_frame(void)
{
    can_frame_t frame;
    frame.extended = nondet_bool();
    return frame;
}

static rx_channel_t any_channel(void)
{
    rx_channel_t channel;
    channel.e2e.synced = nondet_bool();
    channel.alive = nondet_bool();
    channel.failed = nondet_bool();
    channel.seen = nondet_bool();
    ASSUME(channel.e2e.counter < E2E_COUNTERS && channel.bad <= WINDOW_MASK);
    return channel;
}

void proof_e2e_burst_is_detected(void)
{
    can_frame_t frame = any_frame();
    uint16_t id;
    frame.length = E2E_LENGTH;
    ASSUME(frame.data[0] == e2e_crc(id, &frame));
    unsigned byte, shift;
    uint8_t pattern;
    ASSUME(WITHIN(byte, 1U, 6U) && shift <= 8U && pattern != 0U);
    const uint32_t burst = (uint32_t)pattern << shift; /* the CRC processes the highest bit of a byte first */
    frame.data[byte] ^= (uint8_t)(burst >> 8);
    frame.data[byte + 1U] ^= (uint8_t)burst;
    PROVE(frame.data[0] != e2e_crc(id, &frame));
}

void proof_e2e_protected_frame_is_accepted(void)
{
    can_frame_t frame = any_frame();
    uint16_t id;
    uint8_t counter;
    ASSUME(counter < E2E_COUNTERS);
    frame.length = E2E_LENGTH;
    e2e_state_t state = {.counter = (uint8_t)((counter + E2E_COUNTERS - 1U) % E2E_COUNTERS), .synced = true};
    const uint8_t upper = frame.data[1] & 0xF0U;
    e2e_protect(id, &counter, &frame);
    PROVE(counter < E2E_COUNTERS && (frame.data[1] & 0xF0U) == upper);
    PROVE(e2e_check(id, &state, &frame) == E2E_OK);
}

void proof_e2e_counter(void)
{
    e2e_state_t state;
    uint8_t counter;
    state.synced = nondet_bool();
    ASSUME(state.counter < E2E_COUNTERS && counter <= COUNTER_MASK);
    const e2e_state_t before = state;
    const e2e_status_t status = check_counter(&state, counter);
    const unsigned expected = (before.counter + 1U) % 15U, skipped = (before.counter + 2U) % 15U;
    PROVE(state.counter < E2E_COUNTERS);
    PROVE((status == E2E_OK) == (before.synced && counter == expected));
    PROVE((status == E2E_SKIPPED) == (before.synced && counter == skipped));
    PROVE((status == E2E_REPEATED) == (before.synced && counter == before.counter));
    PROVE((status == E2E_FIRST) == (!before.synced && counter < 15U));
}

void proof_e2e_refuses_other_lengths(void)
{
    can_frame_t frame = any_frame();
    e2e_state_t state;
    uint16_t id;
    ASSUME(frame.length != 8U);
    PROVE(e2e_check(id, &state, &frame) == E2E_WRONG_LENGTH);
}

void proof_count_ones(void)
{
    unsigned bits;
    ASSUME(bits <= WINDOW_MASK);
    unsigned sum = 0;
    for (unsigned n = 0; n < 10U; n++) {
        sum += bits >> n & 1U;
    }
    PROVE(count_ones(bits) == sum);
}

void proof_three_bad_of_ten_fail(void)
{
    rx_channel_t channel = any_channel();
    rx_result_t result;
    ASSUME(WITHIN((int)result, 0, RX_RESULTS - 1));
    const rx_channel_t before = channel;
    record_result(&channel, result);
    PROVE(channel.bad <= WINDOW_MASK);
    PROVE(result == RX_SYNCED || channel.failed == (count_ones(channel.bad) >= 3U));
    PROVE(result == RX_SYNCED || (channel.bad & 1U) == ((result == RX_ACCEPTED) ? 0U : 1U));
    PROVE(result == RX_ACCEPTED || channel.alive == before.alive);
    PROVE(result != RX_ACCEPTED || (channel.alive && channel.age_us == 0U));
}

void proof_a_message_times_out(void)
{
    rx_channel_t channel = any_channel();
    uint32_t elapsed_us, time_out_ms;
    ASSUME(channel.age_us <= 100000000U && elapsed_us <= 10000U && WITHIN(time_out_ms, 1U, 10000U));
    const rx_channel_t before = channel;
    const bool timed_out = advance_age(&channel, elapsed_us, time_out_ms);
    PROVE(!channel.alive || channel.age_us < time_out_ms * 1000U);
    PROVE(timed_out == (before.alive && !channel.alive));
    PROVE(!timed_out || !channel.e2e.synced);
}

void proof_a_refused_frame_changes_no_request(void)
{
    can_rx_t rx;
    rx.command_channel = any_channel();
    rx.limits_channel = any_channel();
    const can_frame_t frame = any_frame();
    const can_rx_t before = rx;
    const rx_result_t result = can_rx_frame(&rx, &scales, &frame);
    PROVE(WITHIN((int)result, 0, RX_RESULTS - 1));
    const bool same = rx.command.enable == before.command.enable && rx.command.mode == before.command.mode &&
                      rx.command.fault_reset == before.command.fault_reset;
    PROVE(result == RX_ACCEPTED || same);
    PROVE(result == RX_ACCEPTED || rx.command_channel.alive == before.command_channel.alive);
    PROVE(rx.count[result] == ((before.count[result] < UINT16_MAX) ? before.count[result] + 1 : UINT16_MAX));
    PROVE(result != RX_ACCEPTED || frame.id == BUS_VCU_TORQUE_REQUEST_FRAME_ID || same);
}

void proof_a_lost_command_asks_for_nothing(void)
{
    can_rx_t rx;
    rx.command_channel = any_channel();
    rx.limits_channel = any_channel();
    uint32_t elapsed_us;
    ASSUME(elapsed_us <= 10000U && rx.command_channel.age_us <= 1000000U && rx.limits_channel.age_us <= 1000000U);
    const bool was_alive = rx.command_channel.alive;
    can_rx_tick(&rx, elapsed_us);
    if (was_alive && !rx.command_channel.alive) {
        PROVE(!rx.command.enable && !rx.command.fault_reset);
        PROVE(rx.command.torque_requested_Nm == 0.0F);
        PROVE(rx.command.limit_drive_Nm == 0.0F && rx.command.limit_regen_Nm == 0.0F);
    }
}
