/* SPDX-License-Identifier: Apache-2.0 */
#define _POSIX_C_SOURCE 200809L
#include "bench.h"

#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ARGUMENTS_MAX = 68, RAMPS_MAX = 8, NAME_SIZE = 48, ANSWER_SIZE = 8192 };
#define RUN_MAX_NS 1e15 /* eleven days */

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
    /* the run under way */
    int runner; /* the client that has asked; -1: no run */
    bool begun;
    uint64_t periods;
    uint16_t peer; /* 0: waits for nobody */
    uint64_t wanted;
    bench_ramp_t ramp[RAMPS_MAX];
    int ramps;
};

typedef struct {
    char *word[ARGUMENTS_MAX];
    int count;
} arguments_t;

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

__attribute__((format(printf, 3, 4))) static void say(bench_t *bench, int client, const char *format, ...)
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

#define REFUSE(...)                                                                                                    \
    do {                                                                                                               \
        bench->refused++;                                                                                              \
        say(bench, client, "error " __VA_ARGS__);                                                                      \
    } while (0)

static bool number(const char *word, double *value)
{
    char *end;
    *value = strtod(word, &end);
    return end != word && *end == '\0' && isfinite(*value);
}

static bool whole(const char *word, uint64_t most, uint64_t *value)
{
    char *end;
    errno = 0;
    const unsigned long long read = strtoull(word, &end, 10);
    *value = read;
    return word[0] >= '0' && word[0] <= '9' && *end == '\0' && errno == 0 && read <= most;
}

/* A time in ns, rounded to whole periods. */
static bool duration(const bench_t *bench, const char *count, const char *unit, uint64_t *periods)
{
    static const struct {
        const char *name;
        double ns;
    } units[] = {{"us", 1e3}, {"ms", 1e6}, {"s", 1e9}};
    const double period_ns = (double)bench->vecu->period_ns;
    double n;
    double ns = strcmp(unit, "periods") == 0 ? period_ns : 0.0;
    for (size_t i = 0; i < sizeof units / sizeof units[0]; i++) {
        ns = strcmp(unit, units[i].name) == 0 ? units[i].ns : ns;
    }
    if (ns == 0.0 || !number(count, &n) || n < 0.0 || n * ns > RUN_MAX_NS) {
        return false;
    }
    *periods = (uint64_t)llround(n * ns / period_ns);
    return true;
}

static void do_hello(bench_t *bench, int client, const arguments_t *a)
{
    (void)a;
    const vecu_t *v = bench->vecu;
    say(bench, client, "ok fluxtrue-vecu 1 %s period_ns=%" PRIu64 " now_ns=%" PRIu64,
        bench->realtime ? "realtime" : "fast", v->period_ns, v->now_ns);
}

static void do_names(bench_t *bench, int client, const arguments_t *a)
{
    char text[ANSWER_SIZE] = "ok";
    size_t used = 2;
    (void)a;
    const char *name;
    for (int i = 0; (name = stand_name(i)) != NULL; i++) {
        used += (size_t)snprintf(text + used, sizeof text - used, " %s", name);
    }
    for (int i = 0; (name = sim_name(i)) != NULL && used + strlen(name) + 2U < sizeof text; i++) {
        used += (size_t)snprintf(text + used, sizeof text - used, " %s", name);
    }
    say(bench, client, "%s", text);
}

/* The dc voltage is the battery's and the switches'. */
static bool settable(const vecu_t *vecu, const char *name)
{
    return strcmp(name, "plant.vdc_V") != 0 && !isnan(vecu_get(vecu, name)) &&
           (strncmp(name, "plant.", 6) == 0 || strncmp(name, "board.", 6) == 0);
}

static void do_set(bench_t *bench, int client, const arguments_t *a)
{
    double value;
    if (a->count < 3 || a->count % 2 == 0) {
        REFUSE("set: wanted pairs of name and value");
        return;
    }
    for (int i = 1; i < a->count; i += 2) {
        if (!settable(bench->vecu, a->word[i])) {
            REFUSE("set: '%s' is no name that can be set", a->word[i]);
            return;
        }
        if (!number(a->word[i + 1], &value)) {
            REFUSE("set: %s = '%s': wanted a finite number", a->word[i], a->word[i + 1]);
            return;
        }
    }
    for (int i = 1; i < a->count; i += 2) {
        (void)number(a->word[i + 1], &value);
        if (!vecu_set(bench->vecu, a->word[i], value)) {
            REFUSE("set: %s = %s is out of range%s", a->word[i], a->word[i + 1],
                   i > 1 ? "; what stood before it has been set" : "");
            return;
        }
    }
    say(bench, client, "ok");
}

static void do_get(bench_t *bench, int client, const arguments_t *a)
{
    char text[ANSWER_SIZE] = "ok";
    size_t used = 2;
    if (a->count < 2) {
        REFUSE("get: wanted names");
        return;
    }
    for (int i = 1; i < a->count; i++) {
        const double value = vecu_get(bench->vecu, a->word[i]);
        if (isnan(value)) {
            REFUSE("get: unknown name '%s'", a->word[i]);
            return;
        }
        used += (size_t)snprintf(text + used, sizeof text - used, " %.17g", value);
    }
    say(bench, client, "%s", text);
}

static void do_ramp(bench_t *bench, int client, const arguments_t *a)
{
    double to;
    uint64_t periods;
    if (a->count != 5 || !settable(bench->vecu, a->word[1]) || !number(a->word[2], &to) ||
        !duration(bench, a->word[3], a->word[4], &periods) || strlen(a->word[1]) >= NAME_SIZE) {
        REFUSE("ramp: wanted <name> <value> <n> <unit>");
        return;
    }
    const double from = vecu_get(bench->vecu, a->word[1]);
    if (bench->ramps == RAMPS_MAX || !vecu_set(bench->vecu, a->word[1], to)) {
        REFUSE("ramp: %s to %s: %s", a->word[1], a->word[2],
               bench->ramps == RAMPS_MAX ? "too many ramps at a time" : "out of range");
        return;
    }
    (void)vecu_set(bench->vecu, a->word[1], from); /* every value between two allowed ones is allowed */
    bench_ramp_t *ramp = &bench->ramp[bench->ramps++];
    const uint64_t now = bench->vecu->now_ns;
    *ramp = (bench_ramp_t){.from = from, .to = to, .begin_ns = now, .end_ns = now + periods * bench->vecu->period_ns};
    (void)snprintf(ramp->name, sizeof ramp->name, "%s", a->word[1]);
    say(bench, client, "ok");
}

static void do_record(bench_t *bench, int client, const arguments_t *a)
{
    const char *names[ARGUMENTS_MAX];
    uint64_t every = 1;
    const bool off = a->count == 2 && strcmp(a->word[1], "off") == 0;
    if (!off && (a->count < 3 || !whole(a->word[1], 1000000, &every))) {
        REFUSE("record: wanted <periods> <name> ... or off");
        return;
    }
    const int count = off ? 0 : a->count - 2;
    for (int i = 0; i < count; i++) {
        names[i] = a->word[i + 2];
    }
    if (sim_record(bench->vecu->sim, names, count, (int)every) != SIM_OK) {
        REFUSE("record: an unknown name, or too many");
        return;
    }
    bench->columns = count;
    say(bench, client, "ok");
}

static void do_run(bench_t *bench, int client, const arguments_t *a)
{
    uint64_t periods, peer = 0, wanted = 0;
    if ((a->count != 3 && a->count != 5) || !duration(bench, a->word[1], a->word[2], &periods) ||
        (a->count == 5 && (!whole(a->word[3], UINT16_MAX, &peer) || !whole(a->word[4], UINT64_MAX, &wanted)))) {
        REFUSE("run: wanted <n> periods|us|ms|s [<port> <frames>]");
        return;
    }
    bench->runner = client;
    bench->begun = false;
    bench->periods = periods;
    bench->peer = (uint16_t)peer;
    bench->wanted = wanted;
}

static void do_hash(bench_t *bench, int client, const arguments_t *a)
{
    (void)a;
    say(bench, client, "ok %016" PRIx64, vecu_take_hash(bench->vecu));
}

static void do_counters(bench_t *bench, int client, const arguments_t *a)
{
    const hub_counts_t h = hub_counts(bench->vecu->hub);
    const line_counts_t own = line_server_counts(bench->server);
    (void)a;
    say(bench, client,
        "ok malformed=%" PRIu64 " dropped=%" PRIu64 " from_clients=%" PRIu64 " to_ecu=%" PRIu64 " from_ecu=%" PRIu64
        " ecu_lost=%" PRIu64 " bus_frames=%" PRIu64 " bus_bits=%" PRIu64 " bus_lost=%" PRIu64 " load=%.6f"
        " load_peak=%.6f own_load_peak=%.6f windows=%" PRIu64 " windows_over=%" PRIu64 " slow_clients=%" PRIu64
        " bench_refused=%" PRIu64 " bench_dropped=%" PRIu64,
        h.malformed, h.lines.dropped, h.from_clients, h.to_ecu, h.from_ecu, h.ecu_lost, h.bus.frames, h.bus.bits,
        h.bus.lost, h.bus.load, h.bus.load_peak, h.bus.own_load_peak, h.bus.windows, h.bus.windows_over,
        h.lines.slow_clients + own.slow_clients, bench->refused, own.dropped);
}

static void do_reset(bench_t *bench, int client, const arguments_t *a)
{
    uint64_t seed = bench->vecu->seed;
    if (a->count > 2 || (a->count == 2 && !whole(a->word[1], 1ULL << 52, &seed))) {
        REFUSE("reset: wanted at most a seed, a whole number up to 2^52");
        return;
    }
    const char *bad = vecu_reset(bench->vecu, seed);
    bench->columns = 0;
    bench->ramps = 0;
    if (bad != NULL) {
        REFUSE("reset: %s", bad);
        return;
    }
    say(bench, client, "ok");
}

static void carry_out(bench_t *bench, int client, char *text)
{
    static const struct {
        const char *name;
        void (*act)(bench_t *, int, const arguments_t *);
    } commands[] = {{"hello", do_hello}, {"names", do_names},   {"set", do_set}, {"get", do_get},
                    {"ramp", do_ramp},   {"record", do_record}, {"run", do_run}, {"hash", do_hash},
                    {"counters", do_counters}, {"reset", do_reset}};
    arguments_t a = {.count = 0};
    char *rest = text;
    for (char *word = strtok_r(text, " \t\r", &rest); word != NULL; word = strtok_r(NULL, " \t\r", &rest)) {
        if (a.count == ARGUMENTS_MAX) {
            REFUSE("more than %d words", ARGUMENTS_MAX);
            return;
        }
        a.word[a.count++] = word;
    }
    for (size_t i = 0; a.count > 0 && i < sizeof commands / sizeof commands[0]; i++) {
        if (strcmp(a.word[0], commands[i].name) == 0) {
            commands[i].act(bench, client, &a);
            return;
        }
    }
    REFUSE("unknown command, wanted: hello names set get ramp record run hash counters reset");
}

void bench_service(bench_t *bench)
{
    char text[LINE_LENGTH + 1];
    int client;
    line_event_t event;
    while (bench->runner < 0 && (event = line_server_next(bench->server, &client, text)) != LINE_NONE) {
        if (event == LINE_TEXT) {
            carry_out(bench, client, text);
        }
    }
}

static void finish(bench_t *bench)
{
    uint64_t received = 0, sent = 0;
    hub_run(bench->vecu->hub, bench->vecu->now_ns);
    (void)hub_client_counts(bench->vecu->hub, bench->peer, &received, &sent);
    say(bench, bench->runner, "ok %" PRIu64 " %" PRIu64, bench->vecu->now_ns, sent);
    bench->runner = -1;
}

/* The run may begin when its client has been heard with the frames it says it has sent. */
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
    say(bench, bench->runner, "%s", text);
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
