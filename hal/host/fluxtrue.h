/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_HOST_FLUXTRUE_H
#define HAL_HOST_FLUXTRUE_H
/** Software in the loop: the firmware as a library, for any plant that can call C.
 *   One call to fluxtrue_step() is one PWM period: samples in, the duties for the next period out.
 *   FLUXTRUE_ABI is counted up when calls are added. Calls are not removed and do not change: a program that was built
 *   for a lower number runs with this library, too.
 * Source   docs/howto/software-in-the-loop.md
 * Units    SI; the names of fluxtrue_set() and fluxtrue_get() end in their unit
 * Errors   a call that answers a negative code has changed nothing; fluxtrue_get() of an unknown name is NaN;
 *          NaN, infinite or impossible samples disable switching and set a fault bit
 * Context  any number of instances in one process; one thread per instance at a time. Calls without an instance may be
 *          made from any thread */
#if defined _WIN32 && defined FLUXTRUE_BUILD
#define FLUXTRUE_API __declspec(dllexport)
#elif defined _WIN32
#define FLUXTRUE_API __declspec(dllimport)
#elif defined __GNUC__
#define FLUXTRUE_API __attribute__((visibility("default")))
#else
#define FLUXTRUE_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/** The version of this interface; fluxtrue_abi() is that of the library. Version 1 had no fluxtrue_abi(). */
#define FLUXTRUE_ABI 2

enum {
    FLUXTRUE_OK = 0,
    FLUXTRUE_UNKNOWN_NAME = -1,
    FLUXTRUE_OUT_OF_RANGE = -2,
    FLUXTRUE_READ_ONLY = -3,
    FLUXTRUE_NO_STATE = -4 /* not a state that this library can restore, or one that it cannot save */
};

enum { FLUXTRUE_MEMORY_SIZE = 4096 };

/** Kind of a name's value. */
enum {
    FLUXTRUE_NUMBER = 0,
    FLUXTRUE_SWITCH = 1, /* 0 or 1 */
    FLUXTRUE_COUNT = 2,  /* a whole number from 0 on */
    FLUXTRUE_CHOICE = 3, /* a whole number; fluxtrue_word() has a word for each value */
    FLUXTRUE_BITS = 4    /* a word of bits; fluxtrue_word() has a word for each bit */
};

typedef struct fluxtrue fluxtrue_t;

/** Description of a name. The texts are valid as long as the library is loaded. */
typedef struct {
    const char *name;
    const char *unit; /* "" without a unit */
    const char *help; /* a sentence */
    double lo, hi;    /* range that fluxtrue_set() accepts; NaN if the name is read only */
    double least;     /* besides 0 no smaller magnitude is accepted: the format would make it 0; 0: no such limit */
    double initial;   /* value in a new drive */
    int kind;         /* FLUXTRUE_NUMBER ... */
    int writable;     /* 1: fluxtrue_set() accepts it; 0: read only */
} fluxtrue_info_t;

/** Several periods in one call. All arrays are row-major, one row per period, and belong to the caller. */
typedef struct {
    int periods;
    const double *in;         /* rows of 6, as fluxtrue_step() */
    double *out;              /* rows of 4, as fluxtrue_step(); NULL: not wanted */
    int sets;                 /* number of names set; 0: none */
    const int *set;           /* their handles */
    const double *set_values; /* rows of `sets`: set before the first period, and before a period in which it differs */
    int gets;                 /* number of names read; 0: none */
    const int *get;           /* their handles */
    double *get_values;       /* rows of `gets`, read after each period */
} fluxtrue_batch_t;

/** The version of the firmware in this library, "major.minor.patch"; valid as long as the library is loaded. */
FLUXTRUE_API const char *fluxtrue_version(void);
/** FLUXTRUE_ABI of the library. */
FLUXTRUE_API int fluxtrue_abi(void);
/** The name of the motor compiled in; valid as long as the library is loaded. */
FLUXTRUE_API const char *fluxtrue_motor(void);
/** The PWM period in seconds: the time that one fluxtrue_step() stands for. */
FLUXTRUE_API double fluxtrue_period_s(void);
/** A new drive with the motor compiled in; NULL when out of memory. */
FLUXTRUE_API fluxtrue_t *fluxtrue_create(void);
FLUXTRUE_API void fluxtrue_destroy(fluxtrue_t *drive);
/** As fluxtrue_create() leaves it. The flash is erased, too: fluxtrue_memory_read() before it keeps a copy. */
FLUXTRUE_API void fluxtrue_reset(fluxtrue_t *drive);
/** FLUXTRUE_OK or the reason for the refusal; a refused value changes nothing. */
FLUXTRUE_API int fluxtrue_set(fluxtrue_t *drive, const char *name, double value);
/** The value now; NaN for an unknown name. */
FLUXTRUE_API double fluxtrue_get(const fluxtrue_t *drive, const char *name);
/** The index-th name; NULL after the last one and for a negative index. */
FLUXTRUE_API const char *fluxtrue_name(int index);
/** The handle of a name, for fast access: the same in every drive of this library, but not in another library.
 *  FLUXTRUE_UNKNOWN_NAME: no such name. Handles are the indices of fluxtrue_name(). */
FLUXTRUE_API int fluxtrue_handle(const char *name);
/** As fluxtrue_set() and fluxtrue_get(), without the search for the name. */
FLUXTRUE_API int fluxtrue_set_by(fluxtrue_t *drive, int handle, double value);
FLUXTRUE_API double fluxtrue_get_by(const fluxtrue_t *drive, int handle);
/** Writes the description of a name to the first `size` bytes of info, sizeof *info for the caller: later versions may
 *  add members at the end. FLUXTRUE_UNKNOWN_NAME: no such handle; FLUXTRUE_OUT_OF_RANGE: size is not positive. */
FLUXTRUE_API int fluxtrue_info(int handle, fluxtrue_info_t *info, int size);
/** The word for a value of a name that stands for an enumeration, in lower case: "moved" for ("commission_failure", 2);
 *  of a word of bits that for the bit: "over_current" for ("fault_word", 0). FLUXTRUE_UNKNOWN_NAME: no such name or
 *  value; FLUXTRUE_OUT_OF_RANGE: the word with its end needs more than size characters. */
FLUXTRUE_API int fluxtrue_word(const char *name, int value, char *word, int size);
/** What it means, a sentence; NULL for no such name or value. */
FLUXTRUE_API const char *fluxtrue_explanation(const char *name, int value);
/** The drive's flash, FLUXTRUE_MEMORY_SIZE bytes. The identified values are saved there 0.1 s after `enable` has gone
 *  to 0, at most every five minutes. A new drive that is given this memory starts with them.
 *  FLUXTRUE_OUT_OF_RANGE: another size. */
FLUXTRUE_API int fluxtrue_memory_read(const fluxtrue_t *drive, unsigned char *data, int size);
/** Before the first step, as at power-on; FLUXTRUE_READ_ONLY afterwards. A record that is damaged or of another motor
 *  is not used. */
FLUXTRUE_API int fluxtrue_memory_write(fluxtrue_t *drive, const unsigned char *data, int size);
/** in: ia_A ib_A ic_A vdc_V theta_m_rad t_winding_C at the period's start.
 *  out: duty_a duty_b duty_c in 0..1 for the next period; gates_on 1 while switching is enabled, else 0. */
FLUXTRUE_API void fluxtrue_step(fluxtrue_t *drive, const double in[6], double out[4]);
/** Runs the periods of a batch. All handles and all values to be set are checked first: FLUXTRUE_UNKNOWN_NAME,
 *  FLUXTRUE_READ_ONLY or FLUXTRUE_OUT_OF_RANGE (also for a negative number of anything) mean that nothing has run. */
FLUXTRUE_API int fluxtrue_run(fluxtrue_t *drive, const fluxtrue_batch_t *batch);

/** The whole state of a drive, as bytes without addresses: a drive that it is restored to continues bit by bit as the
 *  saved one, in this or another process. It belongs to this library file; a library of another version, another motor
 *  or another layout refuses it, and so is a state that has been damaged (FLUXTRUE_NO_STATE). A drive on a bus (virtual
 *  ECU) has no state to save. FLUXTRUE_OUT_OF_RANGE: size is not fluxtrue_state_size(). */
FLUXTRUE_API int fluxtrue_state_size(void);
FLUXTRUE_API int fluxtrue_state_save(const fluxtrue_t *drive, void *state, int size);
FLUXTRUE_API int fluxtrue_state_restore(fluxtrue_t *drive, const void *state, int size);

#ifdef __cplusplus
}
#endif

#endif
