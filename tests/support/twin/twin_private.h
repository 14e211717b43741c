/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TWIN_PRIVATE_H
#define TWIN_PRIVATE_H
/** The controller object of twin.h, shared by the files that implement its step and its named values. */
#include <stdint.h>

#include "twin/twin.h"
#include "twin/twin_identify.h"

enum { TWIN_READY = 0, TWIN_RUN = 1, TWIN_FAULT = 2 };

enum {
    TWIN_FAULT_OVER_CURRENT = 1 << 0,
    TWIN_FAULT_OVER_VOLTAGE = 1 << 1,
    TWIN_FAULT_UNDER_VOLTAGE = 1 << 2,
    TWIN_FAULT_CURRENT_SUM = 1 << 3,
    TWIN_FAULT_INPUT = 1 << 5
};

typedef struct {
    int over_voltage, under_voltage, current_sum;
} twin_monitor_t;

struct twin {
    motor_si_t motor; /* a copy: twin_set() may change it */
    /* commands */
    double torque_requested, id_command, iq_command, compensation;
    bool enable, torque_loop, identification, current_mode, robust;
    /* state */
    int run_state; /* of the 1 kHz task */
    bool fault_reset;
    unsigned long periods;
    unsigned fault_word;
    twin_monitor_t monitor;
    twin_angle_state_t tracker;
    twin_current_state_t current;
    twin_turning_state_t turning;
    twin_mrai_state_t mrai;
    twin_mrai_schedule_t schedule;
    twin_mrai_quality_t quality;
    twin_torque_estimate_t torque_mean;
    twin_window_t window, complete;
    twin_identify_t identify;
    double torque_estimated, psi_delta, iron_admittance; /* of the identification that is selected */
    twin_torque_state_t torque_state;
    double torque_commanded;
    bool modulation_limited;
    int periods_on; /* since switching was enabled, saturates at 3 */
    /* latest signals */
    twin_mrai_in_t sample; /* its u acts during the present period */
    twin_dq_t i_ref, u, applied;
    twin_target_t target;
    twin_rotating_t rotating;
    twin_reference_t reference;
    double trim;
    twin_limit_state_t limit;
    twin_dq_t psi_ref; /* tables' flux at the last reference */
    twin_abc_t last_i; /* the last finite samples; kept while a sample is NaN or infinite */
    double last_theta_m, theta;
    double v_dc, winding_C;
};

#endif
