/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/host/port.h"

#include <math.h>

#include "hal/adc.h"
#include "hal/angle.h"
#include "hal/board.h"
#include "hal/can.h"
#include "hal/host/can_host.h"
#include "hal/irq.h"
#include "hal/nvm.h"
#include "hal/pwm.h"
#include "hal/shut_off.h"
#include "hal/system.h"
#include "hal/temperature.h"
#include "hal/watchdog.h"

/* The HAL's functions have no instance argument; a thread serves one instance at a time. */
static _Thread_local fluxtrue_t *active;

void host_port_select(fluxtrue_t *instance)
{
    active = instance;
}

void host_port_recall(fluxtrue_t *instance)
{
    host_port_select(instance);
    memory_recall(&instance->memory, &instance->drive);
    host_port_select(NULL);
}

void hal_adc_read(adc_counts_t *counts)
{
    *counts = active->counts;
}

void hal_adc_latest(current_counts_t *counts)
{
    *counts = (current_counts_t){active->counts.i_a, active->counts.i_b, active->counts.i_c};
}

int16_t hal_adc_known_permille(void)
{
    return (int16_t)lrint(active->board.known_share * 1000.0);
}

uint32_t hal_angle_read(void)
{
    return active->theta_m;
}

bool hal_angle_is_absolute(void)
{
    return !active->board.angle_unknown;
}

void hal_pwm_write(duty_t duty)
{
    active->duty = duty;
}

static bool fault_line(const host_board_t *board)
{
    return board->gate_fault || board->short_circuit_blocked;
}

/* A controller's timer disables switching at the fault's edge, and its interrupt is masked until switching is enabled
 * again. */
bool host_port_fault_line(fluxtrue_t *instance)
{
    host_board_t *board = &instance->board;
    if (!fault_line(board) || board->gate_fault_told) {
        return false;
    }
    board->fault_latched = board->gate_fault_told = board->gate_fault_for_board = true;
    return true;
}

/* Enabling ends the latch if the line is no longer active. */
void hal_pwm_enable(bool on)
{
    host_board_t *board = &active->board;
    if (on && !fault_line(board)) {
        board->fault_latched = false;
    }
    board->gate_fault_told = board->gate_fault_told && !(on && (!active->gates || !board->fault_latched));
    active->gates = on;
}

bool hal_pwm_gates(void)
{
    return active->board.gates_stuck || (active->gates && !active->board.fault_latched);
}

void hal_irq_pend_mrai(void)
{
    active->mrai_pending = true;
}

bool hal_can_receive(can_frame_t *frame)
{
    return can_host_receive(active, frame);
}

bool hal_can_send(const can_frame_t *frame)
{
    return can_host_send(active, frame);
}

uint32_t hal_can_lost(void)
{
    return active->board.lost;
}

uint32_t hal_can_bus_off(void)
{
    return active->board.bus_off;
}

void hal_board_set(board_output_t output, bool on)
{
    active->board.output[output] = on;
}

bool hal_board_gate_fault(void)
{
    const bool reported = active->board.gate_fault_for_board || fault_line(&active->board);
    active->board.gate_fault_for_board = false;
    return reported;
}

int16_t hal_temperature_winding_dC(void)
{
    return active->board.winding_broken ? TEMPERATURE_OUT_OF_RANGE : (int16_t)lrint(active->winding_C * 10.0);
}

int16_t hal_temperature_inverter_dC(void)
{
    return active->board.inverter_broken ? TEMPERATURE_OUT_OF_RANGE : (int16_t)lrint(active->board.inverter_C * 10.0);
}

int16_t hal_temperature_processor_dC(void)
{
    return TEMPERATURE_UNKNOWN; /* a PC has no such sensor */
}

void hal_watchdog_start(void)
{
    active->board.watchdog_started = true;
}

void hal_watchdog_service(void)
{
    active->board.watchdog_services++;
}

bool hal_shut_off_question(uint8_t *question)
{
    *question = active->board.external_watchdog.question;
    return true;
}

void hal_shut_off_answer(uint32_t answer)
{
    external_watchdog_answer(&active->board.external_watchdog, answer);
}

bool hal_shut_off_supply(void)
{
    return external_watchdog_supply(&active->board.external_watchdog, active->board.output[BOARD_GATE_DRIVER]);
}

/* Not available for a process on a PC: stack use and reset cause. */
uint32_t hal_system_stack_unused(void)
{
    return 0;
}

reset_cause_t hal_system_reset_cause(void)
{
    return RESET_POWER_ON;
}

bool hal_nvm_begin(void)
{
    return true;
}

void hal_nvm_end(void)
{
}

bool hal_nvm_read(uint32_t slot, uint32_t offset, void *data, uint32_t size)
{
    return nvm_host_read(&active->nvm, slot, offset, data, size);
}

bool hal_nvm_erase(uint32_t slot)
{
    return nvm_host_erase_slot(&active->nvm, slot);
}

bool hal_nvm_program(uint32_t slot, uint32_t offset, const void *data, uint32_t size)
{
    return nvm_host_program(&active->nvm, slot, offset, data, size);
}
