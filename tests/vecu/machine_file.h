/* SPDX-License-Identifier: Apache-2.0 */
#ifndef VECU_MACHINE_FILE_H
#define VECU_MACHINE_FILE_H
/** Another machine at the terminals than that of the firmware's motor data, from a text file:
 *   <name> <value>                    a plant parameter, "plant.r_ohm_20 0.02"; up to 128 of them
 *   map <nd> <nq> <number> ...        at the end: nd values of i_d, nq of i_q, then nd x nq of psi_d and of psi_q;
 *                                     without it the inductances are constant
 * Units    SI; names of tests/loop/runner/sim.h
 * Errors   NULL: the file cannot be read or is not of this form
 * Context  simulation only; one file, read once */
#include "machine_data.h"

const machine_data_t *machine_file_load(const char *path);

#endif
