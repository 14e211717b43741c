/* SPDX-License-Identifier: Apache-2.0 */
#ifndef VECU_BENCH_PRIVATE_H
#define VECU_BENCH_PRIVATE_H
/** Shared by the commands and the runs of the bench channel.
 * Context  tests/vecu/bench*.c only */
#include "bench.h"

enum { ARGUMENTS_MAX = 68, RAMPS_MAX = 8, NAME_SIZE = 48, ANSWER_SIZE = 8192 };

typedef struct {
    char name[NAME_SIZE];
    double from, to;
    uint64_t begin_ns, end_ns;
} bench_ramp_t;

struct bench {
    line_server_t *server;
    vecu_t *vecu;
    bool realtime;
    uint64_t refused;
    int columns;
    /* The present run. */
    int runner; /* the client that requested it; -1: no run */
    bool begun;
    uint64_t periods;
    uint16_t peer; /* CAN client whose frames it waits for; 0: none */
    uint64_t wanted;
    bench_ramp_t ramp[RAMPS_MAX];
    int ramps;
};

/** Sends one line of an answer. */
__attribute__((format(printf, 3, 4))) void bench_say(bench_t *bench, int client, const char *format, ...);
/** Executes the command in a line; a run is only noted, and begins in bench_step(). */
void bench_obey(bench_t *bench, int client, char *text);

#define REFUSE(...) \
    do { \
        bench->refused++; \
        bench_say(bench, client, "error " __VA_ARGS__); \
    } while (0)

#endif
