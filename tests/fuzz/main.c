/* SPDX-License-Identifier: Apache-2.0 */
/* The receive path under random and mutated frames:  fuzz_bus <frames> <seed>
 * The whole ECU runs, millisecond by millisecond. After each one the values that it has accepted must equal those of an
 * independent model (oracle.c), and the requested torque must lie between its last value and what the model allows. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "hal/host/can_host.h"
#include "hal/host/instance.h"
#include "loop/runner/sim.h"
#include "oracle.h"
#include "sender.h"
#include "vecu/machine_data.h"

#define BURST_MAX 30U /* frames per millisecond that one step of the task can process */
#define PERIODS_PER_MS 10
#define CAPACITANCE_F 500e-6
#define ROUNDING_NM 0.02 /* two counts of the torque */

typedef struct {
    uint64_t frames, accepted, milliseconds, running_ms;
} tally_t;

static fluxtrue_t ecu;
static sim_t *sim;
static oracle_t oracle;
static sender_t sender;
static tally_t tally;

static void fail(const char *what)
{
    printf("FAILED after %" PRIu64 " frames: %s\n", tally.frames, what);
    exit(1);
}

static void check(bool good, const char *what)
{
    if (!good) {
        fail(what);
    }
}

static bool near(float value, int tenths)
{
    return fabs((double)value - tenths / 10.0) < 1e-3;
}

static void compare_command(void)
{
    const can_rx_t *rx = &ecu.ecu.rx;
    check(rx->accepted == (oracle.accepted & 0xFFFFU), "a command was accepted that the oracle refuses, or refused");
    check(rx->command.enable == oracle.enable && rx->command.fault_reset == oracle.reset, "enable or reset differ");
    check((int)rx->command.mode == oracle.mode, "mode differs");
    check(near(rx->command.torque_requested_Nm, oracle.torque_dNm), "torque request differs");
    check(near(rx->command.limit_drive_Nm, oracle.drive_dNm), "drive limit differs");
    check(near(rx->command.limit_regen_Nm, oracle.regen_dNm), "regen limit differs");
    check(fabs((double)rx->limits.drive_kW - oracle.power_drive_10W / 100.0) < 1e-3, "power limit differs");
    check(fabs((double)rx->limits.regen_kW - oracle.power_regen_10W / 100.0) < 1e-3, "power limit differs");
    check(near(rx->battery_V, oracle.battery_dV), "battery voltage differs");
    check(rx->command_channel.alive == oracle.command.alive, "the age of the command differs");
    check(rx->limits_channel.alive == oracle.limits.alive, "the age of the limits differs");
    check(rx->command_channel.failed == oracle_failed(&oracle.command), "3 of 10 evaluated differently");
}

static void compare_torque(double before_Nm)
{
    const double base_Nm = (double)ecu.drive.motor->bases.torque_Nm;
    const double now_Nm = ecu.drive.request.torque_arbitrated / 32768.0 * base_Nm;
    const double most_Nm = (double)ecu.drive.motor->torque_max_Nm;
    const double asked_Nm = oracle.command.alive ? oracle.torque_dNm / 10.0 : 0.0;
    check(fabs(now_Nm) <= most_Nm + ROUNDING_NM, "more torque than the machine may give");
    check(now_Nm <= fmax(fmax(before_Nm, asked_Nm), 0.0) + ROUNDING_NM, "torque that was not requested");
    check(now_Nm >= fmin(fmin(before_Nm, asked_Nm), 0.0) - ROUNDING_NM, "torque that was not requested");
    check(!ecu.drive.request.enable || oracle.command.alive || now_Nm != 0.0 || before_Nm != 0.0,
          "switching stays enabled without a command and without torque");
}

static void put(can_frame_t frame)
{
    tally.accepted += oracle_frame(&oracle, &frame) ? 1U : 0U;
    check(can_host_put(&ecu, &frame), "the queue of the harness is too short");
    tally.frames++;
}

/* Phases of normal traffic, in which the drive reaches the state run, and attacks of every intensity. */
static void traffic(uint32_t ms)
{
    const uint32_t mood = (ms / 2000U) % 4U;
    if (ms % 10U == 0U && sender_random(&sender, 50) != 0U) {
        put(sender_sane(&sender, 0));
    }
    if (ms % 100U == 5U && sender_random(&sender, 50) != 0U) {
        put(sender_sane(&sender, 1));
    }
    const uint32_t frames_max = (mood == 0U) ? 0U : (mood == 1U) ? 1U : BURST_MAX - 3U;
    const uint32_t chance = (mood == 1U) ? sender_random(&sender, 40) / 39U : sender_random(&sender, frames_max + 1U);
    for (uint32_t n = 0; n < ((mood == 0U) ? 0U : chance); n++) {
        put(sender_insane(&sender));
    }
}

static void set(const char *name, double value)
{
    check(sim_set(sim, name, value) == SIM_OK, name);
}

/* The machine, turned slowly from outside. */
static void start_plant(void)
{
    const machine_data_t *m = &machine_data;
    sim = sim_create_around(&ecu);
    check(sim != NULL, "out of memory");
    for (const machine_value_t *v = m->values; v->name != NULL; v++) {
        set(v->name, v->value);
    }
    check(sim_map(sim, m->id_A, m->nd, m->iq_A, m->nq, m->psi_d_Vs, m->psi_q_Vs) == SIM_OK, "flux map");
    set("plant.dc_link_F", CAPACITANCE_F);
    set("plant.precharge_s", 0.005); /* so that the stretches between the attacks suffice for running */
    set("plant.discharge_s", 0.05);
    set("plant.imposed_speed", 1.0);
    set("plant.speed_rad_s", 30.0);
    check(sim_start(sim) == NULL, "plant");
}

static void millisecond(uint32_t ms)
{
    can_frame_t sent;
    const double before_Nm = ecu.drive.request.torque_arbitrated / 32768.0 * (double)ecu.drive.motor->bases.torque_Nm;
    traffic(ms);
    oracle_tick(&oracle);
    check(sim_run(sim, PERIODS_PER_MS, NULL, 0) == 0, "the simulation cannot go on");
    while (can_host_take(&ecu, &sent)) {
        check(sent.length == 8 && !sent.extended, "a frame was sent that the DBC does not know");
    }
    compare_command();
    compare_torque(before_Nm);
    tally.milliseconds++;
    tally.running_ms += ecu.drive.request.enable ? 1U : 0U;
}

int main(int argc, char **argv)
{
    if (argc != 3) {
        fprintf(stderr, "usage: fuzz_bus <frames> <seed>\n");
        return 2;
    }
    const uint64_t frames = strtoull(argv[1], NULL, 10);
    fluxtrue_init(&ecu);
    can_host_attach(&ecu);
    start_plant();
    oracle_start(&oracle);
    sender_start(&sender, strtoull(argv[2], NULL, 10));
    for (uint32_t ms = 0; tally.frames < frames; ms++) {
        millisecond(ms);
    }
    check(tally.running_ms > tally.milliseconds / 20U, "the drive hardly ever ran: the campaign proves little");
    printf("%" PRIu64 " frames in %" PRIu64 " ms of simulated time: %" PRIu64 " accepted, as the oracle says; "
           "switching enabled during %" PRIu64 " ms\n",
           tally.frames, tally.milliseconds, tally.accepted, tally.running_ms);
    sim_destroy(sim);
    return 0;
}
