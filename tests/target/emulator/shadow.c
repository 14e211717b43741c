/* SPDX-License-Identifier: Apache-2.0 */
/* The same firmware compiled for the host follows the emulated one: each activity runs when the emulated core enters
 * its handler, with the counts and the angle that the pins carry. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "emulated_private.h"
#include "hal/host/port.h"

enum { FAST_VECTOR = 16 + 39, MRAI_VECTOR = 16 + 69, TASK_VECTOR = 16 + 48 };
#define PWM_TICK_S (1.0 / 112e6)
enum { ENCODER_COUNTS = 16384, ENCODER_SHIFT = 18 };

uint32_t pins_theta(const emulated_t *e)
{
    const uint32_t angle = emu_pins_look(e->emu)->angle;
    const bool encoder = (emu_register(e->emu, "FTM2.QDCTRL") & 1U) != 0;
    const uint64_t count = ((uint64_t)angle * ENCODER_COUNTS) >> 32;
    return encoder ? (uint32_t)count << ENCODER_SHIFT : angle & 0xFFFF0000U;
}

static void samples_take(emulated_t *e)
{
    const emu_pins_t *pins = emu_pins_look(e->emu);
    e->shadow->counts = (adc_counts_t){.i_a = pins->adc[0][0], .i_b = pins->adc[1][0], .i_c = pins->adc[0][1],
                                       .v_dc = pins->adc[1][1]};
    e->shadow->theta_m = pins_theta(e);
}

static void follow(void *user, int vector, bool entered)
{
    emulated_t *e = user;
    if (!entered) {
        return;
    }
    host_port_select(e->shadow);
    if (vector == FAST_VECTOR) {
        samples_take(e);
        fast_isr(&e->shadow->drive);
    } else if (vector == MRAI_VECTOR) {
        mrai_isr(&e->shadow->drive);
    } else if (vector == TASK_VECTOR) {
        task_1khz(&e->shadow->drive);
    }
    host_port_select(NULL);
}

void shadow_inputs(emulated_t *e)
{
    const mirror_t *m = &e->mirror;
    for (int i = 0; i < m->inputs; i++) {
        memcpy((uint8_t *)&e->shadow->drive + m->part[i].here, (uint8_t *)&m->host->drive + m->part[i].here,
               m->part[i].size);
    }
}

/* It starts from the state that the image has now. */
bool shadow_start(emulated_t *e)
{
    if (e->shadow == NULL) {
        e->shadow = fluxtrue_create();
    }
    if (e->shadow == NULL) {
        return false;
    }
    mirror_pull(&e->mirror);
    const motor_t own = e->shadow->drive.motor; /* its tables are here */
    e->shadow->drive = e->mirror.host->drive;
    e->shadow->drive.motor = own;
    shadow_inputs(e);
    emu_on_exception(e->emu, follow, e);
    return true;
}

/* What the timer has just loaded against the duties of the period: hal/s32k144/pwm.c rounds to whole ticks. */
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
    return bridge.gates == e->shadow->gates ? NULL : "gates";
}

void shadow_compare(emulated_t *e)
{
    if (emu_active_vector(e->emu) != 0) {
        return; /* in the middle of something: the next period will do */
    }
    const char *part = mirror_differs(&e->mirror, e->shadow);
    part = part != NULL ? part : bridge_differs(e);
    e->compared++;
    if (part != NULL && e->differing++ == 0) {
        (void)snprintf(e->difference, sizeof e->difference, "%s, period %llu", part, (unsigned long long)e->steps);
    }
}
