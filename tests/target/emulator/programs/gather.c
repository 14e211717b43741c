/* SPDX-License-Identifier: Apache-2.0 */
/* Calls the driver hal/s32k144/gather.c, which is compiled with this program, as the test's script says. Each time the
 * test changes `asked`, the program makes the calls, starts the copy and waits until the driver is idle. */
#include "hal/gather.h"

#include "bare.h"

/* STEPS: a set-up, two moves of all columns, two parts and END. */
enum { END = 0, SET_UP = 1, MOVE = 2, ADD = 3, STEPS = 24 };

#define DEMCR REG(0xE000EDFCU)
#define DWT_CTRL REG(0xE0001000U)
#define DWT_CYCCNT REG(0xE0001004U)

typedef struct {
    uint32_t call, a, b, c;
} step_t;

volatile step_t script[STEPS];
uint32_t stride[HAL_GATHER_COLUMNS];
volatile uint32_t asked, started, ended; /* the same while the program waits for the test */
volatile uint32_t idle_before, idle_after_set_up, idle_after_start;
volatile uint32_t cycles; /* from before the start until the driver was idle */

extern uint32_t __bss_start__[], __bss_end__[];

void reset(void);
__attribute__((section(".vectors"), used)) const vector_t vectors[16] = {(vector_t)STACK_TOP, reset};

static void set_up(uint32_t columns, uint32_t row_size)
{
    hal_gather_set_up(columns, stride, row_size);
    idle_after_set_up = hal_gather_is_idle();
}

/* The number of parts. */
static uint32_t follow_script(void)
{
    uint32_t parts = 0;
    for (const volatile step_t *step = script; step->call != END; step++) {
        if (step->call == SET_UP) {
            set_up(step->a, step->b);
        } else if (step->call == MOVE) {
            hal_gather_move(step->a, (const void *)step->b, (int16_t *)step->c);
        } else {
            hal_gather_add(step->a, step->b != 0U);
            parts++;
        }
    }
    return parts;
}

static void copy(uint32_t parts)
{
    const uint32_t before = DWT_CYCCNT;
    hal_gather_start(parts);
    idle_after_start = hal_gather_is_idle();
    started = asked;
    while (!hal_gather_is_idle()) {
    }
    cycles = DWT_CYCCNT - before;
}

__attribute__((used)) void reset(void)
{
    watchdog_off();
    for (volatile uint32_t *word = __bss_start__; word < __bss_end__; word++) {
        *word = 0;
    }
    DEMCR = 1U << 24;
    DWT_CTRL = 1;
    for (;;) {
        while (asked == ended) {
        }
        idle_before = idle_after_set_up = hal_gather_is_idle();
        copy(follow_script());
        ended = asked;
    }
}
