/* SPDX-License-Identifier: Apache-2.0 */
#ifndef FX_CODEGEN_H
#define FX_CODEGEN_H
/** Makes the compiler choose cheaper instructions; no function here changes a value.
 *   Together the uses hold the averages of the fast ISR and of the tick, and the tick's maximum, within their bounds
 *   (docs/performance.md); a use that saves nothing is not kept. Each use saves these instructions per period (emulated
 *   Cortex-M4, gcc 12.2, hsm1; measured with tools/fluxtrue bench without that one use):
 *   use                                                   tick         fast ISR
 *   FX_LOAD_TWO       angle tracker, state and gains      2
 *                     current control, integrators        1
 *                     current control, anti-windup        1            1
 *                     window of the identification                     3
 *                     monitor.h: currents, dc voltage                  1 each
 *                     hal/s32k144/angle_quadrature.c                   1
 *   fx_both_loaded    window, sums stored together                     2
 *                     modulation: slopes, gains           1 each       1, 0
 *   fx_in_register    current control, speed              2            4
 *                     modulation: level, half a duty      3 each       1, 2
 *                     modulation: limited pulses          up to 4      up to 2
 *                     modulation: middle phase                         0.8
 *                     hal/s32k144/pwm.c: rounding, rise                2, 3
 *   fx_read_two       hal/s32k144/sampling.c                           3
 *   FX_ADDRESS_ONCE   slot of the sample                               18
 *                     timer of hal/s32k144/pwm.c                       2
 *                     slot of the command                              2
 *                     point of the sine table             2            2 (1 kHz task: 11)
 *                     table of the circle                 up to 1
 *   FX_PADDING_WORD   sample                                           9 to 11
 *   FX_PADDING_FLAG   sample                                           2
 * The following save, measured without all uses of one of them at once (the drive's program of tools/fluxtrue bench):
 *   FX_USUALLY                1.4 instructions of the tick, 5 of its maximum, with the look-up's hints
 *   FX_COLD                   6 instructions of the fast ISR, 234 bytes of the control library
 *   FX_NOT_INLINED            210 bytes of the control library; the fast ISR would have 1 less without
 *   FX_INLINED                104 instructions of the 1 kHz task
 *   FX_INLINES_CALLS          108 instructions of the fast ISR
 * Source   our own measurement; Arm v7-M ARM A7.7.50 (LDRD needs word alignment only)
 * Units    none
 * Range    every value and every address of two words
 * Rounding none
 * Errors   FX_LOAD_TWO, FX_POWER_OF_TWO_SIZE and FX_WORD_OF_FLAGS do not compile where their assumption does not hold
 * Context  any */

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The compiler places the code of the other case out of the way of the usual one. */
#define FX_USUALLY(condition) __builtin_expect((condition), 1)

/* Of a function: a call of it is rare, so that it is compiled for size and its callers keep their registers. */
#define FX_COLD __attribute__((cold))
/* One copy of its instructions for all callers. */
#define FX_NOT_INLINED __attribute__((noinline))
/* A copy of its instructions in each caller, or in this function those of everything that it calls. */
#define FX_INLINED __attribute__((always_inline))
#define FX_INLINES_CALLS __attribute__((flatten))
/* FX_INLINED if the compiler optimises. Without optimisation, as in the build that measures coverage, the branches of
 * an inlined function would be counted in each caller. */
#ifdef __OPTIMIZE__
#define FX_INLINED_IF_OPTIMISED FX_INLINED
#else
#define FX_INLINED_IF_OPTIMISED
#endif
/* The passes of the loop that follows, eight at most, are written one behind the other, so that what depends on the
 * pass alone is a constant. */
#define FX_UNROLLED _Pragma("GCC unroll 8")

/* A type whose objects may be parts of objects of any other type. */
#define FX_ANY_OBJECT __attribute__((may_alias))

/* The same value in a register, opaque to the compiler: it neither recomputes the value nor folds it into other
 * operations, and a branch that computes it stays a branch. */
static inline int32_t fx_in_register(int32_t x)
{
    __asm__("" : "+r"(x));
    return x;
}

/* Both values are in registers at this point: words that lie side by side are loaded or stored by one instruction. */
// NOLINTNEXTLINE(readability-non-const-parameter): the operands are outputs, too
static inline void fx_both_loaded(int32_t *a, int32_t *b)
{
    __asm__("" : "+r"(*a), "+r"(*b));
}

/* The address is computed once, not as part of every access. */
#define FX_ADDRESS_ONCE(pointer) __asm__("" : "+r"(pointer))

/* The compiler moves no access to memory across this point; the processor has one core and needs nothing more. */
static inline void fx_compiler_barrier(void)
{
    __asm__ volatile("" ::: "memory");
}

typedef struct {
    int32_t first, second;
} FX_ANY_OBJECT fx_two_words_t;

static inline fx_two_words_t fx_load_two_words(const int32_t *from)
{
#ifdef __ARM_FEATURE_DSP
    typedef int64_t double_word_t __attribute__((may_alias, aligned(4)));
    fx_two_words_t y;
    /* Uv: the address may contain a constant that fits LDRD. */
    __asm__("ldrd %0, %1, %2" : "=r"(y.first), "=r"(y.second) : "Uv"(*(const double_word_t *)from));
    return y;
#else
    return *(const fx_two_words_t *)from;
#endif
}

/* Two registers of a peripheral that lie side by side, read once each and in this order. */
static inline fx_two_words_t fx_read_two(const volatile uint32_t *from)
{
#ifdef __ARM_FEATURE_DSP
    typedef uint64_t register_pair_t __attribute__((may_alias, aligned(4)));
    fx_two_words_t y;
    __asm__ volatile("ldrd %0, %1, %2" : "=r"(y.first), "=r"(y.second) : "Uv"(*(const volatile register_pair_t *)from));
    return y;
#else
    const int32_t first = (int32_t)from[0];
    return (fx_two_words_t){first, (int32_t)from[1]};
#endif
}

/* 0, or an error of the compiler. */
#define FX_ASSERTED_ZERO(condition) (sizeof(char[(condition) ? 1 : -1]) - 1U)

/* Two fields of a structure by one LDRD; the compiler would load each where it is needed. Both are words, and the
 * second follows the first. */
#define FX_LOAD_TWO(pointer, a, b) \
    fx_load_two_words((const int32_t *)&(pointer)->a + \
                      FX_ASSERTED_ZERO(offsetof(__typeof__(*(pointer)), b) == \
                                           offsetof(__typeof__(*(pointer)), a) + sizeof(int32_t) && \
                                       sizeof (pointer)->a == sizeof(int32_t) && \
                                       sizeof (pointer)->b == sizeof(int32_t)))

/* An unused word. With it a structure has a size that is a power of two, and the address of a slot is a shift. */
#define FX_PADDING_WORD uint32_t fx_padding

/* An unused flag, always false. It is the fourth flag of a word, and all four are then written by one instruction. */
#define FX_PADDING_FLAG bool fx_padding_flag

/* After a structure with FX_PADDING_FLAG; first: the first of the four flags. */
#define FX_WORD_OF_FLAGS(type, first) \
    _Static_assert(offsetof(type, first) % sizeof(uint32_t) == 0U && \
                       offsetof(type, fx_padding_flag) == offsetof(type, first) + 3U, \
                   "the flags of " #type " are not one word")

/* After a structure with FX_PADDING_WORD. Only the target's layout counts: other compilers have larger enumerations. */
#ifdef __arm__
#define FX_POWER_OF_TWO_SIZE(type) \
    _Static_assert((sizeof(type) & (sizeof(type) - 1U)) == 0U, #type " needs another FX_PADDING_WORD, or none")
#else
#define FX_POWER_OF_TWO_SIZE(type) _Static_assert(sizeof(type) != 0U, #type)
#endif

#endif
