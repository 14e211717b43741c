/* SPDX-License-Identifier: Apache-2.0 */
#include "ecu/ecu_private.h"
#include "hal/can.h"
#include "hal/system.h"

void ecu_diagnostics(const ecu_t *ecu, telemetry_t *telemetry)
{
    const can_rx_t *rx = &ecu->rx;
    diagnostics_t *d = &telemetry->diagnostics;
    if (!can_tx_may_send_diagnostics(&ecu->tx)) {
        return;
    }
    d->crc_errors = rx->count[RX_CRC];
    d->repeated = rx->count[RX_REPEATED];
    d->jumps = rx->count[RX_JUMP];
    d->length_errors = rx->count[RX_LENGTH];
    d->range_errors = rx->count[RX_RANGE];
    d->id_errors = rx->count[RX_ID];
    d->ignored = rx->count[RX_IGNORED];
    d->time_outs = rx->time_outs;
    d->accepted = rx->accepted;
    d->skipped = rx->skipped;
    d->not_sent = ecu->not_sent;
    d->task_overruns = ecu->liveness.task_overruns;
    d->watchdog_held = ecu->liveness.held;
    d->lost_frames = hal_can_lost();
    d->bus_off = hal_can_bus_off();
    d->stack_unused_bytes = hal_system_stack_unused();
    d->reset_cause = (uint32_t)hal_system_reset_cause();
}
