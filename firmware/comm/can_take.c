/* SPDX-License-Identifier: Apache-2.0 */
#include "comm/can_take.h"

#include "bus/signals.h"

static bool take_command(can_rx_t *rx, const bus_scales_t *scales, const can_frame_t *frame)
{
    struct bus_vcu_torque_request_t m;
    /* MCDC_EXCL C1: unpack refuses only a short frame, which check_protection() has refused before */
    if (bus_vcu_torque_request_unpack(&m, frame->data, frame->length) != 0 || !bus_vcu_torque_request_in_range(&m)) {
        return false;
    }
    rx->command = (bus_command_t){
        .enable = m.enable != 0U,
        .fault_reset = m.fault_reset != 0U,
        .mode = (command_mode_t)m.mode,
        .torque_requested_Nm = bus_vcu_torque_request_get_torque_requested(&m, scales),
        .limit_drive_Nm = bus_vcu_torque_request_get_torque_limit_drive(&m, scales),
        .limit_regen_Nm = bus_vcu_torque_request_get_torque_limit_regen(&m, scales),
    };
    rx->accepted++;
    return true;
}

static bool take_limits(can_rx_t *rx, const bus_scales_t *scales, const can_frame_t *frame)
{
    struct bus_vcu_battery_limits_t m;
    /* MCDC_EXCL C1: unpack refuses only a short frame, which check_protection() has refused before */
    if (bus_vcu_battery_limits_unpack(&m, frame->data, frame->length) != 0 || !bus_vcu_battery_limits_in_range(&m)) {
        return false;
    }
    rx->limits = (bus_power_limits_t){
        .drive_kW = bus_vcu_battery_limits_get_power_limit_drive(&m, scales),
        .regen_kW = bus_vcu_battery_limits_get_power_limit_regen(&m, scales),
    };
    rx->battery_V = bus_vcu_battery_limits_get_battery_voltage(&m, scales);
    return true;
}

static bool take_commission(can_rx_t *rx, const can_frame_t *frame)
{
    struct bus_vcu_commission_t m;
    /* MCDC_EXCL C1: unpack refuses only a short frame, which check_protection() has refused before */
    if (bus_vcu_commission_unpack(&m, frame->data, frame->length) != 0 || !bus_vcu_commission_in_range(&m)) {
        return false;
    }
    rx->commission = (bus_commission_t){
        .movement = m.movement,
        .direction = m.direction,
        .pole_pairs = m.pole_pairs,
        .reversed = m.reversed != 0U,
        .damped = m.damped != 0U,
        .pulses = m.pulses != 0U,
        .offset = m.offset,
        .current_d_permille = m.current_d,
        .current_q_permille = m.current_q,
    };
    return true;
}

bool can_take(can_rx_t *rx, const bus_scales_t *scales, const can_frame_t *frame)
{
    switch (frame->id) {
    case BUS_VCU_TORQUE_REQUEST_FRAME_ID:
        return take_command(rx, scales, frame);
    case BUS_VCU_BATTERY_LIMITS_FRAME_ID:
        return take_limits(rx, scales, frame);
    default:
        return take_commission(rx, frame);
    }
}
