/* SPDX-License-Identifier: Apache-2.0 */
#ifndef ECU_ECU_H
#define ECU_ECU_H
/** The drive on a bus: receives commands, decides the state, arbitrates the torque, runs the drive's 1 kHz task and
 * transmits status.
 *   Ports call fast_isr(&ecu.drive), mrai_isr(&ecu.drive) and, instead of task_1khz(), ecu_task_1khz(&ecu).
 *   The watchdog is served only while both interrupts advance.
 * Source   docs/howto/can.md; docs/architecture.md
 * Units    per unit inside, the DBC's units on the bus
 * Range    steps of 0.8 to 1.25 ms (signal/step_clock.h)
 * Errors   latched faults of drive and supervisor, transmitted on the bus
 * Context  ecu_init() once, then ecu_continue() if a reset has interrupted driving; ecu_task_1khz() every
 *          bases.periods_per_step periods */
#include "calibration/xcp_access.h"
#include "comm/can_rx.h"
#include "comm/can_tx.h"
#include "drive/drive.h"
#include "ecu/arbitration.h"
#include "ecu/battery_voltage.h"
#include "ecu/shut_off.h"
#include "ecu/supervisor.h"
#include "safety/dc_jump.h"
#include "second_level/second_level.h"
#include "signal/step_clock.h"

typedef struct {
    uint16_t task_overruns, held; /* held: steps without service of the watchdog */
    uint8_t late_in_a_row, stalled_in_a_row;
    bool started;
} liveness_t;

typedef struct {
    int32_t reference; /* voltage that the present one is compared with */
    uint32_t us;       /* time for which the voltage has stayed near the reference */
} settling_t;

/** What the bus commands, per unit: converted when it comes. The battery's power limits count while they are alive. */
typedef struct {
    q15_t torque_requested, limit_drive, limit_regen;
    q15_t power_drive, power_regen;
} commanded_t;

typedef struct {
    drive_t drive; /* first, so that the address of the ECU is also that of the drive */
    step_clock_t clock;
    can_rx_t rx;
    commanded_t commanded; /* of rx */
    uint16_t not_sent;
    can_tx_t tx;
    second_level_t second_level;
    supervisor_t supervisor;
    arbitrate_config_t arbitration_config;
    uint32_t rates_seal;       /* of arbitration_config, which nothing changes after ecu_init() */
    uint32_t flags_complement; /* of flags of bus and state machine, as the last step left them */
    arbitrate_state_t arbitration_state;
    liveness_t liveness;
    settling_t settling;
    battery_voltage_t battery_voltage;
    dc_jump_state_t dc_jump;
    uint8_t question;  /* of the external watchdog, at the start of the step */
    bool pulses_asked; /* the last frame for commissioning agreed to pulses */
    shut_off_t shut_off;
    xcp_access_t xcp;
    freeze_frame_t freeze;
    scope_t scope;
} ecu_t;

void ecu_init(ecu_t *ecu, const motor_t *source);
/** After ecu_init(): the drive holds the short circuit through a reset of the processor (drive/after_reset.h).
 * Contactor and gate supply stay on until the machine is slow. */
void ecu_continue(ecu_t *ecu);
void ecu_task_1khz(ecu_t *ecu);

#endif
