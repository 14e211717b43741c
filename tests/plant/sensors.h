/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PLANT_SENSORS_H
#define PLANT_SENSORS_H
/** Current, dc-voltage and angle sensors with their converters.
 *   current: gain, offset, noise, saturation at the full scale, quantisation
 *   angle:   delay, offset, first and second harmonic per resolver turn, spikes, quantisation
 * Source   docs/theory/plant.md (PL-17) ... (PL-19)
 * Units    A, V, rad; counts as a converter with mid-scale zero gives them
 * Rounding half up to the nearest code
 * Context  simulation only */
#include "plant.h"
#include "random.h"

typedef struct {
    random_t rng;
    double current_A[3]; /* last delivered, for a stuck sensor */
    int32_t current_count[3];
    double theta_m_rad;
    int32_t theta_count;
    int spike_sample; /* in its sequence of angle_spike_every */
} sensors_t;

void sensors_create(sensors_t *s, const plant_params_t *p);

void sensors_sample(sensors_t *s, const plant_params_t *p, const plant_truth_t *truth, plant_sensors_t *out);

#endif
