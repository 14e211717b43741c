/* SPDX-License-Identifier: Apache-2.0 */
/* Blocks that know no motor: the functions of firmware/signal. */
#include "proof.h"

#include "signal/counter.h"
#include "signal/debounce.h"
#include "signal/rate_limit.h"
#include "signal/step_clock.h"

void proof_counter_saturates(void)
{
    uint32_t count, max;
    PROVE(count_up_to(count, max) <= max);
    PROVE(count >= max || count_up_to(count, max) == count + 1U);
    uint16_t events;
    const uint16_t before = events;
    count_up(&events);
    PROVE(events >= before && (events == before + 1 || events == UINT16_MAX));
}

void proof_debounce(void)
{
    uint8_t count, samples;
    uint32_t flag;
    const bool condition = nondet_bool();
    ASSUME(samples >= 1U && flag != 0U);
    const uint8_t before = count;
    const uint32_t reported = debounce_step(&count, condition, samples, flag);
    PROVE(reported == 0U || reported == flag);
    PROVE((reported != 0U) == (condition && before + 1 >= samples));
    PROVE(condition || count == 0U);
    PROVE(count <= samples);
}

void proof_rate_limit(void)
{
    q15_t last, target, rate;
    ASSUME(rate >= 0);
    const int32_t y = rate_limit_step(last, target, rate);
    PROVE((y >= last && y <= target) || (y <= last && y >= target));
    PROVE(rate == Q15_MAX || magnitude(y - last) <= rate);
    PROVE(rate != Q15_MAX || y == target);
    PROVE(magnitude((int32_t)target - last) > rate || y == target);
}

void proof_step_clock(void)
{
    uint32_t step_ns;
    step_clock_t clock;
    step_clock_start(&clock, step_ns);
    const uint32_t used_ns = (step_ns >= 800000U && step_ns <= 1250000U) ? step_ns : 1000000U;
    PROVE(clock.step_us * 1000U + clock.step_ns == used_ns && clock.step_ns < 1000U);
    uint32_t rest_us, rest_ns, ms;
    ASSUME(rest_us < 1000U && rest_ns < 1000U);
    clock.rest_us = rest_us;
    clock.rest_ns = rest_ns;
    clock.ms = ms;
    step_clock_step(&clock);
    PROVE(clock.rest_us < 1000U && clock.rest_ns < 1000U && clock.passed_ms <= 2U);
    PROVE(clock.ms == ms + clock.passed_ms);
    PROVE(clock.elapsed_us * 1000U + clock.rest_ns == used_ns + rest_ns);
    PROVE(clock.passed_ms * 1000U + clock.rest_us == clock.elapsed_us + rest_us);
}
