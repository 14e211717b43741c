/* SPDX-License-Identifier: Apache-2.0 */
#include "calibration/calibration.h"

#include "calibration/mrai/mrai_calibration.h"
#include "drive/data_check.h"
#include "types/si.h"

#define INFO(name, lo, hi, unit, text) {#name, lo, hi},
const calibration_info_t calibration_info[CALIBRATION_COUNT] = {CALIBRATION_LIST(INFO)};

float calibration_get(const drive_t *drive, calibration_id_t id)
{
    const motor_t *m = drive->motor;
    const motor_parameters_t *p = &drive->parameters;
    switch (id) {
    case CALIBRATION_torque_slew_Nm_per_s:
        return (p->torque_slew == Q15_MAX) ? 0.0F : si_from_q15(p->torque_slew, m->bases.torque_Nm) / m->bases.step_s;
    case CALIBRATION_torque_loop_bandwidth_rad_s:
        return si_from_q15(p->torque_loop.ki, 1.0F) / m->bases.step_s;
    case CALIBRATION_dead_time_compensation:
        return (m->bridge_duty > 0.0F) ? si_from_q15(p->modulate.dead_time_q16, 0.5F) / m->bridge_duty : 0.0F;
    default:
        return mrai_calibration_get(drive, id);
    }
}

/* The value in SI of one step of the fixed-point format. */
static float least(const drive_t *drive, calibration_id_t id)
{
    const motor_t *m = drive->motor;
    switch (id) {
    case CALIBRATION_torque_slew_Nm_per_s:
        return si_from_q15(1, m->bases.torque_Nm) / m->bases.step_s;
    case CALIBRATION_torque_loop_bandwidth_rad_s:
        return si_from_q15(1, 1.0F) / m->bases.step_s;
    case CALIBRATION_dead_time_compensation:
        return (m->bridge_duty > 0.0F) ? si_from_q15(1, 1.0F) / m->bridge_duty : 0.0F;
    default:
        return mrai_calibration_least(drive, id);
    }
}

value_range_t calibration_range(const drive_t *drive, calibration_id_t id)
{
    return (value_range_t){calibration_info[id].lo, calibration_info[id].hi, least(drive, id)};
}

static void write_parameter(drive_t *drive, calibration_id_t id, float value)
{
    const motor_t *m = drive->motor;
    motor_parameters_t *p = &drive->parameters;
    switch (id) {
    case CALIBRATION_torque_slew_Nm_per_s:
        p->torque_slew = (value > 0.0F) ? q15_from_si(value * m->bases.step_s, m->bases.torque_Nm) : Q15_MAX;
        break;
    case CALIBRATION_torque_loop_bandwidth_rad_s:
        p->torque_loop.ki = q15_from_si(value * m->bases.step_s, 1.0F);
        break;
    case CALIBRATION_dead_time_compensation:
        drive_set_dead_time(p, q15_from_si(value * m->bridge_duty, 1.0F));
        break;
    default:
        mrai_calibration_set(drive, id, value);
        break;
    }
}

void calibration_set(drive_t *drive, calibration_id_t id, float value)
{
    const motor_parameters_t before = drive->parameters;
    write_parameter(drive, id, value);
    data_check_accept(drive, &before);
}
