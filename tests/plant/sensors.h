/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PLANT_SENSORS_H
#define PLANT_SENSORS_H
/** Current, dc-voltage and angle sensors with their converters.
 *   current: gain, offset, noise, saturation at the full scale, quantisation
 *   both:    converter reference, which also changes what is read of a known voltage
 *   angle:   delay, offset, first and second harmonic per resolver turn, spikes, a stuck track, quantisation
 * Source   docs/theory/plant.md (PL-17) ... (PL-19), (PL-32) ... (PL-34)
 * Units    A, V, rad; counts of a converter whose mid-scale is zero current
 * Rounding half up to the nearest code
 * Context  simulation only */
#include <stdbool.h>

#include "plant.h"
#include "random.h"

typedef struct {
    random_t rng;
    double current_A[3]; /* last output, repeated by a stuck sensor */
    int32_t current_count[3];
    double sine_rad, cosine_rad;     /* angle of the resolver whose sine, cosine its tracks show */
    double point_sine, point_cosine; /* of both tracks, with which later samples are compared, (PL-34) */
    bool point_confirmed;
    int wrong_samples; /* in a row, up to those of a failure */
    double theta_m_rad;
    int32_t theta_count;
    int spike_sample; /* index of the next sample in a sequence of angle_spike_every */
} sensors_t;

void sensors_create(sensors_t *s, const plant_params_t *p);

void sensors_sample(sensors_t *s, const plant_params_t *p, const plant_truth_t *truth, plant_sensors_t *out);

#endif
