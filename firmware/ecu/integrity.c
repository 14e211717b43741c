/* SPDX-License-Identifier: Apache-2.0 */
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

/* Flags that only an event changes: a frame, a time-out, a transition of the state machine. Without a check a changed
 * one would act until the next event. One byte each, so that every single flipped bit changes the result. */
static uint32_t flags(const ecu_t *ecu)
{
    const supervisor_t *supervisor = &ecu->supervisor;
    const rx_channel_t *limits = &ecu->rx.limits_channel;
    const uint32_t of_bus = (uint32_t)limits->alive | (uint32_t)limits->seen << 8 |
                            (uint32_t)ecu->rx.command_channel.alive << 16 |
                            (uint32_t)ecu->rx.command_channel.failed << 24;
    const uint32_t of_states = (uint32_t)supervisor->enabled | (uint32_t)supervisor->enable_seen << 8 |
                               (uint32_t)supervisor->reset_seen << 16 | (uint32_t)supervisor->state << 24;
    const shut_off_t *shut_off = &ecu->shut_off;
    const uint32_t of_shut_off = (uint32_t)shut_off->tested | (uint32_t)shut_off->supply_on << 8 |
                                 (uint32_t)shut_off->wrong << 16 | (uint32_t)shut_off->stage << 24;
    return seal_add(seal_add(seal_add(of_states, of_bus), of_shut_off), shut_off->failed);
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
