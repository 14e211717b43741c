/* SPDX-License-Identifier: Apache-2.0 */
#include "ecu/battery_voltage.h"

#define NEAR_SHARE 0.05F
#define MISMATCH_SHARE 0.08F
#define MISMATCH_US 250000U /* beyond two cycles of the battery's message */

static bool is_within(const battery_voltage_in_t *in, float share)
{
    const float difference_V = in->battery_V - in->v_dc_V;
    const float bound_V = share * in->battery_V;
    return difference_V <= bound_V && difference_V >= -bound_V;
}

/* If the battery's voltage was known and its message is lost, the battery may have any voltage now. */
bool battery_voltage_is_near(const battery_voltage_in_t *in)
{
    return !(in->battery_V > 0.0F) || (in->alive && is_within(in, NEAR_SHARE));
}

bool battery_voltage_contradicts(battery_voltage_t *state, const battery_voltage_in_t *in)
{
    const bool comparable = in->battery_V > 0.0F && in->alive && in->contactor;
    if (!comparable || is_within(in, MISMATCH_SHARE)) {
        state->us = 0;
    } else if (state->us <= MISMATCH_US) {
        state->us += in->elapsed_us;
    }
    return state->us > MISMATCH_US;
}
