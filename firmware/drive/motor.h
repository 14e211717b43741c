/* SPDX-License-Identifier: Apache-2.0 */
#ifndef DRIVE_MOTOR_H
#define DRIVE_MOTOR_H
/** Everything that depends on the machine and its inverter: one constant, generated from motor.toml and the flux map.
 * Source   docs/scaling.md, docs/theory; written by `tools/fluxtrue motor build`
 * Units    per unit of bases, unless a name ends in a unit
 * Range    what motor_check() accepts
 * Errors   motor_check() names the first of tables, gains and limits that no drive may run with
 * Context  const data in flash; what changes while driving is motor_parameters_t, of which each drive has its own */
#include "control/adapt/angle_harmonics.h"
#include "control/commission/commission.h"
#include "control/current/angle_tracker.h"
#include "control/current/current_control.h"
#include "control/current/current_control_turning.h"
#include "control/current/flux_table.h"
#include "control/current/measure.h"
#include "control/current/modulate.h"
#include "control/identify/config.h"
#include "control/torque/current_reference.h"
#include "control/torque/i_d_limit.h"
#include "control/torque/limit.h"
#include "control/torque/loop.h"
#include "control/torque/voltage_reserve.h"
#include "drive/movement.h"
#include "safety/frozen_angle.h"
#include "safety/gate_fault.h"
#include "safety/launch_power.h"
#include "safety/monitor.h"
#include "safety/open_switch.h"
#include "safety/plausibility.h"
#include "safety/safe_state.h"
#include "safety/short_side.h"
#include "safety/torque_monitor.h"
#include "second_level/constants.h"
#include "types/bases.h"
#include "types/bus_scales.h"
#include "types/features.h"
#include "types/motor_check.h"

#if FLUXTRUE_MRAI
#include "control/mrai/mrai.h"
#endif

/** The blocks that contain a value which calibration, commissioning or the trim change while the drive runs. Each drive
 * has its own copy; the motor data hold the initial values. Those of the paper's law are separate, so that a build
 * without the law does not contain them. */
typedef struct {
    q15_t torque_slew; /* per 1 kHz step; Q15_MAX: no limit */
    current_control_config_t current_control;
    modulate_config_t modulate;
    torque_loop_config_t torque_loop;
} motor_parameters_t;

/** Constant motor data: drives point to them in flash, where a checksum protects them. */
typedef struct {
    const char *name;
    bases_t bases;
    bus_scales_t bus_scales;
    uint32_t interface_hash; /* of the DBC with these scales */
    uint8_t adc_bits;
    uint16_t trim_steps; /* steps of identification between two changes of the dead-time compensation */
    float current_full_scale_A;
    float v_dc_full_scale_V;
    float torque_max_Nm;
    float psi_f_Vs; /* table value at no current: psi_f^ = psi_f_Vs + dpsi */
    float r_ohm_20;
    float dead_time_s; /* of the bridge, for the port */
    float bridge_duty; /* dead time and device drop as a share of the period: the compensation 1 */
    q15_t torque_max;
    q15_t torque_slew_weak; /* largest slew while the planned flux is below psi_weak, where little voltage is left */
    q15_t psi_weak;
    measure_config_t measure;
    angle_tracker_config_t angle_tracker;
    angle_harmonics_config_t angle_harmonics;
    flux_table_config_t flux_table;
    identify_config_t identify;
    current_reference_config_t current_reference;
    voltage_reserve_config_t voltage_reserve;
    torque_limit_config_t torque_limit;
    i_d_limit_config_t i_d_limit;
    monitor_config_t monitor;
    safe_state_config_t safe_state;
    gate_fault_config_t gate_fault;
    plausibility_config_t plausibility;
    torque_monitor_config_t torque_monitor;
    frozen_angle_config_t frozen_angle;
    launch_power_config_t launch_power;
    commission_config_t commission;
    movement_config_t movement;
    turning_control_config_t turning_control;     /* in place of current_control where the field turns far */
    motor_parameters_t parameters;                /* to start with */
    const second_level_constants_t *second_level; /* of the second level alone */
#if FLUXTRUE_MRAI
    const mrai_config_t *mrai; /* of the paper's law alone, to start with */
#endif
} motor_t;

extern const motor_t motor;

/** The first check that fails, in the order of the signal; MOTOR_CHECK_OK if none does. */
motor_check_t motor_check(const motor_t *motor);

/** The largest current_control.clear_q30 with such a dead time. */
uint32_t motor_clear_q30(const motor_parameters_t *parameters, int32_t dead_time);

#endif
