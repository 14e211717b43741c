/* SPDX-License-Identifier: Apache-2.0 */
#include "control/identify/config.h"

#define NOISE_MIN_Q30 (1 << 19) /* its square is the smallest innovation variance of the Kalman filter */

static motor_check_t priors_check(const identify_config_t *c)
{
    for (unsigned j = 0; j < IDENTIFY_STATES; j++) {
        if (c->sigma[j] <= 0 || c->leak[j] <= 0 || c->leak[j] > Q31(0.25)) {
            return MOTOR_CHECK_IDENTIFY_PRIOR;
        }
    }
    return MOTOR_CHECK_OK;
}

motor_check_t identify_check(const identify_config_t *c)
{
    if (c->l_shift > 14U || c->mean_gain_q32 <= 0 || c->rate_gain_q28 <= 0 || c->window_turns_q29 == 0U ||
        c->turn_to_pu <= 0) {
        return MOTOR_CHECK_IDENTIFY_WINDOW;
    }
    if (c->r0 <= 0 || c->r_known_q30 <= 0 || c->r_known_q30 > IDENTIFY_ONE_Q30) {
        return MOTOR_CHECK_IDENTIFY_RESISTANCE;
    }
    if (c->noise_voltage_q30 < NOISE_MIN_Q30 || c->noise_flux_q30 < 0 || c->noise_rate_q30 < 0 ||
        c->limited_noise <= 0) {
        return MOTOR_CHECK_IDENTIFY_NOISE;
    }
    if (c->omega_min <= 0 || c->i_min <= 0 || c->i_smooth <= 0 || c->i_smooth > c->i_min || c->local_corner <= 0 ||
        c->local_rate <= 0 || c->torque_min <= 0) {
        return MOTOR_CHECK_IDENTIFY_THRESHOLDS;
    }
    if (c->confidence_rate <= 0 || c->mismatch_rate <= 0 || c->confidence_full <= 0 ||
        c->confidence_full >= c->confidence_none) {
        return MOTOR_CHECK_IDENTIFY_CONFIDENCE;
    }
    return priors_check(c);
}
