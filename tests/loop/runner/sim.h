/* SPDX-License-Identifier: Apache-2.0 */
#ifndef LOOP_RUNNER_SIM_H
#define LOOP_RUNNER_SIM_H
/** Closed loop: the simulated drive with the firmware or with its double-precision twin, period by period.
 *   period k: sample, control step, then the plant advances with the duties computed in period k-1
 *   Names: "plant.<field>" (array fields end in _a _b _c), "truth.<field>" (read only); all others are the
 *   controller's.
 * Source   docs/howto/simulate.md
 * Units    SI; a name ends in its unit
 * Errors   the codes below; a refused call changes nothing
 * Context  host; any number of instances, one thread per instance at a time. Order of the calls: sim_create, sim_map
 *          and sim_set of the plant, sim_start, then all others */
#ifdef __GNUC__
#define SIM_API __attribute__((visibility("default")))
#else
#define SIM_API
#endif

enum { SIM_FIRMWARE = 0, SIM_TWIN = 1 };
enum {
    SIM_OK = 0,
    SIM_UNKNOWN_NAME = -1,
    SIM_OUT_OF_RANGE = -2,
    SIM_READ_ONLY = -3,
    SIM_NOT_STARTED = -4,
    SIM_FULL = -5,
    SIM_FAILED = -6
};

typedef struct sim sim_t;
struct fluxtrue; /* hal/host/instance.h */

/** NULL: unknown controller or out of memory. */
SIM_API sim_t *sim_create(int controller);
/** The same with firmware that belongs to the caller and outlives the simulation. */
SIM_API sim_t *sim_create_around(struct fluxtrue *firmware);
/** The firmware with other motor data than those it was compiled with: a motor_t, which outlives the simulation. NULL
 *  also if size is not that of this library's motor_t. */
SIM_API sim_t *sim_create_for(const void *data, unsigned size);
SIM_API void sim_destroy(sim_t *sim);
/** The firmware of this simulation, for fluxtrue_memory_read() and _write(); NULL: another controller. */
SIM_API struct fluxtrue *sim_firmware(sim_t *sim);
/** The machine's flux map, full plane, row-major [i_d][i_q]; copied. Without one the machine has
 * constant inductances. */
SIM_API int sim_map(sim_t *sim, const double *id_A, int nd, const double *iq_A, int nq, const double *psi_d_Vs,
                    const double *psi_q_Vs);
/** Builds the plant. NULL: done; else the name of the first bad field. */
SIM_API const char *sim_start(sim_t *sim);

/** Plant fields act from the next period on. */
SIM_API int sim_set(sim_t *sim, const char *name, double value);
/** NaN: unknown name, or no plant yet. */
SIM_API double sim_get(const sim_t *sim, const char *name);
/** The plant's and the truth's names one by one, NULL after the last; the controller's are
 * fluxtrue_name()'s. */
SIM_API const char *sim_name(int index);

/** What sim_run() records: one row every `every` periods, a column per name. Truth columns are
 * means over the row's periods (time, angles and integrals: the value at its end), all others the
 * value at the row's end. */
SIM_API int sim_record(sim_t *sim, const char *const *names, int count, int every);
/** During the next sim_run() the name goes linearly from one value to the other: plant fields every
 * period, the controller's once per millisecond. */
SIM_API int sim_ramp(sim_t *sim, const char *name, double from, double to);
/** Runs; returns the number of rows written, or a negative code: SIM_FULL if they would not fit (then nothing runs),
 * SIM_FAILED if the controller cannot continue or the plant found no current for its flux linkage. */
SIM_API int sim_run(sim_t *sim, int periods, double *rows, int capacity_rows);
/** The reason after SIM_FAILED, else NULL. */
SIM_API const char *sim_failure(const sim_t *sim);

#endif
