/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_HOST_FLUXTRUE_H
#define HAL_HOST_FLUXTRUE_H
/** Software in the loop: the firmware as a library, for any plant that can call C.
 *   One call to fluxtrue_step() is one PWM period: samples in, the duties for the next period out.
 * Source   docs/howto/software-in-the-loop.md
 * Units    SI; the names of fluxtrue_set() and fluxtrue_get() end in their unit
 * Errors   fluxtrue_set() answers a negative code; fluxtrue_get() of an unknown name is NaN;
 *          NaN, infinite or impossible samples disable switching and set a fault bit
 * Context  any number of instances in one process; one thread per instance at a time */
#ifdef __GNUC__
#define FLUXTRUE_API __attribute__((visibility("default")))
#else
#define FLUXTRUE_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

enum { FLUXTRUE_OK = 0, FLUXTRUE_UNKNOWN_NAME = -1, FLUXTRUE_OUT_OF_RANGE = -2, FLUXTRUE_READ_ONLY = -3 };

enum { FLUXTRUE_MEMORY_SIZE = 4096 };

typedef struct fluxtrue fluxtrue_t;

/** The version of the firmware in this library, "major.minor.patch"; valid as long as the library is loaded. */
FLUXTRUE_API const char *fluxtrue_version(void);
/** A new drive with the motor compiled in; NULL when out of memory. */
FLUXTRUE_API fluxtrue_t *fluxtrue_create(void);
FLUXTRUE_API void fluxtrue_destroy(fluxtrue_t *drive);
/** FLUXTRUE_OK or the reason for the refusal; a refused value changes nothing. */
FLUXTRUE_API int fluxtrue_set(fluxtrue_t *drive, const char *name, double value);
/** The value now; NaN for an unknown name. */
FLUXTRUE_API double fluxtrue_get(const fluxtrue_t *drive, const char *name);
/** The index-th name; NULL after the last one and for a negative index. */
FLUXTRUE_API const char *fluxtrue_name(int index);
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

#ifdef __cplusplus
}
#endif

#endif
