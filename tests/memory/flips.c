/* SPDX-License-Identifier: Apache-2.0 */
/* Single bit flips in the memory of the ECU while it drives a simulated machine:  memory_flips <flips> <seed>
 * At each operating point one process drives there; each flip is a copy of that process (fork), which flips one bit at
 * a random moment and drives on for nine tenths of a second. The shaft torque of the simulated machine, millisecond by
 * millisecond, is compared with that of a copy without a flip. The bus requests other torques meanwhile. */
#include <inttypes.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "comm/e2e.h"
#include "hal/host/can_host.h"
#include "hal/host/instance.h"
#include "loop/runner/sim.h"
#include "memory_map.h"
#include "vecu/machine_data.h"
#include "verdict.h"

#define PERIODS_PER_MS 10
#define RPM (6.283185307179586 / 60.0)
#define HANG_S 20 /* of this process's own processor time, some hundred times what it needs */
#define RUN_MS 900U
#define MOMENTS 200U /* periods among which the moment of the flip is drawn */
/* Of the scope's history and memory, which the drive does not run on, only two slots take part: the samples in them are
 * in use in every 32nd period. */
#define SCOPE_MEMORY ((uint32_t)offsetof(ecu_t, scope.memory))
#define DRIVE_SHARE 4U /* of five flips, this many in the drive, the others in the rest of the ECU */

typedef struct {
    double rpm, torque_Nm;
} point_t;

static const point_t points[] = {{40, 90}, {500, 60}, {1500, -50}, {3000, 100}, {6000, 40}, {9000, -25}};

#define POINTS (sizeof points / sizeof points[0])

typedef struct {
    uint64_t random;
    unsigned counter;
    double torque_Nm;
    bool enable;
} bus_t;

static fluxtrue_t ecu;
static sim_t *sim;
static bus_t bus;

static void check(bool good, const char *what)
{
    if (!good) {
        printf("FAILED: %s\n", what);
        exit(1);
    }
}

/* xorshift64* */
static uint32_t draw(uint64_t *state, uint32_t below)
{
    uint64_t x = *state;
    x ^= x >> 12;
    x ^= x << 25;
    x ^= x >> 27;
    *state = x;
    return (uint32_t)((x * 0x2545F4914F6CDD1DULL) >> 32) % below;
}

static void put16(can_frame_t *frame, unsigned at, int value)
{
    frame->data[at] = (uint8_t)((unsigned)value & 0xFFU);
    frame->data[at + 1U] = (uint8_t)((unsigned)value >> 8 & 0xFFU);
}

static void send_command(void)
{
    can_frame_t frame = {.id = 0x110, .length = 8};
    uint8_t counter = (uint8_t)bus.counter;
    frame.data[1] = (uint8_t)(0x40U | (bus.enable ? 0x10U : 0U));
    put16(&frame, 2, (int)lrint(bus.torque_Nm * 10.0));
    put16(&frame, 4, 2000);
    put16(&frame, 6, 2000);
    e2e_protect(0x1101, &counter, &frame);
    bus.counter = counter;
    (void)can_host_put(&ecu, &frame); /* full when a flip has stopped the task */
}

static void millisecond(unsigned ms, double *shaft_Nm)
{
    can_frame_t sent;
    if (ms % 10U == 0U) {
        send_command();
    }
    check(sim_run(sim, PERIODS_PER_MS, shaft_Nm, 1) >= 0, "the simulation cannot go on");
    while (can_host_take(&ecu, &sent)) {
    }
}

static void set(const char *name, double value)
{
    check(sim_set(sim, name, value) == SIM_OK, name);
}

static void start(void)
{
    const machine_data_t *m = &machine_data;
    static const char *const shaft[] = {"truth.torque_shaft_mean_Nm"};
    fluxtrue_init(&ecu);
    can_host_attach(&ecu);
    sim = sim_create_around(&ecu);
    check(sim != NULL, "out of memory");
    for (const machine_value_t *v = m->values; v->name != NULL; v++) {
        set(v->name, v->value);
    }
    check(sim_map(sim, m->id_A, m->nd, m->iq_A, m->nq, m->psi_d_Vs, m->psi_q_Vs) == SIM_OK, "flux map");
    set("plant.dc_link_F", 500e-6);
    set("plant.precharge_s", 0.005);
    set("plant.magnet_scale", 0.92);
    set("plant.imposed_speed", 1.0);
    check(sim_start(sim) == NULL, "plant");
    check(sim_record(sim, shaft, 1, PERIODS_PER_MS) == SIM_OK, "record");
    bus = (bus_t){.counter = 0};
}

static void drive_to(const point_t *point)
{
    double shaft_Nm;
    start();
    for (unsigned ms = 0; ms < 2500U; ms++) {
        bus.enable = ms > 500U;
        bus.torque_Nm = (ms > 900U) ? point->torque_Nm : 0.0;
        set("plant.speed_rad_s", point->rpm * RPM * fmin(ms / 800.0, 1.0));
        millisecond(ms, &shaft_Nm);
    }
    check(ecu.drive.fast.faults == 0U && ecu.gates, "the drive does not run");
    printf("%.0f rpm: %.1f of %.1f N·m\n", point->rpm, shaft_Nm, point->torque_Nm);
    check(fabs(shaft_Nm - point->torque_Nm) < 6.0, "the torque is not where it should be");
}

/* The torque that is requested during the run. */
static double wanted_Nm(const point_t *point, unsigned ms)
{
    return (ms < 250U)   ? point->torque_Nm
           : (ms < 450U) ? -0.6 * point->torque_Nm
           : (ms < 600U) ? 0.0
                         : point->torque_Nm;
}

/* In a copy of the process: the flip, unless the place is NULL, and what follows from it. */
static void drive_on(const point_t *point, const place_t *place, unsigned moment, trace_t *trace)
{
    *trace = (trace_t){.fault_ms = NO_FAULT};
    for (unsigned ms = 0; ms < RUN_MS; ms++) {
        bus.torque_Nm = wanted_Nm(point, ms);
        if (ms % 10U == 0U) {
            send_command();
        }
        for (unsigned k = 0; k < PERIODS_PER_MS; k++) {
            if (place != NULL && ms * PERIODS_PER_MS + k == moment) {
                ((uint8_t *)&ecu)[place->byte] ^= (uint8_t)(1U << place->bit);
            }
            check(sim_run(sim, 1, &trace->shaft_Nm[ms], 1) >= 0, "the simulation cannot go on");
        }
        can_frame_t sent;
        while (can_host_take(&ecu, &sent)) {
        }
        const bool off = !supervisor_outputs[ecu.ecu.supervisor.state % STATES].run; /* the bus reports the state */
        if ((off || ecu.drive.fast.faults != 0U || ecu.ecu.supervisor.faults != 0U) && trace->fault_ms == NO_FAULT) {
            trace->fault_ms = ms;
            trace->faults = ecu.drive.fast.faults;
        }
        trace->ms = ms + 1U;
    }
}

static void in_a_copy(const point_t *point, const place_t *place, unsigned moment, trace_t *trace)
{
    fflush(stdout);
    trace->ended = 0;
    const pid_t child = fork();
    check(child >= 0, "fork");
    if (child == 0) {
        const struct rlimit limit = {HANG_S, HANG_S};
        (void)setrlimit(RLIMIT_CPU, &limit);
        drive_on(point, place, moment, trace);
        _exit(0);
    }
    int status = 0;
    check(waitpid(child, &status, 0) == child, "wait");
    trace->ended = WIFSIGNALED(status) ? WTERMSIG(status) : WEXITSTATUS(status);
}

static void run_point(const point_t *point, unsigned flips, uint64_t *random, trace_t *traces, tally_t *tally)
{
    drive_to(point);
    trace_t *golden = &traces[0], *trace = &traces[1];
    in_a_copy(point, NULL, 0, golden);
    check(golden->ended == 0 && golden->fault_ms == NO_FAULT, "the drive trips without a flip");
    for (unsigned n = 0; n < flips; n++) {
        const bool in_drive = draw(random, 5) < DRIVE_SHARE;
        const uint32_t begin = in_drive ? 0U : (uint32_t)sizeof(drive_t);
        const uint32_t end = in_drive ? (uint32_t)offsetof(drive_t, samples.slot[2]) : SCOPE_MEMORY;
        const place_t place = {begin + draw(random, end - begin), draw(random, 8)};
        in_a_copy(point, &place, draw(random, MOMENTS), trace);
        classify(tally, golden, trace, &place, point->rpm);
    }
    sim_destroy(sim);
}

int main(int argc, char **argv)
{
    if (argc != 3) {
        fprintf(stderr, "usage: memory_flips <flips> <seed>\n");
        return 2;
    }
    const unsigned flips = (unsigned)strtoul(argv[1], NULL, 10);
    uint64_t random = strtoull(argv[2], NULL, 10) * 0x9E3779B97F4A7C15ULL + 1ULL;
    trace_t *traces = mmap(NULL, 2U * sizeof(trace_t), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    check(traces != MAP_FAILED, "out of memory");
    static tally_t tally;
    for (unsigned k = 0; k < POINTS; k++) {
        run_point(&points[k], flips * (k + 1U) / POINTS - flips * k / POINTS, &random, traces, &tally);
    }
    return verdict_report(&tally);
}
