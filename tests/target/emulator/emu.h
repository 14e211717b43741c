/* SPDX-License-Identifier: Apache-2.0 */
#ifndef EMULATOR_EMU_H
#define EMULATOR_EMU_H
/** An emulated S32K144 that runs an unmodified ELF file: a Cortex-M4F (unicorn) with register-level models of the
 * peripherals that the firmware uses. Time advances by 3/2 core cycles with each executed instruction (a convention of
 * the emulation, not a measurement), and from event to event of the peripherals while the core sleeps.
 * Source   docs/howto/emulate.md
 * Units    time in ticks of 1/3.36 GHz: every clock of the chip is a whole number of them
 * Errors   an access to a register that is not modelled or not clocked, a reserved bit, a fault of the core unless
 *          emu_core_faults() asks for it: the emulation stops, emu_error() names peripheral, register, offset and
 *          program counter
 * Context  host; any number of instances, one thread per instance at a time */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define EMU_TICKS_PER_S 3360000000ULL
/* Exact in ticks, because the period of the core's clock is an even number of ticks at every frequency. */
#define EMU_HALF_CYCLES_PER_INSTRUCTION 3U
#define EMU_PWM_CHANNELS 6

#ifdef __GNUC__
#define EMU_API __attribute__((visibility("default")))
#else
#define EMU_API
#endif

typedef struct emu emu_t;

typedef enum { EMU_FAST = 0, EMU_COUNTING = 1 } emu_mode_t;
/** Stuck: the core executes nothing, as in a loop with all interrupts masked. Halted: a debugger has stopped it. */
typedef enum { EMU_RUNS = 0, EMU_STUCK = 1, EMU_HALTED = 2 } emu_core_state_t;
typedef enum { EMU_LIMIT = 0, EMU_CENTRE = 1, EMU_BREAK = 2, EMU_FAILED = -1 } emu_stop_t;

/** Inputs of the chip. */
typedef struct {
    uint16_t adc[2][32]; /* 12-bit result of each converter's channel */
    uint32_t angle;      /* of the shaft, 2^32 = one turn */
    int32_t angle_rate;  /* speed of the shaft between two settings, in 2^-48 turns per tick */
    bool resolver_fault;
    bool gate_fault; /* the gate driver pulls the fault input low */
} emu_pins_t;

/** State of the bridge in this period; duty: the acting compare values as a share of the period. */
typedef struct {
    double duty[3];
    uint8_t driven; /* outputs that may switch on, one bit each; the even ones are the upper switches */
    bool gates;     /* switching is enabled: all six outputs, in complementary pairs */
    double dead_time_s;
    double period_s;
} emu_bridge_t;

/** NULL: failed, and error holds the reason. EMU_COUNTING counts the instructions one by one and allows
 * emu_break_after(). */
EMU_API emu_t *emu_create(const char *elf, int mode, char *error, size_t size);
EMU_API void emu_destroy(emu_t *emu);

/** The inputs, to be set by the caller at once: the shaft continues from the new angle at this instant. */
EMU_API emu_pins_t *emu_pins(emu_t *emu);
EMU_API const emu_pins_t *emu_pins_now(const emu_t *emu);
/** Lines that may change at any time, not only at the start of a period. */
EMU_API void emu_board_pins(emu_t *emu, bool gate_fault, bool resolver_fault);
/** Faults of an AS5047P: each answer with one wrong bit; each with its error flag; its line stuck; no magnet. */
typedef enum {
    EMU_ENCODER_GOOD = 0,
    EMU_ENCODER_PARITY = 1,
    EMU_ENCODER_EF = 2,
    EMU_ENCODER_LOW = 3,
    EMU_ENCODER_HIGH = 4,
    EMU_ENCODER_WEAK_FIELD = 5
} emu_encoder_fault_t;
EMU_API void emu_encoder_fault(emu_t *emu, emu_encoder_fault_t fault);
/** Errors of an analogue angle sensor by name: sine_ or cosine_ with offset and noise (counts), amplitude (share of the
 * nominal one) and fault (1 open, 2 at the reference, 3 at its middle). They outlast a reset and a power cycle. */
typedef enum { EMU_SETTING_TAKEN = 0, EMU_SETTING_UNKNOWN = 1, EMU_SETTING_OUT_OF_RANGE = 2 } emu_setting_t;
EMU_API emu_setting_t emu_analogue_set(emu_t *emu, const char *name, double value);
EMU_API void emu_bridge(const emu_t *emu, emu_bridge_t *bridge);
EMU_API uint32_t emu_outputs(const emu_t *emu);
EMU_API void emu_core_state(emu_t *emu, emu_core_state_t state);
/** Whether a fault of the core is an exception, as on the chip; from creation on it ends the emulation. Outlasts a
 * reset. */
EMU_API void emu_core_faults(emu_t *emu, bool taken);
/** How long the calibration of a converter takes, in its clocks; from creation on 14,000, which is assumed. Outlasts a
 * reset. */
EMU_API void emu_adc_calibration(emu_t *emu, uint32_t clocks);
/** State of a line of port C to the board: driven high or low; released while it is no output, as after a reset. */
typedef enum { EMU_LINE_RELEASED = 0, EMU_LINE_LOW = 1, EMU_LINE_HIGH = 2 } emu_line_t;
EMU_API emu_line_t emu_line(const emu_t *emu, unsigned line);
EMU_API bool emu_gate_driver(const emu_t *emu);
EMU_API bool emu_safe_state_requested(const emu_t *emu);

/** Runs for at most this number of ticks. EMU_CENTRE: FTM0 has just begun a period and loaded its buffered values; the
 * triggers of this instant follow with the next call, after the caller has set the pins. */
EMU_API int emu_run(emu_t *emu, uint64_t ticks);
EMU_API const char *emu_error(const emu_t *emu);
EMU_API uint64_t emu_now(const emu_t *emu);
EMU_API uint64_t emu_instructions(const emu_t *emu);
EMU_API uint32_t emu_resets(const emu_t *emu);

/** Memory as the debugger sees it, and symbols (0: no such symbol). */
EMU_API bool emu_read(const emu_t *emu, uint32_t address, void *to, uint32_t size);
EMU_API bool emu_write(emu_t *emu, uint32_t address, const void *from, uint32_t size);
EMU_API uint32_t emu_symbol(const emu_t *emu, const char *name);
EMU_API uint32_t emu_symbol_size(const emu_t *emu, const char *name);

/** The value that the program has read last from the counter of FTM0 (timer 0) or FTM2 (timer 1); before: the value
 * that it read before that one. */
EMU_API uint32_t emu_counter_read(const emu_t *emu, int timer, bool before);
/** The angle that the resolver converter has latched. */
EMU_API uint32_t emu_resolver_angle(const emu_t *emu);

/** A register by name, "FTM0.MOD", without side effects; UINT64_MAX: no such register. */
EMU_API uint64_t emu_register(const emu_t *emu, const char *name);
EMU_API bool emu_register_set(emu_t *emu, const char *name, uint32_t value);
/** The same as the core would access it, with every side effect and check; between two runs. */
EMU_API uint64_t emu_register_load(emu_t *emu, const char *name);
EMU_API bool emu_register_store(emu_t *emu, const char *name, uint32_t value);

/** Called when an exception's handler is entered and left (vector number, 16 = first interrupt). */
typedef void (*emu_exception_fn)(void *user, int vector, bool entered);
EMU_API void emu_on_exception(emu_t *emu, emu_exception_fn fn, void *user);
EMU_API int emu_active_vector(const emu_t *emu);
/** Makes an interrupt pending, as its peripheral would. */
EMU_API void emu_pend(emu_t *emu, int vector);

/** Instructions of one handler, without those of handlers that interrupted it, since creation or emu_counts_clear().
 * EMU_FAST counts whole blocks; EMU_COUNTING leaves out the instructions that an IT instruction skips. */
typedef struct {
    uint64_t runs, sum;
    uint32_t least, most;
} emu_counts_t;
EMU_API emu_counts_t emu_counts(const emu_t *emu, int vector);
EMU_API void emu_counts_clear(emu_t *emu);

/** Resets the processor now; cause: the bits of RCM_SRS, with POR set the supply has failed. */
EMU_API void emu_reset_now(emu_t *emu, uint32_t cause);
/** The supply fails and returns: RAM is lost, a command of the flash controller is left half done. */
EMU_API void emu_power_cycle(emu_t *emu);
/** Data flash: commands take the data sheet's longest time instead of its typical one; a sector's erase fails; the seed
 * of what a cut command leaves; completed or cut erases of a sector; the phrase at this address cannot be relied on. */
EMU_API void emu_flash_slow(emu_t *emu, bool slow);
EMU_API void emu_flash_worn(emu_t *emu, uint32_t sector, bool worn);
/** One bit of each byte of this sector cannot be programmed, although the sector erases. */
EMU_API void emu_flash_weak(emu_t *emu, uint32_t sector, bool weak);
EMU_API void emu_flash_random(emu_t *emu, uint32_t seed);
EMU_API uint32_t emu_flash_erases(const emu_t *emu, uint32_t sector);
EMU_API void emu_flash_spoil(emu_t *emu, uint32_t address);

/** A snapshot of everything but the program. */
typedef struct emu_snapshot emu_snapshot_t;
EMU_API emu_snapshot_t *emu_save(emu_t *emu);
EMU_API void emu_restore(emu_t *emu, const emu_snapshot_t *snapshot);
EMU_API void emu_snapshot_free(emu_snapshot_t *snapshot);

/** In counting mode: emu_run() returns EMU_BREAK after this number of further instructions. */
EMU_API void emu_break_after(emu_t *emu, uint64_t instructions);

#endif
