/* SPDX-License-Identifier: Apache-2.0 */
#include <stddef.h>
#include <string.h>

#include "drive/data_check.h"
#include "ecu/ecu_private.h"
#include "signal/seal.h"

static uint32_t rates_seal(const arbitrate_config_t *c)
{
    uint32_t seal = seal_add(SEAL_START, (uint32_t)c->slew);
    seal = seal_add(seal, (uint32_t)c->jerk);
    seal = seal_add(seal, (uint32_t)c->ramp_out);
    seal = seal_add(seal, (uint32_t)c->dead_band);
    return seal_add(seal, (uint32_t)c->omega_standstill);
}

/* The flags below lie in one word each, with what only the task changes, too. */
_Static_assert(offsetof(supervisor_t, enabled) - offsetof(supervisor_t, reset_pending) == 3U, "with the edges seen");
_Static_assert(offsetof(rx_channel_t, failed) - offsetof(rx_channel_t, bad) == 3U, "with the last frames");
_Static_assert(offsetof(shut_off_t, wrong) - offsetof(shut_off_t, stage) == 3U, "with what the test requires");

static uint32_t word_at(const void *first)
{
    uint32_t word;
    (void)memcpy(&word, first, sizeof word);
    return word;
}

/* Flags that only an event changes: a frame, a time-out, a transition of the state machine. Without a check a changed
 * one would act until the next event. Every single flipped bit changes the result. */
static uint32_t flags(const ecu_t *ecu)
{
    const supervisor_t *supervisor = &ecu->supervisor;
    const rx_channel_t *limits = &ecu->rx.limits_channel;
    const shut_off_t *shut_off = &ecu->shut_off;
    uint32_t seal = seal_add((uint32_t)supervisor->state, word_at(&supervisor->reset_pending));
    seal = seal_add(seal, word_at(&limits->bad));
    seal = seal_add(seal, (uint32_t)limits->seen);
    seal = seal_add(seal, word_at(&ecu->rx.command_channel.bad));
    seal = seal_add(seal, word_at(&shut_off->stage));
    return seal_add(seal, shut_off->failed);
}

void ecu_seal_rates(ecu_t *ecu)
{
    ecu->rates_seal = rates_seal(&ecu->arbitration_config);
}

void ecu_seal_flags(ecu_t *ecu)
{
    ecu->flags_complement = ~flags(ecu);
}

void ecu_check_integrity(ecu_t *ecu)
{
    data_check_check_options(&ecu->drive);
    const bool intact = ecu->rates_seal == rates_seal(&ecu->arbitration_config) && ecu->flags_complement == ~flags(ecu);
    ecu->drive.data_check.damaged |= !intact;
}
