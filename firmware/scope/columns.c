/* SPDX-License-Identifier: Apache-2.0 */
#include "scope/columns.h"

#define PERIOD(field) offsetof(sample_t, field)
#define UPPER(field) (offsetof(sample_t, field) + sizeof(int16_t))
#define STEP(field) (FROM_STEP + offsetof(scope_step_values_t, field))
#define PLACE(name, base, place, text) (uint8_t)(place),

static const uint8_t places[CAPTURE_SIGNALS] = {SCOPE_SIGNAL_LIST(PLACE)};

_Static_assert(FROM_STEP + sizeof(scope_step_values_t) <= UINT8_MAX, "a place is a byte");

uint8_t columns_place(const capture_t *capture, uint32_t k)
{
    return places[capture->config.signal[k]];
}

column_t columns_at(const capture_t *capture, uint8_t place, const sample_t *next)
{
    if (is_of_step(place)) {
        return column_of_step(capture, place);
    }
    return (column_t){(const uint8_t *)next + place, stride_of(capture)};
}

void columns_find(capture_t *capture)
{
    const capture_config_t *config = &capture->config;
    capture->trigger_place = places[config->trigger_signal];
    capture->uses_step = is_of_step(capture->trigger_place);
    for (uint8_t k = 0; k < config->signals; k++) {
        capture->uses_step = capture->uses_step || is_of_step(columns_place(capture, k));
    }
}
