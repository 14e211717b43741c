/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/mps2/script.h"

#include "fx/trig.h"

#define POLE_PAIRS 3U
#define STEP_FIRST 17600000U /* of 2^32 per period: 41 turns a second */
#define STEP_GROWTH 11700U
#define ENABLE_AT 20U
#define LEVEL_PERIODS 500U

/* 0 ... height and back, once in 2 * length periods. */
static int32_t triangle(uint32_t period, uint32_t length, int32_t height)
{
    const uint32_t at = period % (2U * length);
    const uint32_t up = (at < length) ? at : 2U * length - at;
    return (int32_t)up * height / (int32_t)length;
}

void script_next(script_t *script)
{
    script->period++;
    script->angle += STEP_FIRST + STEP_GROWTH * script->period;
}

adc_counts_t script_adc(const script_t *script)
{
    const fx_sincos_t at = fx_sincos((uint16_t)(script->angle * POLE_PAIRS >> 16));
    const int32_t d = -triangle(script->period, 700, 300); /* counts of a 12-bit converter */
    const int32_t q = triangle(script->period, 450, 900) - 450;
    const int32_t alpha = (d * at.cos - q * at.sin) / 32768;
    const int32_t side = (d * at.sin + q * at.cos) / 32768 * 887 / 1024; /* sqrt(3)/2 */
    const int32_t b = side - alpha / 2;
    return (adc_counts_t){
        .i_a = (uint16_t)(2048 + alpha),
        .i_b = (uint16_t)(2048 + b),
        .i_c = (uint16_t)(2048 - alpha - b),
        .v_dc = (uint16_t)(2600 + triangle(script->period, 900, 260)),
    };
}

void script_request(const script_t *script, request_t *request)
{
    static const int16_t level[4] = {4000, -9000, 13000, -2500};
    request->enable = script->period >= ENABLE_AT;
    request->torque_arbitrated = level[(script->period / LEVEL_PERIODS) % 4U];
}

static void add(script_t *script, uint32_t value)
{
    script->low += value;
    script->high += script->low;
}

void script_note(script_t *script, duty_t duty, bool gates)
{
    add(script, duty.a);
    add(script, duty.b);
    add(script, duty.c);
    add(script, gates ? 1U : 0U);
    script->differing += (duty.a != script->last) ? 1U : 0U;
    script->last = duty.a;
}
