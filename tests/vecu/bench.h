/* SPDX-License-Identifier: Apache-2.0 */
#ifndef VECU_BENCH_H
#define VECU_BENCH_H
/** The bench channel: control of the test stand beside CAN. One command per line, one answer per command:
 *   hello                             name and versions
 *   names                             every name of the board, the plant and its truth
 *   set <name> <value> [...]          "plant." and "board.": parameters and faults, from the next period on
 *   get <name> [...]
 *   ramp <name> <value> <n> <unit>    changes the value linearly during the next runs
 *   record <periods> <name> [...]     during a run, one line "row <value> ..." every <periods>; "record off" ends it
 *   run <n> <unit> [<port> <count>]   lets time pass; with port and count it first waits until that many frames of the
 *                                     CAN client with this port have been received. Answers the time in ns and the
 *                                     number of frames sent to that client so far
 *   hash                              hash of all duties and gate states since the previous command "hash"
 *   counters                          counters of bus, hub and bench
 *   reset [<seed>]                    power cycle of ECU and plant
 *   units: periods, us, ms, s. Answers: "ok ..." or "error <why>"
 * Source   docs/howto/bench.md
 * Errors   a refused command changes nothing and is counted
 * Context  simulation only; several clients, one run at a time: during it the others wait */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "line_server.h"
#include "vecu.h"

typedef struct bench bench_t;

bench_t *bench_create(uint16_t port, vecu_t *vecu, bool realtime, char *why, size_t size);
void bench_destroy(bench_t *bench);
line_server_t *bench_server(bench_t *bench);

/** Executes the clients' commands up to the next run. */
void bench_service(bench_t *bench);
/** Advances the time by one period during a run, and always if `anyway`. Answers false if time did not advance. */
bool bench_step(bench_t *bench, bool anyway);

#endif
