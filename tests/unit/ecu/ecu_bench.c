/* SPDX-License-Identifier: Apache-2.0 */
#include "ecu_bench.h"

#include "hal/mock_adc.h"
#include "hal/mock_angle.h"
#include "hal/mock_board.h"
#include "hal/mock_can.h"
#include "hal/mock_irq.h"
#include "hal/mock_pwm.h"
#include "hal/mock_shut_off.h"
#include "hal/mock_system.h"
#include "hal/mock_temperature.h"
#include "hal/mock_watchdog.h"

board_t board;
ecu_t ecu;

static void adc_read(adc_counts_t *counts, int calls)
{
    (void)calls;
    *counts = board.counts;
}

static void adc_latest(current_counts_t *counts, int calls)
{
    (void)calls;
    *counts = board.converted;
    if (board.period_passes) {
        const sample_t same = ecu.drive.samples.slot[ecu.drive.samples.generation % SAMPLE_SLOTS];
        ecu.drive.samples.generation++;
        ecu.drive.samples.slot[ecu.drive.samples.generation % SAMPLE_SLOTS] = same;
        ecu.drive.samples.slot[ecu.drive.samples.generation % SAMPLE_SLOTS].acting = true;
        board.period_passes = false;
    }
}

static void board_set(board_output_t output, bool on, int calls)
{
    (void)calls;
    board.outputs[output] = on;
}

static bool board_gate_fault(int calls)
{
    (void)calls;
    return board.gate_fault;
}

static bool can_receive(can_frame_t *frame, int calls)
{
    (void)calls;
    *frame = board.arriving;
    return board.waiting-- > 0;
}

static bool can_send(const can_frame_t *frame, int calls)
{
    (void)calls;
    if (board.mailboxes_full) {
        return false;
    }
    if (frame->id == XCP_ID_ANSWER) {
        board.last_answer = *frame;
        board.answers++;
    } else {
        board.last[frame->id % BOARD_FRAMES] = *frame;
        board.sent++;
    }
    return true;
}

static void watchdog_start(int calls)
{
    (void)calls;
    board.watchdog_starts++;
}

static void watchdog_service(int calls)
{
    (void)calls;
    board.watchdog_services++;
}

static bool ask(uint8_t *now, int calls)
{
    (void)calls;
    *now = board.question;
    return board.fitted;
}

static void take_answer(uint32_t answer, int calls)
{
    (void)calls;
    board.answered = answer;
}

static bool read_supply(int calls)
{
    (void)calls;
    return board.supply;
}

static bool read_gates(int calls)
{
    (void)calls;
    return board.switching;
}

static void connect_inverter(void)
{
    hal_shut_off_question_Stub(ask);
    hal_shut_off_answer_Stub(take_answer);
    hal_shut_off_supply_Stub(read_supply);
    hal_adc_read_Stub(adc_read);
    hal_adc_latest_Stub(adc_latest);
    hal_adc_known_permille_IgnoreAndReturn(1000);
    hal_angle_read_IgnoreAndReturn(0);
    hal_angle_is_absolute_IgnoreAndReturn(true);
    hal_irq_pend_mrai_Ignore();
    hal_pwm_write_Ignore();
    hal_pwm_enable_Ignore();
    hal_pwm_gates_Stub(read_gates);
    hal_board_set_Stub(board_set);
    hal_board_gate_fault_Stub(board_gate_fault);
}

static void connect_processor(void)
{
    hal_can_receive_Stub(can_receive);
    hal_can_send_Stub(can_send);
    hal_can_lost_IgnoreAndReturn(0);
    hal_can_bus_off_IgnoreAndReturn(0);
    hal_system_stack_unused_IgnoreAndReturn(100);
    hal_system_reset_cause_IgnoreAndReturn(RESET_PIN);
    hal_temperature_winding_dC_IgnoreAndReturn(250);
    hal_temperature_inverter_dC_IgnoreAndReturn(250);
    hal_temperature_processor_dC_IgnoreAndReturn(250);
    hal_watchdog_start_Stub(watchdog_start);
    hal_watchdog_service_Stub(watchdog_service);
}

void board_start(void)
{
    board = (board_t){.supply = true,
                      .switching = true,
                      .counts = {2048, 2048, 2048, 0},
                      .converted = {2048, 2048, 2048},
                      .arriving = {.id = 0x7FF, .length = 8}}; /* an unknown identifier */
    connect_inverter();
    connect_processor();
    ecu_init(&ecu, &motor);
}

void task_after(int periods)
{
    for (int n = 0; n < periods; n++) {
        fast_isr(&ecu.drive);
        if (!board.mrai_hangs) {
            mrai_isr(&ecu.drive);
        }
    }
    ecu_task_1khz(&ecu);
}

void tasks(int count)
{
    for (int n = 0; n < count; n++) {
        task_after(NOMINAL_PERIODS);
    }
}
