/* SPDX-License-Identifier: Apache-2.0 */
/* The shadow is the same firmware compiled for the host. Each of its activities runs when the emulated core runs the
 * handler, with the counts and the angle that the handler has read. */
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "emulated_private.h"
#include "fx/q.h"
#include "hal/host/port.h"
#include "hal/s32k144/ntc.h"
#include "hal/s32k144/reference.h"
#include "hal/s32k144/temperature.h"
#include "hal/temperature.h"

enum { FAST_VECTOR = 16 + 39, MRAI_VECTOR = 16 + 69, TASK_VECTOR = 16 + 48, GATE_VECTOR = 16 + 103 };
#define PWM_TICK_S (1.0 / 112e6)
enum { ENCODER_SHIFT = 18, CAPTURED = 0x80 };

/* Computes the angle as hal/s32k144/angle_quadrature.c and angle_resolver.c do, from the values that they have read. An
 * encoder's index has passed before, or the counter started at it. */
static uint32_t angle_read(const emulated_t *e)
{
    if ((emu_register(e->emu, "FTM2.QDCTRL") & 1U) == 0) {
        return emu_resolver_angle(e->emu);
    }
    const uint32_t q32_per_tick = UINT32_MAX / (uint32_t)(emu_register(e->emu, "FTM0.MOD") + 1U);
    const bool passed_index = (emu_register(e->emu, "FTM2.C2SC") & CAPTURED) != 0U;
    const uint32_t at_index = passed_index ? (uint32_t)emu_register(e->emu, "FTM2.C2V") : 0U;
    const uint32_t now = (emu_counter_read(e->emu, 1, false) - at_index) << ENCODER_SHIFT;
    const uint32_t last = (emu_counter_read(e->emu, 1, true) - at_index) << ENCODER_SHIFT;
    const int32_t passed = (int32_t)(emu_counter_read(e->emu, 0, false) * q32_per_tick);
    return (uint32_t)fx_mulhi_sub((int32_t)now, (int32_t)(now - last), passed);
}

static void samples_take(emulated_t *e)
{
    const emu_pins_t *pins = emu_pins_now(e->emu);
    e->shadow->counts =
        (adc_counts_t){.i_a = pins->adc[0][0], .i_b = pins->adc[1][0], .i_c = pins->adc[0][1], .v_dc = pins->adc[1][1]};
    e->shadow->theta_m = angle_read(e);
}

/* Raises the faults before the fast ISR, as hal/s32k144/main.c does. */
static void faults_take(emulated_t *e)
{
    if (e->gate_fault) {
        drive_raise_fault(&e->shadow->drive, FAULT_GATE);
    }
    e->gate_fault = false;
    e->shadow->board.gate_fault = e->pins_of_board.gate_fault; /* read back by hal/host */
}

static double temperature(uint32_t count, bool *broken)
{
    const int16_t dC = ntc_dC((uint16_t)count);
    *broken = !temperature_is_known(dC);
    return *broken ? 0.0 : dC / 10.0;
}

static void winding_take(const emulated_t *e, fluxtrue_t *host)
{
    host->winding_C = temperature((uint32_t)emu_register(e->emu, "ADC0.R2"), &host->board.winding_broken);
}

static void inverter_take(const emulated_t *e, fluxtrue_t *host)
{
    host->board.inverter_C = temperature((uint32_t)emu_register(e->emu, "ADC1.R2"), &host->board.inverter_broken);
}

static void reference_take(const emulated_t *e, fluxtrue_t *host)
{
    host->board.known_share = reference_permille((uint16_t)emu_register(e->emu, "ADC1.R3")) / 1000.0;
}

void temperatures_take(const emulated_t *e, fluxtrue_t *host)
{
    winding_take(e, host);
    inverter_take(e, host);
    reference_take(e, host);
}

/* In the steps in which the image converts them, as hal/s32k144/temperature.c does; the shadow keeps what it has in
 * between. */
static void temperatures_in_turn_take(const emulated_t *e, fluxtrue_t *host)
{
    uint32_t steps = 0;
    (void)emu_read(e->emu, e->temperature_steps_at, &steps, sizeof steps);
    const uint32_t turn = steps % TEMPERATURE_CYCLE_STEPS;
    if (turn == TEMPERATURE_WINDING_TURN || host->board.winding_broken) {
        winding_take(e, host);
    }
    if (turn == TEMPERATURE_INVERTER_TURN || host->board.inverter_broken) {
        inverter_take(e, host);
    }
    reference_take(e, host);
}

/* The task reads all its inputs when it begins, long before the next interrupt, so the shadow computes the whole task
 * at this time. The results are copied to the shadow when the image writes them: all of them when the task ends; when
 * it is interrupted, those bytes that already have their new values in the image's memory. */
static void task_begins(emulated_t *e)
{
    const drive_t before = e->shadow->drive;
    temperatures_in_turn_take(e, e->shadow);
    task_1khz(&e->shadow->drive);
    e->task_result = e->shadow->drive;
    e->shadow->drive = before;
    e->task_runs = true;
}

static void task_ends(emulated_t *e)
{
    e->shadow->drive.task = e->task_result.task;
    e->shadow->drive.commands = e->task_result.commands;
    e->shadow->drive.mrai.schedules = e->task_result.mrai.schedules;
    e->shadow->drive.mrai.task = e->task_result.mrai.task;
    e->shadow->drive.parameters.modulate = e->task_result.parameters.modulate;
    e->shadow->drive.parameters.current_control = e->task_result.parameters.current_control;
    e->shadow->drive.data_check = e->task_result.data_check;
    e->task_runs = false;
}

static void part_take(emulated_t *e, size_t offset, size_t size)
{
    const uint8_t *image = (const uint8_t *)&e->mirror.host->drive + offset;
    const uint8_t *result = (const uint8_t *)&e->task_result + offset;
    uint8_t *shadow = (uint8_t *)&e->shadow->drive + offset;
    for (size_t i = 0; i < size; i++) {
        shadow[i] = image[i] == result[i] ? result[i] : shadow[i];
    }
}

static void task_interrupted(emulated_t *e)
{
    mirror_pull(&e->mirror);
    part_take(e, offsetof(drive_t, task), sizeof e->task_result.task);
    part_take(e, offsetof(drive_t, commands), sizeof e->task_result.commands);
    part_take(e, offsetof(drive_t, mrai.schedules), sizeof e->task_result.mrai.schedules);
    part_take(e, offsetof(drive_t, mrai.task), sizeof e->task_result.mrai.task);
    part_take(e, offsetof(drive_t, parameters.modulate), sizeof e->task_result.parameters.modulate);
}

/* The shadow's fast ISR runs at the end of the image's, which has then read its inputs; no other activity of the drive
 * interrupts it. The other activities run at their beginning. */
static void follow(void *user, int vector, bool entered)
{
    emulated_t *e = user;
    host_port_select(e->shadow);
    if (vector == FAST_VECTOR && entered && e->task_runs) {
        task_interrupted(e);
    } else if (vector == GATE_VECTOR && entered) {
        e->gate_fault = true;
        e->shadow->board.fault_latched = true;
    } else if (vector == FAST_VECTOR && !entered) {
        samples_take(e);
        faults_take(e);
        fast_isr(&e->shadow->drive);
    } else if (vector == MRAI_VECTOR && entered) {
        mrai_isr(&e->shadow->drive);
    } else if (vector == TASK_VECTOR && entered) {
        task_begins(e);
    } else if (vector == TASK_VECTOR) {
        task_ends(e);
    }
    host_port_select(NULL);
}

void shadow_inputs(emulated_t *e)
{
    const mirror_t *m = &e->mirror;
    for (int i = 0; i < m->inputs; i++) {
        memcpy((uint8_t *)&e->shadow->drive + m->part[i].host_offset,
               (uint8_t *)&m->host->drive + m->part[i].host_offset, m->part[i].size);
    }
}

/* The shadow starts from the present state of the image. */
bool shadow_start(emulated_t *e)
{
    if (e->shadow == NULL) {
        e->shadow = fluxtrue_create();
    }
    e->temperature_steps_at = emu_symbol(e->emu, "temperature_steps");
    if (e->shadow == NULL || e->temperature_steps_at == 0U) {
        return false;
    }
    mirror_pull(&e->mirror);
    const drive_t own = e->shadow->drive;
    e->shadow->drive = e->mirror.host->drive;
    e->shadow->drive.motor = own.motor; /* with pointers to the host's tables */
    e->shadow->drive.period = own.period;
    e->shadow->drive.parameters = own.parameters;
    e->shadow->drive.data_check = own.data_check;
    shadow_inputs(e);
    temperatures_take(e, e->shadow);
    emu_on_exception(e->emu, follow, e);
    return true;
}

/* Compares the values that the timer has just loaded with the shadow's duties; hal/s32k144/pwm.c rounds to whole
 * ticks. */
static const char *bridge_differs(const emulated_t *e)
{
    const duty_t duty = e->shadow->duty;
    const double wanted[3] = {duty.a / 32768.0, duty.b / 32768.0, duty.c / 32768.0};
    emu_bridge_t bridge;
    emu_bridge(e->emu, &bridge);
    const double tick = PWM_TICK_S / bridge.period_s;
    for (int x = 0; x < 3; x++) {
        if (fabs(bridge.duty[x] - wanted[x]) > 0.5001 * tick) {
            return "compare values";
        }
    }
    return bridge.gates == (e->shadow->gates && !e->shadow->board.fault_latched) ? NULL : "gates";
}

void shadow_compare(emulated_t *e)
{
    if (emu_active_vector(e->emu) != 0) {
        return; /* an activity is running: the next period is compared */
    }
    char where[64];
    bool differs = mirror_differs(&e->mirror, e->shadow, where, sizeof where);
    const char *outputs = bridge_differs(e);
    if (!differs && outputs != NULL) {
        (void)snprintf(where, sizeof where, "%s", outputs);
        differs = true;
    }
    e->compared++;
    if (differs && e->differing++ == 0) {
        (void)snprintf(e->difference, sizeof e->difference, "%s, period %llu", where, (unsigned long long)e->steps);
    }
}
