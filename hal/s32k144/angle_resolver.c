/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/angle.h"

#include "fx/codegen.h"
#include "fx/q.h"
#include "hal/s32k144/ad2s1210.h"
#include "hal/s32k144/angle.h"
#include "hal/s32k144/pins.h"
#include "hal/s32k144/pwm.h"
#include "hal/s32k144/registers.h"
#include "hal/s32k144/serial_angle.h"

#define VELOCITY_TURNS_PER_S (500.0F / 32768.0F) /* of one bit: resolution of 14 bits, 8.192 MHz */
#define READY_TICKS 85U /* 0.759 us after SAMPLE falls: 6 periods of 8.192 MHz and 20 ns */
#define ONE_MISSING (1U << AD2S1210_BITS)
#define MISSING_MAX (3U * ONE_MISSING) /* a restart of the sampling may lose two */
#define ANY_WORD 0U     /* sent with each frame: the converter has no data input in normal mode */
#define FRAME(bits) (LPSPI_TCR_FRAMESZ((bits) - 1U) | LPSPI_TCR_CPHA | LPSPI_TCR_PRESCALE(0))

static const serial_angle_timing_t timing = {.bit = 2, .select = 4, .gap = 5}; /* 14 MHz, 143 ns */
/* The last frame, whose angle is kept while frames are missing. Its uppermost byte, which no frame uses, counts these
 * periods; with the last of them all bits of the fault register are set. The usual period writes and tests one word. */
static uint32_t position;

/* The converter keeps every fault, including those of its own power-up, until its register has been read in
 * configuration mode between two falling edges of SAMPLE; the second edge comes with the first PWM period. A fault that
 * persists appears in the first frames. */
static void clear_faults(void)
{
    pwm_sample_by_hand();
    PTC->PSOR = (1U << PIN_RESOLVER_A0) | (1U << PIN_RESOLVER_A1);
    LPSPI0->TCR = FRAME(AD2S1210_REGISTER_BITS);
    (void)serial_angle_exchange(AD2S1210_FAULT_REGISTER); /* its address, then its content */
    (void)serial_angle_exchange(AD2S1210_FAULT_REGISTER);
}

/* The position that SAMPLE has latched at the start of the period is sent as soon as the converter has it ready. */
void angle_init(uint32_t period_ticks)
{
    (void)period_ticks;
    serial_angle_init(&timing);
    clear_faults();
    PTC->PCOR = (1U << PIN_RESOLVER_A0) | (1U << PIN_RESOLVER_A1); /* normal mode, position */
    serial_angle_start(&(serial_angle_t){.command = FRAME(AD2S1210_BITS), .word = ANY_WORD, .start = READY_TICKS});
}

/* The velocity that the converter has measured: a reset of the processor does not affect it. */
float angle_first_speed(void)
{
    serial_angle_init(&timing);
    PTC->PSOR = 1U << PIN_RESOLVER_A1;
    LPSPI0->TCR = FRAME(AD2S1210_BITS);
    pwm_sample_by_hand();
    const ad2s1210_frame_t frame = ad2s1210_decode(serial_angle_exchange(0));
    return (frame.fault != 0U) ? -1.0F : (float)fx_abs_q31((int16_t)frame.value) * VELOCITY_TURNS_PER_S;
}

/* Not inlined: with one access to the last frame in each of two branches its address would be kept on the stack until
 * angle_fault(), by two instructions in every period. */
static FX_NOT_INLINED FX_COLD uint32_t without_frame(void)
{
    const uint32_t frame = position + ONE_MISSING;
    return frame | ((frame >= MISSING_MAX) ? AD2S1210_FAULTS : 0U); /* stays when the count overflows */
}

uint32_t hal_angle_read(void)
{
    uint32_t frame;
    if (serial_angle_read(ANY_WORD, &frame) == 0U) {
        frame = without_frame();
    }
    position = frame;
    return (uint32_t)ad2s1210_decode(frame).value << 16;
}

bool hal_angle_is_absolute(void)
{
    return true;
}

uint32_t angle_follow_index(void)
{
    return 0;
}

bool angle_fault(void)
{
    return ad2s1210_decode(position).fault != 0U;
}
