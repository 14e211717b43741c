/* SPDX-License-Identifier: Apache-2.0 */
/* The excitation of a resolver: the output of FTM0's channel 6 through the board's filter, of second order and at its
 * resonance at 10 kHz, to the windings. Between two edges of the output its solution is exact. A square wave of that
 * frequency and half of the period high gives a peak of 1, a quarter of a period later than the middle of the pulse.
 *
 * documented behaviour                               | modelled | test
 * -------------------------------------------------- | -------- | ---------------------------------------------
 * channel 6: high from C6V to C7V (combined)         | yes      | test_the_windings_image_passes_each_check
 * channel 6 forced by SWOCTRL                        | yes      | test_the_windings_image_passes_each_check
 * settling, lag and amplitude of the filter          | yes      | test_a_planted_error_of_the_windings_is_found
 * voltage induced by the rotor's speed               | no       | -
 * other resonances, saturation, temperature          | no       | -
 */
#include <math.h>

#include "emu_private.h"

enum { SC = 0x00, SWOCTRL = 0x94, CHANNEL_6 = 1 << 6, HIGH_6 = 1 << 14, PWMEN6 = 1 << 22 };
#define RESONANCE_RAD_PER_TICK (6.283185307179586 * 10e3 / (double)EMU_TICKS_PER_S)
#define QUALITY 2.0
#define PEAK (4.0 / 3.141592653589793 * QUALITY) /* of the fundamental of a square wave of 1 at resonance */

static uint64_t edge(const emu_t *emu, int channel)
{
    const ftm_t *f = &emu->s.ftm[0];
    return f->start + (uint64_t)f->cv[channel] * emu->s.core_ticks;
}

static bool level(const emu_t *emu, uint64_t when)
{
    const windings_t *w = &emu->s.windings;
    if ((w->forced & CHANNEL_6) != 0U) {
        return (w->forced & HIGH_6) != 0U;
    }
    return w->enabled && emu->s.ftm[0].running && when >= edge(emu, 6) && when < edge(emu, 7);
}

/* x'' + x'/Q + x = +-1/PEAK, time in radians of the resonance. */
static void pass(windings_t *w, bool high, uint64_t ticks)
{
    const double t = (double)ticks * RESONANCE_RAD_PER_TICK, input = (high ? 1.0 : -1.0) / PEAK;
    const double damping = 0.5 / QUALITY, damped = sqrt(1.0 - damping * damping);
    const double from = w->value - input, cross = (w->slope + damping * from) / damped;
    const double decay = exp(-damping * t), c = cos(damped * t), s = sin(damped * t);
    w->value = input + decay * (from * c + cross * s);
    w->slope = decay * ((damped * cross - damping * from) * c - (damped * from + damping * cross) * s);
}

void windings_follow(emu_t *emu, uint64_t when)
{
    windings_t *w = &emu->s.windings;
    while (emu->excited && w->at < when) {
        uint64_t next = when;
        for (int channel = 6; channel <= 7; channel++) {
            next = edge(emu, channel) > w->at && edge(emu, channel) < next ? edge(emu, channel) : next;
        }
        pass(w, level(emu, w->at), next - w->at);
        w->at = next;
    }
}

void windings_changed(emu_t *emu)
{
    const peripheral_t *timer = PERIPHERAL(FTM0);
    emu->s.windings.forced = bus_get(emu, timer, SWOCTRL);
    emu->s.windings.enabled = (bus_get(emu, timer, SC) & PWMEN6) != 0U;
}
