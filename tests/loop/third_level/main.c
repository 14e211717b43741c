/* SPDX-License-Identifier: Apache-2.0 */
/* Errors of the program flow against the simulated external watchdog:  third_level_planted
 * The gate supply must be off within SUPPLY_MS, and no torque be left within TORQUE_MS. Without an error both stay.
 * The linker calls the functions __wrap_<name> in place of <name>. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "drive/drive.h"
#include "ecu/supervisor.h"
#include "hal/shut_off.h"
#include "loop/second_level/vehicle.h"
#include "second_level/second_level.h"

#define STEADY_MS 200
#define AFTER_MS 40
#define SUPPLY_MS 10
#define TORQUE_MS 8
#define TORQUE_NM 5.0

typedef enum {
    NOTHING,
    TASK_STUCK,
    TASK_EVERY_5_MS,
    SECOND_LEVEL_SKIPPED,
    WRONG_ORDER,
    DRIVE_SKIPPED,
    COUNTER_FROZEN,
    ISR_STUCK,
    ANSWER_FROZEN,
    ERRORS
} error_t;

static const char *const names[ERRORS] = {
    "nothing",      "task stuck",           "task every 5 ms", "second level skipped",
    "wrong order",  "drive's task skipped", "counter frozen",  "fast ISR stuck",
    "answer frozen"};

typedef struct {
    double speed_rpm, torque_Nm;
} point_t;

static const point_t points[] = {{0, 100}, {1000, -60}, {4000, 60}, {-3000, 80}};
enum { POINTS = (int)(sizeof points / sizeof points[0]) };

static vehicle_t vehicle;
static error_t error;
static bool task_done;

/* Declared twice: the linker gives both names. */
bool __real_second_level_step(const second_level_constants_t *constants, second_level_t *level,
                              const second_level_in_t *in);
void __real_supervisor_step(supervisor_t *supervisor, const supervisor_in_t *in);
void __real_task_1khz(drive_t *drive);
progress_t __real_drive_progress(drive_t *drive);
void __real_fast_isr(drive_t *drive);
void __real_hal_shut_off_answer(uint32_t answer);
bool __wrap_second_level_step(const second_level_constants_t *constants, second_level_t *level,
                              const second_level_in_t *in);
void __wrap_supervisor_step(supervisor_t *supervisor, const supervisor_in_t *in);
void __wrap_task_1khz(drive_t *drive);
progress_t __wrap_drive_progress(drive_t *drive);
void __wrap_fast_isr(drive_t *drive);
void __wrap_hal_shut_off_answer(uint32_t answer);

bool __wrap_second_level_step(const second_level_constants_t *constants, second_level_t *level,
                              const second_level_in_t *in)
{
    return error != SECOND_LEVEL_SKIPPED && __real_second_level_step(constants, level, in);
}

/* The drive's task runs before the state machine instead of after it. */
void __wrap_supervisor_step(supervisor_t *supervisor, const supervisor_in_t *in)
{
    task_done = error == WRONG_ORDER;
    if (task_done) {
        __real_task_1khz(&vehicle.ecu.drive);
    }
    __real_supervisor_step(supervisor, in);
}

void __wrap_task_1khz(drive_t *drive)
{
    if (!task_done && error != DRIVE_SKIPPED) {
        __real_task_1khz(drive);
    }
    task_done = false;
}

/* The counter of periods, as it would be if it stood still, while the fast ISR goes on. */
progress_t __wrap_drive_progress(drive_t *drive)
{
    const progress_t progress = __real_drive_progress(drive);
    return (error == COUNTER_FROZEN) ? (progress_t){0} : progress;
}

void __wrap_fast_isr(drive_t *drive)
{
    if (error != ISR_STUCK) {
        __real_fast_isr(drive);
    }
}

void __wrap_hal_shut_off_answer(uint32_t answer)
{
    static uint32_t last;
    last = (error == ANSWER_FROZEN) ? last : answer;
    __real_hal_shut_off_answer(last);
}

typedef struct {
    int supply_ms, torque_ms; /* until the supply is off and no torque is left; AFTER_MS: not */
} times_t;

static times_t measure(error_t planted, const point_t *at)
{
    times_t times = {0};
    error = NOTHING;
    vehicle_start(&vehicle, at->speed_rpm);
    vehicle_request(&vehicle, at->torque_Nm);
    vehicle_run(&vehicle, STEADY_MS);
    error = planted;
    for (int ms = 1; ms <= AFTER_MS; ms++) {
        vehicle.ecu.board.task_stuck = error == TASK_STUCK || (error == TASK_EVERY_5_MS && ms % 5 != 0);
        vehicle_millisecond(&vehicle);
        times.supply_ms = (sim_get(vehicle.sim, "truth.gate_supply") > 0.5) ? ms : times.supply_ms;
        times.torque_ms = (fabs(vehicle.torque_Nm) > TORQUE_NM) ? ms : times.torque_ms;
    }
    error = NOTHING;
    vehicle_stop(&vehicle);
    return times;
}

int main(void)
{
    int wrong = 0;
    for (error_t planted = NOTHING; planted < ERRORS; planted++) {
        for (int n = 0; n < POINTS; n++) {
            const times_t t = measure(planted, &points[n]);
            const bool good = (planted == NOTHING) ? t.supply_ms == AFTER_MS && t.torque_ms == AFTER_MS
                                                   : t.supply_ms <= SUPPLY_MS && t.torque_ms <= TORQUE_MS;
            printf("%s %-22s %6.0f rpm %5.0f N.m: supply off after %2d ms, torque gone after %2d ms\n",
                   good ? "  " : "! ", names[planted], points[n].speed_rpm, points[n].torque_Nm, t.supply_ms,
                   t.torque_ms);
            wrong += good ? 0 : 1;
        }
    }
    printf("%d of %d not met\n", wrong, ERRORS * POINTS);
    return (wrong == 0) ? 0 : 1;
}
