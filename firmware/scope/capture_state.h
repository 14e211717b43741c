/* SPDX-License-Identifier: Apache-2.0 */
#ifndef SCOPE_CAPTURE_STATE_H
#define SCOPE_CAPTURE_STATE_H
/** What is to be captured, how far a capture is, and what it is taken from.
 * Source   docs/howto/scope.md
 * Units    raw half words, scope/signal_list.h
 * Range    capture_config_is_valid()
 * Errors   none: values only
 * Context  1 kHz task; the first part of capture_t is read by tools */
#include <stdbool.h>
#include <stdint.h>

#include "drive/exchange.h"
#include "scope/signal_list.h"

#define CAPTURE_SIGNALS_MAX 8U
#define CAPTURE_MEMORY 6144U /* half words */

#define CAPTURE_ENUM(name, base, place, text) CAPTURE_##name,
typedef enum { SCOPE_SIGNAL_LIST(CAPTURE_ENUM) CAPTURE_SIGNALS } capture_signal_t;

/** Values of the 1 kHz task, as they were commanded for the periods that are copied next. */
typedef struct {
    int16_t i_d_ref, i_q_ref;
    int16_t torque_commanded, torque_corrected, torque_estimated;
    int16_t psi_error;
} scope_step_values_t;

typedef enum {
    CAPTURE_IDLE = 0,
    CAPTURE_ARMED = 1,     /* records and waits for the trigger */
    CAPTURE_TRIGGERED = 2, /* records the samples after it */
    CAPTURE_DONE = 3       /* complete, until it is released */
} capture_state_t;

typedef enum {
    TRIGGER_MANUAL = 0, /* by command only */
    TRIGGER_FAULT = 1,  /* the first fault */
    TRIGGER_RISING = 2, /* the signal was below the level and is not any more */
    TRIGGER_FALLING = 3,
    TRIGGER_ABOVE = 4, /* the signal is at or above the level */
    TRIGGER_BELOW = 5,
    TRIGGERS = 6
} capture_trigger_t;

/** What a step has to do. A single changed bit makes none of them another one. */
typedef enum {
    CAPTURE_RECORDS_NOT = 0,
    CAPTURE_RECORDS = 3, /* armed or triggered */
    CAPTURE_ENDS = 12    /* triggered; the hardware copies the last samples */
} capture_recording_t;

/** What an armed capture waits for in its next samples. */
typedef enum {
    SEARCH_PERIODS = 0, /* nothing but a level, or one side of it before an edge, in the samples of every period */
    SEARCH_SAMPLES = 1, /* the same with a divisor */
    SEARCH_STEP = 2,    /* the same in a value of the step */
    SEARCH_ANY = 3,
    SEARCH_LATER = 4, /* nothing before enough samples lie before the trigger */
    SEARCH_NOT = 5    /* a command or a fault */
} capture_search_t;

#define GATHER_CLOSED 0xFFU

/** How far the port's hardware that copies (hal/gather.h) is prepared. A single changed bit makes none of them another
 * one; any other value is as the first. */
typedef enum {
    GATHER_NEVER = 0,      /* not in this capture: it failed, or a step may write the small memory twice */
    GATHER_NOT_SET_UP = 3, /* for this capture */
    GATHER_SET_UP = 5,
    GATHER_CONTINUES = 6 /* where the next sample lies */
} capture_gather_t;

typedef struct {
    uint8_t signals;                     /* 1 ... 8 */
    uint8_t signal[CAPTURE_SIGNALS_MAX]; /* capture_signal_t */
    uint8_t trigger;                     /* capture_trigger_t; a command triggers in addition to all of them */
    uint8_t trigger_signal;              /* need not be one of the captured */
    uint16_t divisor;                    /* periods from one sample to the next, from 1 */
    uint16_t samples;                    /* of each signal */
    uint16_t before;                     /* how many of them lie before the trigger: fewer than samples */
    int16_t level;                       /* raw, in the scale of the trigger's signal */
} capture_config_t;

typedef struct {
    capture_config_t config;
    uint8_t state;   /* capture_state_t */
    uint8_t frozen;  /* 1: a freeze frame around a fault, not what a tool has armed */
    uint16_t number; /* counts the captures; a tool compares it before and after it reads */
    uint16_t first;  /* row of the oldest sample */
    uint16_t before; /* samples before the trigger, fewer than wanted if it came early */
    uint16_t taken;  /* samples in all, valid when done */
    uint16_t lost;
    uint32_t trigger_period; /* number of the PWM period of the trigger, since the start */
    /* Not read by tools. */
    scope_step_values_t values; /* of the command before the last: those of the periods that are being copied */
    scope_step_values_t coming; /* of the last command: those of the periods copied next */
    uint32_t next;              /* period of the next sample */
    uint32_t asked_for;         /* period in which a command or a fault triggers */
    int32_t awaited_offset;     /* the search ends where sign * value + offset >= 0 */
    uint16_t at;                /* row of the next sample; `samples`: the first */
    uint16_t run;               /* samples from it on that lie side by side in the ring and in the memory; 0: unknown */
    uint16_t filled;            /* samples since the arming, counted until enough lie before the trigger */
    uint16_t remaining;         /* samples until the end */
    uint8_t trigger_place;      /* of the trigger's signal: of the step from sizeof(sample_t) on */
    int8_t awaited_sign;        /* 1, or -1: downwards */
    bool uses_step;             /* one of the signals, or the trigger's, is a value of the step */
    uint8_t recording;          /* capture_recording_t */
    uint8_t gather;             /* capture_gather_t */
    uint8_t parts;              /* that the hardware has taken in this step; GATHER_CLOSED: it takes none */
    bool asked;
    uint8_t search; /* capture_search_t */
    bool ready;     /* reaching the level triggers: before an edge, the signal has been on the other side of it */
} capture_t;

#endif
