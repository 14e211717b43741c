/* SPDX-License-Identifier: Apache-2.0 */
#define _POSIX_C_SOURCE 200809L
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench_private.h"

#define RUN_MAX_NS 1e15 /* eleven days */

typedef struct {
    char *word[ARGUMENTS_MAX];
    int count;
} arguments_t;

static bool number(const char *word, double *value)
{
    char *end;
    *value = strtod(word, &end);
    return end != word && *end == '\0' && isfinite(*value);
}

static bool whole(const char *word, uint64_t max, uint64_t *value)
{
    char *end;
    errno = 0;
    const unsigned long long read = strtoull(word, &end, 10);
    *value = read;
    return word[0] >= '0' && word[0] <= '9' && *end == '\0' && errno == 0 && read <= max;
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
    bench_say(bench, client, "ok fluxtrue-vecu 1 %s period_ns=%" PRIu64 " now_ns=%" PRIu64,
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
    bench_say(bench, client, "%s", text);
}

static bool settable(const vecu_t *vecu, const char *name)
{
    return !isnan(vecu_get(vecu, name)) && (strncmp(name, "plant.", 6) == 0 || strncmp(name, "board.", 6) == 0);
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
    bench_say(bench, client, "ok");
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
    bench_say(bench, client, "%s", text);
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
    bench_say(bench, client, "ok");
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
    bench_say(bench, client, "ok");
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
    bench_say(bench, client, "ok %016" PRIx64, vecu_take_hash(bench->vecu));
}

static void do_counters(bench_t *bench, int client, const arguments_t *a)
{
    const hub_counts_t h = hub_counts(bench->vecu->hub);
    const line_counts_t own = line_server_counts(bench->server);
    (void)a;
    bench_say(bench, client,
              "ok malformed=%" PRIu64 " dropped=%" PRIu64 " from_clients=%" PRIu64 " to_ecu=%" PRIu64
              " from_ecu=%" PRIu64 " ecu_lost=%" PRIu64 " bus_frames=%" PRIu64 " bus_bits=%" PRIu64 " bus_lost=%" PRIu64
              " load=%.6f"
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
    bench_say(bench, client, "ok");
}

void bench_obey(bench_t *bench, int client, char *text)
{
    static const struct {
        const char *name;
        void (*act)(bench_t *, int, const arguments_t *);
    } commands[] = {{"hello", do_hello},       {"names", do_names},   {"set", do_set}, {"get", do_get},
                    {"ramp", do_ramp},         {"record", do_record}, {"run", do_run}, {"hash", do_hash},
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
