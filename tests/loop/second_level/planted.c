/* SPDX-License-Identifier: Apache-2.0 */
#include "planted.h"

#include <math.h>
#include <string.h>

#include "comm/can_rx.h"
#include "drive/data_check.h"
#include "ecu/arbitration.h"
#include "ecu/ecu_private.h"

#define CELLS_MAX 4096

/* The planted errors; a value is the index into planted_errors. */
typedef enum {
    NOTHING = -1,
    REF_ID_30,
    REF_IQ_15,
    REF_IQ_40,
    REF_BOTH_25,
    REF_TORQUE_GRID,
    REF_TORQUE_SHIFTED,
    REF_FLUX_GRID,
    FLUX_LQ_70,
    FLUX_LQ_HALF,
    FLUX_LD_DOUBLE,
    FLUX_PSI_F_80,
    FLUX_GRID,
    LIMIT_VEHICLE_IGNORED,
    LIMITS_SWAPPED,
    LIMIT_SCALED,
    RATED_DOUBLE,
    ARBITRATE_120,
    ARBITRATE_SIGN,
    ARBITRATE_STUCK,
    ARBITRATE_OFFSET,
    ARBITRATE_STOP,
    ARBITRATE_SLOW,
    ARBITRATE_NO_RAMP_OUT,
    ARBITRATE_FULL,
    LOOP_ADDS_30,
    LOOP_SIGN,
    LOOP_ESTIMATE_70,
    LOOP_OFFSET,
    LOOP_INTEGRATES_WRONG,
    LIMITED_150,
    LIMITED_SIGN,
    LIMITED_STUCK,
    REFERENCE_SIGN,
    REFERENCE_SWAPPED,
    REFERENCE_IQ_OFFSET,
    REFERENCE_ID_ZERO,
    REFERENCE_120,
    TARGET_125,
    TARGET_STUCK,
    UNITS_BASE_TORQUE,
    UNITS_REQUEST_125,
    UNITS_CURRENT_80,
    UNITS_CURRENT_OFFSET,
    UNITS_ANGLE_30,
    UNITS_ANGLE_MINUS_40,
    UNITS_POLE_PAIRS,
    DECODE_BYTES,
    DECODE_UNSIGNED,
    DECODE_STALE,
    DECODE_SCALE,
    REF_BOTH_40,
    ARBITRATE_TENFOLD,
    LIMITED_OFFSET,
    REFERENCE_BRAKING_150,
    TARGET_SIGN,
    TARGET_OFFSET,
    DECODE_LIMITS_TENFOLD,
    DECODE_ENABLE_KEPT,
    DECODE_REQUEST_KEPT,
    ERRORS
} error_t;

static error_t active = NOTHING;
static vehicle_t *under_test;
static q15_t kept;

static int16_t tables[4][CELLS_MAX];

/* A copy of a table of the motor data with each value multiplied by the factor. */
static const int16_t *scaled(int slot, const int16_t *from, int count, double factor)
{
    for (int n = 0; n < count; n++) {
        tables[slot][n] = (int16_t)lrint(fmin(fmax(factor * from[n], -32767.0), 32767.0));
    }
    return tables[slot];
}

static void scale_references(motor_t *m, double i_d, double i_q)
{
    const int count = m->current_reference.grid.nx * m->current_reference.grid.ny;
    m->current_reference.i_d = scaled(0, m->current_reference.i_d, count, i_d);
    m->current_reference.i_q = scaled(1, m->current_reference.i_q, count, i_q);
}

static int flux_cells(const flux_table_config_t *table)
{
    return (int)(((table->mesh.x_last >> 14) + 2U) * table->mesh.ny);
}

static void ref_id_30(vehicle_t *v)
{
    scale_references(&v->ecu.motor, 1.3, 1.0);
}
static void ref_iq_15(vehicle_t *v)
{
    scale_references(&v->ecu.motor, 1.0, 1.15);
}
static void ref_iq_40(vehicle_t *v)
{
    scale_references(&v->ecu.motor, 1.0, 1.4);
}
static void ref_both_25(vehicle_t *v)
{
    scale_references(&v->ecu.motor, 1.25, 1.25);
}
static void ref_both_40(vehicle_t *v)
{
    scale_references(&v->ecu.motor, 1.4, 1.4);
}
static void ref_torque_grid(vehicle_t *v)
{
    v->ecu.motor.current_reference.grid.x_shift--;
}
static void ref_torque_shifted(vehicle_t *v)
{
    v->ecu.motor.current_reference.grid.x0 -= 3000;
}
static void ref_flux_grid(vehicle_t *v)
{
    v->ecu.motor.current_reference.grid.y0 -= 6000;
}

static void flux_l_q(vehicle_t *v, double factor)
{
    flux_table_config_t *table = &v->ecu.drive.period.flux_table;
    table->l_q = scaled(2, table->l_q, flux_cells(table), factor);
    v->ecu.motor.flux_table.l_q = table->l_q;
}

static void flux_lq_70(vehicle_t *v)
{
    flux_l_q(v, 0.7);
}
static void flux_lq_half(vehicle_t *v)
{
    flux_l_q(v, 0.5);
}

static void flux_ld_double(vehicle_t *v)
{
    flux_table_config_t *table = &v->ecu.drive.period.flux_table;
    table->l_d = scaled(2, table->l_d, flux_cells(table), 1.9);
    v->ecu.motor.flux_table.l_d = table->l_d;
}

static void flux_psi_f_80(vehicle_t *v)
{
    flux_table_config_t *table = &v->ecu.drive.period.flux_table;
    table->psi_f0 = scaled(3, table->psi_f0, (int)table->mesh.ny, 0.8);
    v->ecu.motor.flux_table.psi_f0 = table->psi_f0;
}

static void flux_grid(vehicle_t *v)
{
    v->ecu.drive.period.flux_table.mesh.x0 += 4096;
    v->ecu.motor.flux_table.mesh.x0 += 4096;
}

static void rated_double(vehicle_t *v)
{
    v->ecu.motor.torque_max = (q15_t)(2 * v->ecu.motor.torque_max);
    v->ecu.motor.torque_limit.torque_max = v->ecu.motor.torque_max;
}

static void base_torque(vehicle_t *v)
{
    v->ecu.motor.bases.torque_Nm *= 0.7F;
}

static void current_80(vehicle_t *v)
{
    for (int x = 0; x < 3; x++) {
        measure_line_t *line = &v->ecu.drive.period.measure.phase[x];
        line->scale = line->scale / 10 * 8;
        line->bias = line->bias / 10 * 8;
    }
}

static void current_offset(vehicle_t *v)
{
    v->ecu.drive.period.measure.phase[0].bias += 40000000;
}
static void angle_30(vehicle_t *v)
{
    v->ecu.drive.period.angle_tracker.offset += 357913941U;
}
static void angle_minus_40(vehicle_t *v)
{
    v->ecu.drive.period.angle_tracker.offset -= 477218588U;
}
static void pole_pairs(vehicle_t *v)
{
    v->ecu.drive.period.angle_tracker.pole_pairs++;
}

#define NAMED(id, damage) [id] = {#id, damage}
const planted_t planted_errors[] = {
    NAMED(REF_ID_30, ref_id_30),
    NAMED(REF_IQ_15, ref_iq_15),
    NAMED(REF_IQ_40, ref_iq_40),
    NAMED(REF_BOTH_25, ref_both_25),
    NAMED(REF_TORQUE_GRID, ref_torque_grid),
    NAMED(REF_TORQUE_SHIFTED, ref_torque_shifted),
    NAMED(REF_FLUX_GRID, ref_flux_grid),
    NAMED(FLUX_LQ_70, flux_lq_70),
    NAMED(FLUX_LQ_HALF, flux_lq_half),
    NAMED(FLUX_LD_DOUBLE, flux_ld_double),
    NAMED(FLUX_PSI_F_80, flux_psi_f_80),
    NAMED(FLUX_GRID, flux_grid),
    NAMED(LIMIT_VEHICLE_IGNORED, NULL),
    NAMED(LIMITS_SWAPPED, NULL),
    NAMED(LIMIT_SCALED, NULL),
    NAMED(RATED_DOUBLE, rated_double),
    NAMED(ARBITRATE_120, NULL),
    NAMED(ARBITRATE_SIGN, NULL),
    NAMED(ARBITRATE_STUCK, NULL),
    NAMED(ARBITRATE_OFFSET, NULL),
    NAMED(ARBITRATE_STOP, NULL),
    NAMED(ARBITRATE_SLOW, NULL),
    NAMED(ARBITRATE_NO_RAMP_OUT, NULL),
    NAMED(ARBITRATE_FULL, NULL),
    NAMED(LOOP_ADDS_30, NULL),
    NAMED(LOOP_SIGN, NULL),
    NAMED(LOOP_ESTIMATE_70, NULL),
    NAMED(LOOP_OFFSET, NULL),
    NAMED(LOOP_INTEGRATES_WRONG, NULL),
    NAMED(LIMITED_150, NULL),
    NAMED(LIMITED_SIGN, NULL),
    NAMED(LIMITED_STUCK, NULL),
    NAMED(REFERENCE_SIGN, NULL),
    NAMED(REFERENCE_SWAPPED, NULL),
    NAMED(REFERENCE_IQ_OFFSET, NULL),
    NAMED(REFERENCE_ID_ZERO, NULL),
    NAMED(REFERENCE_120, NULL),
    NAMED(TARGET_125, NULL),
    NAMED(TARGET_STUCK, NULL),
    NAMED(UNITS_BASE_TORQUE, base_torque),
    NAMED(UNITS_REQUEST_125, NULL),
    NAMED(UNITS_CURRENT_80, current_80),
    NAMED(UNITS_CURRENT_OFFSET, current_offset),
    NAMED(UNITS_ANGLE_30, angle_30),
    NAMED(UNITS_ANGLE_MINUS_40, angle_minus_40),
    NAMED(UNITS_POLE_PAIRS, pole_pairs),
    NAMED(DECODE_BYTES, NULL),
    NAMED(DECODE_UNSIGNED, NULL),
    NAMED(DECODE_STALE, NULL),
    NAMED(DECODE_SCALE, NULL),
    NAMED(REF_BOTH_40, ref_both_40),
    NAMED(ARBITRATE_TENFOLD, NULL),
    NAMED(LIMITED_OFFSET, NULL),
    NAMED(REFERENCE_BRAKING_150, NULL),
    NAMED(TARGET_SIGN, NULL),
    NAMED(TARGET_OFFSET, NULL),
    NAMED(DECODE_LIMITS_TENFOLD, NULL),
    NAMED(DECODE_ENABLE_KEPT, NULL),
    NAMED(DECODE_REQUEST_KEPT, NULL),
};
const int planted_count = ERRORS;

void planted_begin(int index, vehicle_t *vehicle)
{
    active = (error_t)index;
    under_test = vehicle;
    kept = vehicle->ecu.drive.request.torque_arbitrated;
    if (index >= 0 && planted_errors[index].damage != NULL) {
        planted_errors[index].damage(vehicle);
        data_check_start(&vehicle->ecu.drive); /* an error of the software: nothing but the torque shows it */
    }
}

static q15_t times(q15_t x, double factor)
{
    return (q15_t)lrint(fmin(fmax(factor * x, -32767.0), 32767.0));
}

q15_t __real_arbitrate_step(const arbitrate_config_t *config, arbitrate_state_t *state, const arbitrate_in_t *in);
q15_t __wrap_arbitrate_step(const arbitrate_config_t *config, arbitrate_state_t *state, const arbitrate_in_t *in);
q15_t __wrap_arbitrate_step(const arbitrate_config_t *config, arbitrate_state_t *state, const arbitrate_in_t *in)
{
    arbitrate_in_t wrong = *in;
    arbitrate_config_t slow = *config;
    switch (active) {
    case ARBITRATE_120:
        return times(__real_arbitrate_step(config, state, in), 1.2);
    case ARBITRATE_TENFOLD:
        wrong.torque_requested = times(in->torque_requested, 10.0);
        return __real_arbitrate_step(config, state, &wrong);
    case ARBITRATE_SIGN:
        return times(__real_arbitrate_step(config, state, in), -1.0);
    case ARBITRATE_STUCK:
        return in->run ? kept : (q15_t)0;
    case ARBITRATE_OFFSET:
        return in->run ? (q15_t)(__real_arbitrate_step(config, state, in) + 2000) : (q15_t)0;
    case ARBITRATE_STOP:
        wrong.stop = false;
        wrong.torque_requested = kept;
        return __real_arbitrate_step(config, state, &wrong);
    case ARBITRATE_SLOW:
        slow.slew /= 100;
        slow.jerk = slow.slew;
        return __real_arbitrate_step(&slow, state, in);
    case ARBITRATE_NO_RAMP_OUT:
        if (in->ramp_out) {
            return in->run ? kept : (q15_t)0;
        }
        break;
    case ARBITRATE_FULL:
        wrong.torque_requested = (in->torque_requested < 0) ? -in->limit_drive : in->limit_drive;
        return __real_arbitrate_step(config, state, &wrong);
    default:
        break;
    }
    return __real_arbitrate_step(config, state, in);
}

arbitrate_in_t __real_ecu_arbitration(const ecu_t *ecu);
arbitrate_in_t __wrap_ecu_arbitration(const ecu_t *ecu);
arbitrate_in_t __wrap_ecu_arbitration(const ecu_t *ecu)
{
    arbitrate_in_t in = __real_ecu_arbitration(ecu);
    const q15_t drive = in.limit_drive;
    switch (active) {
    case LIMIT_VEHICLE_IGNORED:
        in.limit_drive = in.limit_regen = under_test->ecu.motor.torque_max;
        break;
    case LIMITS_SWAPPED:
        in.limit_drive = in.limit_regen;
        in.limit_regen = drive;
        break;
    case LIMIT_SCALED:
        in.limit_drive = times(in.limit_drive, 1.5);
        in.limit_regen = times(in.limit_regen, 1.5);
        break;
    case UNITS_REQUEST_125:
        in.torque_requested = times(in.torque_requested, 1.25);
        break;
    default:
        break;
    }
    return in;
}

q15_t __real_torque_loop_step(const torque_loop_config_t *config, torque_loop_state_t *state,
                              const torque_loop_in_t *in);
q15_t __wrap_torque_loop_step(const torque_loop_config_t *config, torque_loop_state_t *state,
                              const torque_loop_in_t *in);
q15_t __wrap_torque_loop_step(const torque_loop_config_t *config, torque_loop_state_t *state,
                              const torque_loop_in_t *in)
{
    torque_loop_in_t wrong = *in;
    const q15_t right = __real_torque_loop_step(config, state, in);
    switch (active) {
    case LOOP_ADDS_30:
        return times(right, 1.3);
    case LOOP_SIGN:
        return times(right, -1.0);
    case LOOP_ESTIMATE_70:
        wrong.torque_estimated = times((q15_t)in->torque_estimated, 0.7);
        return __real_torque_loop_step(config, state, &wrong);
    case LOOP_OFFSET:
        return (q15_t)(right + 1800);
    case LOOP_INTEGRATES_WRONG:
        state->correction += 2000000;
        return right;
    default:
        return right;
    }
}

torque_limit_t __real_torque_limit_step(const torque_limit_config_t *config, torque_limit_state_t *state,
                                        const torque_limit_in_t *in);
torque_limit_t __wrap_torque_limit_step(const torque_limit_config_t *config, torque_limit_state_t *state,
                                        const torque_limit_in_t *in);
torque_limit_t __wrap_torque_limit_step(const torque_limit_config_t *config, torque_limit_state_t *state,
                                        const torque_limit_in_t *in)
{
    torque_limit_t allowed = __real_torque_limit_step(config, state, in);
    switch (active) {
    case LIMITED_150:
        allowed.torque_limited = times(allowed.torque_limited, 1.5);
        break;
    case LIMITED_OFFSET:
        allowed.torque_limited = (q15_t)(allowed.torque_limited - 2000);
        break;
    case LIMITED_SIGN:
        allowed.torque_limited = times(allowed.torque_limited, -1.0);
        break;
    case LIMITED_STUCK:
        allowed.torque_limited = kept;
        break;
    default:
        break;
    }
    return allowed;
}

current_reference_t __real_current_reference_step(const current_reference_config_t *config,
                                                  const current_reference_in_t *in);
current_reference_t __wrap_current_reference_step(const current_reference_config_t *config,
                                                  const current_reference_in_t *in);
current_reference_t __wrap_current_reference_step(const current_reference_config_t *config,
                                                  const current_reference_in_t *in)
{
    current_reference_t reference = __real_current_reference_step(config, in);
    const dq_q15_t right = reference.i_ref;
    switch (active) {
    case REFERENCE_SIGN:
        reference.i_ref.q = -right.q;
        break;
    case REFERENCE_BRAKING_150:
        reference.i_ref.q = (right.q < 0) ? right.q * 3 / 2 : right.q;
        break;
    case REFERENCE_SWAPPED:
        reference.i_ref = (dq_q15_t){-fx_abs_q31(right.q), (right.q < 0) ? right.d : -right.d};
        break;
    case REFERENCE_IQ_OFFSET:
        reference.i_ref.q += 4000;
        break;
    case REFERENCE_ID_ZERO:
        reference.i_ref.d = 0;
        break;
    case REFERENCE_120:
        reference.i_ref = (dq_q15_t){right.d * 6 / 5, right.q * 6 / 5};
        break;
    default:
        break;
    }
    return reference;
}

current_target_t __real_current_control_target(const current_control_config_t *config, const operating_point_t *at,
                                               int32_t psi_d_error, rotating_flux_t *rotating);
current_target_t __wrap_current_control_target(const current_control_config_t *config, const operating_point_t *at,
                                               int32_t psi_d_error, rotating_flux_t *rotating);
current_target_t __wrap_current_control_target(const current_control_config_t *config, const operating_point_t *at,
                                               int32_t psi_d_error, rotating_flux_t *rotating)
{
    static dq_q15_t kept_i_ref;
    const dq_q15_t i_ref = at->i;
    operating_point_t there = *at;
    if (active == TARGET_125 || active == TARGET_SIGN || active == TARGET_OFFSET) {
        there.i = (active == TARGET_125)    ? (dq_q15_t){i_ref.d * 5 / 4, i_ref.q * 5 / 4}
                  : (active == TARGET_SIGN) ? (dq_q15_t){i_ref.d, -i_ref.q}
                                            : (dq_q15_t){i_ref.d, i_ref.q - 4000};
    } else if (active == TARGET_STUCK) {
        there.i = kept_i_ref;
    } else {
        kept_i_ref = i_ref;
        return __real_current_control_target(config, at, psi_d_error, rotating);
    }
    there.flux = flux_table_step(&under_test->ecu.motor.flux_table, there.i);
    return __real_current_control_target(config, &there, psi_d_error, rotating);
}

rx_result_t __real_can_rx_frame(can_rx_t *rx, const bus_scales_t *scales, const can_frame_t *frame);
rx_result_t __wrap_can_rx_frame(can_rx_t *rx, const bus_scales_t *scales, const can_frame_t *frame);
rx_result_t __wrap_can_rx_frame(can_rx_t *rx, const bus_scales_t *scales, const can_frame_t *frame)
{
    const bus_command_t before = rx->command;
    const rx_result_t result = __real_can_rx_frame(rx, scales, frame);
    bus_command_t *command = &rx->command;
    switch (active) {
    case DECODE_BYTES:
        command->torque_requested_Nm = (float)(int16_t)(frame->data[2] << 8 | frame->data[3]) * 0.1F;
        break;
    case DECODE_UNSIGNED:
        command->torque_requested_Nm = fabsf(command->torque_requested_Nm);
        break;
    case DECODE_STALE:
        command->torque_requested_Nm = before.torque_requested_Nm;
        command->enable = before.enable;
        break;
    case DECODE_LIMITS_TENFOLD:
        command->limit_drive_Nm *= 10.0F;
        command->limit_regen_Nm *= 10.0F;
        break;
    case DECODE_ENABLE_KEPT:
        command->enable = true;
        command->torque_requested_Nm = before.torque_requested_Nm;
        break;
    case DECODE_REQUEST_KEPT:
        command->torque_requested_Nm = before.torque_requested_Nm;
        break;
    case DECODE_SCALE:
        command->torque_requested_Nm *= 1.25F;
        break;
    default:
        break;
    }
    return result;
}
