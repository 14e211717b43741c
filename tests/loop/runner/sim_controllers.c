/* SPDX-License-Identifier: Apache-2.0 */
/* The two controllers that come with the runner: the firmware, and its twin. */
#include "hal/host/instance.h"
#include "sim_private.h"
#include "twin/twin.h"

#include <stddef.h>

static void firmware_step(void *self, const double in[6], double out[4])
{
    fluxtrue_step(self, in, out);
}

static int firmware_set(void *self, const char *name, double value)
{
    return fluxtrue_set(self, name, value);
}

static double firmware_get(const void *self, const char *name)
{
    return fluxtrue_get(self, name);
}

static double firmware_get_by(const void *self, int handle)
{
    return fluxtrue_get_by(self, handle);
}

static void firmware_destroy(void *self)
{
    fluxtrue_destroy(self);
}

/* On a bus the state machine controls the board. */
static bool firmware_switches(const void *self, plant_switches_t *on)
{
    const fluxtrue_t *drive = self;
    const bool *output = drive->board.output;
    const external_watchdog_t *device = &drive->board.external_watchdog;
    *on = (plant_switches_t){.precharge = output[BOARD_PRECHARGE],
                             .contactor = output[BOARD_MAIN_CONTACTOR],
                             .discharge = output[BOARD_DISCHARGE],
                             .gate_supply = external_watchdog_supply(device, output[BOARD_GATE_DRIVER])};
    return drive->on_bus;
}

static void firmware_gate_fault(void *self, bool reported)
{
    ((fluxtrue_t *)self)->board.short_circuit_blocked = reported;
}

static void firmware_known_voltage(void *self, double share)
{
    ((fluxtrue_t *)self)->board.known_share = share;
}

/* The caller owns the firmware. */
static void firmware_keep(void *self)
{
    (void)self;
}

static void twin_step_(void *self, const double in[6], double out[4])
{
    twin_step(self, in, out);
}

static int twin_set_(void *self, const char *name, double value)
{
    return twin_set(self, name, value);
}

static double twin_get_(const void *self, const char *name)
{
    return twin_get(self, name);
}

static void twin_destroy_(void *self)
{
    twin_destroy(self);
}

static sim_t *create_around(fluxtrue_t *firmware, void (*destroy)(void *self))
{
    return sim_create_with((sim_controller_t){firmware, firmware_step, firmware_set, firmware_get, NULL, destroy,
                                              firmware_switches, firmware_gate_fault, NULL, firmware_known_voltage,
                                              fluxtrue_handle, firmware_get_by});
}

sim_t *sim_create(int controller)
{
    if (controller == SIM_FIRMWARE) {
        return create_around(fluxtrue_create(), firmware_destroy);
    }
    if (controller == SIM_TWIN) {
        return sim_create_with((sim_controller_t){twin_create(), twin_step_, twin_set_, twin_get_, NULL, twin_destroy_,
                                                  NULL, NULL, NULL, NULL, NULL, NULL});
    }
    return NULL;
}

sim_t *sim_create_around(fluxtrue_t *firmware)
{
    return create_around(firmware, firmware_keep);
}

sim_t *sim_create_for(const void *data, unsigned size)
{
    fluxtrue_t *firmware = (size == sizeof firmware->motor) ? fluxtrue_create() : NULL;
    if (firmware != NULL) {
        fluxtrue_init_with(firmware, data);
    }
    return create_around(firmware, firmware_destroy);
}

fluxtrue_t *sim_firmware(sim_t *sim)
{
    return sim->controller.step == firmware_step ? (fluxtrue_t *)sim->controller.self : NULL;
}
