/* SPDX-License-Identifier: Apache-2.0 */
#include "bench.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include "bench_private.h"

bench_t *bench_create(uint16_t port, vecu_t *vecu, bool realtime, char *why, size_t size)
{
    bench_t *bench = calloc(1, sizeof *bench);
    line_server_t *server = line_server_create(port, LINE_BY_NEWLINE, why, size);
    if (bench == NULL || server == NULL) {
        line_server_destroy(server);
        free(bench);
        return NULL;
    }
    *bench = (bench_t){.server = server, .vecu = vecu, .realtime = realtime, .runner = -1};
    return bench;
}

void bench_destroy(bench_t *bench)
{
    if (bench != NULL) {
        line_server_destroy(bench->server);
        free(bench);
    }
}

line_server_t *bench_server(bench_t *bench)
{
    return bench->server;
}

void bench_say(bench_t *bench, int client, const char *format, ...)
{
    char text[ANSWER_SIZE];
    va_list values;
    va_start(values, format);
    const int length = vsnprintf(text, sizeof text - 1U, format, values);
    va_end(values);
    const size_t used = length < (int)sizeof text - 1 ? (size_t)length : sizeof text - 2U;
    text[used] = '\n';
    line_server_send(bench->server, client, text, used + 1U);
}

void bench_service(bench_t *bench)
{
    char text[LINE_LENGTH + 1];
    int client;
    line_event_t event;
    while (bench->runner < 0 && (event = line_server_next(bench->server, &client, text)) != LINE_NONE) {
        if (event == LINE_TEXT) {
            bench_obey(bench, client, text);
        }
    }
}

static void finish(bench_t *bench)
{
    uint64_t received = 0, sent = 0;
    hub_run(bench->vecu->hub, bench->vecu->now_ns);
    (void)hub_client_counts(bench->vecu->hub, bench->peer, &received, &sent);
    bench_say(bench, bench->runner, "ok %" PRIu64 " %" PRIu64, bench->vecu->now_ns, sent);
    bench->runner = -1;
}

/* A run begins when the stated number of frames of its client has been received. */
static bool may_begin(bench_t *bench)
{
    uint64_t received = 0, sent = 0;
    if (bench->runner < 0 || bench->begun) {
        return bench->runner >= 0;
    }
    if (bench->peer != 0U && !hub_client_counts(bench->vecu->hub, bench->peer, &received, &sent)) {
        const int client = bench->runner;
        bench->runner = -1;
        REFUSE("run: no CAN client has port %u", (unsigned)bench->peer);
    } else if (!line_server_connected(bench->server, bench->runner)) {
        bench->runner = -1;
    } else {
        bench->begun = bench->peer == 0U || received >= bench->wanted;
    }
    return bench->runner >= 0 && bench->begun;
}

static void ramps_apply(bench_t *bench)
{
    const uint64_t now = bench->vecu->now_ns;
    for (int i = bench->ramps - 1; i >= 0; i--) {
        const bench_ramp_t *r = &bench->ramp[i];
        const bool over = now >= r->end_ns;
        const double share = over ? 1.0 : (double)(now - r->begin_ns) / (double)(r->end_ns - r->begin_ns);
        (void)vecu_set(bench->vecu, r->name, r->from + share * (r->to - r->from));
        if (over) {
            bench->ramp[i] = bench->ramp[--bench->ramps];
        }
    }
}

static void say_row(bench_t *bench, const double *row)
{
    char text[ANSWER_SIZE] = "row";
    size_t used = 3;
    for (int i = 0; i < bench->columns; i++) {
        used += (size_t)snprintf(text + used, sizeof text - used, " %.9g", row[i]);
    }
    bench_say(bench, bench->runner, "%s", text);
}

bool bench_step(bench_t *bench, bool anyway)
{
    double row[ARGUMENTS_MAX];
    const bool running = may_begin(bench);
    if (running && bench->periods == 0U) {
        finish(bench);
        return true;
    }
    if (!running && !anyway) {
        return false;
    }
    ramps_apply(bench);
    if (vecu_step(bench->vecu, row) && running) {
        say_row(bench, row);
    }
    bench->periods -= running ? 1U : 0U;
    if (running && bench->periods == 0U) {
        finish(bench);
    }
    return true;
}
