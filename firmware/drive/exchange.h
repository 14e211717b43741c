/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_EXCHANGE_H
#define DRIVE_EXCHANGE_H
/** The boxes through which priorities exchange data; each has one writer.
 *   slot[generation & 1] is complete, the writer fills the other one and then advances generation. The box of the
 *   samples has more slots: it is the history that the scope captures from.
 *   From task to ISR, the writer cannot interrupt the reader: one read is enough.
 *   From fast ISR to task, it can: the task copies all it needs, and repeats the copy if a period has interrupted it.
 *   Who needs nothing but one sample reads it in place, because its slot is written again only 64 periods later.
 *   The paper's identification has a box of its own for its gains (drive/mrai); it reads points in that of the samples.
 * Source   docs/architecture.md, shared data; one core, the writer always completes before a lower priority resumes
 * Units    per unit of motor.bases; angles in turns times 2^32
 * Range    a generation wraps after 2^32 periods or steps; only differences and remainders are used
 * Errors   none
 * Context  stated per box */
#include <stdbool.h>
#include <stdint.h>

#include "control/current/current_control.h"
#include "control/identify/window.h"
#include "fx/codegen.h"
#include "types/frames.h"
#include "types/operating_point.h"
#include "types/samples.h"

/** One period as the fast ISR measured it. Writer: fast ISR. Readers: 1 kHz task, MRAI interrupt. */
typedef struct {
    operating_point_t point;
    uint32_t theta_e;     /* of the samples, 2^32 = one turn */
    fx_pair_t i_ab;       /* alpha, beta */
    int32_t zero_q28;     /* mean of the phases */
    int32_t v_dc;         /* q15 */
    uint32_t theta_m;     /* mechanical, after correction of the sensor's known error */
    bool acting;          /* the bridge switched throughout the last period and is switching now */
    bool voltage_limited; /* the voltage circle limited the voltage; clamped pulses do not count */
    bool pulses_clamped;  /* the bridge cannot make these pulses: the acting voltage is less well known */
    FX_PADDING_FLAG;
    FX_PADDING_WORD;
} sample_t;

FX_WORD_OF_FLAGS(sample_t, acting);
FX_POWER_OF_TWO_SIZE(sample_t);

/** Number of periods that remain readable: a power of two, and at least those of one step of the task plus those before
 * a fault that the scope's freeze frame needs. */
#define SAMPLE_SLOTS 64U

typedef struct {
    volatile uint32_t generation; /* slot[generation % SAMPLE_SLOTS] is complete */
    sample_t slot[SAMPLE_SLOTS];
} sample_box_t;

/** One window of the robust identification. Writer: fast ISR. Reader: 1 kHz task. */
typedef struct {
    identify_window_t slot[2];
    volatile uint32_t generation;
} window_box_t;

/** Safe state: decided by the task before a fault occurs, applied by the fast ISR in the period of the fault. */
typedef enum {
    SAFE_FREEWHEEL = 0,             /* switching disabled */
    SAFE_SHORT_ON_OVER_VOLTAGE = 1, /* short circuit if the fault is an over-voltage, else disabled */
    SAFE_SHORT_ON_GATE_FAULT = 2,   /* short circuit if it is a gate-driver fault, else disabled */
    SAFE_SHORT_ON_EITHER = 3,       /* short circuit if it is one of the two, else disabled */
    SAFE_SHORT_CIRCUIT = 4          /* short circuit */
} safe_t;

/** What the bridge does: command_t.run. */
enum {
    BRIDGE_OFF = 0,     /* switching is disabled */
    BRIDGE_CONTROL = 1, /* current control */
    BRIDGE_PULSES = 2,  /* voltage pulses: an even number, for which fast_isr() leaves the usual route */
    BRIDGE_MOVED = 4,   /* current control in the frame of a movement (drive/movement.h): even, too */
    BRIDGE_MOVED_PULSES = BRIDGE_MOVED | BRIDGE_PULSES
};

/** Command of the task to the fast ISR. Writer: 1 kHz task. Reader: fast ISR. */
typedef struct {
    current_target_t target;
    uint8_t run; /* BRIDGE_... */
    safe_t safe;
    bool upper;            /* the short circuit is made by the upper switches */
    uint32_t faults;       /* found by the task; latched by the fast ISR, which alone writes the fault word */
    uint32_t fault_resets; /* counts up: the fast ISR clears its faults once for each count */
} command_t;

FX_POWER_OF_TWO_SIZE(command_t);

typedef struct {
    command_t slot[2];
    volatile uint32_t generation;
} command_box_t;

/* Prevents the compiler from moving the stores to the slot behind the store to the generation. */
static inline void exchange_barrier(void)
{
    fx_compiler_barrier();
}

/* The slot that sample_box_publish() will complete. */
static inline sample_t *sample_box_begin(sample_box_t *box)
{
    sample_t *slot = &box->slot[(box->generation + 1U) % SAMPLE_SLOTS];
    FX_ADDRESS_ONCE(slot);
    return slot;
}

/* The number of this sample: periods since the start. */
static inline uint32_t sample_box_publish(sample_box_t *box)
{
    exchange_barrier();
    const uint32_t generation = box->generation + 1U;
    box->generation = generation;
    return generation;
}

/* In place. A reader that combines it with other data of the same period must copy all of them and then compare the
 * generation again. */
static inline const sample_t *sample_box_at(const sample_box_t *box, uint32_t generation)
{
    return &box->slot[generation % SAMPLE_SLOTS];
}

/* In place: the fast ISR needs SAMPLE_SLOTS - 1 periods to come back to this slot, far longer than reading it takes. A
 * second call may return a later sample. */
static inline const sample_t *sample_box_last(const sample_box_t *box)
{
    return sample_box_at(box, box->generation);
}

static inline void window_box_write(window_box_t *box, const identify_window_t *window)
{
    box->slot[(box->generation + 1U) & 1U] = *window;
    exchange_barrier();
    box->generation = box->generation + 1U;
}

/* In place: the slot is written again two windows later. The snapshot copies it together with the sample and repeats
 * both if a period came in between. */
static inline const identify_window_t *window_box_at(const window_box_t *box)
{
    return &box->slot[box->generation & 1U];
}

static inline void command_box_write(command_box_t *box, command_t command)
{
    box->slot[(box->generation + 1U) & 1U] = command;
    exchange_barrier();
    box->generation = box->generation + 1U;
}

static inline const command_t *command_box_read(const command_box_t *box)
{
    const command_t *slot = &box->slot[box->generation & 1U];
    FX_ADDRESS_ONCE(slot);
    return slot;
}

#endif
