/* SPDX-License-Identifier: Apache-2.0 */
/* An analogue angle sensor at ADC0_SE3 (sine) and ADC1_SE5 (cosine), of an image that was built for it; for a resolver
 * both are multiplied by the excitation (windings.c). A voltage is the one at the instant at which the converter has
 * sampled it, while the shaft turns on within the period. Its errors are settable: offset, amplitude and noise of each
 * track, a track that stays at one voltage, and the excitation's amplitude.
 *
 * documented behaviour                               | modelled | test
 * -------------------------------------------------- | -------- | --------------------------------------------
 * sine and cosine about the middle of the reference  | yes      | test_the_sincos_image_passes_each_check
 * sampled within the conversion, after SMPLTS clocks | yes      | test_a_planted_error_of_the_sincos_is_found
 * offset, amplitude, noise                           | yes      | test_the_sincos_image_passes_each_check
 * open or shorted wire: a track at one voltage       | yes      | test_the_sincos_image_passes_each_check
 * delay of the sensor and of the inputs' filters     | no       | -
 * angle between the tracks, harmonics                | no       | -
 */
#include <math.h>
#include <string.h>

#include "emu_private.h"

#define TURN_RAD 6.283185307179586
enum { COUNTS = 4096, SINE_INPUT = 3, COSINE_INPUT = 5 };
#define NOMINAL_COUNTS 1638.0 /* 2 V of 5 V, about the middle */

void analogue_power_on(emu_t *emu)
{
    emu->s.analogue = (analogue_t){.track = {{.amplitude = 1.0}, {.amplitude = 1.0}}, .excitation = 1.0, .random = 1};
}

bool analogue_is_at(const emu_t *emu, int instance, uint32_t input)
{
    return emu->analogue && input == (instance == 0 ? SINE_INPUT : COSINE_INPUT);
}

/* Between -1 and 1, a linear congruential generator. */
static double random_share(analogue_t *sensor)
{
    sensor->random = sensor->random * 1664525U + 1013904223U;
    return (double)sensor->random / 2147483648.0 - 1.0;
}

static double excitation(emu_t *emu, uint64_t when)
{
    if (!emu->excited) {
        return 1.0;
    }
    windings_follow(emu, when);
    return emu->s.analogue.excitation * emu->s.windings.value;
}

uint16_t analogue_count(emu_t *emu, int instance, uint64_t when)
{
    analogue_t *sensor = &emu->s.analogue;
    const track_t *track = &sensor->track[instance];
    const double angle = (double)emu_angle_at(emu, when) / 4294967296.0 * TURN_RAD;
    const double wave = (instance == 0 ? sin(angle) : cos(angle)) * excitation(emu, when);
    const double held[] = {0.0, 0.0, COUNTS, COUNTS / 2.0}; /* by fault */
    const double noise = track->noise != 0.0 ? track->noise * random_share(sensor) : 0.0;
    const double volts = track->fault != 0.0 ? held[(int)track->fault]
                                             : COUNTS / 2.0 + track->offset + NOMINAL_COUNTS * track->amplitude * wave;
    return (uint16_t)fmin(fmax(floor(volts + noise + 0.5), 0.0), COUNTS - 1.0);
}

static const struct {
    const char *name;
    size_t at;
    double least, greatest;
} quantities[] = {
    {"offset", offsetof(track_t, offset), -COUNTS, COUNTS},
    {"amplitude", offsetof(track_t, amplitude), 0.0, 2.0},
    {"noise", offsetof(track_t, noise), 0.0, COUNTS},
    {"fault", offsetof(track_t, fault), 0.0, 3.0},
};

static double *find(emu_t *emu, const char *name, size_t *which)
{
    const char *tracks[] = {"sine_", "cosine_"};
    for (size_t t = 0; t < 2U; t++) {
        const size_t length = strlen(tracks[t]);
        for (*which = 0; *which < sizeof quantities / sizeof quantities[0]; (*which)++) {
            if (strncmp(name, tracks[t], length) == 0 && strcmp(name + length, quantities[*which].name) == 0) {
                return (double *)(void *)((char *)&emu->s.analogue.track[t] + quantities[*which].at);
            }
        }
    }
    return NULL;
}

emu_setting_t emu_analogue_set(emu_t *emu, const char *name, double value)
{
    size_t which = 0;
    if (strcmp(name, "excitation") == 0) {
        emu->s.analogue.excitation = value >= 0.0 && value <= 2.0 ? value : emu->s.analogue.excitation;
        return value >= 0.0 && value <= 2.0 ? EMU_SETTING_TAKEN : EMU_SETTING_OUT_OF_RANGE;
    }
    double *quantity = find(emu, name, &which);
    if (quantity == NULL) {
        return EMU_SETTING_UNKNOWN;
    }
    if (!(value >= quantities[which].least && value <= quantities[which].greatest)) {
        return EMU_SETTING_OUT_OF_RANGE;
    }
    *quantity = value;
    return EMU_SETTING_TAKEN;
}
