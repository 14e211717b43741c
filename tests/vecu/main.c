/* SPDX-License-Identifier: Apache-2.0 */
/* The virtual ECU: fluxtrue_vecu [--fast] [--port N] [--bench-port N] [--bit-rate N] [--seed N] [--nvm FILE]
 *                               [--machine FILE]
 * Prints the address on which it listens in one line on standard output. */
#define _POSIX_C_SOURCE 200809L
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "bench.h"
#include "hub.h"
#include "machine_data.h"
#include "machine_file.h"
#include "nvm_file.h"
#include "vecu.h"

enum { EXIT_USAGE = 2, PERIODS_PER_LOOP = 100 };
#define BACKLOG_MAX ((size_t)1 << 18) /* fast: time stops while more bytes than this wait for a client */
#define PATIENCE_NS 2000000000LL      /* longest stop on the wall clock; then the client is disconnected */
/* Real time: a host that is further behind than this does not make up for the rest. While it did, the bus would have no
 * commands, because the clients were delayed like this process. With a command every 10 ms, 10 ms more stay below the
 * time-out of 30 ms. */
#define LAG_MAX_NS 10000000LL

static volatile sig_atomic_t stop;

typedef struct {
    bool realtime;
    uint64_t port, bench_port, bit_rate, seed;
    const char *nvm, *machine;
} options_t;

static void on_signal(int number)
{
    (void)number;
    stop = 1;
}

static int64_t wall_ns(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000000LL + now.tv_nsec;
}

static bool parse_number(const char *option, const char *text, uint64_t min, uint64_t max, uint64_t *value)
{
    char *end = NULL;
    errno = 0;
    const unsigned long long read = text != NULL && text[0] >= '0' && text[0] <= '9' ? strtoull(text, &end, 10) : 0ULL;
    if (end == NULL || *end != '\0' || errno != 0 || read < min || read > max) {
        (void)fprintf(stderr, "error: %s %s: allowed: %llu ... %llu\n", option, text != NULL ? text : "(nothing)",
                      (unsigned long long)min, (unsigned long long)max);
        return false;
    }
    *value = read;
    return true;
}

/* An option with a file, or one that is not known. */
static bool parse_file(const char *option, const char *value, options_t *o)
{
    if (value != NULL && strcmp(option, "--nvm") == 0) {
        o->nvm = value;
        return true;
    }
    if (value != NULL && strcmp(option, "--machine") == 0) {
        o->machine = value;
        return true;
    }
    (void)fprintf(stderr,
                  "error: unknown option '%s', allowed: --fast --realtime --port --bench-port "
                  "--bit-rate --seed --nvm --machine\n",
                  option);
    return false;
}

static bool parse(int count, char **words, options_t *o)
{
    for (int i = 1; i < count; i++) {
        const char *word = words[i];
        const char *value = i + 1 < count ? words[i + 1] : NULL;
        bool good = true;
        if (strcmp(word, "--fast") == 0 || strcmp(word, "--realtime") == 0) {
            o->realtime = word[2] == 'r';
            continue;
        }
        if (strcmp(word, "--port") == 0) {
            good = parse_number(word, value, 0, 65535, &o->port);
        } else if (strcmp(word, "--bench-port") == 0) {
            good = parse_number(word, value, 0, 65535, &o->bench_port);
        } else if (strcmp(word, "--bit-rate") == 0) {
            good = parse_number(word, value, 10000, 1000000, &o->bit_rate);
        } else if (strcmp(word, "--seed") == 0) {
            good = parse_number(word, value, 0, 1ULL << 52, &o->seed);
        } else {
            good = parse_file(word, value, o);
        }
        if (!good) {
            return false;
        }
        i++;
    }
    return true;
}

/* A client that does not read delays a fast run; after PATIENCE_NS it is disconnected. */
static bool must_wait(line_server_t *const *servers, int64_t *since_ns)
{
    const size_t waits = line_server_backlog(servers[0]) + line_server_backlog(servers[1]);
    if (waits <= BACKLOG_MAX) {
        *since_ns = 0;
        return false;
    }
    const int64_t now = wall_ns();
    *since_ns = *since_ns == 0 ? now : *since_ns;
    if (now - *since_ns > PATIENCE_NS) {
        line_server_drop_slow(servers[0], BACKLOG_MAX / 2U);
        line_server_drop_slow(servers[1], BACKLOG_MAX / 2U);
    }
    return true;
}

static void run_fast(vecu_t *vecu, bench_t *bench, line_server_t *const *servers)
{
    bool busy = false;
    int64_t since_ns = 0;
    while (!stop) {
        const bool held = must_wait(servers, &since_ns);
        line_server_wait(servers, 2, busy && !held ? 0 : 100);
        hub_service(vecu->hub, vecu->now_ns);
        bench_service(bench);
        busy = true;
        for (int i = 0; i < PERIODS_PER_LOOP && busy && !held; i++) {
            busy = bench_step(bench, false);
        }
    }
}

static void run_realtime(vecu_t *vecu, bench_t *bench, line_server_t *const *servers)
{
    int64_t start_ns = wall_ns() - (int64_t)vecu->now_ns;
    while (!stop) {
        line_server_wait(servers, 2, 1);
        line_server_drop_slow(servers[0], BACKLOG_MAX);
        line_server_drop_slow(servers[1], BACKLOG_MAX);
        hub_service(vecu->hub, vecu->now_ns);
        bench_service(bench);
        const int64_t due_ns = wall_ns() - start_ns;
        for (int i = 0; i < PERIODS_PER_LOOP && (int64_t)vecu->now_ns < due_ns; i++) {
            (void)bench_step(bench, true);
        }
        if (due_ns - (int64_t)vecu->now_ns > LAG_MAX_NS) {
            start_ns += due_ns - (int64_t)vecu->now_ns;
        }
    }
}

static int serve(const options_t *o, vecu_t *vecu)
{
    char why[128];
    bench_t *bench = NULL;
    vecu->hub = hub_create((uint16_t)o->port, (uint32_t)o->bit_rate, why, sizeof why);
    if (vecu->hub != NULL) {
        bench = bench_create((uint16_t)o->bench_port, vecu, o->realtime, why, sizeof why);
    }
    if (bench == NULL) {
        (void)fprintf(stderr, "error: %s\n", why);
        hub_destroy(vecu->hub);
        return EXIT_USAGE;
    }
    line_server_t *const servers[2] = {hub_server(vecu->hub), bench_server(bench)};
    (void)printf("fluxtrue-vecu motor=%s mode=%s can=%u bench=%u\n", machine_data.motor,
                 o->realtime ? "realtime" : "fast", line_server_port(servers[0]), line_server_port(servers[1]));
    (void)fflush(stdout);
    if (o->realtime) {
        run_realtime(vecu, bench, servers);
    } else {
        run_fast(vecu, bench, servers);
    }
    bench_destroy(bench);
    hub_destroy(vecu->hub);
    return EXIT_SUCCESS;
}

/* Firmware and plant before the first period. */
static bool start(const options_t *o, vecu_t *vecu)
{
    vecu->nvm_path = o->nvm;
    vecu->machine = (o->machine != NULL) ? machine_file_load(o->machine) : NULL;
    if (o->machine != NULL && vecu->machine == NULL) {
        (void)fprintf(stderr, "error: --machine %s: no machine, allowed: a file as tests/vecu/machine_file.h says\n",
                      o->machine);
        return false;
    }
    const char *bad = vecu_reset(vecu, o->seed);
    if (bad != NULL && bad == o->nvm) {
        (void)fprintf(stderr, "error: --nvm %s: no flash contents, allowed: a file of %u bytes, or none yet\n", bad,
                      NVM_HOST_SIZE);
    } else if (bad != NULL) {
        (void)fprintf(stderr, "error: motor %s: %s\n", machine_data.motor, bad);
    }
    return bad == NULL;
}

int main(int count, char **words)
{
    options_t options = {.realtime = true, .port = 29536, .bench_port = 29537, .bit_rate = 500000, .seed = 1};
    vecu_t vecu = {.hub = NULL};
    struct sigaction act = {.sa_handler = on_signal};
    if (!parse(count, words, &options)) {
        return EXIT_USAGE;
    }
    (void)sigaction(SIGINT, &act, NULL);
    (void)sigaction(SIGTERM, &act, NULL);
    act.sa_handler = SIG_IGN;
    (void)sigaction(SIGPIPE, &act, NULL);
    if (!start(&options, &vecu)) {
        return EXIT_USAGE;
    }
    const int status = serve(&options, &vecu);
    vecu_destroy(&vecu);
    return status;
}
