/* SPDX-License-Identifier: Apache-2.0 */
#include "sensors.h"

#include "clamp.h"
#include "mechanics.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#define KNOWN_SHARE_MAX 5.0 /* a volt, where the reference is five */
#define TWO_PI 6.28318530717958647693
#define LENGTH_LEAST 0.79
#define LENGTH_GREATEST 1.21
#define TRACK_STILL (8.0 / 1638.0)
#define LENGTH_CHANGE_SHARE 0.17
#define LENGTH_CHANGE 0.03
#define POINT_FOLLOW (1.0 / 64.0 / 16384.0) /* in a sample */
#define WRONG_SAMPLES_OF_A_FAILURE 3

void sensors_create(sensors_t *s, const plant_params_t *p)
{
    memset(s, 0, sizeof *s);
    random_seed(&s->rng, p->seed);
    for (int x = 0; x < 3; x++) {
        s->current_count[x] = (int32_t)1 << (p->adc_bits - 1);
    }
    s->theta_m_rad = wrap_angle(p->theta_m_rad);
}

/* (PL-17): the top code is one step below the full scale, as in a converter. Mid scale is half of the reference, to
 * which the sensors refer, too. */
static void sample_current(sensors_t *s, const plant_params_t *p, int x, double i_A)
{
    const double mid = ldexp(1.0, p->adc_bits - 1), step = p->current_full_scale_A / mid;
    const double noise = random_normal(&s->rng) * p->current_noise_A_rms;
    double code = (i_A * p->current_gain[x] + p->current_offset_A[x] + noise) / step / p->converter_reference;
    if (p->current_open[x]) {
        code = -mid;
    }
    code = clamp(code, -mid, mid - 1.0);
    const double whole = floor(code + 0.5);
    if (!p->current_stuck[x]) {
        s->current_A[x] = (p->current_quantise ? whole : code) * step;
        s->current_count[x] = (int32_t)(whole + mid);
    }
}

static void sample_vdc(const plant_params_t *p, double vdc_V, plant_sensors_t *out)
{
    const double codes = ldexp(1.0, p->adc_bits), step = p->vdc_full_scale_V / codes;
    const double shown_V = vdc_V * p->vdc_gain + p->vdc_offset_V;
    const double code = clamp(shown_V / step / p->converter_reference, 0.0, codes - 1.0);
    const double whole = floor(code + 0.5);
    out->vdc_V = (p->vdc_quantise ? whole : code) * step;
    out->vdc_count = (int32_t)whole;
}

/* The error of the first samples of each sequence, 0 for the others. */
static double angle_spike(sensors_t *s, const plant_params_t *p)
{
    if (p->angle_spike_every == 0) {
        s->spike_sample = 0;
        return 0.0;
    }
    const int sample = s->spike_sample;
    s->spike_sample = (sample + 1) % p->angle_spike_every;
    return (sample < p->angle_spike_samples) ? p->angle_spike_rad : 0.0;
}

static double approached(double from, double to)
{
    return from + clamp(to - from, -POINT_FOLLOW, POINT_FOLLOW);
}

static void take_point(sensors_t *s, double sine, double cosine)
{
    s->point_sine = sine;
    s->point_cosine = cosine;
    s->point_confirmed = false;
}

/* (PL-34): whether one track stays although the other one moves. */
static bool does_one_track_stay(sensors_t *s, double sine, double cosine)
{
    const double of_sine = fabs(sine - s->point_sine), of_cosine = fabs(cosine - s->point_cosine);
    const double change =
        fabs(sine * sine + cosine * cosine - s->point_sine * s->point_sine - s->point_cosine * s->point_cosine);
    if (fmin(of_sine, of_cosine) > TRACK_STILL || (!s->point_confirmed && change > 0.5 * LENGTH_CHANGE)) {
        take_point(s, sine, cosine);
        return false;
    }
    s->point_confirmed = true;
    if (change > LENGTH_CHANGE_SHARE * fmax(of_sine, of_cosine) + LENGTH_CHANGE) {
        return true;
    }
    s->point_sine = approached(s->point_sine, sine);
    s->point_cosine = approached(s->point_cosine, cosine);
    return false;
}

/* (PL-33), (PL-34): whether the converter of both tracks has failed. */
static bool is_failure(sensors_t *s, double sine, double cosine)
{
    const double length = hypot(sine, cosine);
    const bool is_wrong = length < LENGTH_LEAST || length > LENGTH_GREATEST || does_one_track_stay(s, sine, cosine);
    s->wrong_samples = is_wrong ? s->wrong_samples + (s->wrong_samples < WRONG_SAMPLES_OF_A_FAILURE) : 0;
    return s->wrong_samples >= WRONG_SAMPLES_OF_A_FAILURE;
}

/* (PL-32): the angle that the tracks of the resolver show, in the turn of the resolver in which it truly is. */
static double from_tracks(sensors_t *s, const plant_params_t *p, double theta_rad)
{
    const double resolver_rad = p->resolver_pole_pairs * theta_rad;
    s->sine_rad = p->angle_sine_stuck ? s->sine_rad : resolver_rad;
    s->cosine_rad = p->angle_cosine_stuck ? s->cosine_rad : resolver_rad;
    const double sine = sin(s->sine_rad), cosine = cos(s->cosine_rad);
    if (p->angle_length_check && is_failure(s, sine, cosine)) {
        return NAN;
    }
    if (!p->angle_sine_stuck && !p->angle_cosine_stuck) {
        return theta_rad;
    }
    return theta_rad + remainder(atan2(sine, cosine) - resolver_rad, TWO_PI) / p->resolver_pole_pairs;
}

/* (PL-18), (PL-19) */
static void sample_angle(sensors_t *s, const plant_params_t *p, const plant_truth_t *truth)
{
    const double theta = truth->theta_m_rad - truth->speed_rad_s * p->angle_delay_s;
    const double resolver_rad = p->resolver_pole_pairs * theta, sign = p->angle_reversed ? -1.0 : 1.0;
    double error = p->angle_offset_rad + angle_spike(s, p);
    if (p->angle_h1_rad != 0.0) {
        error += p->angle_h1_rad * sin(resolver_rad + p->angle_h1_phase);
    }
    if (p->angle_h2_rad != 0.0) {
        error += p->angle_h2_rad * sin(2.0 * resolver_rad + p->angle_h2_phase);
    }
    const double shown = from_tracks(s, p, sign * theta + error / p->pole_pairs);
    if (isnan(shown)) {
        s->theta_m_rad = shown; /* the count has no such value and stays */
        return;
    }
    const double measured = wrap_angle(shown);
    if (p->angle_bits > 0) {
        const double codes = ldexp(1.0, p->angle_bits);
        const double whole = fmod(floor(measured / TWO_PI * codes + 0.5), codes);
        s->theta_count = (int32_t)whole;
        s->theta_m_rad = whole / codes * TWO_PI;
    } else {
        s->theta_count = 0;
        s->theta_m_rad = measured;
    }
}

void sensors_sample(sensors_t *s, const plant_params_t *p, const plant_truth_t *truth, plant_sensors_t *out)
{
    for (int x = 0; x < 3; x++) {
        sample_current(s, p, x, truth->i_abc_A[x]);
        out->i_count[(p->phases_swapped && x > 0) ? 3 - x : x] = s->current_count[x];
    }
    out->ia_A = s->current_A[0];
    out->ib_A = s->current_A[p->phases_swapped ? 2 : 1];
    out->ic_A = s->current_A[p->phases_swapped ? 1 : 2];
    sample_vdc(p, truth->vdc_V, out);
    out->known_share = clamp(p->known_voltage_gain / p->converter_reference, 0.0, KNOWN_SHARE_MAX);
    if (!p->angle_stuck) {
        sample_angle(s, p, truth);
    }
    out->theta_m_rad = s->theta_m_rad;
    out->theta_count = s->theta_count;
    out->t_winding_C = p->winding_C;
}
