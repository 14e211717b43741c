/* SPDX-License-Identifier: Apache-2.0 */
#ifndef VECU_VECU_H
#define VECU_VECU_H
/** The virtual ECU: firmware and plant in one process, period by period, with the ECU's CAN channel on a hub.
 *   each period: transmitted frames are received, the firmware computes, the plant advances, frames are sent
 * Source   docs/howto/bench.md
 * Units    ns of simulated time since the program's start; a reset does not turn it back
 * Errors   vecu_reset() answers the name of the machine data that is wrong, nvm_path if that file is wrong, else NULL
 * Context  simulation only; one instance, because calibration tools need its state at a fixed address */
#include <stdbool.h>
#include <stdint.h>

#include "hub.h"
#include "loop/runner/sim.h"
#include "machine_data.h"
#include "stand.h"

typedef struct {
    hub_t *hub;
    sim_t *sim;
    stand_t stand;
    uint64_t now_ns, period_ns;
    uint64_t seed;
    uint64_t duty_hash; /* FNV-1a of all duties and gate states since the last vecu_take_hash() */
    uint64_t resets;
    const char *nvm_path;          /* file that holds the flash over power cycles; NULL: a power cycle erases it */
    const machine_data_t *machine; /* at the terminals; NULL: that of the firmware's motor data */
    uint32_t nvm_changes;          /* number of changes of the flash that the file contains */
} vecu_t;

/** A power cycle of ECU and plant: everything as at the start, with the plant's random numbers from `seed`. */
const char *vecu_reset(vecu_t *vecu, uint64_t seed);
void vecu_destroy(vecu_t *vecu);
/** One PWM period; answers whether `row` (SIM_API sim_record) has been written. */
bool vecu_step(vecu_t *vecu, double *row);
/** Names with "plant.", "truth." or "board.", and names of the firmware, which can only be read, because on a bench the
 * ECU is commanded over CAN. False: unknown, read only or out of range; NaN: unknown. */
bool vecu_set(vecu_t *vecu, const char *name, double value);
double vecu_get(const vecu_t *vecu, const char *name);
/** The hash since the last call, which begins a new one. */
uint64_t vecu_take_hash(vecu_t *vecu);

#endif
