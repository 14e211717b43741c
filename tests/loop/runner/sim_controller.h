/* SPDX-License-Identifier: Apache-2.0 */
#ifndef LOOP_RUNNER_SIM_CONTROLLER_H
#define LOOP_RUNNER_SIM_CONTROLLER_H
/** A controller as the runner sees it: the firmware, its twin, or an emulated processor.
 *   in:  ia_A ib_A ic_A vdc_V theta_m_rad t_winding_C at the period's start
 *   out: duty_a duty_b duty_c in 0..1 for the next period; gates_on 0 or 1
 *   switches(): the switches of the board; NULL or false: the controller has no board and the battery stays connected
 *   outputs_lost(): the controller was reset in this period, so that no gate is on from here on; may be NULL
 *   gate_fault(): tells before each step whether the gate drivers have blocked a short circuit; may be NULL
 *   known_voltage(): tells before each step what the converters read of a known voltage, 1: right; may be NULL
 *   handle(), get_by(): the same as get() in two steps, so that a recorded name is searched once; both may be NULL
 * Errors   set() returns a SIM_ code; get() of an unknown name returns NaN; failure() returns NULL, or the reason why
 *          no further step can be run, and may itself be NULL
 * Context  host; owned by the runner, which destroys it */
#include <stdbool.h>

#include "plant/dc_link.h"
#include "sim.h"

typedef struct {
    void *self;
    void (*step)(void *self, const double in[6], double out[4]);
    int (*set)(void *self, const char *name, double value);
    double (*get)(const void *self, const char *name);
    const char *(*failure)(const void *self);
    void (*destroy)(void *self);
    bool (*switches)(const void *self, plant_switches_t *on);
    void (*gate_fault)(void *self, bool reported);
    bool (*outputs_lost)(const void *self);
    void (*known_voltage)(void *self, double share);
    int (*handle)(const char *name);
    double (*get_by)(const void *self, int handle);
} sim_controller_t;

/** Takes ownership of the controller, also if it returns NULL (out of memory). */
sim_t *sim_create_with(sim_controller_t controller);

#endif
