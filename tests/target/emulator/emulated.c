/* SPDX-License-Identifier: Apache-2.0 */
#include "emulated.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "emulated_private.h"
#include "hal/host/port.h"
#include "loop/runner/sim_private.h"

#define TURN_RAD 6.283185307179586
#define ANGLE_ONE 4294967296.0
#define BOOT_LIMIT_S 0.25

/* ---- sensors to pins ---- */

static uint16_t to_count(double share, unsigned bits)
{
    const double top = (double)(1U << bits) - 1.0;
    return (uint16_t)fmin(fmax(floor(share * (top + 1.0) + 0.5), 0.0), top);
}

/* An NTC of B = 3435 K with a pull-up equal to its resistance at 25 degrees Celsius, hal/s32k144/ntc.h. */
static uint16_t ntc_count(double celsius)
{
    const double r = exp(3435.0 * (1.0 / (celsius + 273.15) - 1.0 / 298.15));
    return to_count(r / (1.0 + r), 12);
}

/* The sensor on the die: 740.5 mV at 25 degrees Celsius, 1.564 mV less for each kelvin; the reference is 5 V
 * (hal/s32k144/die.h). */
static uint16_t die_count(double celsius)
{
    return to_count((0.7405 - 0.001564 * (celsius - 25.0)) / 5.0, 12);
}

/* The bandgap, 1 V at a reference of 5 V (hal/s32k144/sampling.c). */
static uint16_t bandgap_count(double share)
{
    return to_count(share / 5.0, 12);
}

static uint32_t angle_of(double rad)
{
    const double turns = rad / TURN_RAD;
    return (uint32_t)(uint64_t)((turns - floor(turns)) * ANGLE_ONE);
}

/* Until the next sample the shaft turns at the mean speed of the last period. */
static void angle_to_pins(emulated_t *e, emu_pins_t *pins, uint32_t angle)
{
    const int32_t moved = (int32_t)(angle - pins->angle);
    const double rate = (double)moved * 65536.0 / e->period_ticks;
    pins->angle_rate = fabs(rate) > 2e9 || e->steps == 0 ? 0 : (int32_t)rate;
    pins->angle = angle;
}

static void samples_to_pins(emulated_t *e, const double in[6])
{
    const motor_t *m = &motor;
    emu_pins_t *pins = emu_pins(e->emu);
    const double span_A = 2.0 * (double)m->current_full_scale_A;
    pins->adc[0][0] = to_count(in[0] / span_A + 0.5, m->adc_bits);
    pins->adc[1][0] = to_count(in[1] / span_A + 0.5, m->adc_bits);
    pins->adc[0][1] = to_count(in[2] / span_A + 0.5, m->adc_bits);
    pins->adc[1][1] = to_count(in[3] / (double)m->v_dc_full_scale_V, m->adc_bits);
    pins->adc[0][2] = ntc_count(in[5]);
    pins->adc[1][2] = ntc_count(e->inverter_C);
    pins->adc[0][26] = die_count(e->processor_C);
    pins->adc[1][27] = bandgap_count(e->known_share);
    angle_to_pins(e, pins, angle_of(in[4]));
    e->mirror.host->winding_C = in[5];
}

/* ---- a period ---- */

static bool counts(const emulated_t *e)
{
    return (emu_register(e->emu, "FTM0.SC") >> 3 & 3U) != 0U;
}

/* A running timer ends the period; without it the period has its nominal length, so that no time is lost. */
static int run_period(emulated_t *e)
{
    double ticks = counts(e) ? 1.01 * e->period_ticks : e->period_ticks;
    e->lost = e->reset_cause != 0U;
    if (e->lost) {
        ticks = e->reset_share * e->period_ticks;
        (void)emu_run(e->emu, (uint64_t)ticks);
        emu_reset_now(e->emu, e->reset_cause);
        e->reset_cause = 0;
        ticks = e->period_ticks - ticks;
    }
    return emu_run(e->emu, (uint64_t)ticks);
}

static bool outputs_lost(const void *self)
{
    return ((const emulated_t *)self)->lost;
}

static void step(void *self, const double in[6], double out[4])
{
    emulated_t *e = self;
    emu_bridge_t bridge;
    samples_to_pins(e, in);
    if (mirror_push(&e->mirror) && e->shadow != NULL) {
        shadow_inputs(e);
    }
    const int stopped = run_period(e);
    emu_bridge(e->emu, &bridge);
    const bool runs = stopped == EMU_CENTRE || !counts(e); /* without its counter the timer may hold its outputs */
    for (int x = 0; x < 3; x++) {
        out[x] = runs ? bridge.duty[x] : 0.5;
    }
    out[3] = runs && bridge.gates ? 1.0 : 0.0;
    e->lost = e->lost || emu_resets(e->emu) != e->resets_seen;
    e->resets_seen = emu_resets(e->emu);
    e->steps++;
    if (e->shadow != NULL && runs) {
        shadow_compare(e);
    }
}

/* Lines of port C, hal/s32k144/pins.h. */
static bool switches(const void *self, plant_switches_t *on)
{
    enum { PRECHARGE = 0, MAIN_CONTACTOR = 1, DISCHARGE = 2 };
    const emulated_t *e = self;
    *on = (plant_switches_t){.precharge = emu_line(e->emu, PRECHARGE) == EMU_LINE_HIGH,
                             .contactor = emu_line(e->emu, MAIN_CONTACTOR) == EMU_LINE_HIGH,
                             .discharge = emu_line(e->emu, DISCHARGE) == EMU_LINE_HIGH,
                             .gate_supply = emu_gate_driver(e->emu),
                             .hardware_safe = emu_safe_state_requested(e->emu)};
    return e->board;
}

/* The gate drivers hold their line for the period after they have blocked a short circuit. */
static void gate_report(void *self, bool reported)
{
    emulated_t *e = self;
    emu_board_pins(e->emu, e->pins_of_board.gate_fault || reported, e->pins_of_board.resolver_fault);
}

static void known_voltage(void *self, double share)
{
    ((emulated_t *)self)->known_share = share;
}

static const char *failure(const void *self)
{
    return emu_error(((const emulated_t *)self)->emu);
}

/* ---- start ---- */

/* Runs from reset until the PWM starts. */
static const char *boot(emulated_t *e)
{
    const int stopped = emu_run(e->emu, (uint64_t)(BOOT_LIMIT_S * (double)EMU_TICKS_PER_S));
    if (stopped == EMU_FAILED) {
        return emu_error(e->emu);
    }
    if (stopped != EMU_CENTRE) {
        return "the image does not start its PWM";
    }
    return NULL;
}

/* The supply of the processor fails and returns; the machine is not affected. */
static bool power_cycle(emulated_t *e)
{
    emu_power_cycle(e->emu);
    return e->shadow == NULL && boot(e) == NULL;
}

/* ---- names ---- */

static int sensor_set(emulated_t *e, const char *name, double value)
{
    if (strcmp(name, "emulator.encoder_fault") == 0) {
        emu_encoder_fault(e->emu, (emu_encoder_fault_t)value);
        return value >= 0.0 && value <= EMU_ENCODER_WEAK_FIELD ? SIM_OK : SIM_OUT_OF_RANGE;
    }
    const emu_setting_t done = emu_analogue_set(e->emu, name + strlen("emulator."), value);
    return done == EMU_SETTING_UNKNOWN ? SIM_UNKNOWN_NAME : done == EMU_SETTING_TAKEN ? SIM_OK : SIM_OUT_OF_RANGE;
}

static int pin_set(emulated_t *e, const char *name, double value)
{
    assert(e != NULL);
    emu_pins_t *pins = &e->pins_of_board;
    bool *pin = strcmp(name, "emulator.gate_fault") == 0       ? &pins->gate_fault
                : strcmp(name, "emulator.resolver_fault") == 0 ? &pins->resolver_fault
                                                               : NULL;
    if (strcmp(name, "emulator.power_cycle") == 0) {
        return value == 1.0 && power_cycle(e) ? SIM_OK : SIM_OUT_OF_RANGE;
    }
    if (strcmp(name, "emulator.reset_share") == 0) {
        e->reset_share = value;
        return value >= 0.0 && value < 1.0 ? SIM_OK : SIM_OUT_OF_RANGE;
    }
    if (strcmp(name, "emulator.reset") == 0) {
        e->reset_cause = value > 0.0 && value < 65536.0 ? (uint32_t)value : 0U;
        return e->reset_cause != 0U ? SIM_OK : SIM_OUT_OF_RANGE;
    }
    if (strcmp(name, "emulator.shadow") == 0) {
        return value == 1.0 && shadow_start(e) ? SIM_OK : SIM_OUT_OF_RANGE;
    }
    double *temperature = strcmp(name, "emulator.inverter_C") == 0    ? &e->inverter_C
                          : strcmp(name, "emulator.processor_C") == 0 ? &e->processor_C
                                                                      : NULL;
    if (temperature != NULL) {
        const bool possible = value >= -40.0 && value <= (temperature == &e->inverter_C ? 300.0 : 150.0);
        *temperature = possible ? value : *temperature;
        return possible ? SIM_OK : SIM_OUT_OF_RANGE;
    }
    if (strcmp(name, "emulator.board") == 0) {
        e->board = value != 0.0;
        return SIM_OK;
    }
    if (pin == NULL) {
        return isnan(emulated_get(e, name)) ? sensor_set(e, name, value) : SIM_READ_ONLY;
    }
    if (value != 0.0 && value != 1.0) {
        return SIM_OUT_OF_RANGE;
    }
    *pin = value == 1.0;
    emu_board_pins(e->emu, pins->gate_fault, pins->resolver_fault);
    return SIM_OK;
}

static int set(void *self, const char *name, double value)
{
    emulated_t *e = self;
    if (strncmp(name, "emulator.", 9) == 0) {
        return pin_set(e, name, value);
    }
    return mirror_set(&e->mirror, name, value);
}

double emulated_get(emulated_t *e, const char *name)
{
    emu_bridge_t bridge;
    emu_bridge(e->emu, &bridge);
    const struct {
        const char *name;
        double value;
    } values[] = {
        {"emulator.shadow", e->shadow != NULL},
        {"emulator.compared", (double)e->compared},
        {"emulator.differing", (double)e->differing},
        {"emulator.instructions", (double)emu_instructions(e->emu)},
        {"emulator.resets", (double)emu_resets(e->emu)},
        {"emulator.time_s", (double)emu_now(e->emu) / (double)EMU_TICKS_PER_S},
        {"emulator.gate_fault", e->pins_of_board.gate_fault},
        {"emulator.resolver_fault", e->pins_of_board.resolver_fault},
        {"emulator.inverter_C", e->inverter_C},
        {"emulator.processor_C", e->processor_C},
        {"emulator.board", e->board},
        {"emulator.gates", bridge.gates},
        {"emulator.gate_supply", emu_gate_driver(e->emu)},
        {"emulator.reset_share", e->reset_share},
        {"emulator.safe_state", emu_safe_state_requested(e->emu)},
        {"emulator.dead_time_s", bridge.dead_time_s},
        {"emulator.pwm_period_s", bridge.period_s},
    };
    for (size_t i = 0; i < sizeof values / sizeof values[0]; i++) {
        if (strcmp(values[i].name, name) == 0) {
            return values[i].value;
        }
    }
    return (double)NAN;
}

static double get(const void *self, const char *name)
{
    emulated_t *e = (emulated_t *)(uintptr_t)self; /* reading may update the mirror */
    return strncmp(name, "emulator.", 9) == 0 ? emulated_get(e, name) : mirror_get(&e->mirror, name);
}

/* ---- creation ---- */

static void destroy(void *self)
{
    emulated_t *e = self;
    mirror_close(&e->mirror);
    fluxtrue_destroy(e->shadow);
    emu_destroy(e->emu);
    free(e);
}

sim_t *sim_create_emulated(const char *elf, const char *layout, int mode, char *error, size_t size)
{
    emulated_t *e = calloc(1, sizeof *e);
    if (e == NULL) {
        (void)snprintf(error, size, "out of memory");
        return NULL;
    }
    e->emu = emu_create(elf, mode, error, size);
    if (e->emu == NULL) {
        free(e);
        return NULL;
    }
    e->inverter_C = 40.0;
    e->processor_C = 60.0;
    e->known_share = 1.0;
    e->period_ticks = (double)motor.bases.period_s * (double)EMU_TICKS_PER_S;
    const char *bad = mirror_open(&e->mirror, e->emu, layout);
    const double at_rest[6] = {0.0, 0.0, 0.0, 0.0, 0.0, 20.0}; /* the shaft at angle zero, no current */
    if (bad == NULL) {
        samples_to_pins(e, at_rest);
        bad = boot(e);
    }
    if (bad == NULL && !mirror_same_motor(&e->mirror)) {
        bad = "the image was built for another motor than this library";
    }
    if (bad != NULL) {
        (void)snprintf(error, size, "%s: %s", elf, bad);
        destroy(e);
        return NULL;
    }
    return sim_create_with((sim_controller_t){e, step, set, get, failure, destroy, switches, gate_report, outputs_lost,
                                              known_voltage, NULL, NULL});
}

emu_t *sim_emulator(sim_t *sim)
{
    return ((emulated_t *)sim->controller.self)->emu;
}

const char *sim_shadow_difference(sim_t *sim)
{
    const emulated_t *e = sim->controller.self;
    return e->differing > 0 ? e->difference : NULL;
}

void sim_shadow_disturb(sim_t *sim)
{
    const emulated_t *e = sim->controller.self;
    e->shadow->drive.mrai.isr.law.psi_delta ^= 1;
}
